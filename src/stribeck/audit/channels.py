"""Channels that are dead, frozen, clipped, or held between fewer values than there are samples."""

import numpy as np
from numpy.typing import NDArray

from stribeck.audit.cures import listed
from stribeck.audit.evidence import Evidence
from stribeck.finding import Finding
from stribeck.typing import Array

FROZEN = 0.2
"""[s] for which a channel that changed at every sample before does not change at all."""
FROZEN_SAMPLES = 20
ABRUPT = 0.05
"""Share of the top speed with which a joint comes into a frozen part, or out of it; one that is braked is slower."""
ABRUPT_IF_COARSE = 0.3
"""The same of an encoder so coarse that a joint that sticks looks as if it were frozen."""
FROZEN_IF_COARSE = 2.0
"""[s] of such an encoder."""
COARSE = 0.02
"""Resolution of a position, in steps between samples at top speed."""
CLIPS, SHORTEST_CLIP = 2, 4
"""How often a clipped torque stays at an extreme, and for how many samples, at least."""
CLIPPED = 5e-3
"""Share of the samples that lie exactly at an extreme."""
ROUNDING = 1e-6
"""Relative change [1] that the interpolation onto an even clock may make of a constant; encoders resolve more."""
AROUND_TURNS = 9
"""Samples [1] around one where a position turns round that must change too if it is noise."""
HELD_ROWS = 20_000
HELD = 0.95
"""Share of the values that must be held for the same number of samples."""


def check_channels(evidence: Evidence) -> list[Finding]:
    """Return what the numbers of positions and torques show without a model."""
    log, robot = evidence.prepared.log, evidence.robot
    period = evidence.prepared.sampling.period
    kinds: dict[tuple[str, str], list[tuple[str, str]]] = {}

    def add(check: str, channel: str, joint: str, text: str) -> None:
        kinds.setdefault((check, channel), []).append((joint, text))

    least, most = log.torque.min(axis=0), log.torque.max(axis=0)
    for number, column in enumerate(robot.torque_controlled.tolist()):
        joint, position, torque = robot.joint_names[column], log.position[:, column], log.torque[:, column]
        moves = evidence.moves(number)
        for part in _frozen_positions(position, evidence.prepared.sampling.segments, period) if moves else []:
            add("channel-frozen", "position", joint, _between(log.time, part))
        if moves and least[column] == most[column]:
            add("channel-dead", "torque", joint, "")
            continue
        frozen = _frozen_torques(torque, position, evidence.prepared.sampling.segments, period)
        for part in frozen:
            add("channel-frozen", "torque", joint, _between(log.time, part))
        share = clipped(torque, position, float(least[column]), float(most[column])) if moves else 0.0
        if share:
            add("channel-clipped", "torque", joint, f" ({100 * share:.2g} % of the samples)")
        for channel, values in (("torque", torque), ("position", position)):
            held = held_for(values[:HELD_ROWS])
            if held:
                add("channel-held", channel, joint, f" (for {held} samples)")
    return [_finding(check, channel, found) for (check, channel), found in kinds.items()]


TEXTS = {
    "channel-dead": (
        "the {0} does not change at all while the joint moves: {1}",
        "a joint without a torque of its own belongs to [robot] position_controlled",
    ),
    "channel-frozen": (
        "the {0} is frozen while the joint moves: {1}",
        "leave that part of the log out",
    ),
    "channel-clipped": (
        "the {0} stays exactly at its extreme, as if it were clipped: {1}",
        "leave such parts out, or let the robot do less",
    ),
    "channel-held": (
        "the {0} is held at one value for several samples: {1}",
        "log it at the rate that it is measured at",
    ),
}


def _finding(check: str, channel: str, found: list[tuple[str, str]]) -> Finding:
    text, cure = TEXTS[check]
    return Finding(
        check=check,
        channel=channel,
        text=text.format(channel, listed([f"{joint}{evidence}" for joint, evidence in found])),
        cure=cure,
        joints=tuple(dict.fromkeys(joint for joint, _ in found)),
    )


def _between(time: Array, part: slice) -> str:
    return f" ({time[part.start]:.2f} to {time[part.stop - 1]:.2f} s)"


def constant_parts(values: Array, segments: tuple[slice, ...], shortest: int) -> list[slice]:
    """Return the rows of a segment over which a channel keeps exactly one value, at least `shortest` samples long."""
    found: list[slice] = []
    thin = values[:: max(1, shortest // 2)]
    rounding = ROUNDING * float(np.abs(thin).max())
    if not np.any(np.abs(np.diff(thin)) <= rounding):
        return found
    for segment in segments:
        same = np.concatenate([[False], np.abs(np.diff(values[segment])) <= rounding, [False]])
        edges = np.flatnonzero(same[1:] != same[:-1])
        for start, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            if stop - start + 1 >= shortest:
                found.append(slice(segment.start + start, segment.start + stop + 1))
    return found


def _shortest(period: float) -> int:
    return max(FROZEN_SAMPLES, round(FROZEN / period))


def _frozen_positions(position: Array, segments: tuple[slice, ...], period: float) -> list[slice]:
    """Return where a joint's position stops at once although the joint was moving: it was not braked."""
    parts = constant_parts(position, segments, _shortest(period))
    if not parts:
        return []
    steps = np.abs(np.diff(position))
    changes = steps[steps > ROUNDING * float(np.abs(position).max())]
    top = float(np.percentile(changes, 99)) if len(changes) else 0.0
    quantum = float(np.percentile(changes, 1)) if len(changes) else 0.0
    coarse = quantum > COARSE * top
    least = max(ABRUPT_IF_COARSE * top, 5 * quantum) if coarse else ABRUPT * top

    def fast(rows: slice) -> bool:
        whole = slice(rows.start, min(rows.stop + 1, len(position)))
        count = whole.stop - whole.start - 1
        return bool(count >= 4 and abs(position[whole.stop - 1] - position[whole.start]) > count * least)

    if _flickers(position, parts):
        return parts
    found = []
    for part in parts:
        if coarse and (part.stop - part.start) * period < FROZEN_IF_COARSE:
            continue
        before, after = slice(max(part.start - 6, 0), max(part.start - 1, 0)), slice(part.stop, part.stop + 5)
        jumps = part.stop <= len(steps) and steps[part.stop - 1] > 10 * top
        if fast(before) or fast(after) or jumps:
            found.append(part)
    return found


def _flickers(position: Array, parts: list[slice]) -> bool:
    """Return whether a position has noise at almost every sample, but for some parts, so that these are no rest.

    A last digit that changes now and then while a joint rests is no such noise.
    """
    steps = np.diff(position)
    rest = np.ones(len(steps), dtype=bool)
    for part in parts:
        rest[part.start : part.stop] = False
    steps = steps[rest]
    if len(steps) < FROZEN_SAMPLES:
        return False
    unchanged = np.abs(steps) <= ROUNDING * float(np.abs(position).max())
    turns = np.append(steps[1:] * steps[:-1] < 0, False)
    near_turns = np.convolve(turns, np.ones(AROUND_TURNS), "same") > 0.5
    return bool(turns.mean() > 0.1 and unchanged.mean() < 0.05 and unchanged[near_turns].mean() < 0.05)


def _frozen_torques(torque: Array, position: Array, segments: tuple[slice, ...], period: float) -> list[slice]:
    """Return where a torque that else changes at almost every sample keeps one value, while the joint moves."""
    parts = constant_parts(torque, segments, _shortest(period))
    if not parts:
        return []
    frozen = np.zeros(len(torque), dtype=bool)
    for part in parts:
        frozen[part] = True
    changes = np.diff(torque) != 0
    rest = changes[~frozen[1:]]
    if len(rest) == 0 or rest.mean() < 0.5:
        return []
    reach = float(np.ptp(position))
    least, most = float(torque.min()), float(torque.max())
    at_extremes = sum(float(torque[part.start]) in (least, most) for part in parts)
    return [
        part
        for part in parts
        if np.ptp(position[part]) > 0.02 * reach
        and (at_extremes < CLIPS or float(torque[part.start]) not in (least, most))
    ]


def moving(position: Array) -> NDArray[np.bool_]:
    """Return where a joint is not at rest."""
    steps = np.abs(np.gradient(position))
    return np.asarray(steps > 0.01 * np.percentile(steps, 99))


def clipped(torque: Array, position: Array, least: float, most: float) -> float:
    """Return the share of the samples at an extreme if far more lie exactly there than close to it, else 0.

    At rest a torque may well stay as it is.
    """
    share = 0.0
    for sign, top in ((1.0, most), (-1.0, -least)):
        if np.mean(torque[:: max(1, len(torque) // HELD_ROWS)] == sign * top) < CLIPPED / 2:
            continue
        there = torque == sign * top
        count = int(np.count_nonzero(there))
        if count < max(10, CLIPPED * len(torque)):
            continue
        values = sign * torque
        levels = np.unique(values[values > top - 0.1 * (top - float(values.min()))])
        near = int(np.count_nonzero(values >= levels[-min(4, len(levels))])) - count
        edges = np.flatnonzero(np.diff(there.astype(np.int8), prepend=0, append=0))
        long = np.count_nonzero(edges[1::2] - edges[::2] >= SHORTEST_CLIP)
        if len(levels) > 4 and long >= CLIPS and count > 5 * near and moving(position)[there].mean() > 0.5:
            share += count / len(values)
    return share


def held_for(values: NDArray[np.float64]) -> int:
    """Return for how many samples each value of a channel is held, 0 if they differ in that or change at each."""
    steps = np.diff(values)
    changes = np.flatnonzero(np.abs(steps) > ROUNDING * float(np.abs(values).max()))
    changes = changes[np.diff(changes, prepend=-2) > 1]  # an even clock smears a change over two samples
    if len(changes) < 20:
        return 0
    lengths = np.diff(changes)
    typical = int(np.median(lengths))
    if typical < 2 or np.mean(np.abs(lengths - typical) <= max(1, typical // 10)) < HELD:
        return 0
    # Steps of a coarse encoder at constant speed are of one size; those of held values are of all sizes.
    sizes = np.abs(steps[changes])
    if len(np.unique(np.round(sizes / sizes.max(), 6))) < 0.3 * len(sizes) or np.mean(lengths >= 2) < HELD:
        return 0
    return typical

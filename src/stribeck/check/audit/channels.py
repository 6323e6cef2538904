"""Checks of single channels: dead, frozen, clipped, or held for several samples."""

from collections import defaultdict
from collections.abc import Iterable

import numpy as np

from stribeck.check.audit.evidence import AuditData
from stribeck.core.base.finding import Finding, Setting
from stribeck.core.base.spans import Span, listed_spans, runs_of
from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.robot import Robot

FROZEN_SAMPLES = 20
"""Fewest samples of a frozen part [1]."""
ROUNDING = 1e-6
"""Relative change of a constant by interpolation onto an even clock [1]; encoders resolve more."""
HELD_ROWS = 20_000
"""Samples that are searched for held values [1]."""


def check_channels(evidence: AuditData) -> list[Finding]:
    """Report faults of positions and torques that are visible without a model."""
    log, robot, sampling = evidence.prepared.log, evidence.robot, evidence.prepared.sampling
    faults: dict[tuple[str, str], dict[str, str]] = defaultdict(dict)
    frozen: dict[tuple[str, str], list[Span]] = defaultdict(list)
    constant, since = np.ptp(log.torque, axis=0) == 0, log.time - log.start
    moving = [column for number, column in enumerate(robot.torque_controlled.tolist()) if evidence.moves(number)]
    steps = {column: step for column in moving if (step := coarse_step(log.torque[:HELD_ROWS, column]))}
    shortest = max(FROZEN_SAMPLES, round(0.2 / sampling.period))  # 0.2 s
    for column in robot.torque_controlled.tolist():
        joint, position, torque = robot.joint_names[column], log.position[:, column], log.torque[:, column]
        parts, moves = {}, column in moving
        if moves and (still := constant_parts(position, sampling.segments, shortest)):
            parts["position"] = _frozen_positions(position, torque, still, sampling.period)
        if step := steps.get(column) or (moves and _shared_step(torque[:HELD_ROWS], steps.values())):
            faults["channel-coarse", "torque"][joint] = f" ({step:.2g} N m)"
        elif moves and constant[column]:
            faults["channel-dead", "torque"][joint] = ""
        else:
            if share := clipped(torque, position) if moves else 0.0:
                faults["channel-clipped", "torque"][joint] = f" ({100 * share:.2g} % of the samples)"
            elif still := constant_parts(torque, sampling.segments, shortest):
                parts["torque"] = _frozen_torques(torque, position, still)
            for channel, values in (("torque", torque), ("position", position)):
                if held := held_for(values[:HELD_ROWS]):
                    faults["channel-held", channel][joint] = f" ({held} samples)"
        for channel, slices in parts.items():
            if spans := [Span(since[part.start], since[part.stop - 1]) for part in slices]:
                fault = "channel-frozen", channel
                frozen[fault] = list({*frozen[fault], *spans})
                faults[fault][joint] = f" ({listed_spans(spans)})"
    return [
        Finding.of(check, joints, channel=channel, settings=[unmeasured(robot, joints)], exclude=frozen[check, channel])
        for (check, channel), joints in faults.items()
    ]


def unmeasured(robot: Robot, joints: Iterable[str]) -> Setting:
    """Make the setting that leaves joints out in addition to the present ones."""
    return Setting("robot", "position_controlled", [*robot.position_controlled, *joints])


def coarse_step(torque: Array) -> float:
    """Find the step of a torque that stays on multiples of it, if it is larger than 3 % of the variation; otherwise 0.

    More than half of the samples repeat the value before them: the step hides what friction changes between two values.
    """
    changes = np.abs(np.diff(torque))
    changes = changes[changes > ROUNDING * float(np.abs(torque).max())]
    if len(changes) < 20 or len(changes) > 0.5 * len(torque):
        return 0.0
    step = float(changes.min())
    multiples = np.abs(changes / step - np.round(changes / step)) < 1e-3 * changes / step + 1e-6
    return step if step > 0.03 * float(torque.std()) and multiples.mean() > 0.99 else 0.0


def _shared_step(torque: Array, steps: Iterable[float]) -> float:
    """Find the step of other joints on whose multiples a torque stays as well; 0 without one."""
    return next((step for step in steps if np.all(np.abs(torque / step - np.round(torque / step)) < 1e-3)), 0.0)


def constant_parts(values: Array, segments: tuple[slice, ...], shortest: int) -> list[slice]:
    """Find parts of segments, at least `shortest` samples long, in which a channel is exactly constant."""
    parts: list[slice] = []
    thin = values[:: max(1, shortest // 2)]
    rounding = ROUNDING * float(np.abs(thin).max())
    if not np.any(np.abs(np.diff(thin)) <= rounding):
        return parts
    for segment in segments:
        runs = runs_of(np.abs(np.diff(values[segment])) <= rounding) + segment.start  # of steps
        parts += [slice(first, last + 1) for first, last in runs.tolist() if last + 1 - first >= shortest]
    return parts


def _frozen_positions(position: Array, torque: Array, parts: list[slice], period: float) -> list[slice]:
    """Find the constant parts in which a moving joint's position stops abruptly, without braking.

    A robot at rest brakes before and accelerates after it: entry and exit must be faster than 30 % of the top speed, or
    the position jumps afterward. At an end of the log 5 % is sufficient if the torque varies. If the encoder's
    resolution exceeds 2 % of the steps at top speed, one of them is sufficient, but the part must be 2 s long: a joint
    that sticks looks frozen to a coarse encoder.
    """
    if _flickers(position, parts):
        return parts
    steps = np.abs(np.diff(position))
    changes = steps[steps > ROUNDING * float(np.abs(position).max())]
    quantum, top = np.percentile(changes, [1, 99]).tolist() if len(changes) else (0.0, 0.0)
    coarse = quantum > 0.02 * top

    def fast(rows: slice, share: float) -> bool:
        first, last = rows.start, min(rows.stop, len(position) - 1)
        least = max(share * top, 5 * quantum * coarse)  # change per sample
        return bool(last - first >= 4 and abs(position[last] - position[first]) > (last - first) * least)

    frozen_parts = []
    for part in parts:
        if coarse and (part.stop - part.start) * period < 2.0:
            continue
        before, after = slice(max(part.start - 6, 0), max(part.start - 1, 0)), slice(part.stop, part.stop + 5)
        jumps = part.stop <= len(steps) and steps[part.stop - 1] > (10 if coarse else 3) * top
        at_end = part.start == 0 or part.stop >= len(position) - 1
        share = 0.05 if at_end and torque[part].std() > 0.3 * torque.std() and not coarse else 0.3
        abrupt = (fast(before, share), fast(after, share))
        if all(abrupt) or (any(abrupt) and (coarse or share < 0.3)) or jumps:
            frozen_parts.append(part)
    return frozen_parts


def _flickers(position: Array, parts: list[slice]) -> bool:
    """Whether a position has noise at almost every sample outside some parts, which are then no periods of rest.

    A last digit that changes occasionally at rest is not such noise.
    """
    steps = np.diff(position)[_outside(parts, len(position))[:-1]]
    if len(steps) < FROZEN_SAMPLES:
        return False
    unchanged = np.abs(steps) <= ROUNDING * float(np.abs(position).max())
    turns = np.append(steps[1:] * steps[:-1] < 0, False)
    near_turns = np.convolve(turns, np.ones(9), "same") > 0.5
    return bool(turns.mean() > 0.1 and unchanged.mean() < 0.05 and unchanged[near_turns].mean() < 0.05)


def _outside(parts: list[slice], count: int) -> BoolArray:
    """Mask the samples of a log outside of some parts, shape (count,)."""
    outside = np.ones(count, dtype=bool)
    for part in parts:
        outside[part] = False
    return outside


def _frozen_torques(torque: Array, position: Array, parts: list[slice]) -> list[slice]:
    """Find the parts where a joint moves whose torque is constant, and otherwise changes at almost every sample."""
    rest = np.diff(torque)[_outside(parts, len(torque))[1:]] != 0
    if len(rest) == 0 or rest.mean() < 0.5:
        return []
    extreme = [torque[part.start] in (torque.min(), torque.max()) for part in parts]
    moving = [np.ptp(position[part]) > 0.02 * np.ptp(position) for part in parts]
    clips = sum(extreme) > 1
    return [part for part, top, moves in zip(parts, extreme, moving, strict=True) if moves and not (clips and top)]


def clipped(torque: Array, position: Array) -> float:
    """Compute the share of the samples at an extreme, if far more are exactly there than close to it; otherwise 0.

    The extreme must be reached twice for at least four samples while the joint moves; at rest a torque may be constant.
    """
    least_share = 5e-3  # smallest share of the samples that lie exactly at an extreme [1]
    share = 0.0
    for values in (torque, -torque):
        top = values.max()
        at_extreme = values == top
        count = int(np.count_nonzero(at_extreme))
        if count < max(10, least_share * len(torque)):
            continue
        steps = np.abs(np.gradient(position))
        moving = steps > 0.01 * np.percentile(steps, 99)
        levels = np.unique(values[values > top - 0.1 * (top - values.min())])
        near = int(np.count_nonzero(values >= levels[-min(4, len(levels))])) - count
        long = np.count_nonzero(np.diff(runs_of(at_extreme)) >= 4)
        if len(levels) > 4 and long >= 2 and count > 5 * near and moving[at_extreme].mean() > 0.5:
            share += count / len(values)
    return share


def held_for(values: Array) -> int:
    """Count the samples for which each value of a channel is held; 0 if the counts differ or are one."""
    steps = np.diff(values)
    changes = np.flatnonzero(np.abs(steps) > ROUNDING * float(np.abs(values).max()))
    changes = changes[np.diff(changes, prepend=-2) > 1]  # an even clock smears a change over two samples
    if len(changes) < 20:
        return 0
    lengths = np.diff(changes)
    most = 0.95  # share of the values that must be held for the same number of samples [1]
    typical = int(np.median(lengths))
    if typical < 2 or np.mean(np.abs(lengths - typical) <= max(1, typical // 10)) < most:
        return 0
    # Steps of a coarse encoder have one size; steps between held values have any size.
    sizes = np.abs(steps[changes])
    if len(np.unique(np.round(sizes / sizes.max(), 6))) < 0.3 * len(sizes) or np.mean(lengths >= 2) < most:
        return 0
    return typical

"""One log worked through: read, prepared, its friction torque found and thinned."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from stribeck.auto_filter import cutoff_from_log
from stribeck.collect import MOST_KEPT, GroundReaction, join, thin
from stribeck.contact import SupportPhase, SupportPhases, find_support_phases
from stribeck.errors import errors_about, findings_kept
from stribeck.friction_torque import Chunk, friction_torque, support_name
from stribeck.log import RobotLog
from stribeck.motion import Filter, make_filter, resolve_auto
from stribeck.readers import read_log
from stribeck.robot import Robot
from stribeck.samples import Samples
from stribeck.sampling import Sampling, regularise
from stribeck.settings import FilterSettings, Settings

Progress = Callable[[str, float], None]
"""Told the stage and how much of it is done, from 0 to 1."""


def quiet(*_: object) -> None:
    """Show no progress."""


GROUND_TOLERANCE = 0.1
"""Share of the weight by which model and foot sensor may differ without a warning."""
STOP_MARGIN = 1e-3
"""[rad] or [m]"""
STRETCH = 4.0
"""[s] of the log that the report shows over time."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PreparedLog:
    """A log that is ready for estimation: evenly sampled, its support known, its filter chosen."""

    log: RobotLog
    sampling: Sampling
    support: SupportPhases
    motion_filter: Filter
    settings: Settings
    notes: tuple[str, ...] = ()

    def chunks(self, robot: Robot, phases: tuple[SupportPhase, ...] | None = None, stride: int = 1) -> Iterator[Chunk]:
        """Yield the friction torque of the log, or of some of its phases or of one of `stride` rows."""
        return friction_torque(
            robot,
            self.log,
            self.sampling.segments,
            self.support.phases if phases is None else phases,
            self.motion_filter,
            self.sampling.period,
            self.settings,
            stride,
        )

    def stride(self, count: int) -> int:
        """Return one of how many rows is kept if there are `count` logs like this one."""
        rows = sum(phase.last - phase.first for phase in self.support.phases)
        return max(1, -(-rows * count // MOST_KEPT))


def prepare(log: RobotLog | str | Path, robot: Robot, settings: Settings) -> PreparedLog:
    """Read a log, put it on an even clock, find its support phases and choose its filter.

    Raises
    ------
    LogError, SettingsError
        If the log cannot be used.
    """
    with findings_kept() as notes:
        if not isinstance(log, RobotLog):
            log = read_log(log, robot)
        notes += log.notes
        log, sampling = regularise(log, robot.log_table)
        notes += sampling.notes
        support = find_support_phases(log, robot, sampling.segments, settings.support)
        notes += support.notes
        chosen = settings.filter
        if chosen.kind == "auto":
            choice = cutoff_from_log(robot, log, sampling.segments, support.phases, sampling.period, settings)
            chosen = resolve_auto(chosen, choice)
            notes.append(f"filter chosen from the spectrum of the model's acceleration: {choice.reason}")
        motion_filter = make_filter(chosen, sampling.period)
        if robot.base == "floating" and log.base_orientation is None:
            notes.append("no base orientation: the standing foot is taken to be level")
    return PreparedLog(
        log=log,
        sampling=sampling,
        support=support,
        motion_filter=motion_filter,
        settings=settings.model_copy(update={"filter": chosen}),
        notes=tuple(notes),
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class Survey:
    """What stays of a log after its friction torque has been worked through.

    Attributes
    ----------
    path, duration, rate
        Of the log; [s], [Hz].
    used
        Samples that a fit may use for some joint.
    samples
        Those kept, in bounded number.
    stretch
        A few seconds at the full rate.
    phases
        Support timeline, as in `Evidence`.
    notes, warnings
        A sentence each.
    filter_name, filter_settings, support_source
        What was chosen.
    """

    path: str
    duration: float
    rate: float
    used: int
    samples: Samples
    stretch: Samples
    phases: list[tuple[float, float, str, bool]]
    notes: list[str]
    warnings: list[str]
    filter_name: str
    filter_settings: FilterSettings
    support_source: str


def survey(
    source: RobotLog | str | Path,
    index: int,
    count: int,
    robot: Robot,
    settings: Settings,
    write: Callable[[int, Chunk], None],
    progress: Progress,
) -> Survey:
    """Work through log `index` of `count`: every sample to `write`, one of some to the fit.

    Raises
    ------
    LogError, SettingsError
        If the log cannot be used.
    """
    with errors_about(source.path if isinstance(source, RobotLog) else str(source)):
        progress(f"reading log {index + 1} of {count}", index / count)
        prepared = prepare(source, robot, settings)
        return _work_through(prepared, index, count, robot, write, progress)


def thinned_samples(source: RobotLog | str | Path, count: int, robot: Robot, settings: Settings) -> Samples:
    """Return the samples that `survey` keeps of one of `count` logs, and work no others out.

    Raises
    ------
    LogError, SettingsError
        If the log cannot be used.
    """
    prepared = prepare(source, robot, settings)
    stride = prepared.stride(count)
    return join([thin(chunk, stride) for chunk in prepared.chunks(robot, stride=stride)])


def _work_through(
    prepared: PreparedLog,
    index: int,
    count: int,
    robot: Robot,
    write: Callable[[int, Chunk], None],
    progress: Progress,
) -> Survey:
    log, phases = prepared.log, prepared.support.phases
    stride = prepared.stride(count)
    ground = GroundReaction()
    kept, used = [], 0
    for chunk in prepared.chunks(robot):
        write(index, chunk)
        kept.append(thin(chunk, stride))
        used += int(chunk.samples.usable.any(axis=1).sum())
        _compare_ground_reaction(ground, log, chunk)
        progress(f"friction torque of log {index + 1} of {count}", (index + chunk.rows[-1] / len(log.time)) / count)
    samples = join(kept)
    notes, warnings = _ground_reaction_texts(ground, robot)
    warnings += stops_reached(log, robot)
    return Survey(
        path=log.path,
        duration=float(log.time[-1] - log.time[0]),
        rate=prepared.sampling.rate,
        used=used,
        samples=samples,
        stretch=_clear_stretch(prepared, robot, samples),
        phases=[
            (
                float(log.time[phase.start]),
                float(log.time[phase.stop - 1]),
                support_name(phase),
                phase.last > phase.first and phase.kind != "flight",
            )
            for phase in phases
        ],
        notes=[*prepared.notes, *notes],
        warnings=warnings,
        filter_name=prepared.motion_filter.name,
        filter_settings=prepared.settings.filter,
        support_source=prepared.support.source,
    )


def _clear_stretch(prepared: PreparedLog, robot: Robot, samples: Samples) -> Samples:
    """Return a few seconds at the full rate, around where most joints move fast."""
    log = prepared.log
    speed = np.abs(samples.velocity)
    busy = np.where(samples.usable, speed / np.maximum(speed.max(axis=0), 1e-9), 0.0).sum(axis=1)
    bins = ((samples.time - samples.time[0]) / STRETCH).astype(int)
    begin = samples.time[0] + STRETCH * int(np.argmax(np.bincount(bins, busy)))
    low, high = np.searchsorted(log.time, [begin, begin + STRETCH])
    clipped = tuple(
        replace(phase, first=max(phase.first, int(low)), last=min(phase.last, int(high)))
        for phase in prepared.support.phases
    )
    return join([chunk.samples for chunk in prepared.chunks(robot, clipped)])


def stops_reached(log: RobotLog, robot: Robot) -> list[str]:
    """Return a warning about joints that reach the end of their range, where a stop's torque is taken for friction."""
    low, high = robot.position_limits
    lowest, highest = log.position.min(axis=0), log.position.max(axis=0)
    reached = np.flatnonzero((lowest < low + STOP_MARGIN) | (highest > high - STOP_MARGIN))
    if len(reached) == 0:
        return []
    spans = [
        f"{robot.joint_names[k]} ({lowest[k]:.3g} to {highest[k]:.3g}, limits {low[k]:.3g} to {high[k]:.3g})"
        for k in reached
    ]
    return [
        "joints reach the end of their range in the model, where a stop would take part of the torque: "
        + ", ".join(spans)
    ]


def _compare_ground_reaction(ground: GroundReaction, log: RobotLog, chunk: Chunk) -> None:
    if log.foot_wrench is None:
        return
    for k, name in enumerate(chunk.samples.support_names):
        rows = np.flatnonzero(chunk.samples.support == k)
        if len(rows) and name in log.foot_names:
            ground.add(chunk.wrench[rows], log.foot_wrench[chunk.rows[rows], log.foot_names.index(name)])


def _ground_reaction_texts(ground: GroundReaction, robot: Robot) -> tuple[list[str], list[str]]:
    """Return a note, and a warning where model and foot sensor are far apart."""
    if not ground.samples:
        return [], []
    weight = robot.mass * float(np.linalg.norm(robot.gravity))
    vertical, mean = float(ground.rms[2]), float(ground.mean[2])
    text = (
        f"ground reaction, foot sensor against model, RMS over {ground.samples} samples: vertical {vertical:.1f} N "
        f"({100 * vertical / weight:.1f} % of the weight, mean {mean:+.1f} N), horizontal "
        f"{float(np.hypot(*ground.rms[:2])):.1f} N, moments {float(np.linalg.norm(ground.rms[3:])):.2f} N m"
    )
    far = vertical > GROUND_TOLERANCE * weight
    return [text], [f"the model and the foot sensors disagree: {text}"] if far else []

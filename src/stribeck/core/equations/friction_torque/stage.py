"""Friction torque of all logs: every sample for the table, a thinned selection for fit and report."""

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from stribeck.core.base.finding import Finding
from stribeck.core.base.parts import SERVICES
from stribeck.core.base.typing import Array
from stribeck.core.equations.friction_torque.inverse_dynamics import Chunk, support_name, torque_chunks
from stribeck.core.equations.friction_torque.preparation import Logs, PreparedLog, Progress
from stribeck.core.equations.friction_torque.table import friction_table
from stribeck.core.equations.friction_torque.thinning import join, join_logs, thin
from stribeck.core.errors import errors_about
from stribeck.core.filters import make_filter, resolve_auto
from stribeck.core.log import RobotLog
from stribeck.core.log.storage import release_memory
from stribeck.core.result.samples import MOST_KEPT, FrictionSamples
from stribeck.core.robot import Robot
from stribeck.core.settings import FilterSettings, Settings


@dataclass(frozen=True, eq=False, kw_only=True)
class LogFriction:
    """Friction torque of one log: a bounded number of samples, and notes.

    Attributes
    ----------
    used
        Number of samples that a fit may use for some joint.
    samples
        Kept samples, bounded in number.
    close_up
        A few seconds at the full rate.
    phases
        Contact modes over time, as in `Evidence`.
    notes, findings
        Notes, one sentence each, and findings.
    filter_name
        Description of the filter with its numbers.
    """

    used: int
    samples: FrictionSamples
    close_up: FrictionSamples
    phases: list[tuple[float, float, str, bool]]
    notes: list[str]
    findings: list[Finding]
    filter_name: str


@dataclass(frozen=True, eq=False, kw_only=True)
class LogsFriction:
    """Friction torque of all logs.

    Attributes
    ----------
    logs
        Friction torque of each log.
    samples
        Kept samples of all logs.
    settings
        Settings with the chosen filter.
    notes
        Notes on the choice of the filter, one sentence each.
    """

    logs: tuple[LogFriction, ...]
    samples: FrictionSamples
    settings: Settings
    notes: list[str]


class FrictionTorqueStage:
    """Computes the friction torque of logs, and caches the last result.

    The fit and the report share the result. The table belongs to the last result. The filter is chosen once, from the
    first log before any correction, so that methods are compared at one bandwidth.
    """

    def __init__(
        self, table: Path | None, progress: Progress, first: PreparedLog, robot: Robot, settings: Settings
    ) -> None:
        self._table, self._progress, self._given = table, progress, (first, robot, settings)
        self._last: tuple[object, LogsFriction] | None = None

    @cached_property
    def _filter(self) -> tuple[FilterSettings, list[str]]:
        self._progress("choosing the filter", 0.0)
        settings, notes = with_filter(*self._given)
        return settings.filter, notes

    @cached_property
    def _cutoff(self) -> float | None:
        """Cutoff chosen from the first log [Hz], for any kind of filter."""
        if self._given[2].filter.kind == "auto":
            return self._filter[0].cutoff
        log, robot, settings = self._given
        return with_filter(log, robot, settings.model_copy(update={"filter": FilterSettings()}))[0].filter.cutoff

    def __call__(self, logs: Logs, robot: Robot, settings: Settings) -> LogsFriction:
        """Compute the friction torque of logs for a robot, with one filter for all logs.

        Raises
        ------
        LogError, SettingsError
            If a log lacks a channel that the settings require, is too short, or the settings do not suit it.
        """
        asked = tuple(logs), robot, settings  # the same logs and robot, equal settings
        if self._last is None or self._last[0] != asked:
            self._last = asked, self._compute(logs, robot, settings)
        return self._last[1]

    def _compute(self, logs: Logs, robot: Robot, settings: Settings) -> LogsFriction:
        filter_, notes = self._filter
        settings = settings.model_copy(update={"filter": filter_})
        if settings.observer_bandwidth == "auto":
            settings = settings.model_copy(update={"observer_bandwidth": self._cutoff})
        rough = self._given[0].log.unscaled
        with friction_table(self._table, rough) if self._table else nullcontext(_drop) as write:
            parts = [log_friction(logs, k, robot, settings, write, self._progress) for k in range(len(logs))]
        samples = join_logs([part.samples for part in parts])
        return LogsFriction(logs=tuple(parts), samples=samples, settings=settings, notes=notes)


def _drop(*_: object) -> None:
    """Discard a chunk."""


def with_filter(prepared: PreparedLog, robot: Robot, settings: Settings) -> tuple[Settings, list[str]]:
    """Choose the filter from a log if its kind is "auto", and note the choice.

    Raises
    ------
    LogError
        If no segment is long enough for a spectrum.
    """
    if settings.filter.kind != "auto":
        return settings, []
    with errors_about(prepared.log.path):
        choice = SERVICES["cutoff"](prepared, robot, settings)
    note = f"filter chosen from the spectrum of the model's acceleration: {choice.reason}"
    return settings.model_copy(update={"filter": resolve_auto(settings.filter, choice)}), [note]


def thinned_samples(
    prepared: PreparedLog, count: int, robot: Robot, settings: Settings, most: int = MOST_KEPT
) -> FrictionSamples:
    """Compute only the samples that `log_friction` keeps of one of `count` logs."""
    stride = _choose_stride(prepared, count, most)
    return join([thin(chunk, stride) for chunk in torque_chunks(prepared, robot, settings, stride=stride)])


def log_friction(
    logs: Logs, index: int, robot: Robot, settings: Settings, write: Callable[[int, Chunk], None], progress: Progress
) -> LogFriction:
    """Compute the friction torque of log `index`: pass every sample to a table's `write`, keep a thinned selection.

    Raises
    ------
    LogError, SettingsError
        If the log cannot be used.
    """
    prepared, count = logs[index], len(logs)
    log, phases = prepared.log, prepared.support.phases
    stride = _choose_stride(prepared, count, MOST_KEPT)
    kept, used, moments = [], 0, np.zeros((3, 6))
    with errors_about(log.path):
        for chunk in torque_chunks(prepared, robot, settings, stride=stride if write is _drop else 1):
            write(index, chunk)
            kept.append(thin(chunk, stride))
            used += chunk.samples.stride * int(chunk.samples.usable.any(axis=1).sum())
            moments += _compare_wrenches(log, chunk)
            progress(f"friction torque of log {index + 1} of {count}", (index + chunk.rows[-1] / len(log.time)) / count)
            release_memory()
        samples = join(kept)
    notes, findings = _note_ground_reaction(moments, robot)
    return LogFriction(
        used=min(used, len(log.time)),  # of thinned samples, each counts as many
        samples=samples,
        close_up=_cut_close_up(prepared, robot, settings, samples),
        phases=[
            (
                float(log.time[phase.start]),
                float(log.time[phase.stop - 1]),
                support_name(phase),
                support_name(phase) in samples.support_names and phase.last > phase.first,
            )
            for phase in phases
        ],
        notes=notes,
        findings=findings,
        filter_name=_name_filter(settings, prepared.sampling.period),
    )


def _compare_wrenches(log: RobotLog, chunk: Chunk) -> Array:
    """Compare a single standing foot's measured wrench with the predicted wrench.

    Computes count, sum and sum of squares of the differences over a chunk, shape (3, 6). They are independent of
    friction.
    """
    moments = np.zeros((3, 6))
    for k, name in enumerate(chunk.samples.support_names):
        rows = np.flatnonzero(chunk.samples.support == k)
        if log.foot_wrench is not None and len(rows) and name in log.foot_names:
            difference = log.foot_wrench[chunk.rows[rows], log.foot_names.index(name)] - chunk.wrench[rows]
            difference = difference[np.all(np.isfinite(difference), axis=1)]
            moments += [np.full(6, len(difference)), difference.sum(axis=0), (difference**2).sum(axis=0)]
    return moments


def _note_ground_reaction(moments: Array, robot: Robot) -> tuple[list[str], list[Finding]]:
    """Write a note on the differences of wrenches, and a finding if model and foot sensor differ strongly."""
    samples = int(moments[0, 0])
    if not samples:
        return [], []
    weight = robot.mass * float(np.linalg.norm(robot.gravity))
    rms, mean = np.sqrt(moments[2] / samples), float(moments[1, 2] / samples)
    text = (
        f"ground reaction, foot sensor minus model, RMS over {samples} samples: vertical {rms[2]:.1f} N "
        f"({100 * rms[2] / weight:.1f} % of the weight, mean {mean:+.1f} N), horizontal "
        f"{float(np.hypot(*rms[:2])):.1f} N, moments {float(np.linalg.norm(rms[3:])):.2f} N m"
    )
    return [text], [Finding.of("foot-sensors", evidence=text)] if rms[2] > 0.1 * weight else []


def _name_filter(settings: Settings, period: float) -> str:
    name = make_filter(settings.filter, period).name
    bandwidth = settings.observer_bandwidth
    return f"{name}; momentum observer, -3 dB at {bandwidth:.3g} Hz" if bandwidth else name


def _choose_stride(prepared: PreparedLog, count: int, most: int) -> int:
    """Compute the thinning stride for `count` logs of this size."""
    rows = sum(phase.last - phase.first for phase in prepared.support.phases)
    return max(1, -(-rows * count // most))


def _cut_close_up(prepared: PreparedLog, robot: Robot, settings: Settings, samples: FrictionSamples) -> FrictionSamples:
    """Select a few seconds at the full rate, around the fastest motion of most joints."""
    duration = 4.0  # [s]
    log = prepared.log
    speed = np.abs(samples.velocity)
    busy = np.where(samples.usable, speed, 0.0) @ (1 / np.maximum(speed.max(axis=0), 1e-9))
    bins = ((samples.time - samples.time[0]) / duration).astype(int)
    begin = samples.time[0] + duration * int(np.argmax(np.bincount(bins, busy)))
    low, high = np.searchsorted(log.time, [begin, begin + duration])
    clipped = tuple(
        replace(phase, first=max(phase.first, int(low)), last=min(phase.last, int(high)))
        for phase in prepared.support.phases
    )
    return join([chunk.samples for chunk in torque_chunks(prepared, robot, settings, clipped)])

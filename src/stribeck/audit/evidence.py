"""What the checks look at: a log's torque beside the model's, worked out once, in parts of it if it is long."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from stribeck.friction_torque.stream import torque_chunks
from stribeck.motion import make_filter
from stribeck.preparation import PreparedLog
from stribeck.robot import Robot
from stribeck.settings import FilterSettings, Settings
from stribeck.typing import Array

MOST_SAMPLES = 30_000
"""Samples that are looked at; of a longer log, `PARTS` that lie evenly over it."""
PARTS = 8
BIN = 0.04
"""[s]; means over bins are compared, so that an encoder's noise, which large inertias multiply, is not."""
FILTER = 0.05
"""[s] that the filter of motions covers where the settings leave its choice to the log."""
STILL = 0.01
"""[rad/s] or [m/s]: a joint that never moves faster stands still."""


@dataclass(frozen=True, eq=False)
class Run:
    """Samples without a break in one contact mode: measured torque, model's torque and velocity, each (t, k)."""

    torque: Array
    model: Array
    velocity: Array


@dataclass(frozen=True, eq=False, kw_only=True)
class Evidence:
    """A prepared log and what the model says of it, of the k torque-controlled joints.

    Attributes
    ----------
    prepared, robot
        What it is of.
    runs
        At the log's rate.
    rows
        Of the log, in the middle of each of the B bins, shape (B,).
    run
        Number of the run that each bin is of, shape (B,).
    support, support_names
        As in `Samples`, of the bins.
    torque, model, velocity, acceleration
        Means over the bins, shape (B, k); the model's torque, which is inverse dynamics less the external torque, is
        NaN where it is not known.
    external
        The same of the external torque, zero where there is none.
    """

    prepared: PreparedLog
    robot: Robot
    runs: list[Run]
    rows: NDArray[np.int64]
    run: NDArray[np.int64]
    support: NDArray[np.int64]
    support_names: tuple[str, ...]
    torque: Array
    model: Array
    velocity: Array
    acceleration: Array
    external: Array

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the k joints."""
        return tuple(self.robot.joint_names[column] for column in self.robot.torque_controlled)

    @cached_property
    def top_speed(self) -> Array:
        """99th percentile of each joint's speed, shape (k,)."""
        if len(self.rows) == 0:
            return np.zeros(len(self.joints))
        return np.asarray(np.percentile(np.abs(self.velocity), 99, axis=0))

    @cached_property
    def position_range(self) -> tuple[Array, Array]:
        """Lowest and highest position of all joints of the robot in the whole log, shape (n,) each."""
        position = self.prepared.log.position
        return position.min(axis=0), position.max(axis=0)

    def moves(self, k: int) -> bool:
        """Whether a joint moves at all."""
        return bool(self.top_speed[k] > STILL)


def gather(prepared: PreparedLog, robot: Robot, settings: Settings) -> Evidence:
    """Return what the checks look at, of at most `MOST_SAMPLES` samples.

    Raises
    ------
    LogError, SettingsError
        If the log lacks a channel that the settings ask for, or the settings do not suit it.
    """
    period = prepared.sampling.period
    plain = {"averaged_law": False, "filter_torque": False, "standing_legs": True}
    differentiated = settings.filter.kind == "auto" or (settings.filter.kind == "log" and settings.observer_bandwidth)
    settings = settings.model_copy(update=plain | {"observer_bandwidth": None})
    if differentiated:  # an observer's log may have velocities alone
        window = 2 * max(3, round(FILTER / period / 2)) + 1
        settings = settings.model_copy(update={"filter": FilterSettings(kind="savitzky-golay", window=window)})
    size = max(1, round(BIN / period))
    margin = make_filter(settings.filter, period).half_width
    runs: list[Run] = []
    bins: dict[str, list[Array]] = {"torque": [], "model": [], "velocity": [], "acceleration": [], "external": []}
    rows: list[NDArray[np.int64]] = []
    run: list[NDArray[np.int64]] = []
    support: list[NDArray[np.int64]] = []
    names: tuple[str, ...] = ()
    for chunk in torque_chunks(_parts(prepared, margin), robot, settings):
        samples, names = chunk.samples, chunk.samples.support_names
        for part in chunk.runs():
            log, used = prepared.log, (chunk.rows[part][:, None], robot.torque_controlled)
            torque = log.torque[used]
            model = np.where(samples.usable[part], torque - samples.friction_torque[part], np.nan)
            count = len(torque) // size
            if count == 0:
                continue
            there = {"torque": torque, "model": model, "velocity": samples.velocity[part]}
            there["acceleration"] = samples.acceleration[part]
            there["external"] = np.zeros_like(torque) if log.external_torque is None else log.external_torque[used]
            for name, values in there.items():
                bins[name].append(values[: count * size].reshape(count, size, -1).mean(axis=1))
            rows.append(chunk.rows[part][size // 2 : count * size : size])
            support.append(samples.support[part][: count * size : size])
            run.append(np.full(count, len(runs)))
            runs.append(Run(torque, model, samples.velocity[part]))
    empty = np.empty((0, len(robot.torque_controlled)))
    return Evidence(
        prepared=prepared,
        robot=robot,
        runs=runs,
        rows=_joined(rows),
        run=_joined(run),
        support=_joined(support),
        support_names=names,
        **{name: np.concatenate([empty, *values]) for name, values in bins.items()},
    )


def _joined(parts: list[NDArray[np.int64]]) -> NDArray[np.int64]:
    return np.concatenate([np.empty(0, dtype=np.int64), *parts])


def _parts(prepared: PreparedLog, margin: int) -> PreparedLog:
    """Return the log with as much of its segments as is looked at."""
    rows = len(prepared.log.time)
    if rows <= MOST_SAMPLES:
        return prepared
    length = MOST_SAMPLES // PARTS + 2 * margin
    starts = np.linspace(0, rows - length, PARTS).astype(int)
    segments = tuple(
        slice(max(segment.start, start), min(segment.stop, start + length))
        for start in starts.tolist()
        for segment in prepared.sampling.segments
        if max(segment.start, start) < min(segment.stop, start + length)
    )
    return replace(prepared, sampling=replace(prepared.sampling, segments=segments))

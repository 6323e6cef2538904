"""Measured torque and the model's torque of a log, computed once for all checks; a long log is sampled in parts."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.ndimage import convolve1d

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.equations.friction_torque.inverse_dynamics import torque_chunks
from stribeck.core.equations.friction_torque.preparation import PreparedLog
from stribeck.core.equations.whole_log.noise import white_noise
from stribeck.core.filters import make_filter, savgol_kernels
from stribeck.core.robot import Robot
from stribeck.core.settings import FilterSettings, Settings

BIN, MOST_SAMPLES = 0.04, 30_000
"""Duration of a bin [s], and number of examined samples [1]; a longer log is sampled in evenly spaced parts."""
LEAST_BINS = 24
"""Minimum number of bins, or of pairs of bins, for any comparison with the model [1]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class AuditData:
    """A prepared log and the model's torque, for the k torque-controlled joints.

    Attributes
    ----------
    prepared, robot
        The log and its robot.
    stride
        Number of rows of the log between two samples of the model's torque [1].
    rows
        Row of the log in the middle of each of the B bins, shape (B,).
    run
        Number of the run of each bin, shape (B,): uninterrupted samples in one contact mode.
    support, support_names
        Support of each bin, see `FrictionSamples`.
    velocity_range
        Lowest and highest velocity of all samples, shape (k,) each; zero without samples.
    torque, model, velocity, acceleration
        Means over the bins, shape (B, k); the model's torque is inverse dynamics minus the external torque, NaN where
        it is unknown.
    external
        Mean external torque, shape (B, k); zero without the channel.
    """

    prepared: PreparedLog
    robot: Robot
    stride: int
    velocity_range: tuple[Array, Array]
    rows: IntArray
    run: IntArray
    support: IntArray
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

    @property
    def support_feet(self) -> list[list[str]]:
        """Standing feet of each support."""
        return [[foot for foot in name.split("+") if foot in self.robot.contacts] for name in self.support_names]

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
        """Whether a joint moves faster than 0.01 rad/s or m/s."""
        return bool(self.top_speed[k] > 0.01)

    @cached_property
    def standing(self) -> set[str]:
        """Names of joints that stand still while others move: a brake or stiction may carry any part of their load."""
        span = np.subtract(*self.position_range[::-1])[self.robot.torque_controlled]
        creeps = 0.01  # range of positions [rad], [m] within which a joint only creeps: most gears preslide further
        standing = {name for k, name in enumerate(self.joints) if not self.moves(k) or span[k] < creeps}
        return standing if len(standing) < len(self.joints) else set()


def gather(prepared: PreparedLog, robot: Robot, settings: Settings, most: int = MOST_SAMPLES) -> AuditData:
    """Compute the evidence for all checks from at most `most` samples.

    The checks compare means over bins of 40 ms, because encoder noise, which large inertias multiply, averages out. The
    model's torque needs only 8 samples per bin, after a filter over 50 ms, or up to 200 ms if encoders are noisy.

    Raises
    ------
    LogError, SettingsError
        If the log lacks a channel that the settings require, or the settings do not suit it.
    """
    period, log = prepared.sampling.period, prepared.log
    settings, differentiated = _plain(settings, prepared, robot.torque_controlled)
    size = max(1, round(BIN / period))
    stride = max(step for step in range(1, max(1, size // 8) + 1) if size % step == 0) if differentiated else 1
    known, points = robot.torque_controlled, size // stride
    speeds: list[Array] = []
    channels = ("torque", "model", "velocity", "acceleration", "external")
    empty = dict.fromkeys(channels, np.empty((0, len(known))))
    parts: list[dict[str, Any]] = [empty | dict.fromkeys(("rows", "support", "run"), np.empty(0, dtype=np.int64))]
    names: tuple[str, ...] = ()
    examined = _parts(prepared, make_filter(settings.filter, period).half_width, most)
    for chunk in torque_chunks(examined, robot, settings, stride=stride):
        samples, names = chunk.samples, chunk.samples.support_names
        for part in chunk.runs():
            rows, velocity = chunk.rows[part], samples.velocity[part]
            count = len(rows) // points
            if count == 0:
                continue
            torque = log.torque[rows[0] : rows[-1] + stride, known]
            measured = torque[::stride]
            model = np.where(samples.usable[part], measured - samples.friction_torque[part], np.nan)
            external = np.zeros_like(measured) if log.external_torque is None else log.external_torque[rows][:, known]
            thinned = model, velocity, samples.acceleration[part], external
            means = _means(torque, count, size), *(_means(values, count, points) for values in thinned)
            middles = rows[0] + size // 2 + size * np.arange(count)
            bins = {"rows": middles, "support": samples.support[part][:count], "run": np.full(count, len(speeds))}
            parts.append(bins | dict(zip(channels, means, strict=True)))
            speeds.append(velocity)
    every = np.concatenate(speeds or [np.zeros((1, len(known)))])
    return AuditData(
        prepared=prepared,
        robot=robot,
        stride=stride,
        velocity_range=(every.min(axis=0), every.max(axis=0)),
        support_names=names,
        **{name: np.concatenate([part[name] for part in parts]) for name in parts[0]},
    )


def _plain(settings: Settings, prepared: PreparedLog, joints: IntArray) -> tuple[Settings, bool]:
    """Choose settings that filter only motion, and return whether they differentiate positions over 50 ms or more."""
    kind = settings.filter.kind
    differentiated = kind == "auto" or (kind == "log" and settings.observer_bandwidth is not None)
    plain = {"averaged_law": False, "filter_torque": False, "standing_legs": True, "observer_bandwidth": None}
    of_motion = {"filter": _differentiator(prepared, joints)} if differentiated else {}  # an observer has velocities
    return settings.model_copy(update=plain | of_motion), differentiated


def _differentiator(prepared: PreparedLog, joints: IntArray) -> FilterSettings:
    """Choose a window of 50 ms, or of 100 or 200 ms while half of most joints' accelerations is encoder noise."""
    position, period = prepared.log.position[:MOST_SAMPLES, joints], prepared.sampling.period
    noise = white_noise(position, prepared.sampling.segments)
    for seconds in (0.05,) if prepared.log.unscaled else (0.05, 0.1, 0.2):  # gains are found and checked alike
        window = 2 * max(3, round(seconds / period / 2)) + 1
        chosen = FilterSettings(kind="savitzky-golay", window=window)
        kernel = savgol_kernels(window, chosen.order, period)[2]
        acceleration = convolve1d(position, kernel, axis=0).std(axis=0)
        if np.median(noise * np.linalg.norm(kernel) / np.maximum(acceleration, 1e-12)) < 0.5:
            break
    return chosen


def _means(values: Array, count: int, size: int) -> Array:
    return np.asarray(values[: count * size].reshape(count, size, -1).mean(axis=1))


def _parts(prepared: PreparedLog, margin: int, most: int) -> PreparedLog:
    """Cut the segments of a long log to the examined parts."""
    rows = len(prepared.log.time)
    if rows <= most:
        return prepared
    parts = 8  # evenly spaced
    length = most // parts + 2 * margin
    starts = np.linspace(0, rows - length, parts).astype(int)
    segments = tuple(
        slice(max(segment.start, start), min(segment.stop, start + length))
        for start in starts.tolist()
        for segment in prepared.sampling.segments
        if max(segment.start, start) < min(segment.stop, start + length)
    )
    return replace(prepared, sampling=replace(prepared.sampling, segments=segments))

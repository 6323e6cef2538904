"""What a log holds, before anything is identified: channels, sampling, contact modes, ranges, delays and signs."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from stribeck.errors import errors_about, findings_kept
from stribeck.friction_torque.stage import torque_chunks, with_filter
from stribeck.friction_torque.stream import support_name
from stribeck.log import RobotLog
from stribeck.motion import make_filter
from stribeck.preparation import PreparedLog, prepare
from stribeck.robot import Robot
from stribeck.settings import Settings
from stribeck.threads import one_blas_thread
from stribeck.typing import Array

MOST_SAMPLES = 60_000
"""Samples that delays and signs are judged by."""
LONGEST_DELAY = 0.03
"""[s] searched on either side for a delay of the torque."""
SHORTEST_RUN = 0.3
"""[s]; shorter runs say little about a delay."""
OPPOSITE = -0.3
"""A torque whose correlation with the model is below this has the wrong sign."""
EXPLAINED = 0.5
"""Share of a torque's variance that the model must explain before a delay is given."""
FRICTION_SHAPES = (0.01, 0.03, 0.1, 0.3)
"""Widths of the smoothed signs that stand for friction, in shares of the top speed."""
STILL = 0.01
"""[rad/s] or [m/s]: a joint that never moves faster stands still."""


@dataclass(frozen=True, kw_only=True)
class JointInspection:
    """One joint's ranges, and how its torque compares with the model's.

    Attributes
    ----------
    position_range, velocity_range, torque_range
        Smallest and largest [rad], [rad/s], [N m].
    correlation
        Of measured torque and inverse dynamics; None for a joint whose model torque is not known or constant.
    delay
        By which the torque comes later than the motion asks for [s]; None where the model explains too little of it.
    sign
        "opposite" where the torque correlates negatively with the model.
    """

    position_range: tuple[float, float]
    velocity_range: tuple[float, float]
    torque_range: tuple[float, float]
    correlation: float | None
    delay: float | None
    sign: Literal["agrees", "opposite", "unclear"]


@dataclass(frozen=True, kw_only=True)
class Inspection:
    """What `stribeck inspect` shows.

    Attributes
    ----------
    channels
        Name and shape of what the log holds.
    phases
        Start [s], end [s], contact mode, whether it is used.
    gaps
        Last stamp before and first after [s].
    findings
        What a user should act on, a sentence each: joints with opposite signs come first.
    """

    robot: str
    path: str
    samples: int
    duration: float
    rate: float
    jitter: float
    duplicates: int
    gaps: list[tuple[float, float]]
    missing: dict[str, int]
    channels: dict[str, list[int]]
    support_source: str
    phases: list[tuple[float, float, str, bool]]
    filter: str
    joints: dict[str, JointInspection]
    findings: list[str]
    notes: list[str]

    def to_json(self) -> str:
        """Return the inspection as JSON text."""
        return json.dumps(asdict(self), indent=2, allow_nan=False) + "\n"


def inspect_log(log: RobotLog | str | Path, robot: Robot | str | Path, settings: Settings | None = None) -> Inspection:
    """Say what a log holds: channels, sampling, support phases, ranges, delays and signs of the torques.

    Parameters
    ----------
    log
        A log of T samples, or its path.
    robot
        The robot, or the path of its robot file.
    settings
        The robot file's if None.

    Raises
    ------
    LogError, SettingsError
        If the log cannot be used at all.
    RobotFileError
        If a robot file is given and cannot be used.

    Examples
    --------
    >>> found = inspect_log("log.npz", "robot.toml")
    >>> found.rate, found.joints["elbow"].sign
    (1000.0, 'agrees')
    """
    robot = robot if isinstance(robot, Robot) else Robot.from_file(robot)
    where = log.path if isinstance(log, RobotLog) else str(log)
    with one_blas_thread(), findings_kept(robot.warnings), errors_about(where):
        settings = settings or robot.settings
        prepared = prepare(log, robot, settings)
        return _inspect(prepared, robot, *with_filter(prepared, robot, settings))


def _inspect(prepared: PreparedLog, robot: Robot, settings: Settings, choices: list[str]) -> Inspection:
    log, sampling = prepared.log, prepared.sampling
    runs = list(_runs(prepared, robot, settings))
    joints = {
        name: _inspect_joint(runs, k, sampling.period, log, robot.joint_names.index(name))
        for k, name in enumerate(robot.joint_names[c] for c in robot.torque_controlled)
    }
    opposite = [name for name, joint in joints.items() if joint.sign == "opposite"]
    findings = []
    if opposite:
        findings.append(
            f"the torque runs against the model, its sign or the position's may be inverted: {', '.join(opposite)}; "
            "set [log] torque = { scale = -1.0 }, or a scale per joint"
        )
    findings += _common_delay(joints)
    return Inspection(
        robot=robot.name,
        path=log.path,
        samples=len(log.time),
        duration=float(log.time[-1] - log.time[0]),
        rate=float(sampling.rate),
        jitter=round(float(sampling.jitter), 9),  # stamps are floats: less than a nanosecond is none
        duplicates=int(sampling.duplicates),
        gaps=[(float(a), float(b)) for a, b in sampling.gaps],
        missing=dict(sampling.missing),
        channels={name: list(array.shape) for name, array in log.channels().items()},
        support_source=prepared.support.source,
        phases=[
            (float(log.time[p.start]), float(log.time[p.stop - 1]), support_name(p), p.last > p.first)
            for p in prepared.support.phases
        ],
        filter=make_filter(settings.filter, sampling.period).name,
        joints=joints,
        findings=[*findings, *prepared.warnings, *robot.warnings],
        notes=[*prepared.notes, *choices],
    )


@dataclass(frozen=True, eq=False)
class _Run:
    """Samples without a break: measured torque, model's torque and velocity, each (t, k)."""

    torque: Array
    model: Array
    velocity: Array


def _runs(prepared: PreparedLog, robot: Robot, settings: Settings) -> Iterator[_Run]:
    """Yield runs of one support phase each, up to `MOST_SAMPLES` samples."""
    yielded = 0
    for chunk in torque_chunks(prepared, robot, settings):
        for rows in chunk.runs():
            torque = prepared.log.torque[chunk.rows[rows]][:, robot.torque_controlled]
            yield _Run(torque, torque - chunk.samples.friction_torque[rows], chunk.samples.velocity[rows])
            yielded += rows.stop - rows.start
        if yielded >= MOST_SAMPLES:
            return


def _inspect_joint(runs: list[_Run], k: int, period: float, log: RobotLog, column: int) -> JointInspection:
    modelled = [run for run in runs if np.all(np.isfinite(run.model[:, k]))]
    torque = np.concatenate([run.torque[:, k] for run in modelled]) if modelled else np.empty(0)
    model = np.concatenate([run.model[:, k] for run in modelled]) if modelled else np.empty(0)
    velocity = np.concatenate([run.velocity[:, k] for run in runs]) if runs else np.zeros(1)
    correlation, delay = None, None
    sign: Literal["agrees", "opposite", "unclear"] = "unclear"
    if len(torque) > 1 and torque.std() > 0 and model.std() > 0:
        correlation = float(np.corrcoef(torque, model)[0, 1])
        sign = "opposite" if correlation < OPPOSITE else "agrees" if correlation > -OPPOSITE else "unclear"
        if np.abs(velocity).max() > STILL:
            delay = _delay(modelled, k, period)
    return JointInspection(
        position_range=_span(log.position[:, column]),
        velocity_range=_span(velocity),
        torque_range=_span(log.torque[:, column]),
        correlation=correlation,
        delay=delay,
        sign=sign,
    )


def _span(values: Array) -> tuple[float, float]:
    return float(values.min()), float(values.max())


def _delay(runs: list[_Run], k: int, period: float) -> float | None:
    """Return by how much the torque comes late [s], or None where the model explains too little of it.

    For every shift the torque is regressed on the model's torque, the velocity, smoothed signs of it and a constant:
    friction shall not be taken for a delay. A parabola through the best shift and its neighbours gives the fraction of
    a sample.
    """
    reach = max(2, round(LONGEST_DELAY / period))
    runs = [run for run in runs if len(run.model) > 2 * reach + SHORTEST_RUN / period]
    if not runs:
        return None
    speed = np.concatenate([run.velocity[reach:-reach, k] for run in runs])
    model = np.concatenate([run.model[reach:-reach, k] for run in runs])
    top = max(float(np.abs(speed).max()), 1e-9)
    signs = [np.tanh(speed / (share * top)) for share in FRICTION_SHAPES]
    without_model = np.linalg.qr(np.column_stack([np.ones(len(speed)), speed, *signs]))[0]
    with_model = np.linalg.qr(np.column_stack([without_model, model]))[0]

    def shifted(shift: int) -> Array:
        return np.concatenate([run.torque[reach + shift : len(run.torque) - reach + shift, k] for run in runs])

    shifts = np.arange(-reach, reach + 1)
    left = [_unexplained(with_model, shifted(int(shift))) for shift in shifts]
    best = int(np.argmin(left))
    torque = shifted(int(shifts[best]))
    gained = _unexplained(without_model, torque) - left[best]
    if best in (0, len(shifts) - 1) or gained < EXPLAINED * _unexplained(without_model[:, :1], torque):
        return None
    low, middle, high = left[best - 1 : best + 2]
    fraction = 0.5 * (low - high) / (low - 2 * middle + high)
    return float((shifts[best] + fraction) * period)


def _unexplained(orthonormal: Array, torque: Array) -> float:
    """Return the sum of squares that a basis leaves of a torque."""
    return float(torque @ torque - np.sum((orthonormal.T @ torque) ** 2))


def _common_delay(joints: dict[str, JointInspection]) -> list[str]:
    """Return a finding if the joints' delays agree on something larger than a tenth of a millisecond."""
    delays = np.array([joint.delay for joint in joints.values() if joint.delay is not None])
    if len(delays) == 0:
        return []
    middle = float(np.median(delays))
    spread = float(np.median(np.abs(delays - middle)))
    if abs(middle) < max(1e-4, 2 * spread):
        return []
    return [
        f"the torque comes {1e3 * middle:+.2f} ms after what the motion asks for (median of {len(delays)} joints); "
        f"set [log] torque = {{ delay = {middle:.5f} }} if all signals should belong to one time"
    ]

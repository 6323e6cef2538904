"""Optimal trajectory for identifying friction within the limits of the robot.

A Fourier series minimizes the volume of the uncertainty of all friction coordinates, log det of their covariance
(D-optimality; Swevers et al. 1997), with bodies fitted too, by sequential quadratic programming. Limits of position,
speed and torque are constraints on a smooth maximum over the samples (Kreisselmeier and Steinhauser 1979). The series
found is checked on a fine grid, and shrunk towards the posture until it is within limits and clear of collisions.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as csv

from stribeck.core.base.typing import Array
from stribeck.core.dynamics.state import State
from stribeck.core.errors import SettingsError
from stribeck.core.judgement.curve import WIDEST
from stribeck.core.judgement.speed import top_speed
from stribeck.core.result import CurvePoint
from stribeck.design.planning.advice import width_of
from stribeck.design.planning.collision import CLEARANCE, SelfCollision
from stribeck.design.planning.information import covariances, expected_curve, quantile
from stribeck.design.planning.series import PERIOD, TORQUE_SHARE, Series, Task, optimized

FINE = 0.01
"""Sampling period of the final check [s]."""


@dataclass(frozen=True, kw_only=True)
class Promise:
    """Expected result for one joint: half of the 95 % interval of each parameter, and the friction curve.

    `assumed` are the parameters for which it is computed.
    """

    top_speed: float
    assumed: dict[str, float]
    half_width: dict[str, float]
    curve: tuple[CurvePoint, ...]
    relative_width: float
    enough: bool


@dataclass(frozen=True, kw_only=True)
class Trajectory:
    """A motion of all joints of a robot.

    Attributes
    ----------
    joint_names
        Names of all joints; joints without a promise rest.
    duration, period
        Duration, a multiple of the period, and period [s].
    promise
        Expected result per joint.
    used
        Largest share of the limits of positions, speeds and torques [1]; 0 for torques without limits.
    clearance
        Smallest distance of bodies [m]; None if unknown.
    at
        Function that computes positions, velocities and accelerations of all joints at some times [s], shape (T, n).
    """

    joint_names: tuple[str, ...]
    duration: float
    period: float
    promise: dict[str, Promise]
    used: dict[str, float]
    clearance: float | None
    at: Callable[[Array], State] = field(repr=False, compare=False)

    @property
    def lines(self) -> list[str]:
        """One line per moving joint: range, top speed and number of reversals."""
        state = self.at(np.arange(0, self.duration, FINE))
        lines = []
        for name, position, velocity in zip(self.joint_names, state.position.T, state.velocity.T, strict=True):
            if turns := int(np.count_nonzero(np.diff(np.sign(velocity)))):
                span = f"{position.min():.2f} to {position.max():.2f}, up to {np.abs(velocity).max():.2g} per second"
                lines.append(f"{name}: {span}, {turns} reversals")
        return lines

    def write_csv(self, path: Path) -> None:
        """Write one row per 10 ms: time [s], then position, velocity and acceleration of each joint, in SI units."""
        time = np.linspace(0.0, self.duration, round(self.duration / FINE) + 1)
        state = self.at(time)
        columns = {"time": time}
        for kind in ("position", "velocity", "acceleration"):
            for name, signal in zip(self.joint_names, getattr(state, kind).T, strict=True):
                columns[f"{kind}.{name}"] = np.round(signal, 9) + 0.0
        csv.write_csv(pa.table(columns), path, csv.WriteOptions(quoting_style="needed"))


def design(
    task: Task, duration: float, bodies: SelfCollision | None, *, predict: bool = True
) -> tuple[Trajectory, list[str]]:
    """Design the trajectory, with notes on its limits, and without a promise unless friction and noise are known.

    Raises
    ------
    SettingsError
        If the posture itself exceeds a limit.
    """
    _check_posture(task)
    series, size, why, nearest = within_limits(task, task.series(optimized(task)), bodies)
    notes = []
    if size < 1:
        notes.append(f"the trajectory is drawn to {size:.0%} towards the posture, as {why} would exceed what it may be")
    repeats = max(1, round(duration / PERIOD))
    state = task.motion(series, np.arange(0, PERIOD, FINE))
    promise = promise_of(task, state, repeats) if predict else {}
    short = [name for name, result in promise.items() if not result.enough]
    if short:
        notes.append(f"the trajectory is too short, or its limits too narrow, for {', '.join(short)}")
    return Trajectory(
        joint_names=task.dynamics.robot.joint_names,
        duration=repeats * PERIOD,
        period=PERIOD,
        promise=promise,
        used=task.used(state),
        clearance=nearest,
        at=lambda time: task.motion(series, time),
    ), notes


def _check_posture(task: Task) -> None:
    robot = task.dynamics.robot
    load = task.dynamics.load(State(task.posture[None], *np.zeros((2, 1, len(task.posture)))))[0]
    share = np.abs(load) / (TORQUE_SHARE * robot.effort_limits)
    worst = int(np.argmax(share))
    if share[worst] > 1:
        raise SettingsError(
            f"plan: in the middle position {robot.joint_names[worst]} carries {abs(load[worst]):.3g} N m, more "
            f"than {TORQUE_SHARE:.0%} of its limit of {robot.effort_limits[worst]:.3g}; expected a base that is held "
            "another way, or the right limits in the model"
        )


def within_limits(task: Task, series: Series, bodies: SelfCollision | None) -> tuple[Series, float, str, float | None]:
    """Shrink a series towards the posture, in steps of a twentieth, until it is within all limits.

    Returns the series, the factor [1], the exceeded limit ("" if none), and the smallest distance of bodies [m], None
    if unknown.
    """
    time = np.arange(0, PERIOD, FINE)
    size, why = 1.0, ""
    for _ in range(60):  # the last one is a twentieth of the series
        shrunk = task.shrunk(series, size)
        state = task.motion(shrunk, time)
        used = task.used(state)
        worst = max(used, key=lambda name: used[name])
        nearest, pair = bodies.nearest(state.position[::10]) if bodies else (np.inf, "")
        if used[worst] <= 1 and nearest >= CLEARANCE:
            return shrunk, size, why, nearest if np.isfinite(nearest) else None
        why = why or (worst if used[worst] > 1 else f"the distance of {pair}")
        size *= 0.95
    raise SettingsError(
        f"plan: no trajectory about the middle position is within the limits, as {why} would exceed what it may be; "
        "expected a log about another posture, or wider limits"
    )


def promise_of(task: Task, state: State, repeats: int) -> dict[str, Promise]:
    """Predict the result for each moving joint after a number of periods."""
    duration = repeats * PERIOD
    repeated = [replace(joint, noise=joint.noise / repeats) for joint in task.joints]
    matrices = covariances(task.dynamics, state, repeated, FINE)
    promise = {}
    for joint, covariance in zip(task.joints, matrices, strict=True):
        top = top_speed(state.velocity[:, joint.column])
        curve = expected_curve(joint, covariance, top, duration)
        errors = np.sqrt(np.diag(covariance)) * joint.units * quantile(duration)
        width = width_of(curve)
        promise[task.dynamics.robot.joint_names[joint.column]] = Promise(
            top_speed=top,
            assumed=dict(zip(joint.names, joint.values.tolist(), strict=True)),
            half_width=dict(zip(joint.names, errors.tolist(), strict=True)),
            curve=curve,
            relative_width=width,
            enough=width <= WIDEST,
        )
    return promise

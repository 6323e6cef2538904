"""The trajectory that makes friction known best within the limits of the robot.

A Fourier series minimizes the volume of the uncertainty of all friction coordinates, log det of their covariance
(D-optimality; Swevers et al. 1997), with bodies fitted too, by sequential quadratic programming. Limits of position,
speed and torque are constraints on a smooth maximum over the samples (Kreisselmeier and Steinhauser 1979). The series
found is checked on a fine grid, and shrunk towards the posture until it is within limits and clear of collisions.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import lru_cache

import numpy as np
from scipy.optimize import NonlinearConstraint, minimize
from scipy.special import logsumexp

from stribeck.dynamics.state import State
from stribeck.errors import SettingsError
from stribeck.identification.judgement.curve import WIDEST
from stribeck.identification.judgement.speed import top_speed
from stribeck.planning.advice import width_of
from stribeck.planning.collision import CLEARANCE, SelfCollision
from stribeck.planning.fourier import FREE, Series
from stribeck.planning.information import Dynamics, covariances, expected_curve, log_volume, quantile
from stribeck.planning.joint import PlannedJoint
from stribeck.result import CurvePoint
from stribeck.typing import Array

PERIOD = 10.0
"""Longest period of the series, and shortest trajectory [s]: harmonics from 0.1 to 0.8 Hz suit legs and arms."""

FINE = 0.01
"""Sampling period of the final check [s]."""

TORQUE_SHARE = 0.8
"""Share of the torque limits that a trajectory uses [1]: tracking it takes more."""

STEP = 1e-4
"""Step of finite differences, for coordinates of size 1."""


@dataclass(frozen=True, kw_only=True)
class Promise:
    """What a trajectory will show of one joint: half of the 95 % interval of each parameter, and its friction curve.

    `assumed` are the parameters that the promise is computed for.
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
        Names of all joints; those without a promise rest.
    duration, period
        [s]; the duration is a number of periods.
    promise
        Promise per joint.
    used
        Largest share of the limits of positions, speeds and torques [1]; 0 for torques without limits.
    clearance
        Least distance of bodies [m]; None if it is not known.
    """

    joint_names: tuple[str, ...]
    duration: float
    period: float
    promise: dict[str, Promise]
    used: dict[str, float]
    clearance: float | None
    motion: Callable[[Array], State] = field(repr=False, compare=False)

    def at(self, time: Array) -> State:
        """Compute positions, velocities and accelerations of all joints at some times [s], shape (T, n)."""
        return self.motion(np.asarray(time, dtype=np.float64))

    def to_plain(self) -> dict[str, object]:
        """Convert to the entry of plan.json."""
        return {key: value for key, value in asdict(self).items() if key != "motion"}


@dataclass(frozen=True, eq=False)
class Task:
    """The task that a trajectory solves.

    Attributes
    ----------
    dynamics
        Dynamics of the robot.
    joints
        Joints that move, m of them.
    posture
        Position of the joints that rest [rad], [m], shape (n,).
    period
        Period of the series [s].
    """

    dynamics: Dynamics
    joints: Sequence[PlannedJoint]
    posture: Array
    period: float

    @property
    def columns(self) -> list[int]:
        """Columns of the joints that move."""
        return [joint.column for joint in self.joints]

    def series(self, coordinates: Array) -> Series:
        """Build a series from coordinates, centres first, shape ((1 + FREE) m,), in units of the reach."""
        first, rest = coordinates[: len(self.joints)], coordinates[len(self.joints) :]
        reach = [joint.reach for joint in self.joints]
        centre = np.array([each.middle for each in reach]) + first * [each.amplitude for each in reach]
        return Series(self.period, centre, rest.reshape(FREE, -1) * np.array([each.speed for each in reach]))

    def shrunk(self, series: Series, size: float) -> Series:
        """Shrink a series towards the posture by a factor."""
        rest = self.posture[self.columns]
        return Series(series.period, rest + size * (series.centre - rest), size * series.coefficients)

    def motion(self, series: Series, time: Array) -> State:
        """Compute the motion of all joints at some times [s], shape (T, n)."""
        moved = series.at(time)
        position = np.tile(self.posture, (len(time), 1))
        velocity, acceleration = np.zeros((2, *position.shape))
        for signal, own in ((position, moved.position), (velocity, moved.velocity), (acceleration, moved.acceleration)):
            signal[:, self.columns] = own
        return State(position, velocity, acceleration)

    def shares(self, state: State, load: Array) -> dict[str, Array]:
        """Compute positions, speeds and torques as shares of their limits [1], shapes (T, joints)."""
        reach, torque = [joint.reach for joint in self.joints], load.copy()
        for joint in self.joints:
            torque[:, joint.column] += joint.found.friction(state.velocity[:, joint.column])
        away = np.abs(state.position[:, self.columns] - [each.middle for each in reach])
        return {
            "position": away / [each.amplitude for each in reach],
            "speed": np.abs(state.velocity[:, self.columns]) / [each.speed for each in reach],
            "torque": np.abs(torque) / (TORQUE_SHARE * self.dynamics.robot.effort_limits),
        }

    def used(self, state: State) -> dict[str, float]:
        """Compute the largest shares of the limits [1]."""
        return {
            name: float(each.max(initial=0.0)) for name, each in self.shares(state, self.dynamics.load(state)).items()
        }


def design(task: Task, duration: float, bodies: SelfCollision | None) -> tuple[Trajectory, list[str]]:
    """Design the trajectory, with notes on what limits it.

    Raises
    ------
    SettingsError
        If the posture itself exceeds a limit.
    """
    _check_posture(task)
    series, size, why, nearest = within_limits(task, task.series(_optimized(task)), bodies)
    notes = []
    if size < 1:
        notes.append(f"the trajectory is drawn to {size:.0%} towards the posture, as {why} would exceed what it may be")
    repeats = max(1, round(duration / task.period))
    names = task.dynamics.robot.joint_names
    state = task.motion(series, np.arange(0, task.period, FINE))
    promise = promise_of(task, state, repeats)
    short = [names[k] for k in task.columns if not promise[names[k]].enough]
    if short:
        notes.append(f"the trajectory is too short, or its limits too narrow, for {', '.join(short)}")
    return Trajectory(
        joint_names=names,
        duration=repeats * task.period,
        period=task.period,
        promise=promise,
        used=task.used(state),
        clearance=nearest,
        motion=lambda time: task.motion(series, time),
    ), notes


def _check_posture(task: Task) -> None:
    robot = task.dynamics.robot
    load = task.dynamics.load(State(task.posture[None], *np.zeros((2, 1, len(task.posture)))))[0]
    share = np.abs(load) / (TORQUE_SHARE * robot.effort_limits)
    worst = int(np.argmax(share))
    if share[worst] > 1:
        raise SettingsError(
            f"plan: in the middle of the log {robot.joint_names[worst]} carries {abs(load[worst]):.3g} N m, more "
            f"than {TORQUE_SHARE:.0%} of its limit of {robot.effort_limits[worst]:.3g}; expected a base that is held "
            "another way, or the right limits in the model"
        )


def _optimized(task: Task) -> Array:
    """Search the coordinates of the best series, shape ((1 + FREE) m,), from the best of 20 random ones."""
    time = np.arange(96) * task.period / 96  # twelve samples of the fastest harmonic's period

    @lru_cache(maxsize=4)
    def value(coordinates: bytes) -> Array:
        return _criterion(task, np.frombuffer(coordinates), time)

    @lru_cache(maxsize=1)
    def slope(coordinates: bytes) -> Array:
        here = np.frombuffer(coordinates)
        steps = STEP * np.eye(len(here))
        return np.column_stack([(_criterion(task, here + step, time) - value(coordinates)) / STEP for step in steps])

    generator, size = np.random.default_rng(0), (1 + FREE) * len(task.joints)
    starts = [_feasible(task, generator.standard_normal(size) * 0.3, time) for _ in range(20)]
    start = min(starts, key=lambda each: value(each.tobytes())[0])
    free = NonlinearConstraint(lambda z: value(z.tobytes())[1:], 0.0, np.inf, jac=lambda z: slope(z.tobytes())[1:])
    found = minimize(  # type: ignore[call-overload]
        lambda z: float(value(z.tobytes())[0]),
        start,
        jac=lambda z: slope(z.tobytes())[0],
        constraints=free,
        method="SLSQP",
        options={"maxiter": 60, "ftol": 1e-3},
    )
    # limits exceeded by a fifth are met by shrinking; a series that exceeds them more is not used
    return np.asarray(found.x) if value(found.x.tobytes())[1:].min() > -0.2 else start


def _feasible(task: Task, coordinates: Array, time: Array) -> Array:
    """Shrink coordinates by fifths until no limit is exceeded."""
    coordinates[: len(task.joints)] *= 0.3
    while np.abs(coordinates).max() > STEP and _criterion(task, coordinates, time)[1:].min() < 0:
        coordinates = 0.8 * coordinates
    return coordinates


def _criterion(task: Task, coordinates: Array, time: Array) -> Array:
    """Compute the log volume of the uncertainty per coordinate, then the free share of each limit [1]."""
    state = task.motion(task.series(coordinates), time)
    regressor = task.dynamics.regressor(state)
    volume = log_volume(regressor[:, task.columns], task.dynamics, state, task.joints, time[1])
    shares = task.shares(state, regressor @ task.dynamics.nominal)
    # a smooth maximum of sharpness 40 exceeds the maximum by log(samples) / 40, a tenth at most
    free = [1 - logsumexp(40.0 * share, axis=0) / 40.0 for share in shares.values()]
    return np.concatenate([[volume], *(each[np.isfinite(each)] for each in free)])


def within_limits(task: Task, series: Series, bodies: SelfCollision | None) -> tuple[Series, float, str, float | None]:
    """Shrink a series towards the posture, in steps of a twentieth, until it is within all limits.

    Returns the series, the factor [1], the limit that the series exceeded, "" if none, and the least distance of
    bodies [m], None if it is not known.
    """
    time = np.arange(0, task.period, FINE)
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
        f"plan: no trajectory about the middle of the log is within the limits, as {why} would exceed what it may be; "
        "expected a log about another posture"
    )


def promise_of(task: Task, state: State, repeats: int) -> dict[str, Promise]:
    """Predict what a number of periods of a motion will show of each joint that moves."""
    duration = repeats * task.period
    repeated = [replace(joint, noise=joint.noise / repeats) for joint in task.joints]
    found = covariances(task.dynamics, state, repeated, FINE)
    promise = {}
    for joint, covariance in zip(task.joints, found, strict=True):
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

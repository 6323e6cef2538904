"""The trajectory that makes friction known best within the limits of the robot.

A Fourier series is sought whose friction coordinates have the least volume of uncertainty, log det of their covariance
(D-optimality; Swevers et al. 1997), with bodies fitted along, by sequential quadratic programming. Limits of position,
speed and torque are constraints, the largest value over the samples taken smoothly (Kreisselmeier and Steinhauser
1979). What is found is checked on a fine grid, and drawn towards the posture as far as limits and bodies ask for it.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from functools import lru_cache

import numpy as np
from scipy.optimize import NonlinearConstraint, minimize
from scipy.special import logsumexp

from stribeck.dynamics.state import State
from stribeck.errors import SettingsError
from stribeck.identification.judgement.curve import WIDEST
from stribeck.identification.judgement.speed import top_speed
from stribeck.planning.assumed import AssumedFriction
from stribeck.planning.collision import CLEARANCE, SelfCollision
from stribeck.planning.fourier import FREE, Series
from stribeck.planning.information import Dynamics, covariances, expected_curve, log_volume, quantile, width_of
from stribeck.planning.motions import Reach
from stribeck.result import CurvePoint
from stribeck.typing import Array

PERIOD = 10.0
"""Longest period of the series [s]: harmonics from 0.1 to 0.8 Hz, which legs and arms can follow."""

SHORTEST = 10.0
"""Of a trajectory [s]: intervals come from how its parts differ."""

GRID = 96
"""Samples of a period while a series is sought [1], twelve of the fastest harmonic's."""

FINE = 0.01
"""Between samples of the check [s]."""

TORQUE_SHARE = 0.8
"""Share of the torque limits that a trajectory uses [1]: tracking it takes more."""

SHARPNESS = 40.0
"""Of the smooth largest value [1]: it is log(samples) / 40 above the largest, a tenth at most."""

STARTS, ROUNDS = 20, 60
"""Random series of which the best is a start, and steps of the programming [1]."""

STEP = 1e-4
"""Of differences, of coordinates about 1 large."""

CLOSE = 0.2
"""By how much a series may exceed limits before it is drawn together [1]; one that exceeds more is not used."""

DRAWS = 60
"""Steps in which a series is drawn towards the posture, by a twentieth each [1]: the last leaves a twentieth of it."""

NEAR = 0.1
"""Between samples at which distances of bodies are looked at [s]."""


@dataclass(frozen=True, kw_only=True)
class Promise:
    """What a trajectory will say of one joint: half of the 95 % interval of each parameter, and its friction curve.

    `assumed` are the parameters that it is worked out for.
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
        Of all joints; those without a promise rest.
    duration, period
        [s]; as many periods as go into the duration follow one another.
    promise
        By joint.
    used
        Largest share of what positions, speeds and torques may be [1]; of torques 0 if the model has no limits.
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
        """Return positions, velocities and accelerations of all joints at these times [s], shape (T, n)."""
        return self.motion(np.asarray(time, dtype=np.float64))

    def to_plain(self) -> dict[str, object]:
        """Return what plan.json has of it."""
        return {key: value for key, value in asdict(self).items() if key != "motion"}


@dataclass(frozen=True, eq=False)
class Task:
    """What a trajectory is made for.

    Attributes
    ----------
    dynamics
        Of the robot.
    friction, noise, reach
        Of the joints that move, by column.
    posture
        Where the others rest [rad], [m], shape (n,).
    period
        Of the series [s].
    """

    dynamics: Dynamics
    friction: Mapping[int, AssumedFriction]
    noise: Mapping[int, float]
    reach: Mapping[int, Reach]
    posture: Array
    period: float

    @property
    def columns(self) -> list[int]:
        """Joints that move."""
        return list(self.friction)

    def series(self, coordinates: Array) -> Series:
        """Return the series of coordinates, centres first, shape ((1 + FREE) m,), in units of the reach."""
        first, rest = coordinates[: len(self.reach)], coordinates[len(self.reach) :]
        own = list(self.reach.values())
        speed = np.array([each.speed for each in own])
        centre = np.array([each.middle for each in own]) + first * [each.amplitude for each in own]
        return Series(self.period, centre, rest.reshape(FREE, -1) * speed)

    def whole(self, moved: State) -> State:
        """Return the motion of all joints from that of the ones that move."""
        position = np.tile(self.posture, (len(moved.position), 1))
        velocity, acceleration = np.zeros((2, *position.shape))
        for signal, own in ((position, moved.position), (velocity, moved.velocity), (acceleration, moved.acceleration)):
            signal[:, self.columns] = own
        return State(position, velocity, acceleration)

    def shares(self, state: State, load: Array) -> dict[str, Array]:
        """Return how much of what they may be positions, speeds and torques are [1], shapes (T, joints)."""
        own = list(self.reach.values())
        away = np.abs(state.position[:, self.columns] - [each.middle for each in own])
        torque = load.copy()
        for column, assumed in self.friction.items():
            torque[:, column] += assumed.joint.friction(state.velocity[:, column])
        limits = TORQUE_SHARE * self.dynamics.robot.effort_limits
        return {
            "position": away / [each.amplitude for each in own],
            "speed": np.abs(state.velocity[:, self.columns]) / [each.speed for each in own],
            "torque": np.abs(torque) / limits,
        }


def design(task: Task, duration: float, bodies: SelfCollision | None) -> tuple[Trajectory, list[str]]:
    """Return the trajectory, and notes on what it could not use.

    Raises
    ------
    SettingsError
        If the posture itself exceeds a limit.
    """
    _check_posture(task)
    series = task.series(_optimised(task))
    drawn, nearest = _within_limits(task, series, bodies)
    notes = []
    if drawn[0] < 1:
        notes.append(
            f"the trajectory is drawn to {drawn[0]:.0%} towards the posture, as {drawn[1]} would exceed what it may be"
        )
    repeats = max(1, round(duration / task.period))
    found = _drawn(task, series, drawn[0])
    names = task.dynamics.robot.joint_names
    state = task.whole(found.at(np.arange(0, task.period, FINE)))
    promise = _promise(task, state, repeats)
    short = [names[k] for k in task.columns if not promise[names[k]].enough]
    if short:
        notes.append(f"the trajectory is too short, or its limits too narrow, for {', '.join(short)}")
    load = task.dynamics.regressor(state, list(range(len(names)))) @ task.dynamics.nominal
    return Trajectory(
        joint_names=names,
        duration=repeats * task.period,
        period=task.period,
        promise=promise,
        used={name: float(share.max(initial=0.0)) for name, share in task.shares(state, load).items()},
        clearance=nearest,
        motion=lambda time: task.whole(found.at(time)),
    ), notes


def _check_posture(task: Task) -> None:
    robot = task.dynamics.robot
    still = task.whole(State(task.posture[None, task.columns], *np.zeros((2, 1, len(task.columns)))))
    load = task.dynamics.regressor(still, list(range(len(robot.joint_names)))) @ task.dynamics.nominal
    share = np.abs(load[0]) / (TORQUE_SHARE * robot.effort_limits)
    if share.max() > 1:
        worst = int(np.argmax(share))
        raise SettingsError(
            f"plan: in the middle of the log {robot.joint_names[worst]} carries {abs(load[0, worst]):.3g} N m, more "
            f"than {TORQUE_SHARE:.0%} of its limit of {robot.effort_limits[worst]:.3g}; expected a base that is held "
            "another way, or the right limits in the model"
        )


def _optimised(task: Task) -> Array:
    """Return the coordinates of the best series, shape ((1 + FREE) m,)."""
    time = np.arange(GRID) * task.period / GRID
    generator = np.random.default_rng(0)

    @lru_cache(maxsize=4)
    def value(coordinates: bytes) -> Array:
        return _criterion(task, np.frombuffer(coordinates), time)

    @lru_cache(maxsize=1)
    def slope(coordinates: bytes) -> Array:
        here = np.frombuffer(coordinates)
        steps = STEP * np.eye(len(here))
        return np.column_stack([(_criterion(task, here + step, time) - value(coordinates)) / STEP for step in steps])

    def evaluate(coordinates: Array) -> Array:
        """Return the log volume, then how much is free of each limit."""
        return value(coordinates.tobytes())

    def slopes(coordinates: Array) -> Array:
        """Return their derivatives."""
        return slope(coordinates.tobytes())

    size = (1 + FREE) * len(task.reach)
    starts = [_feasible(task, generator.standard_normal(size) * 0.3, time) for _ in range(STARTS)]
    start = min(starts, key=lambda each: evaluate(each)[0])
    found = minimize(  # type: ignore[call-overload]
        lambda z: float(evaluate(z)[0]),
        start,
        jac=lambda z: slopes(z)[0],
        constraints=NonlinearConstraint(lambda z: evaluate(z)[1:], 0.0, np.inf, jac=lambda z: slopes(z)[1:]),
        method="SLSQP",
        options={"maxiter": ROUNDS, "ftol": 1e-3},
    )
    return np.asarray(found.x) if evaluate(found.x)[1:].min() > -CLOSE else start


def _feasible(task: Task, coordinates: Array, time: Array) -> Array:
    """Return coordinates drawn to where no limit is exceeded, by tenths."""
    coordinates[: len(task.reach)] *= 0.3
    while np.abs(coordinates).max() > STEP and _criterion(task, coordinates, time)[1:].min() < 0:
        coordinates = 0.8 * coordinates
    return coordinates


def _criterion(task: Task, coordinates: Array, time: Array) -> Array:
    """Return the log volume of the uncertainty a coordinate, then how much is free of each limit [1]."""
    state = task.whole(task.series(coordinates).at(time))
    regressor = task.dynamics.regressor(state, list(range(state.position.shape[1])))
    load = regressor @ task.dynamics.nominal
    volume = log_volume(regressor[:, task.columns], task.dynamics, state, task.friction, task.noise, time[1])
    shares = task.shares(state, load)
    free = [1 - logsumexp(SHARPNESS * share, axis=0) / SHARPNESS for share in shares.values()]
    return np.concatenate([[volume], *(each[np.isfinite(each)] for each in free)])


def _within_limits(task: Task, series: Series, bodies: SelfCollision | None) -> tuple[tuple[float, str], float | None]:
    """Return how far the series is drawn towards the posture [1] and why, and the least distance of bodies [m]."""
    time = np.arange(0, task.period, FINE)
    size, why = 1.0, ""
    for _ in range(DRAWS):
        state = task.whole(_drawn(task, series, size).at(time))
        load = task.dynamics.regressor(state, list(range(state.position.shape[1]))) @ task.dynamics.nominal
        shares = {name: float(share.max(initial=0.0)) for name, share in task.shares(state, load).items()}
        worst = max(shares, key=lambda name: shares[name])
        nearest, pair = bodies.nearest(state.position[:: round(NEAR / FINE)]) if bodies else (np.inf, "")
        if shares[worst] <= 1 and nearest >= CLEARANCE:
            return (size, why), nearest if np.isfinite(nearest) else None
        why = why or (worst if shares[worst] > 1 else f"the distance of {pair}")
        size *= 0.95
    raise SettingsError(
        f"plan: no trajectory about the middle of the log is within the limits, as {why} would exceed what it may be; "
        "expected a log about another posture"
    )


def _drawn(task: Task, series: Series, size: float) -> Series:
    """Return a series drawn towards the posture by a factor."""
    rest = task.posture[task.columns]
    return Series(series.period, rest + size * (series.centre - rest), size * series.coefficients)


def _promise(task: Task, state: State, repeats: int) -> dict[str, Promise]:
    """Return what so many periods of a motion will say of each joint that moves."""
    duration = repeats * task.period
    noise = {column: task.noise[column] / repeats for column in task.columns}
    found = covariances(task.dynamics, state, task.friction, noise, FINE)
    promise = {}
    for (column, assumed), covariance in zip(task.friction.items(), found, strict=True):
        top = top_speed(state.velocity[:, column])
        curve = expected_curve(assumed, covariance, top, duration)
        errors = np.sqrt(np.diag(covariance)) * assumed.units * quantile(duration)
        width = width_of(curve)
        promise[task.dynamics.robot.joint_names[column]] = Promise(
            top_speed=top,
            assumed=dict(zip(assumed.names, assumed.values.tolist(), strict=True)),
            half_width=dict(zip(assumed.names, errors.tolist(), strict=True)),
            curve=curve,
            relative_width=width,
            enough=width <= WIDEST,
        )
    return promise

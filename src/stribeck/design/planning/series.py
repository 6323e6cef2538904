"""Motions as finite Fourier series, and the search for the best one (Swevers et al. 1997).

With w = 2 pi / `PERIOD` and the harmonics k,

    q(t) = c + sum_k a_k / (k w) sin(k w t) - b_k / (k w) cos(k w t),   sum_k a_k = 0,   sum_k k b_k = 0

Velocity and acceleration are zero at t = 0. Periods follow one another, and the last one ends at rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, null_space
from scipy.optimize import NonlinearConstraint, minimize
from scipy.special import logsumexp

from stribeck.core.base.typing import Array
from stribeck.core.dynamics.state import State
from stribeck.design.planning.information import Dynamics, precision
from stribeck.design.planning.joint import PlannedJoint, moving

PERIOD = 10.0
"""Period of the series, and shortest trajectory [s]: harmonics from 0.1 to 0.8 Hz suit legs and arms."""

HARMONICS = np.array([1, 2, 3, 5, 8])
"""Harmonics of a period: a few that lie apart reach slow and fast motion with few coefficients."""

AT_REST = block_diag(null_space(np.ones((1, len(HARMONICS)))), null_space(HARMONICS[None].astype(float)))
"""Matrix from the free coefficients to the weights a_k and b_k, shape (2 harmonics, FREE)."""

FREE = AT_REST.shape[1]
"""Number of free coefficients per joint, given rest at the ends."""

TORQUE_SHARE = 0.8
"""Largest share of the torque limits used by a trajectory [1]; the rest is for tracking."""

STEP = 1e-4
"""Step of finite differences, for coordinates of size 1."""


class Series(NamedTuple):
    """Centers [rad], [m], shape (m,), and free coefficients [rad/s], [m/s], shape (FREE, m), of m joints."""

    center: Array
    coefficients: Array

    def at(self, time: Array) -> State:
        """Compute the motion at some times [s], shape (T, m)."""
        k = 2 * np.pi * HARMONICS / PERIOD
        sine, cosine = np.sin(np.outer(time, k)), np.cos(np.outer(time, k))
        sides = np.hstack([sine / k, -cosine / k]), np.hstack([cosine, sine]), np.hstack([-sine * k, cosine * k])
        weights = AT_REST @ self.coefficients  # a_k and b_k of all joints
        position, velocity, acceleration = (side @ weights for side in sides)
        return State(self.center + position, velocity, acceleration)


@dataclass(frozen=True, eq=False)
class Task:
    """Task of a trajectory.

    Attributes
    ----------
    dynamics
        Dynamics of the robot.
    joints
        Moving joints, m in total.
    posture
        Positions of the resting joints [rad], [m], shape (n,).
    """

    dynamics: Dynamics
    joints: Sequence[PlannedJoint]
    posture: Array

    @property
    def columns(self) -> list[int]:
        """Columns of the joints that move."""
        return [joint.column for joint in self.joints]

    def series(self, coordinates: Array) -> Series:
        """Build a series from coordinates, centers first, shape ((1 + FREE) m,), in units of the reach."""
        first, rest = coordinates[: len(self.joints)], coordinates[len(self.joints) :]
        reaches = [joint.reach for joint in self.joints]
        center = np.array([reach.middle for reach in reaches]) + first * [reach.amplitude for reach in reaches]
        return Series(center, rest.reshape(FREE, -1) * np.array([reach.speed for reach in reaches]))

    def shrunk(self, series: Series, size: float) -> Series:
        """Shrink a series towards the posture by a factor."""
        rest = self.posture[self.columns]
        return Series(rest + size * (series.center - rest), size * series.coefficients)

    def motion(self, series: Series, time: Array) -> State:
        """Compute the motion of all joints at some times [s], shape (T, n)."""
        return moving(self.posture, self.columns, series.at(time))

    def shares(self, state: State, load: Array) -> dict[str, Array]:
        """Compute positions, speeds and torques as shares of their limits [1], shapes (T, joints)."""
        reaches, torque = [joint.reach for joint in self.joints], load.copy()
        for joint in self.joints:
            torque[:, joint.column] += joint.result.friction(state.velocity[:, joint.column], offset=True)
        away = np.abs(state.position[:, self.columns] - [reach.middle for reach in reaches])
        return {
            "position": away / [reach.amplitude for reach in reaches],
            "speed": np.abs(state.velocity[:, self.columns]) / [reach.speed for reach in reaches],
            "torque": np.abs(torque) / (TORQUE_SHARE * self.dynamics.robot.effort_limits),
        }

    def used(self, state: State) -> dict[str, float]:
        """Compute the largest shares of the limits [1]."""
        shares = self.shares(state, self.dynamics.load(state))
        return {name: float(share.max(initial=0.0)) for name, share in shares.items()}


def optimized(task: Task) -> Array:
    """Search the coordinates of the best series, shape ((1 + FREE) m,), from the best of 20 random ones."""
    time = np.arange(96) * PERIOD / 96  # twelve samples of the fastest harmonic's period

    @lru_cache(maxsize=4)
    def value(coordinates: bytes) -> Array:
        return _criterion(task, np.frombuffer(coordinates), time)

    @lru_cache(maxsize=1)
    def slope(coordinates: bytes) -> Array:
        point = np.frombuffer(coordinates)
        steps = STEP * np.eye(len(point))
        return np.column_stack([(_criterion(task, point + step, time) - value(coordinates)) / STEP for step in steps])

    generator, size = np.random.default_rng(0), (1 + FREE) * len(task.joints)
    starts = [_feasible(task, generator.standard_normal(size) * 0.3, time) for _ in range(20)]
    start = min(starts, key=lambda candidate: value(candidate.tobytes())[0])
    free = NonlinearConstraint(lambda z: value(z.tobytes())[1:], 0.0, np.inf, jac=lambda z: slope(z.tobytes())[1:])
    optimum = minimize(  # type: ignore[call-overload]
        lambda z: float(value(z.tobytes())[0]),
        start,
        jac=lambda z: slope(z.tobytes())[0],
        constraints=free,
        method="SLSQP",
        options={"maxiter": 60, "ftol": 1e-3},
    )
    # series that exceed limits by up to a fifth are shrunk, others are not used
    return np.asarray(optimum.x) if value(optimum.x.tobytes())[1:].min() > -0.2 else start


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
    matrix = precision(regressor[:, task.columns], task.dynamics, state, task.joints, time[1])
    volume = -np.linalg.slogdet(matrix)[1] / len(matrix)
    shares = task.shares(state, regressor @ task.dynamics.nominal)
    # a smooth maximum of sharpness 40 exceeds the maximum by log(samples) / 40, at most 0.1
    free = [1 - logsumexp(40.0 * share, axis=0) / 40.0 for share in shares.values()]
    return np.concatenate([[volume], *(share[np.isfinite(share)] for share in free)])

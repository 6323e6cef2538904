"""What a motion will say about friction: the Fisher information of friction and bodies together.

At each sample, the torque of joint i is off by noise of a spectral density S_i, and depends on that joint's friction
parameters p_i and on the inertial parameters x of all bodies, which have the priors of the method. A motion has the
information

    A = sum_i 1/S_i int [Phi_i Y_i]^T [Phi_i Y_i] dt + priors

of (p, x), with Phi_i and Y_i the derivatives of the torque, and the covariance of p is the block of its inverse
(Swevers et al. 1997).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import block_diag
from scipy.ndimage import uniform_filter1d
from scipy.special import stdtrit  # of scipy.stats, which is slow to import

from stribeck.dynamics.rooted import RootMotion
from stribeck.dynamics.state import State
from stribeck.equations.constants import BOXES, LONGEST_SEGMENT, WINDOW_LENGTH
from stribeck.equations.regressors import inertia_regressors
from stribeck.identification.judgement.curve import relative_width
from stribeck.identification.whole_log.model.bodies import bodies_of
from stribeck.planning.assumed import AssumedFriction
from stribeck.result import CurvePoint
from stribeck.robot import Robot
from stribeck.settings import Priors
from stribeck.typing import Array

UNKNOWN = 1e6
"""Half of an interval over the value [1] of friction that is zero, as far as is known."""

BODIES_KNOWN = 1e12
"""What a joint's torque says of bodies over their priors [1], at most: less noise would be less than rounding."""

COARSE = 0.02
"""Time between samples at which bodies are looked at [s]."""


@dataclass(frozen=True, eq=False)
class Dynamics:
    """Torque of a robot whose base does not move, and its derivatives by the bodies' inertial parameters.

    Attributes
    ----------
    robot
        The robot.
    gravity
        In coordinates of the base [m/s^2], shape (3,).
    directions
        Inertial parameters a standard deviation of the prior, by coordinates, shape (10 L, 10 L).
    nominal
        The model's inertial parameters, shape (10 L,).
    """

    robot: Robot
    gravity: Array
    directions: Array
    nominal: Array

    def regressor(self, state: State, joints: list[int]) -> Array:
        """Return the derivatives of some joints' torques by all inertial parameters, shape (T, joints, 10 L)."""
        tree = self.robot.tree
        root = RootMotion(np.tile(self.gravity, (len(state.position), 1))) if tree.floating else None
        return inertia_regressors(self.robot, tree, tree.root_size + np.array(joints), state, root)


def dynamics_of(robot: Robot, gravity: Array, priors: Priors) -> Dynamics:
    """Return the dynamics of a robot with a base that does not move, gravity in coordinates of the base."""
    inertias = list(robot.tree.model.inertias)[1:]
    nominal = np.array([inertia.toDynamicParameters() for inertia in inertias])
    slopes = bodies_of(nominal, priors).slopes(np.zeros(nominal.shape))
    size = nominal.size
    directions = np.zeros((size, size))
    for k, slope in enumerate(slopes):
        directions[10 * k : 10 * k + 10, 10 * k : 10 * k + 10] = slope
    return Dynamics(robot, gravity, directions, nominal.ravel())


def covariances(
    dynamics: Dynamics,
    state: State,
    friction: Mapping[int, AssumedFriction],
    noise: Mapping[int, float],
    period: float,
) -> list[Array]:
    """Return the covariance of each joint's friction coordinates, shape (k, k), in the order of `friction`.

    Parameters
    ----------
    dynamics
        Of the robot.
    state
        A motion, sampled so finely that a window of the method has several samples.
    friction, noise
        By column of the joint: its friction, and the spectral density of its torque [N^2 m^2 s].
    period
        Time that a sample stands for [s].
    """
    coarse = max(1, round(COARSE / period))
    regressor = dynamics.regressor(state.take(slice(None, None, coarse)), list(friction))
    places = np.arange(len(state.position)) / coarse
    first = np.minimum(places.astype(int), len(regressor) - 2)
    share = (places - first)[:, None, None]
    regressor = (1 - share) * regressor[first] + share * regressor[first + 1]
    matrix, sizes = _precision(regressor, dynamics, state, friction, noise, period)
    scale = 1 / np.sqrt(np.diag(matrix))
    covariance = scale[:, None] * np.linalg.inv(scale[:, None] * matrix * scale) * scale
    edges = np.cumsum([0, *sizes]).tolist()
    return [covariance[first:last, first:last] for first, last in pairwise(edges)]


def log_volume(
    regressor: Array,
    dynamics: Dynamics,
    state: State,
    friction: Mapping[int, AssumedFriction],
    noise: Mapping[int, float],
    period: float,
) -> float:
    """Return the log of the volume of the uncertainty of all friction coordinates, over their number."""
    matrix, sizes = _precision(regressor, dynamics, state, friction, noise, period)
    return float(-np.linalg.slogdet(matrix)[1] / sum(sizes))


def _precision(
    regressor: Array,
    dynamics: Dynamics,
    state: State,
    friction: Mapping[int, AssumedFriction],
    noise: Mapping[int, float],
    period: float,
) -> tuple[Array, list[int]]:
    """Return the precision of all joints' friction coordinates, bodies fitted along, and how many each joint has."""
    bodies = np.eye(dynamics.directions.shape[1])
    crossed, blocks = [], []
    for k, (column, assumed) in enumerate(friction.items()):
        velocity, load = state.velocity[:, column], regressor[:, k] @ dynamics.nominal
        phi = assumed.columns(velocity, state.acceleration[:, column], load, state.position[:, column])
        moves, of_bodies = assumed.moves(velocity)[:, None], regressor[:, k] @ dynamics.directions
        density = max(noise[column], period * float(np.sum((moves * of_bodies) ** 2)) / BODIES_KNOWN)
        moves = np.sqrt(period / density) * moves
        phi, of_bodies = moves * averaged(phi, period), moves * of_bodies
        blocks.append(phi.T @ phi + np.diag(assumed.precision))
        crossed.append(phi.T @ of_bodies)
        bodies += of_bodies.T @ of_bodies
    across = np.vstack(crossed)
    return block_diag(*blocks) - across @ np.linalg.solve(bodies, across.T), [len(block) for block in blocks]


def averaged(columns: Array, period: float) -> Array:
    """Return columns over time, shape (T, k), as a window of the method averages them."""
    length = max(1, round((WINDOW_LENGTH / period + BOXES - 1) / BOXES))
    for _ in range(BOXES if length > 1 else 0):
        columns = uniform_filter1d(columns, length, axis=0)
    return columns


def expected_curve(
    assumed: AssumedFriction, covariance: Array, speed: float, duration: float
) -> tuple[CurvePoint, ...]:
    """Return the friction curve with the intervals that a covariance gives, up to a top speed."""
    speeds, values, slopes = assumed.curve(speed)
    errors = np.sqrt(np.maximum(np.einsum("sk,kl,sl->s", slopes, covariance, slopes), 0.0))
    half = quantile(duration) * errors
    unit = "N" if assumed.prismatic else "N m"
    return tuple(
        CurvePoint(
            velocity=float(v),
            value=float(r),
            standard_error=float(e),
            interval_95=(max(float(r - h), 0.0), float(r + h)),
            unit=unit,
        )
        for v, r, e, h in zip(speeds, values, errors, half, strict=True)
    )


def width_of(curve: tuple[CurvePoint, ...]) -> float:
    """Return half of the 95 % interval over the value [1], as the verdicts have it, `UNKNOWN` at most."""
    return min(relative_width(curve), UNKNOWN)


def quantile(duration: float) -> float:
    """Return Student's 97.5 % quantile with the degrees of freedom of a log of a duration [s]."""
    return float(stdtrit(max(duration / LONGEST_SEGMENT - 1, 1.0), 0.975))

"""What a motion will say about friction: the Fisher information of friction and bodies together.

At each sample, the torque of joint i has noise of spectral density S_i and depends on that joint's friction parameters
p_i and on the inertial parameters x of all bodies, which have the priors of the method. A motion has the information

    A = sum_i 1/S_i int [Phi_i Y_i]^T [Phi_i Y_i] dt + priors

about (p, x), with Phi_i and Y_i the derivatives of the torque. The covariance of p is a block of its inverse (Swevers
et al. 1997).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import block_diag
from scipy.special import stdtrit  # of scipy.stats, which is slow to import

from stribeck.dynamics.rooted import RootMotion
from stribeck.dynamics.state import State
from stribeck.equations.constants import LONGEST_SEGMENT
from stribeck.equations.regressors import inertia_regressors
from stribeck.identification.judgement.curve import curve_points
from stribeck.identification.whole_log.model.bodies import bodies_of
from stribeck.planning.joint import PlannedJoint, averaged
from stribeck.result import CurvePoint
from stribeck.robot import Robot
from stribeck.settings import Priors
from stribeck.typing import Array


@dataclass(frozen=True, eq=False)
class Dynamics:
    """Torques of a robot whose base does not move, and their derivatives by the bodies' inertial parameters.

    Attributes
    ----------
    robot
        The robot.
    gravity
        Gravity in coordinates of the base [m/s^2], shape (3,).
    directions
        Change of the inertial parameters per standard deviation of the prior, shape (10 L, 10 L).
    nominal
        Inertial parameters of the model, shape (10 L,).
    """

    robot: Robot
    gravity: Array
    directions: Array
    nominal: Array

    def regressor(self, state: State, joints: list[int] | None = None) -> Array:
        """Compute the derivatives of some or all joints' torques by the inertial parameters, (T, joints, 10 L)."""
        tree = self.robot.tree
        root = RootMotion(np.tile(self.gravity, (len(state.position), 1))) if tree.floating else None
        columns = np.arange(len(self.robot.joint_names)) if joints is None else np.array(joints)
        return inertia_regressors(self.robot, tree, tree.root_size + columns, state, root)

    def load(self, state: State) -> Array:
        """Compute the torques that a motion needs without friction, shape (T, n)."""
        return self.regressor(state) @ self.nominal


def dynamics_of(robot: Robot, gravity: Array, priors: Priors) -> Dynamics:
    """Build the dynamics of a robot with a base that does not move, gravity in coordinates of the base."""
    nominal = np.array([inertia.toDynamicParameters() for inertia in list(robot.tree.model.inertias)[1:]])
    directions = block_diag(*bodies_of(nominal, priors).slopes(np.zeros(nominal.shape)))
    return Dynamics(robot, gravity, directions, nominal.ravel())


def covariances(dynamics: Dynamics, state: State, joints: Sequence[PlannedJoint], period: float) -> list[Array]:
    """Compute the covariance of each joint's friction coordinates, shape (k, k).

    Parameters
    ----------
    dynamics
        Dynamics of the robot.
    state
        A motion, sampled so finely that a window of the method has several samples.
    joints
        The joints.
    period
        Time that a sample stands for [s].
    """
    coarse = max(1, round(0.02 / period))  # bodies change slowly: 20 ms are fine enough
    regressor = dynamics.regressor(state.take(slice(None, None, coarse)), [joint.column for joint in joints])
    places = np.arange(len(state.position)) / coarse
    first = np.minimum(places.astype(int), len(regressor) - 2)
    share = (places - first)[:, None, None]
    regressor = (1 - share) * regressor[first] + share * regressor[first + 1]
    matrix, sizes = _precision(regressor, dynamics, state, joints, period)
    scale = 1 / np.sqrt(np.diag(matrix))
    covariance = scale[:, None] * np.linalg.inv(scale[:, None] * matrix * scale) * scale
    edges = np.cumsum([0, *sizes]).tolist()
    return [covariance[first:last, first:last] for first, last in pairwise(edges)]


def log_volume(
    regressor: Array, dynamics: Dynamics, state: State, joints: Sequence[PlannedJoint], period: float
) -> float:
    """Compute the log of the volume of the uncertainty of all friction coordinates, divided by their number."""
    matrix, sizes = _precision(regressor, dynamics, state, joints, period)
    return float(-np.linalg.slogdet(matrix)[1] / sum(sizes))


def _precision(
    regressor: Array, dynamics: Dynamics, state: State, joints: Sequence[PlannedJoint], period: float
) -> tuple[Array, list[int]]:
    """Compute the precision of all friction coordinates, with bodies fitted too, and each joint's number of them."""
    bodies = np.eye(dynamics.directions.shape[1])
    crossed, blocks = [], []
    for k, joint in enumerate(joints):
        velocity, load = state.velocity[:, joint.column], regressor[:, k] @ dynamics.nominal
        phi = joint.columns(velocity, state.acceleration[:, joint.column], load, state.position[:, joint.column])
        moves, of_bodies = joint.moves(velocity)[:, None], regressor[:, k] @ dynamics.directions
        # a torque says at most 1e12 times as much about bodies as their priors; beyond, noise is below rounding
        density = max(joint.noise, period * float(np.sum((moves * of_bodies) ** 2)) / 1e12)
        moves = np.sqrt(period / density) * moves
        phi, of_bodies = moves * averaged(phi, period), moves * of_bodies
        blocks.append(phi.T @ phi + np.diag(joint.precision))
        crossed.append(phi.T @ of_bodies)
        bodies += of_bodies.T @ of_bodies
    across = np.vstack(crossed)
    return block_diag(*blocks) - across @ np.linalg.solve(bodies, across.T), [len(block) for block in blocks]


def expected_curve(joint: PlannedJoint, covariance: Array, speed: float, duration: float) -> tuple[CurvePoint, ...]:
    """Compute the friction curve up to a top speed, with the intervals that a covariance gives."""
    speeds, values, slopes = joint.curve(speed)
    errors = np.sqrt(np.maximum(np.einsum("sk,kl,sl->s", slopes, covariance, slopes), 0.0))
    return curve_points(speeds, values, errors, quantile(duration), joint.prismatic)


def quantile(duration: float) -> float:
    """Compute Student's 97.5 % quantile with the degrees of freedom of a log of a duration [s]."""
    return float(stdtrit(max(duration / LONGEST_SEGMENT - 1, 1.0), 0.975))

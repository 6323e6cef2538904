"""Expected uncertainty of friction after a motion: Fisher information of friction and bodies together.

At each sample, the torque of joint i has noise of spectral density S_i and depends on that joint's friction parameters
p_i and on the inertial parameters x of all bodies, which have the priors of the method. A motion has the information

    A = sum_i 1/S_i int [Phi_i Y_i]^T [Phi_i Y_i] dt + priors

about (p, x), with Phi_i and Y_i the derivatives of the torque. The covariance of p is a block of its inverse (Swevers
et al. 1997).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import block_diag
from scipy.special import stdtrit  # avoids the slow import of scipy.stats

from stribeck.core.base.typing import Array
from stribeck.core.dynamics.rooted import RootMotion
from stribeck.core.dynamics.state import State
from stribeck.core.equations.whole_log.filters import WINDOW_LENGTH
from stribeck.core.equations.whole_log.regressors import inertia_regressors
from stribeck.core.equations.whole_log.segments import LONGEST_SEGMENT
from stribeck.core.errors import SettingsError
from stribeck.core.estimator.model.bodies import bodies_of
from stribeck.core.judgement.curve import curve_points
from stribeck.core.result import CurvePoint, Result
from stribeck.core.result.saved import saved_evidence
from stribeck.core.robot import Robot
from stribeck.core.settings import Priors
from stribeck.design.planning.joint import PlannedJoint, PresentMotion, averaged


@dataclass(frozen=True, eq=False)
class Dynamics:
    """Torques of a robot with a fixed base, and their derivatives with respect to the inertial parameters.

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
        """Compute the derivatives of joint torques with respect to the inertial parameters, shape (T, joints, 10 L)."""
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
    slopes = bodies_of(nominal, priors).slopes(np.zeros(nominal.shape))
    return Dynamics(robot, gravity, block_diag(*slopes), nominal.ravel())


def covariances(dynamics: Dynamics, state: State, joints: Sequence[PlannedJoint], period: float) -> list[Array]:
    """Compute the covariance of each joint's friction coordinates, shape (k, k).

    Parameters
    ----------
    dynamics
        Dynamics of the robot.
    state
        Motion with several samples per window of the method.
    joints
        The joints.
    period
        Sampling period [s].
    """
    coarse = max(1, round(0.02 / period))  # inertial torques change slowly: 20 ms are sufficient
    regressor = dynamics.regressor(state.take(slice(None, None, coarse)), [joint.column for joint in joints])
    places = np.arange(len(state.position)) / coarse
    first = np.minimum(places.astype(int), len(regressor) - 2)
    share = (places - first)[:, None, None]
    regressor = (1 - share) * regressor[first] + share * regressor[first + 1]
    matrix = precision(regressor, dynamics, state, joints, period)
    scale = 1 / np.sqrt(np.diag(matrix))
    covariance = scale[:, None] * np.linalg.inv(scale[:, None] * matrix * scale) * scale
    edges = np.cumsum([0, *(len(joint.names) for joint in joints)]).tolist()
    return [covariance[first:last, first:last] for first, last in pairwise(edges)]


def precision(
    regressor: Array, dynamics: Dynamics, state: State, joints: Sequence[PlannedJoint], period: float
) -> Array:
    """Compute the precision of all friction coordinates, with bodies fitted too."""
    bodies = np.eye(dynamics.directions.shape[1])
    crossed, blocks = [], []
    for k, joint in enumerate(joints):
        velocity, load = state.velocity[:, joint.column], regressor[:, k] @ dynamics.nominal
        phi = joint.columns(velocity, state.acceleration[:, joint.column], load, state.position[:, joint.column])
        moves, of_bodies = joint.moves(velocity)[:, None], regressor[:, k] @ dynamics.directions
        # limits the information to 1e12 times the prior's; beyond, noise is below rounding
        density = max(joint.noise, period * float(np.sum((moves * of_bodies) ** 2)) / 1e12)
        moves = np.sqrt(period / density) * moves
        phi, of_bodies = moves * averaged(phi, period), moves * of_bodies
        blocks.append(phi.T @ phi + np.diag(joint.precision))
        crossed.append(phi.T @ of_bodies)
        bodies += of_bodies.T @ of_bodies
    across = np.vstack(crossed)
    return np.asarray(block_diag(*blocks) - across @ np.linalg.solve(bodies, across.T))


def expected_curve(joint: PlannedJoint, covariance: Array, speed: float, duration: float) -> tuple[CurvePoint, ...]:
    """Compute the friction curve up to a top speed, with intervals from a covariance."""
    speeds, values, slopes = joint.curve(speed)
    errors = np.sqrt(np.maximum(np.einsum("sk,kl,sl->s", slopes, covariance, slopes), 0.0))
    return curve_points(speeds, values, errors, quantile(duration), joint.prismatic)


def quantile(duration: float) -> float:
    """Compute Student's 97.5 % quantile with the degrees of freedom of a log of a duration [s]."""
    return float(stdtrit(max(duration / LONGEST_SEGMENT - 1, 1.0), 0.975))


def present_motions(result: Result, joints: Iterable[str]) -> dict[str, PresentMotion]:
    """Find the motion of joints in a result's samples, or in the table beside its file.

    Raises
    ------
    SettingsError
        If there is no such table, or it belongs to another result.
    """
    samples = (result.evidence or saved_evidence(result)).samples
    if missing := [name for name in joints if name not in samples.joint_names]:
        raise SettingsError(f"{result.path}: the samples have no joint '{missing[0]}'; repeat `stribeck identify`")
    period = samples.period * samples.stride
    stride = max(1, int(WINDOW_LENGTH / 8 / period))  # averaged over a window
    motions = {}
    for name in joints:
        rows = slice(None, None, stride), samples.joint_names.index(name)
        velocity, torque = samples.velocity[rows], samples.friction_torque[rows]
        motions[name] = PresentMotion(
            velocity=np.nan_to_num(velocity),
            friction_torque=np.nan_to_num(torque),
            usable=samples.usable[rows] & np.isfinite(velocity) & np.isfinite(torque),
            period=stride * period,
        )
    return motions


def noise_of(joints: Mapping[str, PlannedJoint], motions: Mapping[str, PresentMotion]) -> dict[str, float]:
    """Estimate the spectral density of each joint's torque noise [N² m² s] from the intervals of the result.

    A joint without an interval gets the rough estimate from its torque, times the median ratio of both estimates over
    the other joints.
    """
    shown = {name for name, joint in joints.items() if not joint.guessed and joint.result.verdict != "no friction"}
    rough = {name: rough_noise(motion, joints[name] if name in shown else None) for name, motion in motions.items()}
    densities = {name: read_noise(motions[name], joints[name]) for name in motions if name in shown}
    ratios = [densities[name] / rough[name] for name in densities if rough[name] > 0]
    factor = float(np.median(ratios)) if ratios else 1.0
    noise = {name: densities.get(name, factor * rough[name]) for name in motions}
    known = [value for value in noise.values() if value > 0]  # NaN for joints without a usable sample
    if not known:
        raise SettingsError("plan: no joint of the result has a torque whose noise is known; expected a longer log")
    return {name: value if value > 0 else float(np.median(known)) for name, value in noise.items()}


def read_noise(motion: PresentMotion, joint: PlannedJoint) -> float:
    """Compute the spectral density of torque noise [N² m² s] that explains the errors of a joint's friction curve.

    It is the geometric mean, over the points of the curve, of the variance divided by the variance for density 1.
    """
    information = joint.information(motion)
    slopes = joint.curve(joint.result.curve[-1].velocity)[2]
    errors = np.array([point.standard_error for point in joint.result.curve])
    variances = np.maximum(errors, 1e-9) ** 2 * joint.shrinking_share  # smaller errors [N m] are rounding
    noise = float(np.mean(variances))
    for _ in range(20):  # a fixed point, because the prior's part does not grow with the noise
        covariance = np.linalg.inv(information / noise + np.diag(joint.precision))
        noise *= float(np.exp(np.mean(np.log(variances / np.einsum("sk,kl,sl->s", slopes, covariance, slopes)))))
    return noise


def rough_noise(motion: PresentMotion, joint: PlannedJoint | None) -> float:
    """Estimate the spectral density of a joint's torque noise [N² m² s] from the residual of its friction.

    Means over consecutive windows are compared, which cancels slow changes (von Neumann 1941).
    """
    error = motion.friction_torque - (joint.result.friction(motion.velocity) if joint else 0.0)
    length = max(1, round(WINDOW_LENGTH / motion.period))
    count = len(error) // length
    means = error[: count * length].reshape(count, length).mean(axis=1)
    whole = np.asarray(motion.usable[: count * length].reshape(count, length).all(axis=1))
    both = np.logical_and(whole[1:], whole[:-1])
    if not both.any():
        return float("nan")
    return float(np.mean(np.diff(means)[both] ** 2) / 2 * length * motion.period)

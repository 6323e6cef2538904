"""The robot's state from what its sensors give: encoders, IMU and foot forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from stribeck.log import Array
from stribeck.simulation.walking.attitude import AttitudeFilter
from stribeck.simulation.walking.balance.terms import Dynamics

LOADED = (0.05, 0.35)
"""A foot is not trusted to stand below, and fully above, these shares of the weight."""


@dataclass(frozen=True, eq=False)
class Measurement:
    """What the sensors give at one instant; joints in the tree's order.

    Attributes
    ----------
    position
        Of the joints, shape (n,) [rad].
    orientation, angular_velocity, specific_force
        Of the base: quaternion xyzw; in its own coordinates [rad/s], [m/s^2].
    foot_force
        Vertical, of each foot [N], shape (feet,).
    """

    position: Array
    orientation: Array
    angular_velocity: Array
    specific_force: Array
    foot_force: Array


@dataclass(frozen=True, kw_only=True)
class EstimatorGains:
    """How far a period's measurement moves the estimate, 1 for all the way."""

    joint_position: float = 0.5
    joint_velocity: float = 0.13
    base_position: float = 0.05
    base_velocity: float = 0.05
    foothold: float = 0.2  # of a foot that bears nothing
    ground: float = 0.002  # of a foothold's height towards the flat ground


class StateEstimator:
    """Follows the joints by an alpha-beta filter, and the base by strapdown integration held to the standing feet.

    A foot that stands has a foothold p in the world. With r its place in the base, R and w the base's orientation and
    angular velocity, the base is at `p - R r` and moves with `-R (w x r + r')`, as far as the foot bears weight.
    A foothold follows its foot while that bears little, and the height of the ground slowly.
    """

    def __init__(
        self, dynamics: Dynamics, configuration: Array, period: float, gains: EstimatorGains | None = None
    ) -> None:
        self.dynamics, self.period, self.gains = dynamics, period, gains or EstimatorGains()
        self.configuration = configuration.copy()
        self.velocity = np.zeros(dynamics.model.nv)
        self._data = dynamics.model.createData()
        self._local = np.zeros(len(configuration))
        self._rates = np.zeros(dynamics.model.nv)
        self._base_velocity = np.zeros(3)
        places, _, turns = self._feet(configuration[7:], self.velocity[6:])
        rotation = pin.Quaternion(configuration[3:7]).toRotationMatrix()
        headings = np.arctan2(*(rotation @ turns)[:, 1::-1, 0].T)
        self._attitude = AttitudeFilter(rotation, headings, period)
        self._footholds = configuration[:3] + places @ rotation.T

    def update(self, measured: Measurement) -> tuple[Array, Array]:
        """Return configuration and velocity, as Pinocchio has them, after one more period."""
        gains, h = self.gains, self.period
        joints, rates = self._follow_joints(measured.position)
        spin = measured.angular_velocity
        places, motions, turns = self._feet(joints, rates)
        low, high = LOADED
        load = np.minimum(np.maximum((measured.foot_force / self.dynamics.weight - low) / (high - low), 0.0), 1.0)
        rotation = self._attitude.update(measured.orientation, spin, turns, load)
        # Both feet's r and w x r + r', turned into the world at once.
        turned = np.concatenate([places, places @ _skew(spin) + motions]) @ rotation.T
        arms, swings = turned[: len(places)], turned[len(places) :]

        force = rotation @ measured.specific_force + self.dynamics.gravity
        position = self.configuration[:3] + h * self._base_velocity + h * h / 2 * force
        velocity = self._base_velocity + h * force
        trust = load / max(float(load.sum()), 1.0)
        share = float(trust.sum())
        position += gains.base_position * (trust @ (self._footholds - arms) - share * position)
        velocity -= gains.base_velocity * (trust @ swings + share * velocity)
        self._footholds += (gains.foothold * (1 - load))[:, None] * (position + arms - self._footholds)
        self._footholds[:, 2] *= 1 - gains.ground

        self.configuration = np.concatenate([position, pin.Quaternion(rotation).coeffs(), joints])
        self._base_velocity = velocity
        self.velocity = np.concatenate([velocity @ rotation, spin, rates])
        return self.configuration, self.velocity

    def _follow_joints(self, measured: Array) -> tuple[Array, Array]:
        gains, h = self.gains, self.period
        expected = self.configuration[7:] + h * self.velocity[6:]
        error = measured - expected
        return expected + gains.joint_position * error, self.velocity[6:] + gains.joint_velocity / h * error

    def _feet(self, joints: Array, rates: Array) -> tuple[Array, Array, Array]:
        """Return the places and velocities of the soles' centres in the base, shape (feet, 3), and their rotations."""
        model, data = self.dynamics.model, self._data
        self._local[6], self._local[7:], self._rates[6:] = 1.0, joints, rates
        pin.forwardKinematics(model, data, self._local, self._rates)
        places, motions = np.empty((2, len(self.dynamics.frames), 3))
        turns = np.empty((len(places), 3, 3))
        for k, frame in enumerate(self.dynamics.frames):
            pose = pin.updateFramePlacement(model, data, frame)
            places[k], turns[k] = pose.translation, pose.rotation
            motions[k] = pin.getFrameVelocity(model, data, frame, pin.LOCAL_WORLD_ALIGNED).linear
        return places, motions, turns


def _skew(vector: Array) -> Array:
    """Return S with `r S = vector x r` for rows r."""
    x, y, z = vector.tolist()
    return np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])

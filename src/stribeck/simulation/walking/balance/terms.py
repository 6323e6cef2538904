"""Terms of the equation of motion and the tasks at one state, from one pass over the kinematic tree."""

from typing import NamedTuple

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array
from stribeck.core.robot import Robot
from stribeck.simulation.robots.sole import Sole


class FootState(NamedTuple):
    """Motion of a sole.

    Attributes
    ----------
    rotation, place
        Rotation and position of the sole's center in the world, shape (3, 3) and (3,) [m].
    jacobian
        Jacobian of linear and angular velocity in sole coordinates, shape (6, nv).
    velocity, drift
        Velocity in sole coordinates, and spatial acceleration without joint acceleration, shape (6,).
    to_base
        Matrix that converts spatial velocities from sole to base coordinates, shape (6, 6).
    """

    rotation: Array
    place: Array
    jacobian: Array
    velocity: Array
    drift: Array
    to_base: Array


class Terms(NamedTuple):
    """Dynamics of the robot at one state.

    Attributes
    ----------
    inertia, bias
        Inertia matrix M, shape (nv, nv), and bias forces h, shape (nv,).
    base_rotation
        Rotation from the base to the world, shape (3, 3).
    com, com_velocity, com_jacobian, com_drift
        Center of mass in the world and its derivatives, shapes (3,), (3,), (3, nv) and (3,).
    feet
        Feet in the robot's order of contacts.
    """

    inertia: Array
    bias: Array
    base_rotation: Array
    com: Array
    com_velocity: Array
    com_jacobian: Array
    com_drift: Array
    feet: tuple[FootState, ...]


class Dynamics:
    """Pinocchio's model of a robot, with a frame at the center of each sole."""

    def __init__(self, robot: Robot, soles: dict[str, Sole], model: pin.Model | None = None):
        self.model = pin.Model(model or robot.tree.model)
        self.frames = []
        for name, contact in robot.contacts.items():
            frame = self.model.frames[self.model.getFrameId(contact.frame)]
            centre = frame.placement * pin.SE3(np.eye(3), np.array(soles[name].centre))
            sole = pin.Frame(f"sole of {name}", frame.parentJoint, 0, centre, pin.FrameType.OP_FRAME)
            self.frames.append(self.model.addFrame(sole, False))
        ends = [self.model.frames[frame].parentJoint for frame in self.frames]
        self.leg_joints = sorted({joint for end in ends for joint in self.model.supports[end]})
        self.data = self.model.createData()
        self.mass = float(sum(inertia.mass for inertia in self.model.inertias))
        self.gravity = np.array(self.model.gravity.linear)
        self.weight = -self.mass * float(self.gravity[2])
        self._rest = np.zeros(self.model.nv)
        self._upper = np.tri(self.model.nv, dtype=bool).T

    def at(self, configuration: Array, velocity: Array) -> Terms:
        """Compute the terms at a state of Pinocchio."""
        model, data = self.model, self.data
        upper = pin.crba(model, data, configuration)
        inertia = np.where(self._upper, upper, upper.T)  # Pinocchio fills only parts of the lower triangle
        bias = pin.nonLinearEffects(model, data, configuration, velocity)
        pin.forwardKinematics(model, data, configuration, velocity, self._rest)
        pin.computeJointJacobians(model, data)
        base = data.oMi[1].copy()
        rotation = base.rotation
        jacobian = rotation @ inertia[:3] / self.mass
        return Terms(
            inertia=inertia,
            bias=bias,
            base_rotation=rotation,
            com=pin.centerOfMass(model, data, pin.POSITION, False).copy(),
            com_velocity=jacobian @ velocity,
            com_jacobian=jacobian,
            com_drift=rotation @ bias[:3] / self.mass + self.gravity,
            feet=tuple(self._foot(frame, base) for frame in self.frames),
        )

    def _foot(self, frame: int, base: pin.SE3) -> FootState:
        model, data = self.model, self.data
        pose = pin.updateFramePlacement(model, data, frame).copy()
        return FootState(
            pose.rotation,
            pose.translation,
            pin.getFrameJacobian(model, data, frame, pin.LOCAL),
            pin.getFrameVelocity(model, data, frame, pin.LOCAL).vector,
            pin.getFrameAcceleration(model, data, frame, pin.LOCAL).vector,
            base.actInv(pose).toActionMatrix(),
        )

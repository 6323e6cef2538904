"""Momentum of a robot and its change, sample by sample, by Pinocchio's compiled recursions.

Same quantities as `dynamics.momentum.momentum_balance` and `ContactMode.root`, which need hundreds of microseconds for
the arrays of a single sample.
"""

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.dynamics.contact.mode import ContactMode
from stribeck.core.dynamics.momentum import without_gravity
from stribeck.core.dynamics.rooted import workspace
from stribeck.core.dynamics.state import root_quaternions
from stribeck.core.errors import LogError
from stribeck.core.robot import Robot
from stribeck.core.robot.rooting import BASE_FRAME, RootedModel

STEP = 1e-7
"""Step [s] of the forward difference of the momentum; it leaves seven correct digits."""


Base = tuple[Array | None, Array | None]
"""Orientation xyzw of the robot's base frame, shape (4,), and angular velocity of its root link [rad/s], (3,)."""


class Tree:
    """Rooted tree with working memory for one sample.

    Parameters
    ----------
    mode
        Contact mode, which determines the root, the joints between base and standing feet, `stands`, and the joints
        with observable friction, `seen`, shape (n,).
    """

    def __init__(self, mode: ContactMode) -> None:
        robot, rooted = mode.robot, mode.rooted
        self._robot, self._mode = robot, mode
        self._surface, self._carried = mode.surface, robot.carried(mode.feet)
        self._model, self._data = workspace(rooted)
        self._weightless, self._other = workspace(without_gravity(rooted))
        self._columns, self._size = rooted.columns, rooted.root_size
        self._base = rooted.model.getFrameId(BASE_FRAME)
        self._rest, self._rates, self._accelerations = np.zeros((3, rooted.model.nv))
        self._at, self._near = np.tile(pin.neutral(rooted.model), (2, 1))
        self._first = rooted.model.nq - len(self._columns)
        self._payload = _payload_tree(robot, rooted)
        self.stands: BoolArray = mode.standing
        self.seen: BoolArray = ~self.stands | (not mode.leaves_open)

    def momentum(self, position: Array, velocity: Array, base: Base, *, turned: bool = True) -> Array:
        """Compute momentum and b of a sample, shape (2, n), as in `dynamics.momentum`.

        If not `turned`, a standing sole keeps the tilt of the last call.
        """
        size, columns, rates = self._size, self._columns, self._rates
        self._at[self._first :] = position[columns]
        rates[size:] = velocity[columns]
        if size and (turned or self._surface is None):
            self._move_root(position, velocity, base)
        self._near[self._first :] = self._at[self._first :] + STEP * rates[size:]
        momentum = self._project(self._at).copy()
        change = (self._project(self._near) - momentum) / STEP
        change -= pin.rnea(self._model, self._data, self._at, rates, self._accelerations)
        result = np.empty((2, len(columns)))
        result[:, columns] = momentum[size:], change[size:]
        return result

    def payload(self, position: Array, base: Base) -> Array:
        """Compute the joint torques that carry 1 kg at the payload's link at rest [N m], [N], shape (n,)."""
        model, data = self._payload
        self._at[self._first :] = position[self._columns]
        if self._size:
            self._move_root(position, np.zeros_like(position), base)
        torque = np.empty(len(position))
        torque[self._columns] = pin.rnea(model, data, self._at, self._rest, self._accelerations)[self._size :]
        return torque

    def _project(self, configuration: Array) -> Array:
        """Compute M v at a configuration."""
        momentum: Array = pin.rnea(self._weightless, self._other, configuration, self._rest, self._rates)
        return momentum

    def _move_root(self, position: Array, velocity: Array, base: Base) -> None:
        """Set gravity and velocity of a floating root, in its coordinates."""
        robot, twist = self._robot, self._rates[:6]
        twist[:] = 0.0
        orientation, omega = base
        if orientation is None:
            if self._surface is None:
                raise LogError(
                    f"base: none was given, but {self._mode.feet} do not determine the tilt; expected a Base"
                )
            self._accelerations[:3] = -robot.gravity  # the sole is level
            return
        gravity = _rotation(robot, position, orientation).T @ robot.gravity
        if self._surface is not None:
            pin.forwardKinematics(self._model, self._data, self._at)
            gravity = pin.updateFramePlacement(self._model, self._data, self._base).rotation @ gravity
        self._accelerations[:3] = -gravity
        if self._surface is None:
            if omega is None:
                raise LogError(f"base: {'+'.join(self._mode.feet)} leave its angular velocity open")
            twist[3:] = omega
            if not self._carried:
                twist[:3] = self._root_velocity(velocity, omega, -gravity / np.linalg.norm(gravity))

    def _root_velocity(self, velocity: Array, omega: Array, up: Array) -> Array:
        """Compute the velocity of the root link such that the standing points are at rest, or roll."""
        model, data, rates = self._model, self._data, np.zeros(self._model.nv)
        rates[6:] = velocity[self._columns]
        pin.forwardKinematics(model, data, self._at, rates)
        total = np.zeros(3)
        for foot in self._mode.feet:
            contact = self._robot.contacts[foot]
            frame = model.getFrameId(contact.frame)
            place = pin.updateFramePlacement(model, data, frame).translation
            motion = pin.getFrameVelocity(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
            rolled = np.cross(omega + motion.angular, contact.radius * up)
            total -= motion.linear - rolled + np.cross(omega, place)
        return np.asarray(total / len(self._mode.feet))


def _rotation(robot: Robot, position: Array, quaternion: Array) -> Array:
    """Compute the rotation from the root link to the world, shape (3, 3)."""
    if robot.base_frame != BASE_FRAME:
        quaternion = root_quaternions(robot, position[None], quaternion[None])[0]
    rotation: Array = pin.Quaternion(*quaternion[[3, 0, 1, 2]]).normalized().toRotationMatrix()
    return rotation


def _payload_tree(robot: Robot, rooted: RootedModel) -> tuple[pin.Model, pin.Data]:
    """Build a tree whose only mass is 1 kg: at the center of mass of a floating base, or of the last body."""
    body = 1 if robot.base == "floating" else robot.tree.model.njoints - 1
    joint, pose = rooted.bodies[body]
    model = pin.Model(workspace(rooted)[0])
    for number in range(model.njoints):
        model.inertias[number] = pin.Inertia.Zero()
    point = pin.Inertia(1.0, robot.tree.model.inertias[body].lever, np.zeros((3, 3)))
    model.inertias[joint] = pose.act(point)
    model.armature = np.zeros(model.nv)
    return model, model.createData()

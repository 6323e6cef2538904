"""Recording of a simulated walk as a log and its ground truth."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_closing
from scipy.spatial.transform import Rotation

from stribeck.core.base.typing import Array
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.core.robot.kinematics import frame_pose
from stribeck.core.robot.rooting import BASE_FRAME
from stribeck.simulation.mujoco.model import Body
from stribeck.simulation.mujoco.simulator import TOUCH, Snapshot, foot_wrenches
from stribeck.simulation.prescribed.exact import Truth
from stribeck.simulation.span import span


class Recorder:
    """Collect one sample per period of the log, with joints in the tree's order.

    Torque and foot wrench are constant between samples and jump at a sample. The log contains the mean of both sides,
    because the second difference of the position is the mean of two accelerations.

    Attributes
    ----------
    columns, rows
        Indices that convert joints from the log's to the tree's order, and from the tree's to the log's order.
    """

    def __init__(self, robot: Robot, body: Body, samples: int, period: float) -> None:
        joints, feet = len(robot.joint_names), len(robot.contacts)
        self.robot, self.body, self.period, self.filled = robot, body, period, 0
        self.columns, self.rows = span(robot.tree.columns), span(np.argsort(robot.tree.columns))
        self.configuration = np.empty((samples, joints + 7))
        self.velocity = np.empty((samples, joints + 6))
        self.specific_force = np.empty((samples, 3))
        self.friction_torque = np.empty((samples, joints))
        self.torque_after = np.empty((samples, joints))
        self.touch_before, self.touch_after = np.empty((2, samples, feet, TOUCH))

    def see(self, now: Snapshot, touch: Array) -> None:
        """Record the state at the next sample, and the forces on the feet just before."""
        k = self.filled
        self.configuration[k], self.velocity[k] = now.configuration, now.velocity
        self.specific_force[k], self.friction_torque[k] = now.specific_force, now.friction_torque
        self.touch_before[k] = touch
        self.filled += 1

    def act(self, torque: Array, touch: Array) -> None:
        """Record the torque after the last sample, and the forces on the feet just after it."""
        k = self.filled - 1
        self.torque_after[k], self.touch_after[k] = torque, touch

    def log(self) -> RobotLog:
        """Build the log of ideal sensors."""
        rows = slice(self.filled)
        position, velocity = self._joints(self.configuration[rows, 7:]), self._joints(self.velocity[rows, 6:])
        torque, wrench = self.torque_after[rows].copy(), foot_wrenches(self.body, self.touch_after[rows])
        torque[1:] = 0.5 * (self.torque_after[: self.filled - 1] + torque[1:])
        wrench[1:] = 0.5 * (foot_wrenches(self.body, self.touch_before[1 : self.filled]) + wrench[1:])
        weight = self.robot.mass * float(np.linalg.norm(self.robot.gravity))
        return RobotLog(
            time=self.period * np.arange(self.filled, dtype=np.float64),
            joint_names=self.robot.joint_names,
            position=position,
            velocity=velocity,
            torque=self._joints(torque),
            base_orientation=self._base_orientation(position),
            angular_velocity=self.velocity[rows, 3:6].copy(),
            linear_acceleration=self.specific_force[rows].copy(),
            foot_names=tuple(self.robot.contacts),
            # a foot with more than this share of the weight is in contact
            # a shorter loss of contact [s] is a bounce after landing, and is removed
            contact=without_bounces(wrench[:, :, 2] > 0.02 * weight, round(0.1 / self.period)),
            foot_wrench=wrench,
            torque_source=self.robot.torque_source,
        )

    def truth(self, parameters: dict[str, dict[str, float]]) -> Truth:
        """Build the ground truth, with the parameters of the friction."""
        rows = slice(self.filled)
        return Truth(
            friction_torque=self._joints(self.friction_torque[rows]),
            parameters=parameters,
            base_position=self.configuration[rows, :3].copy(),
            base_orientation=self.configuration[rows, 3:7].copy(),
            base_velocity=self.velocity[rows, :6].copy(),
        )

    def _joints(self, tree_order: Array) -> Array:
        return tree_order[:, self.rows]

    def _base_orientation(self, position: Array) -> Array:
        """Compute quaternions xyzw of the base frame of the robot's logs, shape (T, 4)."""
        root = self.configuration[: self.filled, 3:7].copy()
        if self.robot.base_frame == BASE_FRAME:
            return root
        frame = self.robot.tree.model.getFrameId(self.robot.base_frame)
        turn, _ = frame_pose(self.robot.tree, frame, position)
        return np.asarray((Rotation.from_quat(root) * Rotation.from_matrix(turn)).as_quat())


def without_bounces(touching: NDArray[np.bool_], shortest: int) -> NDArray[np.bool_]:
    """Close gaps of fewer samples than `shortest` in contact flags, shape (T, feet)."""
    around = ((shortest, shortest), (0, 0))
    closed = binary_closing(np.pad(touching, around, mode="edge"), np.ones((shortest, 1), dtype=bool))
    return np.asarray(closed[shortest:-shortest])

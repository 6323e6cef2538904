"""Another model of the robot, with the same joints, feet and gravity, and joint friction as its simulator applies it.

R(v) = (Fc + (Fs - Fc) exp(-(v / vs)^2)) sign(v) + Fv v
"""

from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array
from stribeck.core.equations.friction_torque.preparation import PreparedLog
from stribeck.core.errors import RobotFileError
from stribeck.core.robot import Robot, read_robot_file
from stribeck.core.robot.model_file import joint_names, load_model, lock_joints
from stribeck.core.robot.rooting import BASE_FRAME, is_floating, root_at


@dataclass(frozen=True, kw_only=True)
class JointFriction:
    """Friction parameters of one joint: Fc and Fs - Fc [N m], vs [rad/s], Fv [N m s/rad]."""

    coulomb: float = 0.0
    viscous: float = 0.0
    rise: float = 0.0
    stribeck_velocity: float = 1.0

    def __bool__(self) -> bool:
        """Whether there is any."""
        return bool(self.coulomb or self.viscous or self.rise)


Coupling = tuple[dict[str, float], JointFriction]
"""Coefficients by joint, and friction of the sum of speeds."""

StatedFriction = tuple[dict[str, JointFriction], dict[str, Coupling], list[str]]
"""Friction stated in a model file: of joints and couplings by name, and notes on unsupported effects."""


@dataclass(frozen=True, eq=False)
class ModelFriction:
    """The friction of n joints, and of couplings with coefficients b, shape (n,): R(b . v) acts on joint j as b_j R."""

    joints: Sequence[JointFriction]
    couplings: Sequence[tuple[Array, JointFriction]] = ()

    def __bool__(self) -> bool:
        """Whether there is any."""
        return any(self.joints) or any(friction for _, friction in self.couplings)

    def torque(self, velocity: Array) -> Array:
        """Compute the torque that resists motion at velocities of shape (T, n), shape (T, n)."""
        speeds = velocity @ self._coefficients
        return np.asarray((np.sign(speeds) * self._resistance(np.abs(speeds))) @ self._coefficients.T)

    def damping(self, velocity: Array) -> Array:
        """Compute D with R = D v at velocities of shape (T, n), shape (T, n, n)."""
        creep = 1e-3  # [rad/s], [m/s]; slower friction is linear, for a finite slope at rest
        speed = np.maximum(np.abs(velocity @ self._coefficients), creep)
        slope, joints = self._resistance(speed) / speed, len(self.joints)
        matrices = slope[:, :joints, None] * np.eye(joints)
        if self.couplings:
            coupled = self._coefficients[:, joints:]
            matrices += (coupled * slope[:, None, joints:]) @ coupled.T
        return np.asarray(matrices)

    @cached_property
    def _coefficients(self) -> Array:
        """Matrix from joint velocities to the speeds of joints and couplings, shape (n, n + couplings)."""
        return np.column_stack([np.eye(len(self.joints)), *(coefficients for coefficients, _ in self.couplings)])

    @cached_property
    def _numbers(self) -> Array:
        """Friction parameters of all joints and couplings, shape (4, n + couplings)."""
        return np.array([astuple(law) for law in (*self.joints, *(friction for _, friction in self.couplings))]).T

    def _resistance(self, speed: Array) -> Array:
        coulomb, viscous, rise, stribeck_velocity = self._numbers
        return np.asarray(coulomb + rise * np.exp(-((speed / stribeck_velocity) ** 2)) + viscous * speed)


def other_model(robot: Robot, path: Path) -> tuple[Robot, list[str]]:
    """Build the robot with another model file, with notes on the adaptations.

    Joints that the robot does not have are locked at the position in the robot file, or at zero. A contact frame that
    the file lacks is copied from the robot's own model at zero position. The rotor inertia is taken from the file if it
    states one and the torque sensor is not behind the gear; otherwise from the robot.

    Raises
    ------
    RobotFileError
        If the file cannot be read, or lacks a joint of the robot.
    """
    if not path.exists():
        raise RobotFileError(f"{path}: no such file; expected a URDF or MJCF model of robot '{robot.name}'")
    model, notes = load_model(path, robot.base)
    names = joint_names(model)
    if missing := [name for name in robot.joint_names if name not in names]:
        raise RobotFileError(
            f"{path}: has no joint '{missing[0]}', which robot '{robot.name}' has; expected a model of that robot, "
            f"this one has {', '.join(names) or 'no joints'}"
        )
    places = read_robot_file(Path(robot.path)).robot.locked if robot.path != robot.model_path else {}
    locked = {name: places.get(name, 0.0) for name in names if name not in robot.joint_names}
    model = lock_joints(model, locked)
    if free := [name for name in locked if name not in places]:
        notes.append(f"{path.name}: joint(s) {', '.join(free)} are not the robot's and are locked at zero")
    notes += _add_frames(model, robot, path)
    model.armature = _armature(model, robot)
    model.gravity.linear = robot.gravity
    tree = root_at(model)
    tree_names = [str(name) for name in list(tree.model.names)[1 + tree.floating :]]
    order = np.argsort(tree.columns)
    joints = tuple(tree_names[k] for k in order)
    return replace(robot, tree=tree, joint_names=joints, model_path=str(path), warnings=tuple(notes)), notes


def with_joints(prepared: PreparedLog, joints: Sequence[str]) -> PreparedLog:
    """Reorder the joints of a prepared log."""
    log = prepared.log
    if tuple(joints) == log.joint_names:
        return prepared
    order = [log.joint_names.index(name) for name in joints]
    channels = ("position", "torque", "velocity", "acceleration", "temperature", "external_torque")
    moved = {name: value[:, order] for name in channels if (value := getattr(log, name)) is not None}
    return replace(prepared, log=replace(log, joint_names=tuple(joints), **moved))


def _armature(model: pin.Model, robot: Robot) -> Array:
    """Collect the rotor inertias in the order of the model, shape (nv,)."""
    inertias = np.array(model.armature)
    for name, value in zip(robot.joint_names, robot.armature, strict=True):
        place = model.joints[model.getJointId(name)].idx_v
        if robot.torque_source.endswith("_sensor") or not inertias[place]:
            inertias[place] = value
    return inertias


def _add_frames(model: pin.Model, robot: Robot, path: Path) -> list[str]:
    """Add the missing frames of the robot's contacts and base to a model."""
    source = robot.tree.model
    frames = [contact.frame for contact in robot.contacts.values()]
    frames += [robot.base_frame] if robot.base_frame != BASE_FRAME else []
    missing = [name for name in frames if not model.existFrame(name)]
    if not missing:
        return []
    base = int(is_floating(model))  # the free joint, or the world
    zero, target = source.createData(), model.createData()
    for tree, data in ((source, zero), (model, target)):
        pin.forwardKinematics(tree, data, pin.neutral(tree))
    for name in missing:
        frame = source.frames[source.getFrameId(name)]
        carrier = str(source.names[frame.parentJoint])
        joint = int(model.getJointId(carrier)) if carrier in robot.joint_names else base
        in_base = zero.oMi[base].actInv(zero.oMi[frame.parentJoint] * frame.placement)
        placement = target.oMi[joint].actInv(target.oMi[base] * in_base)
        model.addFrame(pin.Frame(name, joint, 0, placement, pin.FrameType.OP_FRAME))
    return [f"{path.name}: frame(s) {', '.join(missing)} are missing, and put where the robot's own model has them"]

"""Replacement of the robot's model by another model with the same joints, feet and gravity."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array
from stribeck.core.equations.friction_torque.preparation import PreparedLog
from stribeck.core.errors import RobotFileError
from stribeck.core.robot import Robot, read_robot_file
from stribeck.core.robot.model_file import joint_names, load_model, lock_joints
from stribeck.core.robot.rooting import BASE_FRAME, is_floating, root_at


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
    zero, target = (_at_zero(tree) for tree in (source, model))
    for name in missing:
        frame = source.frames[source.getFrameId(name)]
        carrier = str(source.names[frame.parentJoint])
        joint = int(model.getJointId(carrier)) if carrier in robot.joint_names else base
        in_base = zero.oMi[base].actInv(zero.oMi[frame.parentJoint] * frame.placement)
        placement = target.oMi[joint].actInv(target.oMi[base] * in_base)
        model.addFrame(pin.Frame(name, joint, 0, placement, pin.FrameType.OP_FRAME))
    return [f"{path.name}: frame(s) {', '.join(missing)} are missing, and put where the robot's own model has them"]


def _at_zero(model: pin.Model) -> pin.Data:
    """Return the configuration at zero joint positions."""
    data = model.createData()
    pin.forwardKinematics(model, data, pin.neutral(model))
    return data

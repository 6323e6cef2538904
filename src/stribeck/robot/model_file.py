"""Read a model file (URDF or MJCF) into Pinocchio, checked, with locked joints removed."""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

import numpy as np
import pinocchio as pin

from stribeck.errors import RobotFileError, did_you_mean
from stribeck.robot.mjcf_file import check_mjcf_file
from stribeck.robot.model_check import check_finite, check_inertias, require_same_joints, require_same_mass
from stribeck.robot.rooting import FLOATING, is_floating
from stribeck.robot.urdf_check import check_urdf, keep_dynamics, moving_joints, total_mass
from stribeck.robot.xml_file import XmlFile, read_xml
from stribeck.typing import Array

MARK = " (body)"
"""Behind the names of frames while they could be taken for joints'."""


def load_model(path: Path, base: Literal["floating", "fixed"]) -> tuple[pin.Model, list[str]]:
    """Return the model of a file and warnings about it.

    Parameters
    ----------
    path
        A URDF or MJCF (MuJoCo) file.
    base
        Whether the root moves freely. A root fixed in a floating model stays where the file puts it.

    Raises
    ------
    RobotFileError
        If the file cannot be read, or Pinocchio reads another robot from it than it describes.
    """
    xml = read_xml(path)
    kind = _kind(xml)
    root = pin.JointModelFreeFlyer() if base == "floating" else None
    try:
        if kind == "urdf":
            model, notes = _build_from_urdf(xml, root)
        else:
            try:
                from stribeck.robot.mjcf_check import add_loop_frames, check_mjcf, compile_mjcf
            except ModuleNotFoundError as error:
                raise RobotFileError(f"{path}: MJCF needs MuJoCo: pip install 'stribeck[simulation]'") from error
            check_mjcf_file(xml)
            compiled = compile_mjcf(path)
            model = pin.buildModelFromMJCF(str(path))
            check_finite(path, model)
            notes = check_mjcf(path, compiled, model)
            if root and not is_floating(model):
                model = _with_root(model, root)
            notes += add_loop_frames(path, compiled, model)
        if base == "fixed" and is_floating(model):
            model = _without_joints(model, [1], pin.neutral(model))
    except (ValueError, RuntimeError, IndexError) as error:
        detail = " ".join(str(error).rpartition("message:")[2].split())[:200]
        raise RobotFileError(f"{path}: Pinocchio cannot read this {kind.upper()} model: {detail}") from error
    return model, notes


def _build_from_urdf(xml: XmlFile, root: pin.JointModelFreeFlyer | None) -> tuple[pin.Model, list[str]]:
    """Return the model of a URDF, whatever its encoding, and warnings."""
    notes, impossible = check_urdf(xml)
    keep_dynamics(xml.root)
    model = pin.buildModelFromXML(xml.text, root) if root else pin.buildModelFromXML(xml.text)
    check_finite(xml.path, model)
    require_same_joints(xml.path, moving_joints(xml.root), model)
    require_same_mass(xml.path, total_mass(xml.root), model)
    return model, notes + check_inertias(xml.path.name, model, impossible)


def _with_root(fixed: pin.Model, root: pin.JointModelFreeFlyer) -> pin.Model:
    """Return the model with a free flyer between it and the world.

    Pinocchio's own way of reading MJCF with a root refuses files with keyframes; its `appendModel` loses armature.
    """
    model = pin.Model()
    frame = model.addJointFrame(model.addJoint(0, root, pin.SE3.Identity(), "root_joint"))
    model = pin.appendModel(model, fixed, frame, pin.SE3.Identity())
    model.armature = np.concatenate([np.zeros(root.nv), fixed.armature])
    return model


def kind_of(path: Path) -> Literal["urdf", "mjcf"]:
    """Return which format a model file has, by its root element.

    Raises
    ------
    RobotFileError
        If there is no such file, or it is none of these.
    """
    return _kind(read_xml(path))


def _kind(xml: XmlFile) -> Literal["urdf", "mjcf"]:
    kinds: dict[str, Literal["urdf", "mjcf"]] = {"robot": "urdf", "mujoco": "mjcf"}
    if xml.root.tag == "sdf":
        raise RobotFileError(f"{xml.path}: SDF models are not read; convert this one to URDF or MJCF")
    if xml.root.tag not in kinds:
        raise RobotFileError(
            f"{xml.path}: the root element is <{xml.root.tag}>; expected <robot> (URDF) or <mujoco> (MJCF)"
        )
    return kinds[xml.root.tag]


def lock_joints(model: pin.Model, locked: Mapping[str, float], where: str) -> pin.Model:
    """Return the model with these joints fixed at the given positions [rad or m].

    Raises
    ------
    RobotFileError
        If the model has no such joint.
    """
    configuration = pin.neutral(model)
    joints = []
    for name, value in locked.items():
        joint = require_joint(model, name, f"{where}: [robot] locked")
        joints.append(joint)
        joint_model = model.joints[joint]
        if joint_model.nq == 1:
            configuration[joint_model.idx_q] = value
        elif joint_model.nq == 2:  # an unbounded joint is stored as cosine and sine
            configuration[joint_model.idx_q : joint_model.idx_q + 2] = np.cos(value), np.sin(value)
    return _without_joints(model, joints, configuration) if joints else model


def _without_joints(model: pin.Model, joints: list[int], configuration: Array) -> pin.Model:
    """Return the model with joints fixed; a body may be called as a joint is, and keeps its name.

    Pinocchio looks frames up by their names alone, and would not know which of the two is meant.
    """
    marked = pin.Model(model)
    taken = {frame.name for frame in model.frames if frame.type == pin.FrameType.JOINT}
    for frame in marked.frames:
        if frame.type != pin.FrameType.JOINT and frame.name in taken:
            frame.name += MARK
    reduced = pin.buildReducedModel(marked, joints, configuration)
    bodies = {frame.name.removesuffix(MARK) for frame in reduced.frames if frame.name.endswith(MARK)}
    for frame in reduced.frames:
        if frame.type == pin.FrameType.FIXED_JOINT and frame.name in bodies:
            frame.name += " (joint)"
        frame.name = frame.name.removesuffix(MARK)
    return reduced


def joint_names(model: pin.Model) -> list[str]:
    """Return the names of the joints beside the root, in the model's order."""
    return [
        str(name)
        for name, joint in zip(list(model.names)[1:], list(model.joints)[1:], strict=True)
        if joint.shortname() not in FLOATING
    ]


def require_joint(model: pin.Model, name: str, where: str) -> int:
    """Return the index of a joint, or say which joints there are."""
    names = joint_names(model)
    if name not in names:
        raise RobotFileError(
            f"{where} names joint '{name}', which the model does not have; it has {_listing(model)}"
            f"{did_you_mean(name, names)}"
        )
    return int(model.getJointId(name))


def _listing(model: pin.Model) -> str:
    return ", ".join(joint_names(model)) or "no joints"

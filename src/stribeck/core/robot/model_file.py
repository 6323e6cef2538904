"""Read a model file (URDF or MJCF) into Pinocchio, check it, and lock joints."""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

import numpy as np
import pinocchio as pin

from stribeck.core.base.finding import listed
from stribeck.core.base.typing import Array
from stribeck.core.errors import RobotFileError
from stribeck.core.robot import model_check
from stribeck.core.robot.rooting import is_floating
from stribeck.core.robot.xml_file import XmlFile, read_xml


def load_model(path: Path, base: Literal["floating", "fixed"], *, loops: bool = False) -> tuple[pin.Model, list[str]]:
    """Read a model file, and collect warnings.

    Parameters
    ----------
    path
        Path of a URDF or MJCF (MuJoCo) file.
    base
        Whether the root moves freely. If fixed, the root of a floating model stays at its pose in the file.
    loops
        Whether a robot file closes the loops of the model. If not, a warning describes how.

    Raises
    ------
    RobotFileError
        If the file cannot be read, or Pinocchio's model differs from the file.
    """
    xml = read_xml(path)
    kind = xml.kind
    root = pin.JointModelFreeFlyer() if base == "floating" else None
    try:
        model, notes = _build_from_urdf(xml, root) if kind == "urdf" else _build_from_mjcf(xml, root, loops=loops)
        if base == "fixed" and is_floating(model):
            model = _without_joints(model, [1], pin.neutral(model))
    except (ValueError, RuntimeError, IndexError) as error:
        detail = " ".join(str(error).rpartition("message:")[2].split())[:200]
        raise RobotFileError(f"{path}: Pinocchio cannot read this {kind.upper()} model: {detail}") from error
    return model, notes


def take_model(model: pin.Model, base: Literal["floating", "fixed"] | None) -> tuple[pin.Model, list[str]]:
    """Check and copy a Pinocchio model, with a fixed root if `base` is "fixed", and collect warnings.

    Raises
    ------
    RobotFileError
        If it contains numbers that are not finite, or has no free flyer although the base is floating.
    """
    name = str(model.name)
    model_check.check_finite(Path(name), model)
    if base == "floating" and not is_floating(model):
        raise RobotFileError(
            f"{name}: this Pinocchio model has a fixed root; expected one built with pin.JointModelFreeFlyer(), "
            'or base="fixed"'
        )
    if base == "fixed" and is_floating(model):
        return _without_joints(model, [1], pin.neutral(model)), model_check.check_inertias(name, model, {})
    return pin.Model(model), model_check.check_inertias(name, model, {})


def _build_from_urdf(xml: XmlFile, root: pin.JointModelFreeFlyer | None) -> tuple[pin.Model, list[str]]:
    """Build the model of a URDF of any encoding, without the elements that make Pinocchio complain."""
    notes, impossible = model_check.check_urdf(xml)
    for parent, kept in ((xml.root, ("link", "joint")), *((link, ("inertial",)) for link in xml.root.findall("link"))):
        for element in list(parent):
            if element.tag not in kept:
                parent.remove(element)
    for element in xml.root.iter():  # urdfdom refuses spaces around a number; names may have them
        values = {key: text.strip() for key, text in element.items() if key not in ("name", "link", "joint")}
        element.attrib.update(values)
    model = pin.buildModelFromXML(xml.text)
    if root and not (is_floating(model) and all(parent > 0 for parent in list(model.parents)[2:])):
        model = pin.buildModelFromXML(xml.text, root)
    model_check.check_finite(xml.path, model)
    model_check.require_same_joints(xml.path, model_check.moving_joints(xml.root), model)
    masses = [float(element.get("value", "nan")) for element in xml.root.findall("link/inertial/mass")]
    model_check.require_same_mass(xml.path, sum(masses), model)
    return model, notes + model_check.check_inertias(xml.path.name, model, impossible)


def _build_from_mjcf(xml: XmlFile, root: pin.JointModelFreeFlyer | None, *, loops: bool) -> tuple[pin.Model, list[str]]:
    """Build the model of an MJCF."""
    try:
        from stribeck.core.robot.mjcf import add_loop_frames, build_model, check_file, compile_mjcf
    except ModuleNotFoundError as error:
        raise RobotFileError(f"{xml.path}: MJCF needs MuJoCo: pip install 'stribeck[simulation]'") from error
    check_file(xml)
    compiled = compile_mjcf(xml.path)
    model, objects = build_model(compiled, root)
    model_check.check_finite(xml.path, model)
    notes = [f"{xml.path.name}: objects beside the robot are left out: {listed(objects)}"] * bool(objects)
    notes += model_check.check_inertias(xml.path.name, model, {})
    of_loops = add_loop_frames(xml.path, compiled, model)
    return model, notes if loops else notes + of_loops


def lock_joints(model: pin.Model, locked: Mapping[str, float]) -> pin.Model:
    """Fix joints at positions [rad or m]."""
    joints, positions = [int(model.getJointId(name)) for name in locked], np.zeros(model.nv)
    for joint, value in zip(joints, locked.values(), strict=True):
        if model.joints[joint].nv == 1:
            positions[model.joints[joint].idx_v] = value
    return _without_joints(model, joints, pin.integrate(model, pin.neutral(model), positions)) if joints else model


def _without_joints(model: pin.Model, joints: list[int], configuration: Array) -> pin.Model:
    """Fix joints; a body with a joint's name keeps its name.

    Pinocchio looks up frames by name only and would confuse the two.
    """
    # Suffix that temporarily distinguishes body frames from joints of the same name.
    mark = " (body)"
    marked = pin.Model(model)
    taken = {frame.name for frame in model.frames if frame.type == pin.FrameType.JOINT}
    for frame in marked.frames:
        if frame.type != pin.FrameType.JOINT and frame.name in taken:
            frame.name += mark
    reduced = pin.buildReducedModel(marked, joints, configuration)
    bodies = {frame.name.removesuffix(mark) for frame in reduced.frames if frame.name.endswith(mark)}
    for frame in reduced.frames:
        if frame.type == pin.FrameType.FIXED_JOINT and frame.name in bodies:
            frame.name += " (joint)"
        frame.name = frame.name.removesuffix(mark)
    return reduced


def joint_names(model: pin.Model) -> list[str]:
    """List the joints other than a free root, in the model's order."""
    return [str(name) for name in list(model.names)[1 + is_floating(model) :]]

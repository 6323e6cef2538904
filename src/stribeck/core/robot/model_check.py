"""Check a URDF, and compare Pinocchio's model with the file.

Pinocchio drops unknown elements, opens loops, and treats coupled joints as independent.
"""

from collections.abc import Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array
from stribeck.core.errors import RobotFileError
from stribeck.core.robot.xml_file import MOST_BODIES, MOST_JOINTS, XmlFile

MOVING = ("revolute", "continuous", "prismatic")
LEAST_MOMENT = -1e-9
"""Smallest moment of inertia [kg m^2] that counts as zero."""
RELATIVE_TOLERANCE = 1e-5
"""Relative tolerance of mass and inertia matrix; numbers in model files have six digits."""


def check_finite(path: Path, model: pin.Model) -> None:
    """Refuse a model with a pose or an inertia that is not finite."""
    for joint in range(model.njoints):
        numbers = [model.jointPlacements[joint].homogeneous, model.inertias[joint].matrix()]
        if not all(np.isfinite(matrix).all() for matrix in numbers):
            raise RobotFileError(
                f"{path}: pose or inertia of joint '{model.names[joint]}' contains a value that is not finite; "
                "expected plain numbers"
            )


def check_inertias(name: str, model: pin.Model, lines: Mapping[str, str]) -> list[str]:
    """Warn about joints whose link has a physically impossible inertia, or that move neither mass nor inertia.

    `lines` maps each link of impossible inertia to its line in the file.
    """
    impossible, empty = [], []
    matrix = pin.crba(model, model.createData(), pin.neutral(model))
    for joint in range(1, model.njoints):
        inertia, place = model.inertias[joint], model.joints[joint].idx_v
        if inertia.mass < 0 or not is_possible(inertia.inertia):
            names = [frame.name for frame in model.frames if frame.parentJoint == joint and frame.name in lines]
            links = ", ".join(f"link '{link}' in {lines[link]}" for link in names)
            impossible.append(f"{model.names[joint]} ({links})" if links else str(model.names[joint]))
        if model.joints[joint].nv == 1 and matrix[place, place] <= 0:
            empty.append(str(model.names[joint]))
    texts = {
        "these joints carry links whose inertia is impossible for a rigid body": impossible,
        "these joints move neither mass nor inertia": empty,
    }
    return [f"{name}: {text}: {', '.join(joints)}" for text, joints in texts.items() if joints]


def is_possible(moments: Array) -> bool:
    """Check that moments of inertia, shape (3, 3), are positive semidefinite and obey the triangle inequality."""
    least, middle, most = np.linalg.eigvalsh(moments)
    return bool(least >= LEAST_MOMENT and least + middle >= most * (1 - 1e-3))  # [1], files have few digits


def require_same_joints(path: Path, expected: set[str], model: pin.Model) -> None:
    """Refuse a model whose joints differ from the file's."""
    joints = range(1, model.njoints)
    read = {str(model.names[k]) for k in joints if model.joints[k].nv == 1 or str(model.names[k]) in expected}
    if odd := sorted(expected ^ read):
        raise RobotFileError(f"{path}: Pinocchio dropped or added joint(s) {', '.join(odd)} when it read the model")


def require_same_mass(path: Path, expected: float, model: pin.Model) -> None:
    """Refuse a model whose mass differs from the file's [kg]."""
    read = sum(inertia.mass for inertia in model.inertias)
    if not abs(read - expected) <= RELATIVE_TOLERANCE * max(abs(expected), 1e-9):
        raise RobotFileError(
            f"{path}: Pinocchio read a mass of {read:.6g} kg, but the file has {expected:.6g} kg; "
            "some body was dropped or counted twice"
        )


def check_urdf(xml: XmlFile) -> tuple[list[str], dict[str, str]]:
    """Check links, joints, their tree, and all numbers that Pinocchio reads.

    Returns
    -------
    warnings
        Parts that stribeck models differently from the file.
    impossible
        Links with physically impossible moments of inertia, by name, with their lines. They are not refused: 14 of the
        70 URDFs of example-robot-data have some, most of them light.

    Raises
    ------
    RobotFileError
        Names the link or joint and its line.
    """
    root = xml.root
    if not root.get("name"):
        xml.repair("a robot without a name has the name of its file", "<robot>", root)
        root.set("name", xml.path.stem)
    macro = next((element for element in root.iter() if element.tag.startswith("xacro:")), None)
    if macro is not None:
        xml.refuse(macro, f"<{macro.tag}> is a macro; expected the URDF that `xacro` generates from this file")
    for tag, most in (("link", MOST_BODIES), ("joint", MOST_JOINTS)):
        elements = [element for element in root.findall(tag) if element.get("type") != "fixed"]
        if len(elements) > most:
            xml.refuse(elements[most], f"the model has {len(elements)} <{tag}>; expected at most {most}")
    links, joints = xml.named("link"), xml.named("joint")
    if not links:
        raise RobotFileError(f"{xml.path}: has no <link>; expected a robot's links and joints")
    moments = {name: _check_inertial(xml, link, f"link '{name}'") for name, link in links.items()}
    for name, joint in joints.items():
        _check_joint(xml, joint, f"joint '{name}'", links)
    _check_tree(xml, links, joints)
    coupled = sorted(name for name in moving_joints(root) if joints[name].find("mimic") is not None)
    warnings = [f"{xml.path.name}: mimic joints are treated as independent: {', '.join(coupled)}"] if coupled else []
    warnings += [f"{xml.path.name}: {repair}: {', '.join(places)}" for repair, places in xml.repairs.items()]
    return warnings, {name: f"line {xml.lines[links[name]]}" for name in links if not is_possible(moments[name])}


def moving_joints(root: Element) -> set[str]:
    """Collect the names of a URDF's joints with one degree of freedom."""
    return {str(joint.get("name")) for joint in root.findall("joint") if joint.get("type") in MOVING}


def _check_inertial(xml: XmlFile, link: Element, of: str) -> Array:
    """Check a link's inertia, and return its moments, shape (3, 3); zero if the link is only a frame."""
    inertial = xml.only(link, "inertial", of)
    if inertial is None:
        return np.zeros((3, 3))
    mass, inertia = xml.only(inertial, "mass", of), xml.only(inertial, "inertia", of)
    if mass is None or inertia is None:
        missing = "mass" if mass is None else "inertia"
        xml.refuse(inertial, f"{of} has an <inertial> without <{missing}>; expected <mass>, <inertia> and <origin>")
    (kilograms,) = xml.numbers(mass, mass.get("value"), 1, f"the mass of {of}")
    if not 0 <= kilograms < 1e6:
        xml.refuse(mass, f"{of} has a mass of {kilograms:g} kg; expected zero or more, less than 1e6")
    keys = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    for key in ("ixy", "ixz", "iyz"):
        if key not in inertia.attrib:
            xml.repair("missing products of inertia are set to zero", f"{key} of {of}", inertia)
            inertia.set(key, "0")
    moments = {key: xml.numbers(inertia, inertia.get(key), 1, f"{key} of {of}")[0] for key in keys}
    for key in ("ixx", "iyy", "izz"):
        if moments[key] < LEAST_MOMENT:
            xml.refuse(inertia, f"{key} of {of} is {moments[key]:g} kg m^2; expected zero or more")
    _check_origin(xml, inertial, of)
    xx, xy, xz, yy, yz, zz = moments.values()
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _check_origin(xml: XmlFile, parent: Element, of: str) -> None:
    origin = xml.first(parent, "origin", of)
    for key in ("xyz", "rpy"):
        if origin is not None and key in origin.attrib:
            xml.numbers(origin, origin.get(key), 3, f"{key} of {of}")


def _check_joint(xml: XmlFile, joint: Element, of: str, links: Mapping[str, Element]) -> None:
    types = (*MOVING, "fixed", "floating", "planar")
    # Attributes of a joint's elements that contain a single number.
    numbers = {
        "limit": ("lower", "upper", "effort", "velocity"),
        "dynamics": ("damping", "friction"),
        "mimic": ("multiplier", "offset"),
        "safety_controller": ("soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"),
        "calibration": ("rising", "falling", "reference_position"),
    }
    kind = joint.get("type")
    if kind not in types:
        xml.refuse(joint, f"{of} has the type '{kind}'; expected one of {', '.join(types)}")
    for end in ("parent", "child"):
        element = xml.only(joint, end, of)
        link = element.get("link") if element is not None else None
        if link not in links:
            xml.refuse(
                joint,
                f"{of} has the {end} link '{link}', which the file does not define; "
                f'add <link name="{link}"/> or remove the joint',
            )
    _check_origin(xml, joint, of)
    axis = xml.first(joint, "axis", of)
    turns = axis is not None and kind not in ("fixed", "floating")
    if axis is not None and turns and not any(xml.numbers(axis, axis.get("xyz"), 3, f"the axis of {of}")):
        xml.refuse(axis, f"{of} has no direction; expected an axis of three finite numbers, not all zero")
    for tag, names in numbers.items():
        element = xml.first(joint, tag, of)
        for name in names:
            if element is not None and name in element.attrib:
                xml.numbers(element, element.get(name), 1, f"{name} of {of}")
    _check_limit(xml, joint, of)


def _check_limit(xml: XmlFile, joint: Element, of: str) -> None:
    """Check the limit of a joint, and repair what Pinocchio refuses."""
    kind, limit = joint.get("type"), joint.find("limit")
    given = () if limit is None else limit.keys()
    if kind in ("revolute", "prismatic") and not {"effort", "velocity"} <= set(given):
        xml.refuse(joint, f'{of} has no limit; write <limit lower="" upper="" effort="" velocity=""/>, or "continuous"')
    if limit is None:
        return
    span = float(limit.get("upper", "inf")) - float(limit.get("lower", "-inf"))
    if kind == "continuous" and span < 2 * np.pi:
        xml.repair("position limits of continuous joints are ignored", of, limit)
    for name in ("effort", "velocity"):
        value = limit.attrib.setdefault(name, "0")
        if float(value) < 0:
            xml.repair("negative limits are used without their sign", f"{name} of {of}", limit)
            limit.set(name, str(abs(float(value))))


def _check_tree(xml: XmlFile, links: Mapping[str, Element], joints: Mapping[str, Element]) -> None:
    """Refuse links with two parents, in a loop, or disconnected from the others."""
    above: dict[str, str] = {}
    for name, joint in joints.items():
        parent, child = (str(end.get("link")) for tag in ("parent", "child") for end in joint.findall(tag))
        if child in above:
            xml.refuse(joint, f"joint '{name}' gives link '{child}' a second parent; expected a tree of links")
        above[child] = parent
    roots = [name for name in links if name not in above]
    if len(roots) > 1:
        xml.refuse(links[roots[1]], f"links '{roots[0]}' and '{roots[1]}' are both roots; expected one tree of links")
    try:
        TopologicalSorter({child: [parent] for child, parent in above.items()}).prepare()
    except CycleError as error:
        xml.refuse(links[name := error.args[1][-1]], f"link '{name}' is in a loop of joints; expected a tree of links")

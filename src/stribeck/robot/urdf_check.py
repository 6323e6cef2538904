"""What a URDF says, checked by link and line before Pinocchio reads it, which drops what it does not understand."""

from xml.etree.ElementTree import Element

import numpy as np

from stribeck.errors import RobotFileError
from stribeck.robot.model_check import LEAST, is_possible
from stribeck.robot.xml_file import MOST_BODIES, MOST_JOINTS, XmlFile, require_few
from stribeck.typing import Array

MOVING = ("revolute", "continuous", "prismatic")
TYPES = (*MOVING, "fixed", "floating", "planar")
MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
NUMBERS: dict[str, tuple[str, ...]] = {
    "limit": ("lower", "upper", "effort", "velocity"),
    "dynamics": ("damping", "friction"),
    "mimic": ("multiplier", "offset"),
    "safety_controller": ("soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"),
    "calibration": ("rising", "falling", "reference_position"),
}
"""Attributes of a joint's elements that are one number each."""


def check_urdf(xml: XmlFile) -> tuple[list[str], dict[str, str]]:
    """Check links, joints, the tree of both, and every number that Pinocchio reads.

    Returns
    -------
    warnings
        What is read otherwise than the file says.
    impossible
        Links whose moments of inertia no rigid body has, by name, with their lines. They are not refused: 14 of the 70
        URDFs of example-robot-data have some, most of them light.

    Raises
    ------
    RobotFileError
        Naming the link or joint and its line.
    """
    root = xml.root
    if not root.get("name"):
        raise RobotFileError(f'{xml.path}: the <robot> element has no name; write <robot name="...">')
    macro = next((element for element in root.iter() if element.tag.startswith("xacro:")), None)
    if macro is not None:
        xml.refuse(macro, f"<{macro.tag}> is a macro; expected the URDF that `xacro` makes of this file")
    require_few(xml, root.findall("link"), MOST_BODIES)
    require_few(xml, [joint for joint in root.findall("joint") if joint.get("type") in MOVING], MOST_JOINTS)
    links, joints = xml.named(root, "link"), xml.named(root, "joint")
    if not links:
        raise RobotFileError(f"{xml.path}: has no <link>; expected a robot's links and joints")
    moments = {name: _check_inertial(xml, link, f"link '{name}'") for name, link in links.items()}
    for name, joint in joints.items():
        _check_joint(xml, joint, f"joint '{name}'", links)
    _check_tree(xml, links, joints)
    coupled = sorted(name for name in moving_joints(root) if joints[name].find("mimic") is not None)
    warnings = [f"{xml.path.name}: mimic joints are taken as independent: {', '.join(coupled)}"] if coupled else []
    impossible = {name: f"line {xml.lines[links[name]]}" for name in links if not is_possible(moments[name])}
    return warnings, impossible


def keep_dynamics(root: Element) -> None:
    """Take away what is drawn or collides, and extensions: Pinocchio would complain of what is wrong there."""
    for element in list(root):
        if element.tag not in ("link", "joint"):
            root.remove(element)
    for link in root.findall("link"):
        for element in list(link):
            if element.tag != "inertial":
                link.remove(element)


def moving_joints(root: Element) -> set[str]:
    """Return the names of the joints of a URDF that have one degree of freedom."""
    return {str(joint.get("name")) for joint in root.findall("joint") if joint.get("type") in MOVING}


def total_mass(root: Element) -> float:
    """Return the mass of all links [kg]."""
    return sum(float(element.get("value", "nan")) for element in root.findall("link/inertial/mass"))


def _check_inertial(xml: XmlFile, link: Element, of: str) -> Array:
    """Return a link's moments of inertia, shape (3, 3); zero if it is a mere frame."""
    inertial = xml.only(link, "inertial", of)
    if inertial is None:
        return np.zeros((3, 3))
    mass, inertia = xml.only(inertial, "mass", of), xml.only(inertial, "inertia", of)
    if mass is None or inertia is None:
        missing = "mass" if mass is None else "inertia"
        xml.refuse(inertial, f"{of} has an <inertial> without <{missing}>; expected <mass>, <inertia> and <origin>")
    (kilograms,) = xml.numbers(mass, mass.get("value"), 1, f"the mass of {of}")
    if kilograms < 0:
        xml.refuse(mass, f"{of} has a mass of {kilograms:g} kg; expected zero or more")
    xx, xy, xz, yy, yz, zz = (xml.numbers(inertia, inertia.get(key), 1, f"{key} of {of}")[0] for key in MOMENTS)
    for key, value in (("ixx", xx), ("iyy", yy), ("izz", zz)):
        if value < -LEAST:
            xml.refuse(inertia, f"{key} of {of} is {value:g} kg m^2; expected zero or more")
    _check_origin(xml, inertial, of)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _check_origin(xml: XmlFile, parent: Element, of: str) -> None:
    origin = xml.only(parent, "origin", of)
    for key in ("xyz", "rpy"):
        if origin is not None and key in origin.attrib:
            xml.numbers(origin, origin.get(key), 3, f"{key} of {of}")


def _check_joint(xml: XmlFile, joint: Element, of: str, links: dict[str, Element]) -> None:
    kind = joint.get("type")
    if kind not in TYPES:
        xml.refuse(joint, f"{of} has the type '{kind}'; expected one of {', '.join(TYPES)}")
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
    axis = xml.only(joint, "axis", of)
    if (
        axis is not None
        and kind not in ("fixed", "floating")
        and not any(xml.numbers(axis, axis.get("xyz"), 3, f"the axis of {of}"))
    ):
        xml.refuse(axis, f"{of} has no direction; expected an axis of three finite numbers, not all zero")
    for tag, names in NUMBERS.items():
        element = xml.only(joint, tag, of)
        for name in names:
            if element is not None and name in element.attrib:
                xml.numbers(element, element.get(name), 1, f"{name} of {of}")
    limit = joint.find("limit")
    if kind in ("revolute", "prismatic") and (limit is None or not {"effort", "velocity"} <= set(limit.keys())):
        xml.refuse(joint, f'{of} has no limit; write <limit lower="" upper="" effort="" velocity=""/>, or "continuous"')


def _check_tree(xml: XmlFile, links: dict[str, Element], joints: dict[str, Element]) -> None:
    """Refuse links that are no tree: with two parents, in a loop, or apart from the others."""
    above: dict[str, str] = {}
    for name, joint in joints.items():
        parent, child = (str(end.get("link")) for tag in ("parent", "child") for end in joint.findall(tag))
        if child in above:
            xml.refuse(joint, f"joint '{name}' gives link '{child}' a second parent; expected a tree of links")
        above[child] = parent
    roots = [name for name in links if name not in above]
    if len(roots) > 1:
        xml.refuse(links[roots[1]], f"link '{roots[1]}' is a root, as '{roots[0]}' is; expected one tree of links")
    below: dict[str, list[str]] = {}
    for child, parent in above.items():
        below.setdefault(parent, []).append(child)
    reached, pending = set(), roots
    while pending:
        link = pending.pop()
        reached.add(link)
        pending += below.get(link, [])
    for name in links:
        if name not in reached:
            xml.refuse(links[name], f"link '{name}' is in a loop of joints; expected a tree of links")

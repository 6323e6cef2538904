"""Reads the tree of an SDF model: links and joints with their poses, in whatever frames these are given.

Pinocchio's Python package has no SDF reader. Loops that SDF describes by a second parent of a link, and gearboxes, are
left out with a warning: what stays is the tree that the joint encoders see. What else this reader does not understand
is refused by name, so that nothing is read otherwise than the file says (sdformat.org/spec, versions 1.4 to 1.12). The
pose of the model itself has no effect: gravity is given in the frame of a fixed base.
"""

import math
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element

import numpy as np
import pinocchio as pin

from stribeck.errors import RobotFileError
from stribeck.robot.model_check import LEAST, check_inertias, is_possible
from stribeck.robot.xml_file import DEEPEST, MOST_BODIES, MOST_JOINTS, XmlFile, require_few
from stribeck.typing import Array

MOVING = ("revolute", "continuous", "prismatic")
READ: dict[str, tuple[str, ...]] = {
    "sdf": ("model", "world"),
    "world": ("model",),
    "model": ("link", "joint", "frame", "pose", "static"),
    "link": ("pose", "inertial", "gravity", "kinematic"),
    "frame": ("pose",),
    "inertial": ("pose", "mass", "inertia"),
    "inertia": ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"),
    "joint": ("pose", "parent", "child", "axis"),
    "axis": ("xyz", "use_parent_model_frame"),
}
"""What is read of an element."""
WITHOUT_EFFECT: dict[str, tuple[str, ...]] = {
    "world": (
        *("light", "physics", "scene", "gui", "plugin", "gravity", "magnetic_field", "atmosphere", "wind", "audio"),
        "spherical_coordinates",
    ),
    "model": ("self_collide", "allow_auto_disable", "enable_wind", "plugin"),
    "link": (
        *("visual", "collision", "sensor", "light", "self_collide", "enable_wind", "must_be_base_link", "battery"),
        *("velocity_decay", "audio_source", "audio_sink", "projector", "particle_emitter"),
    ),
    "joint": ("physics", "sensor"),
    "axis": ("limit", "dynamics", "initial_position"),
}
"""What may stand in an element and changes no rigid-body dynamics; gravity is the robot file's."""
ATTRIBUTES: dict[str, tuple[str, ...]] = {
    "sdf": ("version",),
    "world": ("name",),
    "model": ("name", "canonical_link"),
    "link": ("name",),
    "frame": ("name", "attached_to"),
    "joint": ("name", "type"),
    "pose": ("relative_to", "degrees", "rotation_format"),
    "xyz": ("expressed_in",),
}
"""Attributes that are understood; others are refused unless they are empty or declare a namespace."""
MANY = ("world", "model", "link", "joint", "frame")
"""What an element may hold several of; each is looked at by itself."""
FLAGS = {"static": False, "kinematic": False, "gravity": True}
"""What makes a link or a model other than a body that moves under gravity, unless it is so."""
TRUE, FALSE = ("true", "True", "1"), ("false", "False", "0")
AXES_IN_MODEL = ("1.0", "1.2", "1.3", "1.4")
"""Versions in which a joint's axis is given in the model's frame."""
MODEL_FRAME = "__model__"


def build_from_sdf(xml: XmlFile, root: pin.JointModelFreeFlyer | None) -> tuple[pin.Model, list[str]]:
    """Return the tree of the file's model, and warnings for what was left out or is SDF's default.

    Raises
    ------
    RobotFileError
        If the file holds no model or several, its links do not form a tree, or it has what is not understood.
    """
    file = _Sdf(xml, _only_model(xml))
    links = file.links
    tree, left_out = _tree(file)
    for joint in tree.values():
        _require_understood(xml, joint)
    model = pin.Model()
    model.name = str(file.model.get("name") or xml.path.stem)
    children = {_text(joint, "child") for joint in file.joints.values()}
    base = next((name for name in links if name not in children), None)
    if base is None:
        raise RobotFileError(f"{xml.path}: no link is the root: every link has a parent")
    poses = {name: file.pose(link) for name, link in links.items()}
    placed = {base: (model.addJoint(0, root, pin.SE3.Identity(), "root_joint") if root else 0, poses[base])}
    pending = _children(tree, base)
    while pending:  # depth first, as Pinocchio's recursions need
        child = pending.pop()
        joint = tree[child]
        parent, frame_of_parent = placed[_text(joint, "parent")]
        if joint.get("type") == "fixed":
            placed[child] = (parent, frame_of_parent)
        else:
            joint_pose = file.pose(joint)
            prismatic = joint.get("type") == "prismatic"
            kind = pin.JointModelPrismaticUnaligned if prismatic else pin.JointModelRevoluteUnaligned
            placement = frame_of_parent.actInv(joint_pose)
            new = model.addJoint(parent, kind(file.axis(joint, joint_pose)), placement, str(joint.get("name")))
            model.addJointFrame(new)  # what Pinocchio needs to lock a joint
            placed[child] = (new, joint_pose)
        pending += _children(tree, child)
    impossible, by_default = {}, []
    for name, link in links.items():
        if name not in placed:
            left_out.append(f"link '{name}'")
            continue
        carrier, frame = placed[name]
        inertia, whole = file.inertia(link, moves=carrier > 0)
        if not whole:
            by_default.append(f"'{name}' (line {xml.lines[link]})")
        if not is_possible(inertia.inertia):
            impossible[name] = f"line {xml.lines[link]}"
        placement = frame.actInv(poses[name])
        model.appendBodyToJoint(carrier, inertia, placement)
        model.addFrame(pin.Frame(name, carrier, 0, placement, pin.FrameType.BODY, inertia), False)
    warnings = [f"{xml.path.name}: left out of the tree: {', '.join(left_out)}"] if left_out else []
    if by_default:
        warnings.append(
            f"{xml.path.name}: these links state no mass or no moments, and have 1 kg or 1 kg m^2, as SDF says: "
            + ", ".join(by_default)
        )
    return model, warnings + check_inertias(model.name, model, impossible)


def _only_model(xml: XmlFile) -> Element:
    """Return the file's one model; joints, of which some are left out, are not looked at yet."""
    models = list(xml.root.iter("model"))
    if not models:
        raise RobotFileError(f"{xml.path}: holds no <model>")
    if len(models) > 1:
        xml.refuse(models[1], f"model '{models[1].get('name')}' follows '{models[0].get('name')}'; expected one model")
    for element in (xml.root, *xml.root.findall("world"), models[0], *models[0].findall("link")):
        _require_understood(xml, element)
    for frame in models[0].findall("frame"):
        _require_understood(xml, frame)
    return models[0]


def _require_understood(xml: XmlFile, element: Element) -> None:
    """Refuse an element, or what is read of it, where that is not understood."""
    tag = element.tag
    for name, value in element.attrib.items():
        if value and name not in ATTRIBUTES.get(tag, ()) and not name.startswith("xmlns"):
            xml.refuse(element, f'<{tag}> has the attribute {name}="{value[:60]}", which is not understood; remove it')
    read, ignored = READ.get(tag, ()), WITHOUT_EFFECT.get(tag, ())
    for child in element:
        if child.tag in read:
            if child.tag not in MANY:
                xml.only(element, child.tag, f"<{tag}>")
                _require_understood(xml, child)
        elif child.tag not in ignored:
            known = ", ".join(f"<{name}>" for name in (*read, *ignored)) or "plain text"
            xml.refuse(child, f"<{child.tag[:60]}> in <{tag}> is not understood; expected {known}")
    for name, usual in FLAGS.items():
        if name in read and _flag(xml, element, name, usual) != usual:
            xml.refuse(element, f"<{tag}> sets <{name}> to {str(not usual).lower()}; expected {str(usual).lower()}")


@dataclass(eq=False)
class _Sdf:
    """A model's elements by name, and their poses in its frame."""

    xml: XmlFile
    model: Element
    _open: list[Element] = field(default_factory=list)
    """Whose pose is being looked for, each relative to the next."""

    def __post_init__(self) -> None:
        require_few(self.xml, self.model.findall("link"), MOST_BODIES)
        moving = [joint for joint in self.model.findall("joint") if joint.get("type") in MOVING]
        require_few(self.xml, moving, MOST_JOINTS)
        self.links, self.joints, self.frames = (self.xml.named(self.model, tag) for tag in ("link", "joint", "frame"))

    def pose(self, element: Element) -> pin.SE3:
        """Return the pose of a link, joint or frame in the model's frame."""
        if element in self._open or len(self._open) > DEEPEST:
            self.xml.refuse(
                element, f"the pose of '{element.get('name')}' is relative to itself, or to too many frames"
            )
        usual = {"joint": _text(element, "child"), "frame": element.get("attached_to")}.get(element.tag)
        given = element.find("pose")
        self._open.append(element)
        relative_to = (given.get("relative_to") if given is not None else None) or usual
        found = self._frame(relative_to, element) * self._given_pose(element)
        self._open.pop()
        return found

    def _frame(self, name: str | None, element: Element) -> pin.SE3:
        """Return the pose of what an element names, the model's own frame if it names nothing."""
        if not name or name == MODEL_FRAME:
            return pin.SE3.Identity()
        places = [part[name] for part in (self.links, self.joints, self.frames) if name in part]
        if len(places) != 1:
            found = "no link, joint or frame" if not places else f"{len(places)} elements"
            self.xml.refuse(
                element, f"'{element.get('name')}' refers to '{name}', which is {found}; expected the name of one"
            )
        return self.pose(places[0])

    def _given_pose(self, element: Element) -> pin.SE3:
        """Return the pose that an element states, in whatever frame that is."""
        given = element.find("pose")
        if given is None or not (given.text or "").strip():
            return pin.SE3.Identity()
        of = f"the pose of <{element.tag}>"
        if given.get("rotation_format", "euler_rpy") == "quat_xyzw":
            *place, x, y, z, w = self.xml.numbers(given, given.text, 7, of)
            length = math.hypot(x, y, z, w)
            if not abs(length - 1) < 1e-3:
                self.xml.refuse(given, f"{of} has a quaternion of length {length:g}; expected 1")
            return pin.SE3(pin.Quaternion(*(part / length for part in (w, x, y, z))).matrix(), np.array(place))
        if given.get("rotation_format", "euler_rpy") != "euler_rpy":
            self.xml.refuse(given, f"{of} has a rotation_format other than 'euler_rpy' and 'quat_xyzw'")
        *place, roll, pitch, yaw = self.xml.numbers(given, given.text, 6, of)
        turn = np.array([roll, pitch, yaw])
        if given.get("degrees", "false") in TRUE:
            turn = np.radians(turn)
        return pin.SE3(pin.rpy.rpyToMatrix(*turn), np.array(place))

    def axis(self, joint: Element, pose: pin.SE3) -> Array:
        """Return a joint's unit axis in its own frame; SDF 1.4 gives it in the model's, later versions on demand."""
        name, xyz = joint.get("name"), joint.find("axis/xyz")
        axis = np.array([0.0, 0.0, 1.0])
        if xyz is not None:
            axis = np.array(self.xml.numbers(xyz, xyz.text, 3, f"the axis of joint '{name}'"))
        given_in = joint.find("axis")
        in_model = given_in is not None and _flag(
            self.xml, given_in, "use_parent_model_frame", self.xml.root.get("version") in AXES_IN_MODEL
        )
        expressed_in = xyz.get("expressed_in") if xyz is not None else None
        if expressed_in:
            axis = pose.rotation.T @ self._frame(expressed_in, joint).rotation @ axis
        elif in_model:
            axis = pose.rotation.T @ axis
        length = np.linalg.norm(axis)
        if not 0 < length < np.inf:
            self.xml.refuse(joint, f"joint '{name}' has the axis {axis}; expected finite numbers, not all zero")
        return np.asarray(axis / length)

    def inertia(self, link: Element, *, moves: bool) -> tuple[pin.Inertia, bool]:
        """Return a link's inertia in its frame, and whether the file states all of it."""
        of, inertial = f"link '{link.get('name')}'", link.find("inertial")
        if inertial is None:
            if moves:
                self.xml.refuse(
                    link, f"{of} has no <inertial>, which is 1 kg and 1 kg m^2 in SDF; state them, 0 of a mere frame"
                )
            return pin.Inertia.Zero(), True
        moments = inertial.find("inertia")
        places = {"mass": inertial.find("mass")} | {
            key: None if moments is None else moments.find(key) for key in READ["inertia"]
        }
        values = {"mass": 1.0, "ixx": 1.0, "iyy": 1.0, "izz": 1.0, "ixy": 0.0, "ixz": 0.0, "iyz": 0.0}
        stated = {
            key: self.xml.numbers(place, place.text, 1, f"{key} of {of}")[0]
            for key, place in places.items()
            if place is not None
        }
        values |= stated
        if values["mass"] < 0:
            self.xml.refuse(inertial, f"{of} has a mass of {values['mass']:g} kg; expected zero or more")
        for key in ("ixx", "iyy", "izz"):
            if values[key] < -LEAST:
                self.xml.refuse(inertial, f"{key} of {of} is {values[key]:g} kg m^2; expected zero or more")
        mass, xx, yy, zz, xy, xz, yz = values.values()
        matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        inertia = self._given_pose(inertial).act(pin.Inertia(mass, np.zeros(3), matrix))
        return inertia, {"mass", "ixx", "iyy", "izz"} <= set(stated)


def _tree(file: _Sdf) -> tuple[dict[str, Element], list[str]]:
    """Return the joint that leads to each link, and the joints that would close a loop."""
    tree: dict[str, Element] = {}
    left_out = []
    for name, joint in file.joints.items():
        child, parent = _text(joint, "child"), _text(joint, "parent")
        if joint.get("type") not in (*MOVING, "fixed") or child in tree:
            left_out.append(f"{joint.get('type')} joint '{name}'")
        elif child not in file.links or parent not in file.links:
            file.xml.refuse(joint, f"joint '{name}' connects '{parent}' and '{child}', which are not both links")
        else:
            tree[child] = joint
    return tree, left_out


def _children(tree: dict[str, Element], parent: str) -> list[str]:
    """Return the links that hang on a link, last first."""
    return [child for child, joint in tree.items() if _text(joint, "parent") == parent][::-1]


def _text(element: Element, tag: str) -> str:
    found = element.find(tag)
    return (found.text or "").strip() if found is not None else ""


def _flag(xml: XmlFile, element: Element, tag: str, usual: bool) -> bool:
    """Return a flag, `usual` where it is not stated."""
    text = _text(element, tag)
    if text and text not in (*TRUE, *FALSE):
        xml.refuse(element, f"<{tag}> is '{text[:60]}'; expected true or false")
    return text in TRUE if text else usual

"""Reads the tree part of an SDF model (poses of links in the model frame, as Gazebo and Drake write them).

Pinocchio's Python package has no SDF reader. Loops that SDF describes by a second parent of a link, and gearboxes, are
left out with a warning: what stays is the tree that the joint encoders see.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from stribeck.errors import RobotFileError

MOVING = ("revolute", "continuous", "prismatic")


def build_from_sdf(path: Path, root: pin.JointModelFreeFlyer | None) -> tuple[pin.Model, list[str]]:
    """Return the tree of the file's first model, and warnings for what was left out.

    Raises
    ------
    RobotFileError
        If the file holds no model, or its links do not form a tree.
    """
    element = ElementTree.parse(path).getroot().find(".//model")
    if element is None:
        raise RobotFileError(f"{path}: holds no <model>")
    links = {str(link.get("name")): link for link in element.findall("link")}
    poses = {name: _pose(link) for name, link in links.items()}
    tree, left_out = _tree(element, path, links)
    model = pin.Model()
    model.name = str(element.get("name", path.stem))
    children = {_text(joint, "child") for joint in element.findall("joint")}
    base = next((name for name in links if name not in children), None)
    if base is None:
        raise RobotFileError(f"{path}: no link is the root: every link has a parent")
    placed = {base: (model.addJoint(0, root, pin.SE3.Identity(), "root_joint") if root else 0, poses[base])}
    pending = _children(tree, base)
    while pending:  # depth first, as Pinocchio's recursions need
        child = pending.pop()
        joint = tree[child]
        parent, frame_of_parent = placed[_text(joint, "parent")]
        if joint.get("type") == "fixed":
            placed[child] = (parent, frame_of_parent)
        else:
            joint_pose = poses[child] * _pose(joint)
            prismatic = joint.get("type") == "prismatic"
            kind = pin.JointModelPrismaticUnaligned if prismatic else pin.JointModelRevoluteUnaligned
            placement = frame_of_parent.actInv(joint_pose)
            new = model.addJoint(parent, kind(_axis(joint, joint_pose)), placement, str(joint.get("name")))
            model.addJointFrame(new)  # what Pinocchio needs to lock a joint
            placed[child] = (new, joint_pose)
        pending += _children(tree, child)
    for name, link in links.items():
        if name not in placed:
            left_out.append(f"link '{name}'")
            continue
        carrier, frame = placed[name]
        model.appendBodyToJoint(carrier, _inertia(link, path), frame.actInv(poses[name]))
        model.addBodyFrame(name, carrier, frame.actInv(poses[name]), 0)
    warnings = [f"{path.name}: left out of the tree: {', '.join(left_out)}"] if left_out else []
    return model, warnings


def _tree(
    model: ElementTree.Element, path: Path, links: dict[str, ElementTree.Element]
) -> tuple[dict[str, ElementTree.Element], list[str]]:
    """Return the joint that leads to each link, and the joints that would close a loop."""
    tree: dict[str, ElementTree.Element] = {}
    left_out = []
    for joint in model.findall("joint"):
        child, parent = _text(joint, "child"), _text(joint, "parent")
        name = str(joint.get("name"))
        if joint.get("type") not in (*MOVING, "fixed") or child in tree:
            left_out.append(f"{joint.get('type')} joint '{name}'")
        elif child not in links or parent not in links:
            raise RobotFileError(f"{path}: joint '{name}' connects '{parent}' and '{child}', which are not both links")
        else:
            tree[child] = joint
    return tree, left_out


def _children(tree: dict[str, ElementTree.Element], parent: str) -> list[str]:
    """Return the links that hang on a link, last first."""
    return [child for child, joint in tree.items() if _text(joint, "parent") == parent][::-1]


def _text(element: ElementTree.Element, tag: str, default: str = "") -> str:
    found = element.find(tag)
    return (found.text or default).strip() if found is not None else default


def _numbers(text: str, count: int) -> np.ndarray:
    values = np.array([float(word) for word in text.split()])
    if values.shape != (count,):
        raise ValueError(f"expected {count} numbers, found '{text}'")
    return values


def _pose(element: ElementTree.Element) -> pin.SE3:
    x, y, z, roll, pitch, yaw = _numbers(_text(element, "pose", "0 0 0 0 0 0"), 6)
    return pin.SE3(pin.rpy.rpyToMatrix(roll, pitch, yaw), np.array([x, y, z]))


def _axis(joint: ElementTree.Element, joint_pose: pin.SE3) -> np.ndarray:
    """Return the unit axis in the joint's frame; SDF 1.4 gives it in the model's frame, later versions on demand."""
    axis = _numbers(_text(joint, "axis/xyz", "0 0 1"), 3)
    if _text(joint, "axis/use_parent_model_frame", "0") in ("1", "true"):
        axis = joint_pose.rotation.T @ axis
    length = np.linalg.norm(axis)
    if not 0 < length < np.inf:
        raise ValueError(f"joint '{joint.get('name')}' has the axis {axis}, expected finite numbers, not all zero")
    return np.asarray(axis / length)


def _inertia(link: ElementTree.Element, path: Path) -> pin.Inertia:
    inertial = link.find("inertial")
    if inertial is None:
        return pin.Inertia.Zero()
    ixx, iyy, izz, ixy, ixz, iyz = (
        float(_text(inertial, f"inertia/{key}", "0")) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    )
    matrix = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    mass = float(_text(inertial, "mass", "0"))
    if not mass >= 0:
        raise RobotFileError(f"{path}: link '{link.get('name')}' has a mass of {mass} kg; expected zero or more")
    pose = _pose(inertial)
    return pose.act(pin.Inertia(mass, np.zeros(3), matrix))

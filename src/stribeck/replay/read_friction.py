"""Reads the joint friction of a model file: `<dynamics>` of URDF and SDF, and what an MJCF states."""

from pathlib import Path
from xml.etree.ElementTree import Element

from stribeck.replay.model_friction import JointFriction, StatedFriction
from stribeck.robot.model_file import kind_of
from stribeck.robot.xml_file import XmlFile, read_xml

TERMS = {"friction": "coulomb", "damping": "viscous"}
"""Of `<dynamics>`."""


def read_friction(path: Path) -> StatedFriction:
    """Return the friction of a model file.

    Raises
    ------
    RobotFileError
        If the file cannot be read, or a number is none or negative.
    """
    if kind_of(path) == "mjcf":
        from stribeck.replay.mjcf_friction import read_mjcf_friction

        return read_mjcf_friction(path)
    xml = read_xml(path)
    joints = {
        joint.get("name", ""): joint for joint in xml.root.iter("joint") if joint.get("type")
    }  # no transmission's
    return StatedFriction(joints={name: _of_dynamics(xml, element, name) for name, element in joints.items()})


def _of_dynamics(xml: XmlFile, joint: Element, name: str) -> JointFriction:
    """Return what `<dynamics>` of a joint of a URDF, or of the axis of a joint of an SDF, says."""
    values = {}
    for dynamics in joint.iter("dynamics"):
        stated = dict(dynamics.items()) | {child.tag: child.text or "" for child in dynamics}
        values = {TERMS[key]: _amount(xml, dynamics, key, text, name) for key, text in stated.items() if key in TERMS}
    return JointFriction(**values)


def _amount(xml: XmlFile, dynamics: Element, key: str, text: str, joint: str) -> float:
    (value,) = xml.numbers(dynamics, text, 1, f"{key} of joint '{joint}'")
    if value < 0:
        xml.refuse(dynamics, f"{key} of joint '{joint}' is {text.strip()}; expected zero or more")
    return value

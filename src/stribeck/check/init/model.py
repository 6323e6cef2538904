"""Facts about a robot from its model: whether the base moves, and which frames are feet."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal
from xml.etree.ElementTree import Element

import numpy as np
import pinocchio as pin

from stribeck.check.init.names import words
from stribeck.core.robot import Contact
from stribeck.core.robot.model_file import joint_names, load_model
from stribeck.core.robot.rolling_radius import ball_beside, rolling_radius
from stribeck.core.robot.rooting import WORLD_JOINT, is_on_axis, position_range
from stribeck.core.robot.xml_file import read_xml

FOOT = {"sole": 4.0, "foot": 3.0, "feet": 3.0, "wheel": 3.0, "toe": 2.0, "ankle": 1.0}
"""Words in names of foot frames, with a score: larger for frames more likely to touch the ground."""


@dataclass(frozen=True, kw_only=True)
class ModelFacts:
    """Joints and feet of a model.

    Attributes
    ----------
    joints
        Names of the joints with one degree of freedom, in the model's order.
    range
        Lowest and highest position of every joint [rad] or [m].
    base, evidence
        Whether the base moves, and the reason.
    feet
        Contacts with their suggested names.
    tilted
        Names of contacts whose z axis does not point up with all joints at zero.
    wheels
        Joints of the contacts that are wheels of the base, without legs.
    """

    joints: tuple[str, ...]
    range: dict[str, tuple[float, float]]
    base: Literal["floating", "fixed"]
    evidence: str
    feet: tuple[Contact, ...]
    tilted: tuple[str, ...]
    wheels: tuple[str, ...]


def read_model(path: Path) -> ModelFacts:
    """Find joints and feet in a model file.

    Raises
    ------
    RobotFileError
        If it cannot be read.
    """
    xml = read_xml(path)
    kind, root = xml.kind, xml.root
    model, _ = load_model(path, "floating")
    limits = {name: position_range(model, model.getJointId(name)) for name in joint_names(model)}
    free = kind == "mjcf" and str(model.names[1]) != WORLD_JOINT
    feet, tilted, wheels = _find_feet(path, model, root, free)
    base: Literal["floating", "fixed"] = "fixed"
    links = [link.get("name", "") for link in root.iter("link")]
    children = {child.get("link", "") for child in root.iter("child")}
    ground = ("world", "map", "odom", "universe", "ground")
    fixed_to = [name for name in links if name not in children and name.lower() in ground] if kind == "urdf" else []
    if free:
        base, evidence = "floating", "the model has a free joint"
    elif feet and len(wheels) == len(feet):
        evidence = f"the model's base has wheels, {', '.join(wheels)}"
    elif len(feet) > 1 and not fixed_to:
        base, evidence = "floating", "the model has feet, " + ", ".join(foot.frame for foot in feet)
    else:
        evidence = f"the model's root is '{fixed_to[0]}'" if fixed_to else "the model has no feet"
    single = tuple(name for name in limits if model.joints[model.getJointId(name)].nv == 1)
    return ModelFacts(
        joints=single, range=limits, base=base, evidence=evidence, feet=feet, tilted=tilted, wheels=wheels
    )


def _balls(path: Path, model: pin.Model, data: pin.Data, root: Element, free: bool) -> set[str]:
    """Collect the names of links that are balls, and if the base is free, of sites within balls and bodies with one.

    Only the ends of limbs count. The ball of a body is below the last joints of all limbs, unlike a hand.
    """
    links = {link.get("name", "") for link in root.iter("link") if _is_ball(link)}
    ends = set(range(2, model.njoints)) - set(model.parents) if free else set()
    lowest = min((float(data.oMi[joint].translation[2]) for joint in ends), default=0.0)
    for index, frame in enumerate(model.frames):
        name = str(frame.name)
        if frame.parentJoint not in ends or frame.type == pin.FrameType.JOINT:
            continue
        if frame.type == pin.FrameType.OP_FRAME and rolling_radius(path, name, "point"):
            links.add(name)
        elif frame.type == pin.FrameType.BODY and (ball := ball_beside(path, name)):
            links |= {name} if float(data.oMf[index].act(ball[1])[2]) < lowest else set()
    return links


def _is_ball(link: Element) -> bool:
    """Return whether a URDF link has a single collision sphere; four spheres are the corners of a sole."""
    return [shape.tag for geometry in link.findall("collision/geometry") for shape in geometry] == ["sphere"]


def _find_feet(
    path: Path, model: pin.Model, root: Element, free: bool
) -> tuple[tuple[Contact, ...], tuple[str, ...], tuple[str, ...]]:
    """Find the contact frame of each leg, named after the leg's side; tilted contacts, and joints of base wheels.

    In a model with a free joint, a ball at the end of a leg is a foot by any name.
    """
    accessories = {"imu", "sensor", "ft", "force", "rotor", "cover", "fixed", "lower", "mount", "camera"}
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    balls = _balls(path, model, data, root, free)
    parents = set(list(model.parents)[1:])
    limited = [joint for joint in range(2, model.njoints) if np.isfinite(position_range(model, joint)).all()]
    best: dict[int, tuple[float, int]] = {}
    for index, frame in enumerate(model.frames):
        joint = int(frame.parentJoint)
        named = [FOOT[word] for word in words(str(frame.name)) if word in FOOT]
        named += [0.5 if frame.type == pin.FrameType.BODY else 1.0] * (free and str(frame.name) in balls)
        if frame.type == pin.FrameType.JOINT or not named or joint in parents or joint < 2:
            continue
        up = abs(float(data.oMf[index].rotation[2, 2]))
        score = max(named) - 0.6 * len(accessories & set(words(str(frame.name)))) + 0.3 * (up > 0.9)  # nearly vertical
        score += 0.2 * (frame.type != pin.FrameType.FIXED_JOINT)
        best[joint] = max(best.get(joint, (float("-inf"), 0)), (score, -index))
    frames = {joint: model.frames[-index] for joint, (_, index) in best.items()}
    names = short_names([str(frame.name) for frame in frames.values()])
    contacts, tilted, wheels = [], [], []
    for (joint, frame), name in zip(frames.items(), names, strict=True):
        others = {above for other in frames if other != joint for above in model.supports[other]}
        leg = set(model.supports[joint]) - others - {0, 1}
        # A leg with at least five joints can place a sole flat on the ground.
        point = len(leg) < 5 or str(frame.name) in balls
        # The axle of a wheel is unlimited in a model whose other joints have limits, and the frame lies on the axle.
        rolls = is_on_axis(model, frame) and joint not in limited and len(limited) > 0
        kind: Literal["wheel", "point", "surface"] = "wheel" if rolls else "point" if point else "surface"
        on_base = len(model.supports[joint]) < 5  # no leg: world, base, and at most two joints
        if on_base and rolls:
            wheels.append(str(model.names[joint]))
        elif on_base and "wheel" in words(str(frame.name)):
            continue
        radius = 0.0 if on_base or kind == "surface" else rolling_radius(path, str(frame.name), kind)
        contacts.append(Contact(name, str(frame.name), kind, radius))
        if not (point or rolls) and data.oMf[model.getFrameId(frame.name)].rotation[2, 2] < 0.9:
            tilted.append(name)
    return tuple(contacts), tuple(tilted), tuple(wheels)


def short_names(frames: Sequence[str]) -> list[str]:
    """Shorten frame names by the words that they all share, if the result is unique."""
    parts = [[part for part in re.split(r"[^A-Za-z0-9]+", frame) if part] for frame in frames]
    common = set.intersection(*(set(part) for part in parts)) if len(parts) > 1 else set()
    short = ["_".join(part for part in pieces if part not in common) for pieces in parts]
    return short if all(short) and len(set(short)) == len(short) else list(frames)

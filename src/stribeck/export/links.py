"""The links of a model file behind the bodies that were corrected, and their new inertias.

Pinocchio makes one body of all links that are fixed to each other, or whose joints the robot file locks. A log cannot
distinguish these, so they share the correction.
"""

from collections import defaultdict
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from stribeck.errors import SettingsError
from stribeck.export.sharing import share
from stribeck.inertial_parameters import pseudo_inertia
from stribeck.result import BodyCorrection, Corrections
from stribeck.typing import Array

SAME = 1e-9
"""Largest relative difference of inertias that counts as the same model [1]."""

LEAST_MASS, LARGEST = 1e-9, 1e9
"""Of a body [kg], and of its numbers in SI units; beyond them rounding leaves nothing of an inertia."""


@dataclass(frozen=True, eq=False, kw_only=True)
class LinkInertia:
    """A link's inertia: mass [kg], centre in the link's frame [m], (3,), and (3, 3) about the centre [kg m^2]."""

    mass: float
    centre: Array
    inertia: Array


def corrected_links(
    file: pin.Model, tree: pin.Model, corrections: Corrections, where: str
) -> tuple[dict[str, LinkInertia], list[str]]:
    """Return the new inertias by link name, and the joints whose body was found to be impossible.

    An impossible body, as an impossible one of the model can lead to, gets the nearest inertia that is possible.

    Parameters
    ----------
    file
        What Pinocchio reads from the model file.
    tree
        The robot's tree, whose bodies the corrections name by their joints; some joints of the file may be locked.
    corrections
        What was found.
    where
        The model file, for messages.

    Raises
    ------
    SettingsError
        If the model is not the one that the corrections started from, or a body has a mass or size that none has.
    """
    inertias = _inertias_of_links(file)
    poses: dict[int, dict[str, Array]] = defaultdict(dict)
    for frame in tree.frames:
        if frame.type == pin.FrameType.BODY and str(frame.name) in inertias:
            poses[int(frame.parentJoint)][str(frame.name)] = frame.placement.homogeneous
    found: dict[str, LinkInertia] = {}
    mended = []
    for joint, body in corrections.bodies.items():
        _require_a_body(joint, body, where)
        links = poses[_require_same_body(tree, joint, body, where)]
        before = np.stack([pose @ inertias[name] @ pose.T for name, pose in links.items()])
        wanted = _of_body(body, 1)
        after = share(before, wanted)
        if not _agree(after.sum(axis=0), wanted):
            mended.append(joint)
        for name, old, new in zip(links, before, after, strict=True):
            if not np.array_equal(old, new):
                back = np.linalg.inv(links[name])
                found[name] = _link_inertia(back @ new @ back.T)
    return found, mended


def _inertias_of_links(file: pin.Model) -> dict[str, Array]:
    """Return each moving link's pseudo-inertia in its own frame, shape (4, 4).

    Pinocchio keeps those of fixed links; a joint's own link has what they leave of the joint's body. Of an SDF, each
    link's frame has its own.
    """
    inertias: dict[str, Array] = {}
    own: dict[int, tuple[str, Array]] = {}
    rest = [_of_inertia(inertia) for inertia in file.inertias]
    for frame in file.frames:
        joint, pose = int(frame.parentJoint), frame.placement.homogeneous
        if frame.type != pin.FrameType.BODY or joint == 0:
            continue
        carrier = file.frames[frame.parentFrame]
        if frame.inertia.mass > 0:
            inertias[str(frame.name)] = _of_inertia(frame.inertia)
        elif carrier.type == pin.FrameType.FIXED_JOINT:
            inertias[str(frame.name)] = _of_inertia(carrier.inertia)
            rest[joint] = rest[joint] - pose @ inertias[str(frame.name)] @ pose.T
        else:
            own[joint] = str(frame.name), np.linalg.inv(pose)
    return inertias | {name: back @ rest[joint] @ back.T for joint, (name, back) in own.items()}


def _require_a_body(joint: str, body: BodyCorrection, where: str) -> None:
    """Refuse numbers that no arithmetic can make an inertia of; what is merely impossible is mended."""
    numbers = np.concatenate([body.mass, *body.centre_of_mass, *body.inertia])
    if min(body.mass) < LEAST_MASS or np.abs(numbers).max() > LARGEST:
        raise SettingsError(
            f"{where}: the result changes what '{joint}' carries from {body.mass[0]:g} kg to {body.mass[1]:g} kg, "
            f"or has numbers of it beyond {LARGEST:g}; expected a result that 'stribeck identify' wrote"
        )


def _require_same_body(tree: pin.Model, joint: str, body: BodyCorrection, where: str) -> int:
    """Return the index of the joint that carries a body, if the body is the one that was corrected."""
    index = int(tree.getJointId(joint))
    if index >= tree.njoints:
        raise SettingsError(
            f"{where}: has no joint '{joint}', whose body the result corrects; expected the model that the log was "
            "identified with"
        )
    if not _agree(_of_inertia(tree.inertias[index]), _of_body(body, 0)):
        raise SettingsError(
            f"{where}: what joint '{joint}' carries has not the inertia that the result started from "
            f"({tree.inertias[index].mass:.6g} kg, there {body.mass[0]:.6g} kg); expected the model that the log was "
            "identified with, unchanged"
        )
    return index


def _agree(one: Array, other: Array) -> bool:
    """Return whether two pseudo-inertias are the same; moments of metres and kilograms of links are of one size."""
    return bool(np.abs(one - other).max() <= SAME * np.abs(other).max())


def _of_inertia(inertia: pin.Inertia) -> Array:
    return pseudo_inertia(inertia.toDynamicParameters())


def _of_body(body: BodyCorrection, which: int) -> Array:
    """Return the pseudo-inertia of a body before (0) or after (1), shape (4, 4)."""
    mass, centre = body.mass[which], np.array(body.centre_of_mass[which])
    about_centre = pseudo_inertia(np.array([0.0, 0.0, 0.0, 0.0, *body.inertia[which]]))
    point = np.append(centre, 1.0)
    return about_centre + mass * np.outer(point, point)


def _link_inertia(matrix: Array) -> LinkInertia:
    mass = float(matrix[3, 3])
    centre = matrix[:3, 3] / mass
    moments = matrix[:3, :3] - mass * np.outer(centre, centre)
    return LinkInertia(mass=mass, centre=centre, inertia=np.trace(moments) * np.eye(3) - moments)

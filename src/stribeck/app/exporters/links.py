"""New inertias of a robot, and of a model file's links, from the corrected bodies.

Pinocchio merges links that are fixed to each other, or whose joints the robot file locks, into one body. A log cannot
distinguish them, so they share the correction. Let P be the pseudo-inertia of the body, P' its estimate, and A the
affine map closest to the identity with A P A^T = P'. Link k gets A P_k A^T. The sum is then P', and each link stays
physically possible. Light links keep their inertia, and the heaviest link gets the rest.
"""

from collections import defaultdict
from dataclasses import replace

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array
from stribeck.core.result import BodyCorrection, Corrections
from stribeck.core.result.bodies import agree, body_pseudo_inertia, pseudo_inertia_of, require_same_body
from stribeck.core.robot import Robot
from stribeck.core.robot.model_file import load_model


def corrected_links(robot: Robot, corrections: Corrections) -> tuple[dict[str, pin.Inertia], list[str]]:
    """Compute the new inertias by link name, and list the joints whose estimated body is physically impossible.

    An impossible body, which can result from an impossible body in the model, gets the nearest possible inertia.

    Raises
    ------
    SettingsError
        If the corrections belong to another model, or the mass or size of a body is implausible.
    """
    tree, inertias = robot.tree.model, _inertias_of_links(load_model(robot.model_file, robot.base)[0])
    poses: dict[int, dict[str, Array]] = defaultdict(dict)
    for frame in tree.frames:
        if frame.type == pin.FrameType.BODY and str(frame.name) in inertias:
            poses[int(frame.parentJoint)][str(frame.name)] = frame.placement.homogeneous
    new_inertias: dict[str, pin.Inertia] = {}
    impossible = []
    for joint, body in corrections.bodies.items():
        require_same_body(tree, joint, body, robot.model_path)
        links = poses[int(tree.getJointId(joint))]
        before = np.stack([pose @ inertias[name] @ pose.T for name, pose in links.items()])
        wanted = body_pseudo_inertia(within_reach(body, tree, int(tree.getJointId(joint))), 1)
        after = share(before, wanted)
        if not agree(after.sum(axis=0), wanted):
            impossible.append(joint)
        for (name, pose), old, new in zip(links.items(), before, after, strict=True):
            if not np.array_equal(old, new):
                back = np.linalg.inv(pose)
                new_inertias[name] = pin.Inertia.FromPseudoInertia(pin.PseudoInertia.FromMatrix(back @ new @ back.T))
    return new_inertias, impossible


def within_reach(body: BodyCorrection, tree: pin.Model, joint: int) -> BodyCorrection:
    """Move the center of mass of a body to at most its reach from the joint that carries it.

    The reach is the distance of the farthest joint or frame on the body, or twice that of the model's center of mass,
    and 0.1 m or more.
    """
    places = [tree.jointPlacements[child] for child in range(joint + 1, tree.njoints) if tree.parents[child] == joint]
    places += [frame.placement for frame in tree.frames if frame.parentJoint == joint]
    before, after = map(np.array, body.centre_of_mass)
    distances = [float(np.linalg.norm(place.translation)) for place in places]
    reach = max(0.1, 2 * float(np.linalg.norm(before)), *distances)
    distance = float(np.linalg.norm(after))
    if distance <= reach or not np.any(before != after):
        return body
    return replace(body, centre_of_mass=(body.centre_of_mass[0], tuple((after * reach / distance).tolist())))


def _inertias_of_links(file: pin.Model) -> dict[str, Array]:
    """Compute each moving link's pseudo-inertia in its own frame, shape (4, 4).

    Pinocchio stores the inertias of fixed links; the joint's own link has the rest of the joint's body.
    """
    inertias: dict[str, Array] = {}
    links: dict[int, tuple[str, Array]] = {}
    rest = [pseudo_inertia_of(inertia) for inertia in file.inertias]
    for frame in file.frames:
        joint, pose = int(frame.parentJoint), frame.placement.homogeneous
        if frame.type != pin.FrameType.BODY or joint == 0:
            continue
        carrier = file.frames[frame.parentFrame]
        if frame.inertia.mass > 0:  # read from MJCF
            inertias[str(frame.name)] = pseudo_inertia_of(frame.inertia)
        elif carrier.type == pin.FrameType.FIXED_JOINT:
            inertias[str(frame.name)] = pseudo_inertia_of(carrier.inertia)
            rest[joint] = rest[joint] - pose @ inertias[str(frame.name)] @ pose.T
        else:
            links[joint] = str(frame.name), np.linalg.inv(pose)
    return inertias | {name: back @ rest[joint] @ back.T for joint, (name, back) in links.items()}


def share(links: Array, total: Array) -> Array:
    """Compute the links' new pseudo-inertias, shape (L, 4, 4).

    Their sum is `total`, unless the rest for the heaviest link is physically impossible.

    Parameters
    ----------
    links
        Pseudo-inertias in one frame, shape (L, 4, 4).
    total
        Their new sum, shape (4, 4).
    """
    carrier = _nearest_map(links.sum(axis=0), total)
    masses = links[:, 3, 3]
    heaviest = int(np.argmax(masses))
    for least in (1e-2, 1e-9):  # share of the sum below which links keep their inertia
        shared = links.copy()
        for k in np.flatnonzero(masses > least * masses.sum()):
            shared[k] = possible(carrier @ links[k] @ carrier.T)
        rest = shared[heaviest] + total - shared.sum(axis=0)
        shared[heaviest] = possible(rest)
        if np.array_equal(shared[heaviest], rest):
            break
    return shared


def possible(matrix: Array) -> Array:
    """Project a pseudo-inertia, shape (4, 4), on physically possible second moments.

    Radii of gyration are at least 0.1 mm, because rounding makes a flat link impossible.
    """
    mass, centre, moments = _split(matrix)
    values, axes = np.linalg.eigh(moments)
    least = mass * 1e-4**2  # [kg m^2]
    if values[0] >= least:
        return matrix
    point = np.append(centre, 1.0)
    raised = mass * np.outer(point, point)
    raised[:3, :3] += (axes * np.maximum(values, least)) @ axes.T
    return raised


def _nearest_map(before: Array, after: Array) -> Array:
    """Compute A, shape (4, 4), with A P A^T = P': the optimal transport between the two, with masses scaled."""
    mass, centre, moments = _split(possible(before))
    new_mass, new_centre, new_moments = _split(possible(after))
    root = _root(moments)
    inverse = np.linalg.inv(root)
    turn = inverse @ _root(root @ new_moments @ root) @ inverse
    scale = np.sqrt(new_mass / mass)
    return np.block([[turn, (scale * new_centre - turn @ centre)[:, None]], [np.zeros(3), scale]])


def _root(matrix: Array) -> Array:
    """Compute the square root of a symmetric positive semidefinite matrix, shape (3, 3)."""
    values, axes = np.linalg.eigh(matrix)
    return np.asarray((axes * np.sqrt(np.maximum(values, 0.0))) @ axes.T)


def _split(matrix: Array) -> tuple[float, Array, Array]:
    """Split a pseudo-inertia into mass, center (3,) and second moments about the center (3, 3)."""
    mass = float(matrix[3, 3])
    centre = matrix[:3, 3] / mass
    return mass, centre, matrix[:3, :3] - mass * np.outer(centre, centre)

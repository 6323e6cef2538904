"""Draws from the joint distribution of a result's errors: models that are consistent with the log."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from stribeck.base.typing import Array
from stribeck.friction import get_law
from stribeck.friction.terms import BEYOND_VELOCITY
from stribeck.result import BODY_COORDINATES, BodyCorrection, Corrections, JointResult, ParameterEstimate, Result
from stribeck.robot.inertial_parameters import inertia_of_shape, pseudo_inertia, shape_coordinates

LARGEST = 3.0
"""Largest change of a scale's logarithm [1]; prevents absurd values where the log does not determine a scale."""


def drawn(result: Result, count: int, seed: int = 0) -> Iterator[Result]:
    """Yield results with parameters and inertias drawn from their uncertainty.

    Friction, rotor inertias and bodies are drawn from the joint covariance of their errors, within their bounds; scales
    are drawn in their logarithm. Bodies are drawn in the logarithm of mass, center and shape, so that each stays
    physically possible. For files of earlier versions, joints and bodies are independent and shapes are constant.
    """
    generator = np.random.default_rng(seed)
    labels, root = _root(result)
    for _ in range(count):
        off = dict(zip(labels, (root @ generator.standard_normal(len(labels))).tolist(), strict=True))
        joints = {name: _drawn_joint(name, joint, off) for name, joint in result.joints.items()}
        corrections = result.corrections
        if corrections:
            bodies = {name: _drawn_body(name, body, off) for name, body in corrections.bodies.items()}
            corrections = replace(corrections, bodies=bodies)
        yield replace(result, joints=joints, corrections=corrections)


def _root(result: Result) -> tuple[list[str], Array]:
    """List the labels of all parameters and body coordinates, and compute a root of their errors' correlation.

    The rows of the root have length one. Results are rounded and omit small correlations, so the nearest root is used.
    """
    corrections = result.corrections or Corrections(chi_square=0.0)
    labels = [f"{name}.{parameter}" for name, joint in result.joints.items() for parameter in joint.parameters]
    labels += [f"{name}.{coordinate}" for name in corrections.bodies for coordinate in BODY_COORDINATES]
    place = {label: k for k, label in enumerate(labels)}
    correlation = np.eye(len(labels))
    for name, joint in result.joints.items():
        if (of_joint := joint.correlation_matrix()) is not None:
            own = [place[f"{name}.{parameter}"] for parameter in joint.parameters]
            correlation[np.ix_(own, own)] = np.nan_to_num(of_joint)
    for one, other, value in corrections.correlations:
        if one in place and other in place:
            correlation[place[one], place[other]] = correlation[place[other], place[one]] = value
    values, vectors = np.linalg.eigh(np.clip(correlation, -1.0, 1.0))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return labels, root / np.maximum(np.linalg.norm(root, axis=1, keepdims=True), 1e-12)


def _drawn_joint(joint_name: str, joint: JointResult, off: Mapping[str, float]) -> JointResult:
    known = {parameter.name: parameter for parameter in (*get_law(joint.law).parameters, *BEYOND_VELOCITY)}
    parameters: dict[str, ParameterEstimate] = {}
    for name, found in joint.parameters.items():
        change = off[f"{joint_name}.{name}"]
        error = found.standard_error if np.isfinite(found.standard_error) else 0.0
        own = known.get(name)
        if own is not None and own.logarithmic and found.value > 0:
            value = found.value * float(np.exp(np.clip(change * error / found.value, -LARGEST, LARGEST)))
        else:
            value = found.value + change * error
        low, high = (own.lower, own.upper) if own else (0.0, np.inf)  # a rotor inertia
        parameters[name] = replace(found, value=float(np.clip(value, low, high)))
    return replace(joint, parameters=parameters)


def _drawn_body(name: str, body: BodyCorrection, off: Mapping[str, float]) -> BodyCorrection:
    """Draw mass, center and shape of a body; its inertia about the center is proportional to the mass."""
    (before, mass), (lever, centre), (was, inertia) = body.mass, body.centre_of_mass, body.inertia
    normal = np.array([off[f"{name}.{coordinate}"] for coordinate in BODY_COORDINATES])
    share = float(np.exp(np.clip(normal[0] * body.mass_error / mass, -LARGEST, LARGEST))) if mass > 0 else 1.0
    moved = np.array(centre) + normal[1:4] * np.array(body.centre_of_mass_error)
    about_centre = np.array(inertia)
    if body.shape_error is not None and mass > 0:
        shape = shape_coordinates(pseudo_inertia(np.array([mass, 0.0, 0.0, 0.0, *inertia])))
        if np.isfinite(shape).all():  # physically possible
            change = normal[4:] * np.array(body.shape_error)
            change[:3] = np.clip(change[:3], -LARGEST, LARGEST)
            with np.errstate(over="ignore"):  # implausible values are refused on writing
                about_centre = inertia_of_shape(mass, shape + change)
    return replace(
        body,
        mass=(before, share * mass),
        centre_of_mass=(lever, tuple(moved.tolist())),
        inertia=(was, tuple((share * about_centre).tolist())),
    )

"""A result whose parameters and bodies are moved from their estimates, within what is possible."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from stribeck.core.friction import get_law
from stribeck.core.friction.terms import BEYOND_VELOCITY
from stribeck.core.result import BODY_COORDINATES, BodyCorrection, JointResult, Result
from stribeck.core.result.posterior import coordinates_of
from stribeck.core.robot.inertial_parameters import inertia_of_shape

LARGEST = 3.0
"""Largest change of a scale's logarithm [1]; prevents absurd values where the log does not determine a scale."""


def moved(result: Result, change: Mapping[str, float]) -> Result:
    """Move the coordinates of a result's posterior.

    Parameters are clipped at their bounds, and scales change in their logarithm. Bodies change in mass, center and
    shape, so that each stays physically possible.

    Parameters
    ----------
    change
        Changes by the name of the coordinate.
    """
    corrections = result.corrections
    if corrections:
        bodies = {name: _moved_body(name, body, change) for name, body in corrections.bodies.items()}
        corrections = replace(corrections, bodies=bodies)
    joints = {name: _moved_joint(name, joint, change) for name, joint in result.joints.items()}
    return replace(result, joints=joints, corrections=corrections)


def _moved_joint(joint_name: str, joint: JointResult, change: Mapping[str, float]) -> JointResult:
    known = {parameter.name: parameter for parameter in (*get_law(joint.law).parameters, *BEYOND_VELOCITY)}
    values = {}
    for name, estimate in joint.parameters.items():
        parameter, step = known.get(name), change[f"{joint_name}.{name}"]
        value = estimate.value + step
        if parameter is not None and parameter.logarithmic and estimate.value > 0:
            value = estimate.value * float(np.exp(np.clip(step / estimate.value, -LARGEST, LARGEST)))
        low, high = (parameter.lower, parameter.upper) if parameter else (0.0, np.inf)  # a rotor inertia
        values[name] = float(np.clip(value, low, high))
    return joint.with_values(values)


def _moved_body(name: str, body: BodyCorrection, change: Mapping[str, float]) -> BodyCorrection:
    """Move mass, center and shape of a body; its inertia about the center is proportional to the mass."""
    step = np.array([change[f"{name}.{coordinate}"] for coordinate in BODY_COORDINATES])
    (before, mass), (lever, centre), (was, inertia) = body.mass, body.centre_of_mass, body.inertia
    share = float(np.exp(np.clip(step[0], -LARGEST, LARGEST)))
    about_centre = np.array(inertia)
    if np.any(step[4:]):
        step[4:7] = np.clip(step[4:7], -LARGEST, LARGEST)
        with np.errstate(over="ignore"):  # implausible values are refused on writing
            about_centre = inertia_of_shape(mass, np.array(coordinates_of(body)[4:]) + step[4:])
    return replace(
        body,
        mass=(before, share * mass),
        centre_of_mass=(lever, tuple((np.array(centre) + step[1:4]).tolist())),
        inertia=(was, tuple((share * about_centre).tolist())),
    )

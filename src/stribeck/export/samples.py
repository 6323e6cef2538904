"""Draws of a result from the joint distribution of its errors: robots that the log cannot tell apart."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from stribeck.friction import get_law
from stribeck.friction.terms import BEYOND_VELOCITY
from stribeck.result import BodyCorrection, Corrections, JointResult, ParameterEstimate, Result
from stribeck.typing import Array


def drawn(result: Result, count: int, seed: int = 0) -> Iterator[Result]:
    """Yield so many results, each with parameters and inertias as they may be in truth.

    A joint's parameters, its rotor inertia among them, are drawn together from their covariance, scales by their
    logarithm, within their bounds; joints independently of each other. Bodies are moved and scaled as a whole, from the
    errors of mass and centre of mass, so that each could exist; the correlation of bodies with joints is left out.
    """
    generator = np.random.default_rng(seed)
    for _ in range(count):
        joints = {name: _drawn_joint(joint, generator) for name, joint in result.joints.items()}
        corrections = result.corrections
        if corrections:
            corrections = _drawn_corrections(corrections, generator)
        yield replace(result, joints=joints, corrections=corrections)


def _drawn_joint(joint: JointResult, generator: np.random.Generator) -> JointResult:
    normal = generator.standard_normal(len(joint.parameters))  # always as many, so that a joint's draws are its own
    known = {parameter.name: parameter for parameter in (*get_law(joint.law).parameters, *BEYOND_VELOCITY)}
    off = _root(joint) @ normal
    parameters: dict[str, ParameterEstimate] = {}
    for (name, found), change in zip(joint.parameters.items(), off.tolist(), strict=True):
        error = found.standard_error if np.isfinite(found.standard_error) else 0.0
        own = known.get(name)
        if own is not None and own.logarithmic and found.value > 0:
            value = found.value * float(np.exp(np.clip(change * error / found.value, -LARGEST, LARGEST)))
        else:
            value = found.value + change * error
        low, high = (own.lower, own.upper) if own else (0.0, np.inf)  # a rotor inertia
        parameters[name] = replace(found, value=float(np.clip(value, low, high)))
    return replace(joint, parameters=parameters)


LARGEST = 3.0
"""Change of a scale's logarithm at most [1]: a log that does not show a scale is no reason for an absurd one."""


def _root(joint: JointResult) -> Array:
    """Return a root of the correlation of the parameters' errors, shape (p, p)."""
    size = len(joint.parameters)
    if joint.correlation is None or np.shape(joint.correlation) != (size, size):
        return np.eye(size)
    values, vectors = np.linalg.eigh(np.nan_to_num(np.array(joint.correlation)))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def _drawn_corrections(corrections: Corrections, generator: np.random.Generator) -> Corrections:
    bodies = {name: _drawn_body(body, generator.standard_normal(4)) for name, body in corrections.bodies.items()}
    return replace(corrections, bodies=bodies)


def _drawn_body(body: BodyCorrection, normal: Array) -> BodyCorrection:
    """Return a body whose mass and centre are drawn; its inertia about the centre grows with the mass."""
    (before, mass), (lever, centre), (was, inertia) = body.mass, body.centre_of_mass, body.inertia
    share = float(np.exp(np.clip(normal[0] * body.mass_error / mass, -LARGEST, LARGEST))) if mass > 0 else 1.0
    moved = np.array(centre) + normal[1:] * np.array(body.centre_of_mass_error)
    return replace(
        body,
        mass=(before, share * mass),
        centre_of_mass=(lever, tuple(moved.tolist())),
        inertia=(was, tuple((share * np.array(inertia)).tolist())),
    )

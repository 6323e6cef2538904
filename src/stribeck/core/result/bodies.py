"""Bodies of a robot with the estimates of a result."""

from dataclasses import replace

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError
from stribeck.core.result.parts import BodyCorrection, Corrections
from stribeck.core.robot import Robot
from stribeck.core.robot.inertial_parameters import pseudo_inertia

LARGEST = 1e9
"""Largest plausible value of a body in SI units, and reciprocal of its smallest mass [kg]; limited by rounding."""


def with_bodies(robot: Robot, corrections: Corrections | None) -> Robot:
    """Replace the bodies of a robot by the estimates of a result.

    Raises
    ------
    SettingsError
        If the corrections belong to another model.
    """
    model = pin.Model(robot.tree.model)
    for name, body in (corrections.bodies if corrections else {}).items():
        require_same_body(model, name, body, robot.model_path)
        estimate = pin.PseudoInertia.FromMatrix(body_pseudo_inertia(body, 1))
        model.inertias[model.getJointId(name)] = pin.Inertia.FromPseudoInertia(estimate)
    return replace(robot, tree=replace(robot.tree, model=model))


def require_same_body(tree: pin.Model, joint: str, body: BodyCorrection, where: str) -> None:
    """Check that a body belongs to the model and that its values are plausible."""
    numbers = np.concatenate([body.mass, *body.centre_of_mass, *body.inertia])
    if min(body.mass) < 1 / LARGEST or np.abs(numbers).max() > LARGEST:
        raise SettingsError(
            f"{where}: the result changes the body of '{joint}' from {body.mass[0]:g} kg to {body.mass[1]:g} kg, "
            f"or has values beyond {LARGEST:g}; expected a result written by 'stribeck identify'"
        )
    expected = "expected the model that the log was identified with"
    if not tree.existJointName(joint):
        raise SettingsError(f"{where}: the result corrects the body of joint '{joint}', which is missing; {expected}")
    inertia = tree.inertias[tree.getJointId(joint)]
    if not agree(pseudo_inertia_of(inertia), body_pseudo_inertia(body, 0)):
        raise SettingsError(
            f"{where}: the inertia of the body of joint '{joint}' differs from the model of the result "
            f"({inertia.mass:.6g} kg instead of {body.mass[0]:.6g} kg); {expected}, unchanged"
        )


def agree(matrix: Array, other: Array) -> bool:
    """Check that two pseudo-inertias are equal up to rounding."""
    return bool(np.abs(matrix - other).max() <= 1e-9 * np.abs(other).max())


def pseudo_inertia_of(inertia: pin.Inertia) -> Array:
    """Convert an inertia to its pseudo-inertia, shape (4, 4)."""
    return np.asarray(inertia.toPseudoInertia().toMatrix())


def body_pseudo_inertia(body: BodyCorrection, which: int) -> Array:
    """Compute the pseudo-inertia of a body before (0) or after (1) the correction, shape (4, 4)."""
    point = np.append(body.centre_of_mass[which], 1.0)
    about_centre = pseudo_inertia(np.array([0.0, 0.0, 0.0, 0.0, *body.inertia[which]]))
    return about_centre + body.mass[which] * np.outer(point, point)

"""The model's corrections in words of their own: masses, centres and inertias before and after, gains, zeros."""

from __future__ import annotations

import numpy as np

from stribeck.identification.whole_log.bodies import CENTRE, MASS
from stribeck.identification.whole_log.estimate import WholeLogFit
from stribeck.inertial_parameters import SIZE
from stribeck.result import BodyCorrection, Corrections
from stribeck.typing import Array


def describe_corrections(fit: WholeLogFit, joints: tuple[str, ...], encoders: tuple[str, ...]) -> Corrections:
    """Return what the whole log says beside friction.

    Parameters
    ----------
    fit
        Of the whole log.
    joints, encoders
        Names of the joints that were fitted, and of all joints.
    """
    there = fit.model.corrections
    friction = fit.solution.internal.size
    errors = np.sqrt(np.diag(fit.solution.covariance)[friction:] * fit.widening)
    inertial = there.inertial_parameters.size
    body_errors = errors[:inertial].reshape(-1, SIZE)
    before, change = there.inertial_parameters, fit.corrections[:inertial].reshape(-1, SIZE)
    bodies = {
        name: _describe(before[k], before[k] + change[k], body_errors[k])
        for k, name in enumerate(there.bodies)
        if before[k, 0] > 0
    }
    own = slice(inertial, there.size)
    calibration = fit.corrections[own]
    calibration_errors = errors[own] * fit.model.scales[: there.size - inertial]
    pairs = list(zip(calibration.tolist(), calibration_errors.tolist(), strict=True))
    return Corrections(
        chi_square=fit.chi_square,
        disagreement=fit.disagreement,
        bodies=bodies,
        torque_gain={joints[k]: pairs[k] for k in fit.model.loaded},
        encoder_zero=dict(zip(encoders, pairs[there.gains : there.gains + there.zeros], strict=False)),
    )


def _describe(before: Array, after: Array, errors: Array) -> BodyCorrection:
    return BodyCorrection(
        mass=(float(before[0]), float(after[0])),
        mass_error=float(MASS * errors[0] * after[0]),
        centre_of_mass=(_centre(before), _centre(after)),
        centre_of_mass_error=tuple((CENTRE * errors[1:4]).tolist()),
        inertia=(_inertia(before), _inertia(after)),
        known=float(1 - np.mean(np.minimum(errors, 1.0) ** 2)),
    )


def _centre(parameters: Array) -> tuple[float, ...]:
    return tuple((parameters[1:4] / parameters[0]).tolist())


def _inertia(parameters: Array) -> tuple[float, ...]:
    """Return Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the centre of mass."""
    x, y, z = parameters[1:4] / parameters[0]
    steiner = parameters[0] * np.array([y * y + z * z, -x * y, x * x + z * z, -x * z, -y * z, x * x + y * y])
    return tuple((parameters[4:] - steiner).tolist())

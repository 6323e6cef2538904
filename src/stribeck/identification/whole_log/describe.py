"""Corrections as the result has them: masses, centres and inertias before and after, gains, zeros, delays."""

from __future__ import annotations

import numpy as np

from stribeck.identification.whole_log.estimate import WholeLogFit
from stribeck.identification.whole_log.uncertainty.joint_errors import correlations, shape_errors
from stribeck.inertial_parameters import SIZE
from stribeck.result import BodyCorrection, Corrections
from stribeck.settings import Priors
from stribeck.typing import Array


def describe_corrections(
    fit: WholeLogFit, joints: tuple[str, ...], encoders: tuple[str, ...], torque_delay: float
) -> Corrections:
    """Return the corrections that a fit found.

    Parameters
    ----------
    fit
        Of the whole log.
    joints, encoders
        Names of the joints that were fitted, and of all joints.
    torque_delay
        [s].
    """
    corrections, layout = fit.model.corrections, fit.model.layout
    errors = np.sqrt(fit.solution.model_variance * fit.widening)
    body_errors = errors[layout.part("bodies")].reshape(-1, SIZE)
    before, change = corrections.inertial_parameters, fit.corrections[layout.part("bodies")].reshape(-1, SIZE)
    shapes = shape_errors(fit)
    bodies = {
        name: _describe(before[k], before[k] + change[k], body_errors[k], shapes[k], fit.model.priors)
        for k, name in enumerate(corrections.bodies)
        if before[k, 0] > 0
    }
    units = np.concatenate([np.ones(before.size), fit.model.scales])

    def pairs(name: str) -> list[tuple[float, float]]:
        own = layout.part(name)
        return list(zip(fit.corrections[own].tolist(), (errors * units)[own].tolist(), strict=True))

    gains, delays = pairs("gains"), pairs("delays")
    offsets = corrections.offsets_of_logs(fit.corrections[layout.part("log_offsets")]).T.tolist()
    return Corrections(
        chi_square=fit.chi_square,
        disagreement=fit.heterogeneity,
        bodies=bodies,
        torque_gain={joints[k]: gains[k] for k in fit.model.loaded},
        encoder_zero=dict(zip(encoders, pairs("zeros"), strict=False)),
        log_offsets={joint: tuple(own) for joint, own in zip(joints, offsets, strict=False)},
        torque_delay=(torque_delay, delays[0][1]) if delays else None,
        base_delay=delays[1] if delays[1:] else None,
        correlations=correlations(fit, joints),
    )


def _describe(before: Array, after: Array, errors: Array, shape: Array, priors: Priors) -> BodyCorrection:
    return BodyCorrection(
        mass=(float(before[0]), float(after[0])),
        mass_error=float(priors.mass * errors[0] * after[0]),
        centre_of_mass=(_centre(before), _centre(after)),
        centre_of_mass_error=tuple((priors.centre_of_mass * errors[1:4]).tolist()),
        inertia=(_inertia(before), _inertia(after)),
        known=float(1 - np.mean(np.minimum(errors, 1.0) ** 2)),
        shape_error=tuple(shape.tolist()),
    )


def _centre(parameters: Array) -> tuple[float, ...]:
    return tuple((parameters[1:4] / parameters[0]).tolist())


def _inertia(parameters: Array) -> tuple[float, ...]:
    """Return Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the centre of mass."""
    x, y, z = parameters[1:4] / parameters[0]
    steiner = parameters[0] * np.array([y * y + z * z, -x * y, x * x + z * z, -x * z, -y * z, x * x + y * y])
    return tuple((parameters[4:] - steiner).tolist())

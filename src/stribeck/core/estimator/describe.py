"""Terms and corrections in a result: masses, centers and inertias before and after, gains, zeros, delays."""

from typing import Any

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.equations.constants import LEAST_FRICTION
from stribeck.core.equations.whole_log.corrections import CORRECTIONS
from stribeck.core.equations.whole_log.corrections.correction import Found
from stribeck.core.equations.whole_log.corrections.model import effects_of_logs
from stribeck.core.estimator.estimate import WholeLogFit
from stribeck.core.estimator.terms.selection import JointTerms
from stribeck.core.estimator.uncertainty.joint_errors import error_correlation, shape_errors
from stribeck.core.result import BodyCorrection, Corrections
from stribeck.core.robot.inertial_parameters import SIZE


def joint_terms(fit: WholeLogFit) -> dict[str, JointTerms]:
    """Collect the terms of the law "auto", by joint; empty for other laws."""
    terms, whole = fit.read.terms, fit.read.whole
    warm = terms.mean_temperature
    return {
        joint: JointTerms(
            verdicts=verdicts,
            mean_load=float(whole.mean_load[k]),
            load_deviation=float(whole.load_deviation[k]),
            mean_direction=tuple(terms.direction[k].tolist()) if np.isfinite(terms.direction[k]).all() else None,
            mean_temperature=float(warm[k]) if warm is not None and np.isfinite(warm[k]) else None,
            settings={name: float(values[k]) for name, values in terms.settings.items()},
        )
        for k, (joint, verdicts) in enumerate(zip(fit.joints, fit.terms, strict=False))
    }


def describe_corrections(fit: WholeLogFit) -> Corrections:
    """Convert the corrections of a fit to a result's units and names."""
    model, layout, joints, encoders = fit.fit.model, fit.fit.model.layout, fit.joints, fit.robot.joint_names
    priors, errors = model.priors, np.sqrt(fit.fit.model_variance)
    body_errors = errors[layout.part("bodies")].reshape(-1, SIZE)
    before, change = layout.inertial_parameters, fit.corrections[layout.part("bodies")].reshape(-1, SIZE)
    shapes = shape_errors(fit)
    bodies = {
        name: body_correction(
            before[k],
            before[k] + change[k],
            float(priors.mass * body_errors[k, 0] * (before[k, 0] + change[k, 0])),
            priors.centre_of_mass * body_errors[k, 1:4],
            float(1 - np.mean(np.minimum(body_errors[k], 1.0) ** 2)),
            tuple(shapes[k].tolist()),
        )
        for k, name in enumerate(layout.bodies)
        if before[k, 0] > 0
    }
    values, errors = fit.corrections.copy(), errors * np.concatenate([np.ones(before.size), model.scales])
    values[layout.part("torque_delay")] = fit.delay
    others: dict[str, Any] = {}
    for correction in CORRECTIONS:
        if correction.describe:
            places = layout.part(correction.name)
            others |= correction.describe(Found(layout, values[places], errors[places], joints, encoders))
    return Corrections(
        chi_square=fit.chi_square,
        disagreement=fit.heterogeneity,
        bodies=bodies,
        log_friction={joint: tuple(levels) for joint, levels in zip(joints, _levels(fit), strict=False)},
        correlation=error_correlation(fit),
        **others,
    )


def _levels(fit: WholeLogFit) -> list[list[float]]:
    """Compute each log's friction relative to the mean, minus one, at half the top speed [1], shape (joints, logs).

    The list is empty if all logs have the same friction.
    """
    layout = fit.fit.model.layout
    effects = effects_of_logs(layout, fit.corrections[layout.part("log_effects")])  # (effects, logs, joints)
    change = np.tensordot([0.0, 1.0, 0.5][: len(effects)], effects, 1)  # [N m]
    laws, size = fit.fit.laws, len(fit.fit.laws.law.parameters)
    values = zip(0.5 * laws.top_speed[: change.shape[1]], laws.external(fit.fit.internal), strict=False)
    friction = [laws.law.resisting(np.array([speed]), parameters[:size])[0] for speed, parameters in values]
    levels = change / np.maximum(friction, LEAST_FRICTION * laws.torque[: change.shape[1]])
    return levels.T.tolist() if np.abs(levels).max(initial=0.0) > 1e-3 else []  # held at zero: less


def body_correction(
    before: Array,
    after: Array,
    mass_error: float,
    centre_error: Array,
    known: float,
    shape_error: tuple[float, ...] | None = None,
) -> BodyCorrection:
    """Describe the correction of a body by its inertial parameters, shape (10,) each, and their standard errors."""
    return BodyCorrection(
        mass=(float(before[0]), float(after[0])),
        mass_error=mass_error,
        centre_of_mass=(_centre(before), _centre(after)),
        centre_of_mass_error=tuple(centre_error.tolist()),
        inertia=(_inertia(before), _inertia(after)),
        known=known,
        shape_error=shape_error,
    )


def _centre(parameters: Array) -> tuple[float, ...]:
    return tuple((parameters[1:4] / parameters[0]).tolist())


def _inertia(parameters: Array) -> tuple[float, ...]:
    """Compute Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the center of mass."""
    x, y, z = parameters[1:4] / parameters[0]
    steiner = parameters[0] * np.array([y * y + z * z, -x * y, x * x + z * z, -x * z, -y * z, x * x + y * y])
    return tuple((parameters[4:] - steiner).tolist())

"""What a log can support: the verdict on every parameter and every joint."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from stribeck.friction import FrictionLaw, unit_for
from stribeck.identification.curve_fit.problem import FitProblem, joint_problem
from stribeck.identification.joint_fit import JointFit
from stribeck.identification.judgement.excitation import Excitation, excitation
from stribeck.identification.judgement.weakness import USUAL, Criteria, is_weak, why_identified, why_weak
from stribeck.result import JointResult, ParameterEstimate, Validation
from stribeck.samples import Samples
from stribeck.settings import Settings
from stribeck.typing import Array

POWER_DEAD_ZONE = 1e-3
"""Share [1] of rms velocity times rms torque: less power than this, of either sign, is rounding or standstill."""

NOT_FITTED = "it moves too little where the method can use the log"
"""Of a joint that the samples show to move, but not in the contact modes that a fit used."""


def judge(
    fits: Mapping[str, JointFit],
    samples: Samples,
    law: FrictionLaw,
    settings: Settings,
    validations: Mapping[str, Validation | None],
    criteria: Criteria = USUAL,
) -> dict[str, JointResult]:
    """Return what the samples say about every joint, in the order of `samples.joint_names`.

    A joint that does not move enough gets no numbers. A parameter is weak if it sits on a bound or its 95 % interval
    is wider than its value; an offset may well be zero, so its interval is compared with Coulomb friction where that
    is larger. A joint is weak if one of its parameters is, or if its law is no better than zero friction on blocks
    that the fit did not see. `criteria` are those of the method. A fit has judged the motion by what it saw, which may
    be more than the samples.
    """
    results = {}
    for column, joint in enumerate(samples.joint_names):
        problem = joint_problem(samples, joint, law, settings)
        prismatic = samples.slides(column)
        moved = excitation(problem, prismatic)
        if joint not in fits or not moved.samples:
            results[joint] = _not_excited(moved)
        else:
            results[joint] = _judge_joint(fits[joint], problem, moved, validations[joint], prismatic, criteria)
    return results


def _not_excited(moved: Excitation) -> JointResult:
    return JointResult(
        parameters={},
        verdict="not excited",
        reason=moved.reason or NOT_FITTED,
        samples=moved.samples,
        velocity_range=moved.velocity_range,
        reversals=moved.reversals,
    )


def _judge_joint(
    fit: JointFit,
    problem: FitProblem,
    moved: Excitation,
    validation: Validation | None,
    prismatic: bool,
    criteria: Criteria,
) -> JointResult:
    weak = is_weak(fit, problem.velocity, criteria)
    reason = why_weak(fit, weak, problem.velocity, prismatic)
    if validation and validation.rms >= validation.rms_zero_friction and not reason:
        reason = "on blocks that the fit did not see, its law explains no more than zero friction does"
    if not fit.converged and not reason:
        reason = "the fit did not converge: the samples hardly distinguish the parameters"
    enough = f"{why_identified(criteria)} ({moved.blocks} blocks, {moved.reversals} reversals)"
    return JointResult(
        parameters={
            parameter.name: ParameterEstimate(
                value=float(fit.values[i]),
                standard_error=float(fit.standard_errors[i]),
                interval_95=(float(fit.intervals[i, 0]), float(fit.intervals[i, 1])),
                unit=unit_for(parameter, prismatic),
                verdict="weak" if weak[i] else "identified",
                variance_shares=None if fit.variance_shares is None else fit.variance_shares[i],
            )
            for i, parameter in enumerate(fit.parameters)
        },
        verdict="weak" if reason else "identified",
        reason=reason or enough,
        samples=moved.samples,
        velocity_range=moved.velocity_range,
        reversals=moved.reversals,
        residual_rms=fit.rms,
        validation=validation,
        positive_power_fraction=positive_power_fraction(fit, problem),
    )


def positive_power_fraction(fit: JointFit, problem: FitProblem) -> float:
    """Return the share of samples in which friction would add power, v (R - offset) < 0, (7.9).

    The paper's tau_f is -R, so its P = v tau_f is positive there.
    """
    values = dict(zip(fit.names, fit.values, strict=True))
    torque = problem.friction_torque - values.get("offset", 0.0)
    power = problem.velocity * torque
    dead_zone = POWER_DEAD_ZONE * _rms(problem.velocity) * _rms(torque)
    return float(np.mean(power < -dead_zone))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))

"""What a log can support: the verdict on every parameter and every joint."""

from collections.abc import Mapping

import numpy as np

from stribeck.friction import FrictionLaw, unit_for
from stribeck.friction_torque.samples import FrictionSamples
from stribeck.judgement.curve import (
    NO_FRICTION,
    ROUNDING,
    WIDEST,
    friction_curve,
    is_significant,
    relative_width,
    upper_bound,
)
from stribeck.judgement.curve_fit.problem import FitProblem, joint_problem
from stribeck.judgement.excitation import Excitation, excitation
from stribeck.judgement.joint_fit import JointFit
from stribeck.judgement.passivity import added_power, positive_power_fraction
from stribeck.judgement.weakness import USUAL, Criteria, is_weak, weak_by_themselves, why_weak
from stribeck.result import CurvePoint, JointResult, ParameterEstimate, Validation, Verdict
from stribeck.settings import Settings

NOT_FITTED = "it moves too little where the method can use the log: move it longer between contact changes"
"""Of a joint that the samples show to move, but not in the contact modes that a fit used."""


def judge(
    fits: Mapping[str, JointFit],
    samples: FrictionSamples,
    law: FrictionLaw,
    settings: Settings,
    validations: Mapping[str, Validation | None],
    criteria: Criteria = USUAL,
) -> dict[str, JointResult]:
    """Return what the samples say about every joint, in the order of `samples.joint_names`.

    A joint that does not move enough gets no numbers. The verdict of all others is that of their friction curve: weak
    if half of its 95 % interval is wider than `WIDEST` of it, or if the law is no better than zero friction on blocks
    that the fit did not see; "no friction" if it is significant at no speed, and small against the residual. Each
    parameter has a verdict of its own, by the same width and by the method's `criteria`; an offset may well be zero, so
    its interval is compared with Coulomb friction where that is larger. A fit has judged the motion by what it saw,
    which may be more than the samples.
    """
    results = {}
    for column, joint in enumerate(samples.joint_names):
        problem = joint_problem(samples, joint, law, settings)
        prismatic = samples.slides(column)
        moved = excitation(problem, prismatic)
        if joint not in fits or not moved.samples:
            results[joint] = _not_excited(moved)
        else:
            passive = not added_power(samples, column, fits[joint].by_name.get("offset", 0.0))
            results[joint] = _judge_joint(fits[joint], problem, moved, validations[joint], prismatic, criteria, passive)
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
    passive: bool,
) -> JointResult:
    unresolved = problem.along.unresolved if problem.along else np.nan
    weak = is_weak(fit, problem.velocity, criteria, unresolved)
    curve = friction_curve(fit, problem.law, problem.velocity, prismatic)
    added = positive_power_fraction(problem.velocity, problem.friction_torque - fit.by_name.get("offset", 0.0))
    wrong_sign = "" if passive else f"friction adds power in {added:.0%} of the samples"
    verdict, reason = _verdict(fit, curve, problem, validation, prismatic, wrong_sign)
    if verdict == "identified":
        reason += f" ({moved.blocks} blocks, {moved.reversals} reversals)"
    if is_significant(curve):
        reason += weak_by_themselves(fit, weak, problem.velocity, prismatic, unresolved)
        reason += "" if fit.converged else "; the fit did not converge: samples hardly distinguish the parameters"
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
            if verdict != "no friction" or parameter.name in ("offset", "armature")  # torques that are no friction
        },
        verdict=verdict,
        reason=reason,
        samples=moved.samples,
        velocity_range=moved.velocity_range,
        reversals=moved.reversals,
        residual_rms=fit.rms,
        validation=validation,
        positive_power_fraction=added,
        curve=curve,
    )


def _verdict(
    fit: JointFit,
    curve: tuple[CurvePoint, ...],
    problem: FitProblem,
    validation: Validation | None,
    prismatic: bool,
    wrong_sign: str,
) -> tuple[Verdict, str]:
    """Return the verdict on a joint that moves, and one sentence on why."""
    most = upper_bound(curve)
    significant = is_significant(curve)
    if most <= ROUNDING or (not (wrong_sign or significant) and most <= NO_FRICTION * fit.rms):
        return "no friction", f"no friction detectable, below {most:.2g} {curve[0].unit}"
    if wrong_sign and not significant:
        return "weak", f"{wrong_sign}: a sign, a delay or the model is wrong"
    if (width := relative_width(curve)) > WIDEST:
        return "weak", why_weak(fit, curve, problem.velocity, prismatic)
    if validation and validation.rms >= validation.rms_zero_friction:
        return "weak", "on blocks that the fit did not see, its law explains no more than zero friction does"
    return "identified", f"its friction is known to within {100 * width:.2g} %"

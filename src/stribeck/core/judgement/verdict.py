"""Verdicts on joints and parameters: what the log supports."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from stribeck.core.friction import FrictionLaw, unit_for
from stribeck.core.judgement.curve import ROUNDING, WIDEST, friction_curve, is_significant, relative_width
from stribeck.core.judgement.curve_fit.problem import FitProblem, joint_problem
from stribeck.core.judgement.excitation import MIN_SPEED, Excitation, few_reversals
from stribeck.core.judgement.joint_fit import JointFit
from stribeck.core.judgement.passivity import added_power, positive_power_fraction
from stribeck.core.judgement.reason import Reason
from stribeck.core.judgement.speed import top_speed
from stribeck.core.judgement.weakness import USUAL, Criteria, is_weak, weak_by_themselves, why_weak
from stribeck.core.result import CurvePoint, JointResult, ParameterEstimate, TorqueR2, Validation, Verdict
from stribeck.core.result.samples import FrictionSamples
from stribeck.core.result.tables import upper_bound
from stribeck.core.settings import Settings

UNEXPLAINED = 0.3
"""Residual on held-out data relative to the residual without friction [1], above which a disturbed log decides nothing.

Undisturbed logs of arms and walks reach 0.26; logs in which a hand or a payload is part of the fit start at 0.32."""

NOT_FITTED = Reason(
    "too little motion in the parts that the method can use", remedy="record longer motion between contact changes"
)
"""Reason for a joint that moves, but not in the contact modes that the fit uses."""

ALWAYS_STANDS = Reason(
    "0 usable samples: several feet or wheels always stand, which leaves the contact forces on this joint unknown",
    remedy="set the radius of any ball feet in [contacts], lift one foot at a time, or hang or jack the robot up",
)
"""Reason for a joint of a leg that always shares the load with others."""


def judge(
    fits: Mapping[str, JointFit],
    samples: FrictionSamples,
    law: FrictionLaw,
    settings: Settings,
    validations: Mapping[str, Validation | None],
    criteria: Criteria = USUAL,
    disturbed: str = "",
) -> dict[str, JointResult]:
    """Judge every joint, in the order of `samples.joint_names`.

    - "not excited": the joint does not move enough; it has no parameters.
    - "weak": half of the 95 % interval of the friction curve is wider than `WIDEST` times the curve, the measured
      friction adds power, the law explains held-out blocks no better than zero friction, or leaves more than
      `UNEXPLAINED` of the friction torque there in a log that is `disturbed` ("from 40.2 to 70.1 s"), or the joint
      has `few_reversals`.
    - "no friction": the curve is at most half of the residual (RMS), and is significant at no speed or
      explains held-out blocks no better than zero friction.
    - "identified": otherwise.

    Each parameter has its own verdict, by the same width and the method's `criteria`. The interval of an offset is
    compared with Coulomb friction if that is larger, because an offset can be zero. A joint that was fitted is not
    checked for excitation again, because the fit may use more samples.
    """
    results = {}
    for column, joint in enumerate(samples.joint_names):
        problem = joint_problem(samples, joint, law, settings)
        prismatic = samples.slides(column)
        moved = problem.excitation(prismatic)
        if joint not in fits or not moved.samples:
            shared = not moved.samples and all("+" in support for support in samples.support_names)
            results[joint] = not_excited(replace(moved, reason=ALWAYS_STANDS) if shared else moved)
        else:
            passive = not added_power(samples, column, fits[joint].by_name.get("offset", 0.0))
            unit = samples.torque_unit(column)
            result = _judge_joint(fits[joint], problem, moved, validations[joint], (prismatic, unit), criteria, passive)
            if unit:
                result = replace(result, torque_unit=unit)
                result = replace(result, reason=f"{result.reason}; {result.unit_note}")
            if result.verdict == "identified" and (few := few_reversals(samples.velocity[:, column])):
                result = replace(result, verdict="weak", **few.fields)
            share = result.validation.unexplained if result.validation else 0.0
            if disturbed and result.verdict == "identified" and share > UNEXPLAINED:
                part = f"; on held-out parts, {100 * share:.0f} % of the friction torque stays unexplained"
                why = Reason(f"something else acts on this joint {disturbed}", part)
                result = replace(result, verdict="weak", **why.fields)
            results[joint] = result
    return results


def with_torque_r2(joint: JointResult, r2: TorqueR2 | None, fixed: bool, correction: float) -> JointResult:
    """Add the share of the torque that is explained on held-out parts.

    Nothing is identified by a negative share on a fixed base (others also move by unknown accelerations), nor by one
    below -5 with the given inertias, if the joint's body has an implausible `correction` [prior standard deviations]:
    the torque is less than 0.3 times the model's, and a body has to explain it, as with a missing gear ratio.
    """
    result = replace(joint, torque_r2=r2 if joint.curve else None)
    far = 6.0  # corrections of bodies on real robots whose torques are right reach 4.5 [prior standard deviations]
    replaced = r2 is not None and r2.nominal < -5 and (r2.corrected is None or correction > far)
    if joint.verdict != "identified" or r2 is None or not (replaced or (fixed and r2.best < 0)):
        return result
    given = " with the given inertias" * (r2.best >= 0)
    worse, share = f"the model{given} predicts held-out torques worse than their mean does", min(r2.best, r2.nominal)
    return replace(result, verdict="weak", **Reason(worse, f" (R² = {share:.2f})", "check gain, unit and model").fields)


def filled(samples: FrictionSamples, fits: Mapping[str, JointFit], law: FrictionLaw) -> FrictionSamples:
    """Make all samples of fitted joints that always share the load usable, with the friction torque of the fit."""
    usable, friction = samples.usable.copy(), samples.friction_torque.copy()
    for column, joint in enumerate(samples.joint_names):
        if joint in fits and not usable[:, column].any():
            usable[:, column] = True
            friction[:, column] = law.torque(samples.velocity[:, column], fits[joint].law_values(law))
    return replace(samples, usable=usable, friction_torque=friction)


def not_excited(moved: Excitation) -> JointResult:
    """Make the result of a joint that moves too little, or in no part that the method can use."""
    return JointResult(
        parameters={},
        verdict="not excited",
        **(moved.reason or NOT_FITTED).fields,
        samples=moved.samples,
        velocity_range=moved.velocity_range,
        reversals=moved.reversals,
    )


def _judge_joint(
    fit: JointFit,
    problem: FitProblem,
    moved: Excitation,
    validation: Validation | None,
    kind: tuple[bool, str],
    criteria: Criteria,
    passive: bool,
) -> JointResult:
    """Judge a joint that moves; its kind is whether it is prismatic, and the unit of its torque if not N m or N."""
    prismatic, _ = kind
    unresolved = problem.along.unresolved if problem.along else np.nan
    weak = is_weak(fit, problem.velocity, criteria, unresolved)
    curve = friction_curve(fit, problem.law, problem.velocity, *kind)
    added = positive_power_fraction(problem.velocity, problem.friction_torque - fit.by_name.get("offset", 0.0))
    wrong_sign = "" if passive else f"the fitted friction adds power in {100 * added:.0f} % of the samples"
    verdict, reason = _verdict(fit, curve, problem, validation, prismatic, wrong_sign)
    details = f" ({moved.blocks} blocks, {moved.reversals} reversals)" if verdict == "identified" else ""
    if is_significant(curve):
        details += weak_by_themselves(fit, weak, problem.velocity, prismatic, unresolved)
        if not fit.converged:
            details += "; the fit did not converge because the parameters are hardly distinguishable"
    return JointResult(
        parameters={
            parameter.name: ParameterEstimate(
                value=float(fit.values[i]),
                standard_error=float(fit.standard_errors[i]),
                interval_95=(float(fit.intervals[i, 0]), float(fit.intervals[i, 1])),
                unit=unit_for(parameter, *kind),
                verdict="weak" if weak[i] else "identified",
                variance_shares=None if fit.variance_shares is None else fit.variance_shares[i],
            )
            for i, parameter in enumerate(fit.parameters)
            if verdict != "no friction" or parameter.name in ("offset", "armature")  # torques other than friction
        },
        verdict=verdict,
        **reason._replace(details=reason.details + details).fields,
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
) -> tuple[Verdict, Reason]:
    """Decide the verdict on a joint that moves, and state the reason."""
    most = upper_bound(curve)
    significant = is_significant(curve)
    useless = validation is not None and validation.rms >= validation.rms_zero_friction
    unseen = not wrong_sign and most <= 0.5 * fit.rms and (useless or not significant)
    if most <= ROUNDING or unseen:
        return "no friction", Reason(f"no friction detected, below {most:.2g} {curve[0].unit}")
    if wrong_sign and not significant:
        return "weak", Reason(wrong_sign, remedy="check torque sign, delay and model")
    if (width := relative_width(curve)) > WIDEST:
        return "weak", why_weak(fit, curve, problem.velocity, prismatic)
    if useless:
        return "weak", Reason("the law explains held-out blocks no better than zero friction")
    if top_speed(problem.velocity) < MIN_SPEED[prismatic]:
        least = f"{MIN_SPEED[prismatic]} {'m/s' if prismatic else 'rad/s'}"
        return "weak", Reason(f"moves more slowly than {least}", remedy="move the joint faster")
    return "identified", Reason(f"friction known to within {100 * width:.2g} %")

"""Scale of torques and external torques, by the model, its effort limits and the robot's weight."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from math import ceil
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from stribeck.check.audit.bounds import out_of_bounds
from stribeck.check.audit.evidence import AuditData
from stribeck.check.audit.hypotheses import Hypothesis, compete, rivals
from stribeck.check.audit.motion import angle_between, gravity_torques, tilted
from stribeck.check.audit.regression import GainFit, fit
from stribeck.check.audit.units import FAR, MOST, UNITS, concerns_most, possible_causes, unit_of
from stribeck.core.base.finding import Finding, Setting
from stribeck.core.base.spans import Span
from stribeck.core.base.typing import Array
from stribeck.core.equations.friction_torque.payload import payload_entry
from stribeck.core.robot.kinematics import link_of
from stribeck.core.robot.scale_setting import scale_setting

BINS_FOR_GAIN = 75
"""Fewest bins for a gain [1]; errors of the model dominate shorter motions."""
SURE = 4.0
"""Deviation of a gain from one that counts as significant [standard errors]."""
NEAR = 1.6
"""Factor [1] up to which gains can be explained by wrong inertias."""
IMPLAUSIBLE = 10.0
"""Error of the last body's mass that no model has [prior standard deviations]: the robot carries something."""
SOME = 0.08
"""Smallest logarithm of a gain that is reported, if no other cause explains the torques as well [1]."""


def judged(estimate: GainFit, largest: float) -> bool:
    """Whether the model's variation is large relative to friction and noise, and not tiny relative to other joints'."""
    if estimate.share < 0.8 or estimate.leverage < 0.2 or estimate.swing < 2e-3 * largest:
        return False
    return abs(estimate.gain) * estimate.swing > estimate.friction_and_error


def _off(estimate: GainFit) -> bool:
    least = min(abs(estimate.gain), abs(abs(estimate.gain) - 1))  # a gain that may be zero is none
    return not 1 / NEAR < abs(estimate.gain) < NEAR and least > SURE * estimate.error


def check_scales(evidence: AuditData, fits: dict[int, GainFit], joints: list[int]) -> list[Finding]:
    """Report torques of implausible size: gains that differ from one, and exceeded bounds."""
    positive = all(estimate.gain > 0 for estimate in fits.values())
    if positive and evidence.robot.settings.fit_armature is True:  # rotors look like gains
        evidence = replace(evidence, robot=replace(evidence.robot, torque_source="motor_side_sensor"))
        largest = max((estimate.swing for estimate in fits.values()), default=0.0)
        fits = {k: refit for k in fits if (refit := fit(evidence, k)) and judged(refit, largest)}
    off = {k: estimate for k, estimate in fits.items() if _off(estimate) and _surely(estimate)}
    competing = compete(evidence, joints) if positive else []
    all_off = concerns_most(len(off), len(fits), evidence.joints)
    possible = [cause for cause in competing if not all_off or cause.kind != "none"]  # then there is some cause
    if causes := _causes(evidence, rivals(possible), bool(off)):
        return causes
    if all_off:
        return [_scale_of_all(evidence, {evidence.joints[k]: abs(estimate.gain) for k, estimate in off.items()})]
    bounded = out_of_bounds(evidence, [k for k in joints if k not in off])
    if competing or any(finding.stops for finding in bounded):
        return bounded
    off = {k: estimate for k, estimate in off.items() if evidence.moves(k)}  # a gear at rest can carry any torque
    if off:
        other = _of_rotors_and_tilts(evidence)
        off = {k: gain for k, gain in off.items() if (refit := fit(evidence, k, beside=other[:, k])) and _off(refit)}
    if not off or len(evidence.rows) < BINS_FOR_GAIN:
        return bounded
    gains = {evidence.joints[k]: (estimate.gain, estimate.error) for k, estimate in off.items()}
    return [_gain_finding(evidence, gains), *bounded]


def _gain_finding(evidence: AuditData, gains: Mapping[str, tuple[float, float]]) -> Finding:
    """Report wrong gains of single torques, each with its standard error [1]."""
    sizes = {name: abs(gain) for name, (gain, _) in gains.items()}
    gear = ", as if a gear ratio were missing" * all(not 1 / 12 < size < 12 for size in sizes.values())
    setting = scale_setting(evidence.robot, {name: 1 / size for name, size in sizes.items()})
    texts = {name: f" ({gain:.3g} ± {2 * error:.1g} times the model's)" for name, (gain, error) in gains.items()}
    return Finding.of("torque-gain", texts, gear=gear, settings=[setting], gains=sizes)


def _causes(evidence: AuditData, causes: Sequence[Hypothesis], off: bool) -> list[Finding]:
    """Report the only cause that explains the torques, or a list of causes; empty if its effect is small."""
    if not any(large := [_large(evidence, cause, off) for cause in causes]):
        return []
    causes = [cause for cause, noticeable in zip(causes, large, strict=True) if noticeable or cause.kind == "body"]
    if {cause.kind for cause in causes} == {"gain", "common gain"}:
        causes = [cause for cause in causes if cause.kind == "common gain"]
    if len(causes) > 1:
        return [Finding.of("several-causes.audit", causes="; ".join(_words(evidence, cause) for cause in causes))]
    cause = causes[0]
    if cause.kind == "gravity":
        return [tilted(evidence, evidence.robot.gravity + cause.values)]
    if cause.kind == "body":
        return [_body_finding(evidence, cause)]
    errors = {evidence.joints[k]: estimate.error for k in cause.places if (estimate := fit(evidence, k))}
    gains = {name: gain for name, gain in cause.gains(evidence.joints).items() if abs(np.log(gain)) > SOME}
    if cause.kind == "common gain" or len(gains) == len(evidence.joints) > 1:
        return [_scale_of_all(evidence, gains)]
    sure = {name: (gain, error) for name, gain in gains.items() if gain > SURE * (error := errors.get(name, 0.0))}
    return [_gain_finding(evidence, sure)] if sure else []


def _large(evidence: AuditData, cause: Hypothesis, off: bool) -> bool:
    """Whether a cause changes friction noticeably; the fit corrects bodies unless they look like a gain or a load."""
    if cause.kind == "gravity":
        tilted_by = float(np.deg2rad(2.0))  # smallest tilt of the base that is reported [rad]
        return angle_between(evidence.robot.gravity, evidence.robot.gravity + cause.values) > tilted_by
    if cause.kind == "body":
        model, joint = evidence.robot.tree.model, cause.places[0] + 1
        more = cause.values[0] / (evidence.robot.settings.priors.mass * model.inertias[joint].mass)
        return off or (more > IMPLAUSIBLE and len(model.subtrees[joint]) == 1)
    for k, change in zip(cause.places, cause.values, strict=True):
        # errors of all bodies can imitate a gain; a real one also shows in the fit of its torque
        estimate = fit(evidence, k)
        if abs(np.log1p(change)) > SOME and (estimate is None or abs(np.log(abs(estimate.gain))) > SOME / 2):
            return True
    return False


def _words(evidence: AuditData, cause: Hypothesis) -> str:
    if cause.kind == "gravity":
        turned = angle_between(evidence.robot.gravity, evidence.robot.gravity + cause.values)
        return f"a base that is tilted by {np.rad2deg(turned):.2g}°"
    if cause.kind == "body":
        return f"a body: {_body_words(evidence, cause)}"
    if cause.kind == "common gain":
        factor = float(1 + cause.values[0])
        return f"one gain of all torques ({factor:.3g}): {possible_causes(factor)}"
    gains = cause.gains(evidence.joints).items()
    return f"gains of torques ({', '.join(f'{name} {gain:.3g}' for name, gain in gains)})"


def _body_words(evidence: AuditData, cause: Hypothesis) -> str:
    tree, joint = evidence.robot.tree, cause.places[0] + 1
    inertia, more = tree.model.inertias[joint], float(cause.values[0])
    if abs(more) < 0.05 * inertia.mass:  # gravity does not show the mass of a body that only turns
        away = 1e3 * float(np.linalg.norm(cause.values[1:4])) / inertia.mass
        return f"{link_of(tree, joint).name} appears to have its center of mass {away:.0f} mm elsewhere"
    return f"{link_of(tree, joint).name} appears {abs(more):.2g} kg {'heavier' if more > 0 else 'lighter'}"


def _body_finding(evidence: AuditData, cause: Hypothesis) -> Finding:
    """Report a body that is heavier or lighter than in the model; what is heavier can be stated as a payload."""
    robot, (mass, *moment), joint = evidence.robot, cause.values[:4].tolist(), cause.places[0] + 1
    if mass < 0.05 * robot.tree.model.inertias[joint].mass:
        return Finding.of("bodies-differ.audit", evidence=_body_words(evidence, cause))
    link = link_of(robot.tree, joint)
    com = link.placement.actInv(np.array(moment) / mass).tolist()
    log = evidence.prepared.log
    whole = Span(0.0, ceil(float(np.ptp(log.time))), Path(log.path).name)
    setting = Setting("robot", "payload", [payload_entry(str(link.name), mass, com, [whole])])
    return Finding.of("payload.audit", evidence=_body_words(evidence, cause), settings=[setting])


def _of_rotors_and_tilts(evidence: AuditData) -> Array:
    """Compute the torques of other errors: of a missing rotor per kg m^2, and of an IMU's tilt per rad.

    Shape (B, k, 0 to 4): rotors in the torques of link-side sensors, where friction's shapes have none, and three axes.
    """
    log, gravity = evidence.prepared.log, evidence.robot.gravity
    other = evidence.acceleration[:, :, None]
    if evidence.robot.torque_source != "link_side_sensor":
        other = other[..., :0]
    if evidence.robot.base != "floating" or log.base_orientation is None:
        return other
    axes = Rotation.from_quat(log.base_orientation[evidence.rows]).as_matrix()
    turned = np.cross(axes.transpose(0, 2, 1), gravity)  # gravity's change in the world for each axis
    tilted = np.einsum("bkw,baw->bka", gravity_torques(evidence, evidence.robot, np.eye(3)), turned)
    return np.dstack([other, tilted])


def _surely(estimate: GainFit) -> bool:
    """Whether the gain is wrong even if all of the error is in the model (reverse regression)."""
    other = abs(estimate.gain) / estimate.share
    return not 1 / NEAR < other < NEAR and (other > 1) == (abs(estimate.gain) > 1)


def _scale_of_all(evidence: AuditData, gains: dict[str, float]) -> Finding:
    """Report torques in another unit, or factors that are no unit with all causes that they may have."""
    middle = float(np.median(list(gains.values())))
    common = all(abs(np.log(gain / middle)) < 0.3 for gain in gains.values())
    unit = unit_of(middle) if common else None
    guess = f"as if they were in {UNITS[unit]}" if unit else "by one factor" if common else "with a factor per joint"
    return Finding.of(
        "torque-scale" if unit else "torque-scale.unclear",
        list(gains),
        stops=not 1 / FAR < middle < FAR,
        factor=middle,
        guess=guess,
        evidence=", ".join(f"{name} {gain:.3g}" for name, gain in list(gains.items())[:6]),
        settings=[scale_setting(evidence.robot, dict.fromkeys(evidence.joints, 1 / (unit or 1.0)))],
        gains=gains,
        causes=possible_causes(middle if common else None),
    )


def check_external(evidence: AuditData, left_out: Collection[str] = ()) -> list[Finding]:
    """Report external torques with a wrong sign or size; joints that are omitted have been reported.

    The measured torque minus friction and inverse dynamics is the opposite of the external torque, if friction resists;
    otherwise the measured torque is wrong.
    """
    off: dict[str, GainFit] = {}
    for k, name in enumerate(evidence.joints):
        external = evidence.external[:, k]
        if name in left_out or not external.any():
            continue
        dynamics = evidence.model[:, k] + external
        estimate = fit(evidence, k, model=-external, torque=evidence.torque[:, k] - dynamics)
        if estimate is None or not judged(estimate, estimate.swing) or estimate.dissipation < 0:
            continue
        if not 1 / NEAR < estimate.gain < NEAR and abs(estimate.gain - 1) > SURE * estimate.error:
            off[name] = estimate
    if not off:
        return []
    setting = scale_setting(evidence.robot, {name: result.gain for name, result in off.items()}, "external_torque")
    texts = {name: f" ({x.gain:.3g} ± {2 * x.error:.1g} times the expected torque)" for name, x in off.items()}
    most = len(off) >= MOST * len(evidence.joints)
    return [Finding.of("external-torque", texts, stops=most, settings=[setting])]

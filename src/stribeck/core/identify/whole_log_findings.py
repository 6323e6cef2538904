"""Findings on a whole-log fit: errors beyond their covariance, a model far off, delays, and misfits of the law."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain

import numpy as np
import scipy  # its special is slow to import: loaded at its first use

from stribeck.core.base.finding import Finding, Setting
from stribeck.core.base.spans import listed_spans
from stribeck.core.base.typing import Array
from stribeck.core.equations.constants import LEAST_FRICTION
from stribeck.core.equations.whole_log.corrections import CORRECTIONS
from stribeck.core.equations.whole_log.corrections.calibration import delay_finding
from stribeck.core.equations.whole_log.corrections.correction import Layout
from stribeck.core.estimator.estimate import WholeLogFit
from stribeck.core.estimator.fit_checks.competing_causes import HEAVIEST, Cause, Causes
from stribeck.core.estimator.fit_checks.misfits import Misfit, misfit_findings
from stribeck.core.estimator.uncertainty.resisting import Resisting
from stribeck.core.friction.terms.motion import drift
from stribeck.core.identify.causes_of_spans import FEW, CausesOfSpans
from stribeck.core.identify.contract import Fitted
from stribeck.core.judgement.curve import WIDEST
from stribeck.core.result import Corrections
from stribeck.core.robot import Robot
from stribeck.core.robot.scale_setting import scale_setting

FAR = 10.0
"""Corrections [1], in prior standard deviations, from which a warning is given: no real model has such errors."""


def find_problems(fit: WholeLogFit, fitted: Fitted, causes: Causes, of_spans: CausesOfSpans) -> list[Finding]:
    """Find the problems of a fit that a user should act on."""
    corrections, times = fitted.corrections, float(np.sqrt(fit.heterogeneity))
    assert corrections is not None, "a fit to whole logs has corrections"
    problems = _of_disturbances(fit, of_spans)
    symptoms = {"chi-square": fit.chi_square >= 1.5, "heterogeneity": times >= 2.0}  # beyond what errors explain
    gain = any(cause.kind == "gain" for cause in causes.rivals)
    if fit.robot.base == "floating" and (gain or all(symptoms.values())):  # loops carry the error to all legs
        symptoms = {"heterogeneity.floating": True}
    problems += [Finding.of(check, chi_square=fit.chi_square, times=times) for check in symptoms if symptoms[check]]
    if fit.robot.torque_source != "command" and causes.scale_error > 0.1:
        problems.append(Finding.of("torque-scale.unknown"))
    if np.any(np.abs(fit.fit.corrections[fit.fit.model.layout.part("wrenches")]) > FAR):
        problems.append(Finding.of("wrench-sensors", far=FAR))
    problems += [*_of_logs(fit, corrections), *_of_drift(fit, fitted)]
    single, delays, misfits = _of_causes(fit, causes), _of_delays(fit, fitted, corrections), _of_misfits(fit, fitted)
    if any(payload.spans != payload.aside for payload in of_spans.carried):  # bodies contain it, which explains errors
        return [*problems, *delays, *misfits]
    if not single:
        return [*problems, *_of_bodies(fit, fitted, causes), *delays, *misfits]
    joints = {joint for cause in single for joint in cause.joints}  # their friction is strained by the same errors
    delays = [delay for delay in delays if delay.check != "base-orientation-delay"]
    return [*problems, *single, *delays, *(misfit for misfit in misfits if not joints.issuperset(misfit.joints))]


def _of_disturbances(fit: WholeLogFit, of_spans: CausesOfSpans) -> list[Finding]:
    """Find spans that are set aside, and the payloads that explain them."""
    if fit.read.set_aside <= FEW:
        return []
    problems, carried = [], of_spans.carried
    explained = {span for payload in carried for span in payload.aside}
    if aside := [span for span in chain(*fit.read.spans(used=False)) if span not in explained]:
        others = [span for span in aside if span not in of_spans.rubbed]  # a joint rubs whenever it passes the place
        spans, rest = listed_spans(aside, of_spans.words), listed_spans(list(chain(*fit.read.spans(used=True))))
        check = "set-aside" if others else "set-aside.rubs"
        problems.append(Finding.of(check, spans=spans, rest=rest, exclude=others))
    if carried:
        setting = Setting("robot", "payload", [payload.table for payload in carried])
        which = "These" if all(payload.spans == payload.aside for payload in carried) else "The other"
        problems.append(Finding.of("payload", masses="; ".join(map(str, carried)), which=which, settings=[setting]))
    return problems


def _of_causes(fit: WholeLogFit, causes: Causes) -> list[Finding]:
    """Find single errors of sensors or model."""
    unexplained = 4.0  # chi^2 per degree of freedom [1] from which no single cause can explain the residual
    if fit.chi_square > unexplained:
        return []
    problems = cause_findings(causes, fit.robot, fit.joints, fit.fit.model.layout)
    moved = float(np.max(fit.read.pilot.components.root[:3], initial=0.0))
    moving = 0.15  # acceleration of standing feet [m/s^2] that is reported; feet of walking humanoids reach 0.03
    return problems or [Finding.of("base-moves", acceleration=moved)] * (moved > moving)


def _of_bodies(fit: WholeLogFit, fitted: Fitted, causes: Causes) -> list[Finding]:
    """Find bodies that differ from the model, if no other error explains more, or are implausible."""
    moved, small, problems, model = {}, True, [], fit.fit.model
    # In `studies.misfits` a payload that the log shows moves a body by 5 and more, and nothing else does by more than
    # 2.6. Second moments, which absorb friction that the law does not describe, are corrected by more.
    differs = 3.0  # correction of mass or center of mass that is reported [prior standard deviations]
    if causes.leading == "body":
        masses = model.layout.inertial_parameters[:, 0]
        for name, mass, correction in zip(model.layout.bodies, masses, causes.bodies, strict=True):
            possible = abs(model.priors.mass * correction[0]) < np.log(HEAVIEST)
            if possible and max(abs(correction[0]), np.linalg.norm(correction[1:4])) > differs:
                more = float(mass * np.expm1(model.priors.mass * correction[0]))
                moved[name] = body_text(more, model.priors.centre_of_mass * correction[1:4])
                small &= abs(more) < 0.03 * float(masses.sum())  # of the robot's mass: friction stays the same
    if moved:
        evidence = ", ".join(f"{name} appears {text}" for name, text in moved.items())
        problems.append(replace(Finding.of("bodies-differ", tuple(moved), evidence=evidence), note=small))
    if bodies := [name for name, size in fitted.body_corrections.items() if size > FAR and name not in moved]:
        problems.append(Finding.of("bodies-implausible", bodies, bodies=", ".join(bodies), far=FAR))
    return problems


def _of_logs(fit: WholeLogFit, corrections: Corrections) -> list[Finding]:
    """Find joints whose friction in one log differs from its mean by more than logs of one robot usually differ."""
    names = [spans[0].log if spans else "" for spans in fit.read.spans(used=True)]
    furthest = {
        joint: max(zip(changes, names, strict=True), key=lambda pair: abs(pair[0]))
        for joint, changes in corrections.log_friction.items()
    }
    far = {joint: f" ({100 * off:+.0f} % in {name})" for joint, (off, name) in furthest.items() if abs(off) > WIDEST}
    return [Finding.of("log-friction", far)] if far else []


def _of_misfits(fit: WholeLogFit, fitted: Fitted) -> list[Finding]:
    """Report what the laws do not describe; a joint is doubted unless its interval contains the change of its curve."""
    paced = _paced(fit)
    likely = [() if "drift" in {m.kind for m in own} and k in paced else own for k, own in enumerate(fit.misfits)]
    contained = [not misfits or _contained(fit, fitted, k, misfits) for k, misfits in enumerate(likely)]
    found = []
    for inside in (False, True):
        own = [misfits if each is inside else () for misfits, each in zip(likely, contained, strict=True)]
        for finding in misfit_findings(own, fit.joints, fit.read.terms.settings):
            reach = "The intervals contain this" if inside else "This moves the curves out of their intervals"
            doubt = "" if inside else finding.doubt
            found.append(replace(finding, text=f"{finding.text}. {reach}", doubt=doubt, note=inside))
    return found


def _contained(fit: WholeLogFit, fitted: Fitted, joint: int, misfits: Sequence[Misfit]) -> bool:
    """Whether the interval of a joint's curve is wider than what its misfits would change."""
    resisting, budget = Resisting(fit.fit, joint), fit.budget
    tested = max(1.0, fit.chi_square) * resisting.variance(budget.total - budget.heterogeneity)
    whole = resisting.variance(budget.total) + fit.law_misfits[joint] ** 2
    share = float(np.sqrt(np.max(tested / whole)))  # standard errors of the test relative to those of the interval [1]
    quantile = float(scipy.special.stdtrit(fitted.fits[fit.joints[joint]].degrees_of_freedom.min(), 0.975))
    return share * max(misfit.shift for misfit in misfits) < quantile


def _of_drift(fit: WholeLogFit, fitted: Fitted) -> list[Finding]:
    """Find joints whose law contains a drift of more than 5 % of their friction at half the top speed."""
    changed, laws, paced = {}, fit.fit.laws, _paced(fit)
    for k, (joint, joint_fit) in enumerate(fitted.fits.items()):
        speed = laws.top_speed[[k]] / 2
        friction = laws.law.resisting(speed, joint_fit.law_values(laws.law, joint_fit.mean_load))
        share = float((drift(joint_fit.by_name, speed) / np.maximum(friction, LEAST_FRICTION * laws.torque[k]))[0])
        if abs(share) > 0.05 and k not in paced:  # relative change during a log [1], as for misfits
            changed[joint] = f" ({100 * share:+.0f} %)"
    return [Finding.of("friction-drift.known", changed)] if changed else []


def _paced(fit: WholeLogFit) -> set[int]:
    """Find the joints whose speed rises or falls with time, as in a chirp: friction seems to drift there."""
    least, parts = 0.8, fit.read.pilot.parts  # smallest correlation of the logarithm of the speed with time [1]
    rows = [[part.time.mean(), *np.log(np.maximum(part.velocity.std(axis=0), 1e-9))] for part in parts]
    with np.errstate(all="ignore"):  # speeds may be constant
        return set(np.flatnonzero(np.abs(np.corrcoef(rows, rowvar=False)[0, 1:]) > least)) if rows[3:] else set()


def _of_delays(fit: WholeLogFit, fitted: Fitted, corrections: Corrections) -> list[Finding]:
    """Find delays of torques and base orientation, and torques that may be late or not."""
    problems, torque_delay = list[Finding](), corrections.torque_delay
    joints = tuple(name for name, terms in fitted.terms.items() if terms.verdicts["presliding"].kept)
    if torque_delay and joints and torque_delay[1] > 0.7 * fit.fit.model.priors.torque_delay:
        size, error = 1e3 * torque_delay[0], 2e3 * torque_delay[1]
        problems.append(Finding.of("torque-delay.ambiguous", joints, size=size, error=error))
    for check, delay, channel in (
        ("torque-delay.fit", corrections.torque_delay, "torque"),
        ("base-orientation-delay", corrections.base_delay, "base_orientation"),
    ):
        if delay and abs(delay[0]) > max(1.5e-3, 3 * delay[1]):  # [s]
            problems.append(delay_finding(check, channel, delay[0], fit.robot))
    return problems


def cause_findings(causes: Causes, robot: Robot, joints: Sequence[str], model: Layout) -> list[Finding]:
    """Report the cause, the causes that explain the residual about equally well, or all wrong gains."""
    findings = [_finding(cause, robot, joints, model) for cause in (*causes.rivals, *causes.more_gains)]
    if len(findings) < 2:
        return findings
    check = "several-causes.gains" if causes.more_gains else "several-causes"
    named = tuple(dict.fromkeys(joint for finding in findings for joint in finding.joints))
    gains = {joint: gain for finding in reversed(findings) for joint, gain in finding.gains.items()}
    listed = "; ".join(f"{finding.check}: {finding.text}" for finding in findings)
    return [Finding.of(check, named, causes=listed, gains=gains)]


def _finding(cause: Cause, robot: Robot, joints: Sequence[str], model: Layout) -> Finding:
    """Report one cause; numbers of joints and bodies refer to the names."""
    size, error = float(cause.values[0]), 2 * float(cause.errors[0])
    names = [joints[place] for place in cause.places] if cause.kind in ("gain", "rotor", "delay") else []
    if cause.kind in ("scale", "gain"):
        factor = np.exp(size) if cause.kind == "scale" else 1 / (1 - size)
        check, scaled = ("torque-gain.fit", names) if names else ("torque-scale.fit", _measured(robot))
        gains, settings = dict.fromkeys(scaled, factor), [scale_setting(robot, dict.fromkeys(scaled, 1 / factor))]
        error *= factor
        return Finding.of(check, scaled, factor=factor, error=error, settings=settings, stops=False, gains=gains)
    if correction := next((correction for correction in CORRECTIONS if correction.kind == cause.kind), None):
        assert correction.finding is not None, "a kind of a cause has a finding"
        return correction.finding(cause.places, cause.values, cause.errors, robot)
    if cause.kind == "delay":
        return Finding.of("friction-delay", names, evidence=f"{names[0]} ({1e3 * size:.2g} ms)")
    if cause.kind == "rotor":
        rotors = zip(names, cause.values.tolist(), cause.errors.tolist(), strict=True)
        sure = {name: f" ({value:.2g} ± {2 * error:.1g} kg m²)" for name, value, error in rotors if value > 4 * error}
        return Finding.of("rotor-missing", sure)
    (place,) = cause.places
    body = model.bodies[place]
    more = float(model.inertial_parameters[place, 0]) * float(np.expm1(size))
    evidence = f"{body} appears {body_text(more, cause.values[1:])}"
    return Finding.of("bodies-differ", [body], evidence=evidence)


def body_text(more: float, away: Array) -> str:
    """Describe how a body differs from the model: by a mass [kg], and by a shift of its center of mass [m]."""
    heavier = f"{abs(more):.2g} kg {'heavier' if more > 0 else 'lighter'}"
    return f"{heavier} and its center of mass {1e3 * float(np.linalg.norm(away)):.0f} mm elsewhere"


def _measured(robot: Robot) -> list[str]:
    return [robot.joint_names[column] for column in robot.torque_controlled]

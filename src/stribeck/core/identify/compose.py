"""Compose the result and its evidence from a method's fits and the friction torque of the samples."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from stribeck.core.base.files import sha256
from stribeck.core.base.finding import merged
from stribeck.core.base.parts import SERVICES
from stribeck.core.base.typing import Array
from stribeck.core.base.version import __version__
from stribeck.core.equations.friction_torque.preparation import Logs, log_names
from stribeck.core.equations.friction_torque.shown import before_and_after, in_channel_units, swinging, timeline
from stribeck.core.equations.friction_torque.stage import LogsFriction
from stribeck.core.errors import NothingIdentifiedError
from stribeck.core.estimator.terms.selection import with_terms
from stribeck.core.friction import FrictionLaw
from stribeck.core.identify.audited import model_findings
from stribeck.core.identify.contract import Fitted, Method
from stribeck.core.identify.own_friction import own_friction
from stribeck.core.judgement.excitation import why_none
from stribeck.core.judgement.joint_fit import in_channel_unit, with_armature, with_gain_error
from stribeck.core.judgement.next_log import with_next_log
from stribeck.core.judgement.passivity import passivity_violated
from stribeck.core.judgement.reason import Reason
from stribeck.core.judgement.torque_error import change_by_inertias, friction_errors, torque_errors
from stribeck.core.judgement.verdict import filled, judge, with_torque_r2
from stribeck.core.log import RobotLog
from stribeck.core.result import Corrections, CouplingResult, Evidence, JointResult, Result, TorqueR2, Validation
from stribeck.core.result.provenance import log_summary, provenance
from stribeck.core.result.result import FileStamp
from stribeck.core.result.samples import FrictionSamples
from stribeck.core.robot import Robot
from stribeck.core.settings import Settings


def compose(
    fitted: Fitted,
    friction: LogsFriction,
    prepared: Logs,
    robot: Robot,
    law: FrictionLaw,
    settings: Settings,
    method: Method,
    gain_errors: Mapping[str, float],
) -> Result:
    """Compose the result.

    Parameters
    ----------
    fitted, friction
        Fits of the method, and the friction torque computed with its robot and logs.
    prepared, robot
        Logs and robot as given by the user, before corrections.
    law, settings, method
        Law, settings and method of the fit.
    gain_errors
        Relative standard error [1] of the factor from current to torque, by joint.

    Raises
    ------
    NothingIdentifiedError
        If no joint moves enough.
    """
    log = prepared[0].log
    choices = [
        ("Filter", "; ".join(dict.fromkeys(part.filter_name for part in friction.logs))),
        ("Contact modes from", "; ".join(dict.fromkeys(part.support.source for part in prepared))),
    ]
    origin = provenance(fitted.settings or settings, method.uses, robot.path, choices)
    evidence = _evidence(fitted, friction, prepared, robot, law, origin)
    r2, change = _held_out(fitted, friction, prepared, robot, law)
    of_logs = [own_friction(part.samples, fitted.fits, law, robot, fitted.couplings) for part in friction.logs]
    fits = fitted.fits
    fitted = _finished(fitted, robot, log, gain_errors)
    corrections = fitted.corrections and replace(fitted.corrections, held_out_change=change)
    rolls = any(contact.radius and contact.given for contact in robot.contacts.values())  # not one from the log
    samples = filled(evidence.samples, fitted.fits, law) if rolls else evidence.samples
    ranges = _position_ranges(prepared, robot)
    joints = _joints(fitted, samples, law, settings)
    for name, joint in joints.items():
        joint = with_torque_r2(joint, r2.get(name), robot.base == "fixed", fitted.body_corrections.get(name, 0.0))
        joints[name] = replace(joint, position_range=ranges.get(name))
    removed = fitted.corrections.log_friction if fitted.corrections else {}
    joints = with_next_log(joints, of_logs, fits, law, removed)
    return Result(
        robot=robot.name,
        robot_file=FileStamp(path=str(Path(robot.path).resolve()), sha256=sha256(robot.path)) if robot.path else None,
        log=log_summary([part.log for part in prepared], prepared[0].sampling.rate, sum(p.used for p in friction.logs)),
        law=law.name,
        method=method.name,
        joints={name: joints[name] for name in friction.samples.joint_names},
        couplings={
            name: CouplingResult(**vars(joints[name]), joints=robot.couplings[name]) for name in fitted.couplings
        },
        findings=[
            *model_findings(robot),
            *merged([(name, part.findings) for name, part in zip(log_names(prepared), friction.logs, strict=True)]),
            *passivity_violated(joints, evidence.samples),
            *SERVICES["inseparable_delays"](joints, log, robot),
            *fitted.findings,
        ],
        corrections=_with_command_delays(corrections, log),
        stribeck=__version__,
        evidence=evidence,
    )


def _finished(fitted: Fitted, robot: Robot, log: RobotLog, gain_errors: Mapping[str, float]) -> Fitted:
    """Add gain errors and the model's rotors to the fits, and divide joints with rough gains by them."""
    fits = {name: with_gain_error(fit, gain_errors.get(name, 0.0)) for name, fit in fitted.fits.items()}
    rotors = dict(zip(robot.joint_names, robot.armature.tolist(), strict=True))
    fits |= {name: with_armature(fit, rotors[name]) for name, fit in fits.items() if name in rotors}
    validations, terms = dict(fitted.validations), dict(fitted.terms)
    for name, gain in log.unscaled.items():
        if name in fits:
            fits[name] = in_channel_unit(fits[name], gain)
        if (validation := validations.get(name)) is not None:
            validations[name] = Validation(**{key: value / gain for key, value in vars(validation).items()})
        if name in terms:
            loads = {key: getattr(terms[name], key) / gain for key in ("mean_load", "load_deviation")}
            terms[name] = replace(terms[name], **loads)
    return replace(fitted, fits=fits, validations=validations, terms=terms)


def _with_command_delays(corrections: Corrections | None, log: RobotLog) -> Corrections | None:
    """Add the delay of each joint's commands, which is found before the fit."""
    if corrections is None or not log.command_delays:
        return corrections
    return replace(corrections, command_delay=dict(zip(log.joint_names, log.command_delays, strict=True)))


def _joints(fitted: Fitted, samples: FrictionSamples, law: FrictionLaw, settings: Settings) -> dict[str, JointResult]:
    """Judge every joint and coupling, and add the terms of the law "auto"."""
    joints = judge(fitted.fits, samples, law, settings, fitted.validations, fitted.criteria, fitted.disturbed)
    if all(joint.verdict == "not excited" for joint in joints.values()):
        raise NothingIdentifiedError(why_none({name: joint.reason for name, joint in joints.items()}))
    for name, joint in joints.items():
        if joint.parameters:
            joints[name] = replace(joint, correlation=fitted.fits[name].correlation(tuple(joint.parameters)))
    explained = [  # residuals of the joints whose load the model explains
        residual
        for name, terms in fitted.terms.items()
        if joints[name].torque_unit is None
        and (residual := joints[name].residual_rms)
        and residual <= 0.5 * terms.mean_load
    ]
    for name, terms in fitted.terms.items():
        if joints[name].parameters:
            noise = 0.0 if joints[name].torque_unit else min(explained, default=0.0)
            joints[name] = with_terms(joints[name], terms, noise)
    for name, where in fitted.rubbing.items():
        if joints[name].verdict == "identified":
            why = Reason(f"the joint rubs {where}, and the curve is valid elsewhere", remedy="find what rubs")
            joints[name] = replace(joints[name], verdict="weak", **why.fields)
    for name in fitted.robot.bare & fitted.fits.keys():
        where = ", ".join(each for each in fitted.couplings if name in fitted.robot.couplings[each])
        why = Reason(f"the friction of this joint is the friction of {where}")
        joints[name] = replace(joints[name], verdict="no friction", curve=(), terms=None, **why.fields)
    return joints


def _held_out(
    fitted: Fitted, friction: LogsFriction, prepared: Logs, robot: Robot, law: FrictionLaw
) -> tuple[dict[str, TorqueR2], tuple[float, float] | None]:
    """Compute the explained share of each joint's torque on held-out parts, and what corrected inertias change."""
    if fitted.unseen is None:
        return {}, None
    fits = fitted.unseen.fits
    given = fitted.unseen.samples(friction, prepared, robot)
    parts = [swinging(part, robot) for part in given if part.torque is not None]
    torques, errors, shares = list[Array](), list[Array](), list[dict[str, float]]()
    for samples in (own_friction(part, fits, law, robot, fitted.couplings) for part in parts):
        assert samples.torque is not None
        measured = samples.torque.shape[1]  # couplings have no measured torque
        torques.append(samples.torque)
        errors.append(friction_errors(samples, fits, law)[:, :measured])
        names, velocity = samples.joint_names[:measured], samples.velocity[:, :measured]
        (explained,) = torque_errors(names, velocity, samples.torque, errors[-1:], rest=0.0)
        shares.append({name: error.r2 for name, error in explained.items()})
    if len(shares) < 2:
        return {name: TorqueR2(nominal=share) for of_joints in shares for name, share in of_joints.items()}, None
    r2 = {name: TorqueR2(nominal=share, corrected=shares[1].get(name)) for name, share in shares[0].items()}
    return r2, change_by_inertias(torques[0], *errors)


def _position_ranges(prepared: Logs, robot: Robot) -> dict[str, tuple[float, float]]:
    """Find the lowest and highest position of each joint [rad], [m]."""
    low = np.min([np.nanmin(part.log.position, axis=0) for part in prepared], axis=0)
    high = np.max([np.nanmax(part.log.position, axis=0) for part in prepared], axis=0)
    return dict(zip(robot.joint_names, zip(low.tolist(), high.tolist(), strict=True), strict=True))


def _evidence(
    fitted: Fitted,
    friction: LogsFriction,
    prepared: Logs,
    robot: Robot,
    law: FrictionLaw,
    origin: list[tuple[str, str]],
) -> Evidence:
    """Collect the data that the report draws, in the units of the channels."""
    log = prepared[0].log
    both = friction.samples, friction.logs[0].close_up
    shown = [own_friction(part, fitted.fits, law, robot, fitted.couplings) for part in both]
    correction = None if fitted.robot is robot else before_and_after(friction, prepared, robot)
    if log.unscaled:
        shown = [in_channel_units(part, log) for part in shown]
        correction = correction and (in_channel_units(correction[0], log), in_channel_units(correction[1], log))
    samples, close_up = shown
    return Evidence(
        samples=samples,
        phases=timeline(friction, prepared, fitted.set_aside),
        close_up=close_up,
        provenance=origin,
        prismatic=frozenset(name for column, name in enumerate(samples.joint_names) if samples.slides(column)),
        notes=[
            *(note for part in prepared for note in part.notes),
            *fitted.notes,
            *friction.notes,
            *(note for part in friction.logs for note in part.notes),
        ],
        correction=correction,
        torque_source=log.torque_source,
        robot=robot,
    )

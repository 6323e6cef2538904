"""Compose the result and its evidence from a method's fits and the friction torque of the samples."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from stribeck.audit import inseparable_delays, model_findings
from stribeck.base.finding import merged
from stribeck.base.version import __version__
from stribeck.errors import NothingIdentifiedError
from stribeck.friction import FrictionLaw
from stribeck.friction_torque.preparation import Logs, log_names
from stribeck.friction_torque.samples import FrictionSamples
from stribeck.friction_torque.stage import LogsFriction, thinned_samples
from stribeck.friction_torque.thinning import join_logs, take
from stribeck.judgement.excitation import why_none
from stribeck.judgement.joint_fit import JointFit, in_channel_unit, with_gain_error
from stribeck.judgement.own_friction import own_friction
from stribeck.judgement.passivity import passivity_violated
from stribeck.judgement.reason import Reason
from stribeck.judgement.torque_error import torque_r2
from stribeck.judgement.verdict import filled, judge, with_torque_r2
from stribeck.log import RobotLog
from stribeck.methods import Fitted, Method
from stribeck.result import Corrections, CouplingResult, Evidence, JointResult, Result, TorqueR2, Validation
from stribeck.result.provenance import log_summary, provenance
from stribeck.robot import Robot
from stribeck.settings import Settings
from stribeck.whole_log.terms.selection import with_terms


def compose(
    fitted: Fitted,
    friction: LogsFriction,
    prepared: Logs,
    robot: Robot,
    law: FrictionLaw,
    settings: Settings,
    method: Method,
    gain_errors: Mapping[str, float] | None = None,
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
    couplings = {name: robot.couplings[name] for name in fitted.couplings}
    fitted = replace(
        fitted,
        fits={name: with_gain_error(fit, (gain_errors or {}).get(name, 0.0)) for name, fit in fitted.fits.items()},
    )
    samples, close_up = (
        own_friction(part, fitted.fits, law, couplings) for part in (friction.samples, friction.logs[0].close_up)
    )
    fits = {name: _with_model_armature(fit, name, robot) for name, fit in fitted.fits.items()}
    correction = None if fitted.robot is robot else _before_and_after(friction, prepared, robot)
    if rough := (log := prepared[0].log).unscaled:
        samples, close_up = (_in_channel_units(part, log) for part in (samples, close_up))
        correction = correction and (_in_channel_units(correction[0], log), _in_channel_units(correction[1], log))
        fits |= {name: in_channel_unit(fits[name], gain) for name, gain in rough.items() if name in fits}
        fitted = _divided(fitted, rough)
    rolls = any(contact.radius and contact.given for contact in robot.contacts.values())  # not one from the log
    judged = filled(samples, fits, law) if rolls else samples
    r2, ranges = _torque_r2(fitted, friction, prepared, robot, law), _position_ranges(prepared, robot)
    found = {
        name: replace(with_torque_r2(joint, r2.get(name), robot.base == "fixed"), position_range=ranges.get(name))
        for name, joint in _joints(fitted, fits, judged, law, settings).items()
    }
    choices = [
        ("Filter", "; ".join(dict.fromkeys(part.filter_name for part in friction.logs))),
        ("Contact modes from", "; ".join(dict.fromkeys(part.support.source for part in prepared))),
    ]
    findings = [
        *model_findings(robot),
        *merged([(name, part.findings) for name, part in zip(log_names(prepared), friction.logs, strict=True)]),
        *passivity_violated(found, samples),
        *inseparable_delays(found, prepared[0].log, robot),
        *fitted.findings,
    ]
    return Result(
        robot=robot.name,
        log=log_summary(
            [part.log.path for part in prepared],
            [float(part.log.time[-1] - part.log.time[0]) for part in prepared],
            prepared[0].sampling.rate,
            sum(part.used for part in friction.logs),
            sum(len(part.log.time) for part in prepared),
        ),
        law=law.name,
        method=method.name,
        joints={name: found[name] for name in friction.samples.joint_names},
        couplings={name: CouplingResult(**vars(found[name]), joints=own) for name, own in couplings.items()},
        findings=findings,
        corrections=_with_command_delays(fitted.corrections, prepared[0].log),
        stribeck=__version__,
        evidence=_evidence(
            fitted,
            friction,
            (samples, close_up),
            prepared,
            correction,
            provenance(fitted.settings or settings, method.uses, robot.path, choices),
        ),
    )


def _in_channel_units(samples: FrictionSamples, log: RobotLog) -> FrictionSamples:
    """Divide the friction torque of joints by their rough gains."""
    names, unscaled = samples.joint_names, log.unscaled
    return replace(
        samples,
        friction_torque=samples.friction_torque / [unscaled.get(name, 1.0) for name in names],
        units=tuple(log.channel_unit(samples.slides(k)) * (name in unscaled) for k, name in enumerate(names)),
    )


def _divided(fitted: Fitted, rough: Mapping[str, float]) -> Fitted:
    """Divide the validations and loads of joints by their rough gains."""
    validations, terms = dict(fitted.validations), dict(fitted.terms)
    for name, gain in rough.items():
        if (own := validations.get(name)) is not None:
            validations[name] = Validation(**{key: value / gain for key, value in vars(own).items()})
        if name in terms:
            loads = {key: getattr(terms[name], key) / gain for key in ("mean_load", "load_deviation")}
            terms[name] = replace(terms[name], **loads)
    return replace(fitted, validations=validations, terms=terms)


def _with_command_delays(corrections: Corrections | None, log: RobotLog) -> Corrections | None:
    """Add the delay of each joint's commands, which is found before the fit."""
    if corrections is None or not log.command_delays:
        return corrections
    return replace(corrections, command_delay=dict(zip(log.joint_names, log.command_delays, strict=True)))


def _joints(
    fitted: Fitted, fits: Mapping[str, JointFit], samples: FrictionSamples, law: FrictionLaw, settings: Settings
) -> dict[str, JointResult]:
    """Judge every joint and coupling, and add the terms of the law "auto"."""
    joints = judge(fits, samples, law, settings, fitted.validations, fitted.criteria, fitted.disturbed)
    if all(joint.verdict == "not excited" for joint in joints.values()):
        raise NothingIdentifiedError(why_none({name: joint.reason for name, joint in joints.items()}))
    for name, joint in joints.items():
        if joint.parameters:
            joints[name] = replace(joint, correlation=_correlation(fits[name], tuple(joint.parameters)))
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
    return joints


def _torque_r2(
    fitted: Fitted, friction: LogsFriction, prepared: Logs, robot: Robot, law: FrictionLaw
) -> dict[str, TorqueR2]:
    """Compute the share of each joint's torque that is explained on held-out parts."""
    if fitted.unseen is None:
        return {}
    fits, couplings = fitted.unseen.fits, {name: robot.couplings[name] for name in fitted.couplings}
    shares = [
        torque_r2(own_friction(_swinging(part, robot), fits, law, couplings), fits, law)
        for part in fitted.unseen.samples(friction, prepared, robot)
    ]
    return {
        name: TorqueR2(nominal=nominal, corrected=shares[1].get(name) if len(shares) > 1 else None)
        for name, nominal in (shares[0] if shares else {}).items()
    }


def _position_ranges(prepared: Logs, robot: Robot) -> dict[str, tuple[float, float]]:
    """Find the lowest and highest position of each joint [rad], [m]."""
    low = np.min([np.nanmin(part.log.position, axis=0) for part in prepared], axis=0)
    high = np.max([np.nanmax(part.log.position, axis=0) for part in prepared], axis=0)
    return dict(zip(robot.joint_names, zip(low.tolist(), high.tolist(), strict=True), strict=True))


def _correlation(fit: JointFit, names: tuple[str, ...]) -> tuple[tuple[float, ...], ...]:
    """Compute the correlation of the errors of some parameters; a parameter without error is correlated with none."""
    own = [fit.names.index(name) for name in names]
    covariance = fit.covariance[np.ix_(own, own)]
    errors = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.divide(1.0, errors, out=np.zeros_like(errors), where=errors > 0)
    found = covariance * np.outer(scale, scale)
    np.fill_diagonal(found, 1.0)
    return tuple(tuple(row) for row in np.round(found.clip(-1.0, 1.0), 6).tolist())


def _evidence(
    fitted: Fitted,
    friction: LogsFriction,
    shown: tuple[FrictionSamples, FrictionSamples],
    prepared: Logs,
    correction: tuple[FrictionSamples, FrictionSamples] | None,
    origin: list[tuple[str, str]],
) -> Evidence:
    """Collect the data that the report draws."""
    samples, close_up = shown
    return Evidence(
        samples=samples,
        phases=_phases(fitted, friction, prepared),
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
        torque_source=prepared[0].log.torque_source,
    )


def _phases(fitted: Fitted, friction: LogsFriction, prepared: Logs) -> list[tuple[float, float, str, bool]]:
    """List the phases of the timeline: contact modes, and spans that are excluded or set aside."""
    found: list[tuple[float, float, str, bool]] = []
    for k, (part, log) in enumerate(zip(friction.logs, (each.log for each in prepared), strict=True)):
        kinds = {"set aside": fitted.set_aside[k] if fitted.set_aside else (), "excluded": log.excluded}
        spans = [(log.start + a, log.start + b, kind, False) for kind, own in kinds.items() for a, b, _ in own]
        found += sorted([*part.phases, *spans], key=lambda phase: phase[0])
    return found


def _before_and_after(friction: LogsFriction, prepared: Logs, robot: Robot) -> tuple[FrictionSamples, FrictionSamples]:
    """Select samples of free and swinging limbs, with robot and logs as given and as corrected.

    These limbs show best how a model affects friction.
    """
    settings, samples = friction.settings.model_copy(update={"standing_legs": False}), friction.samples
    before = join_logs([thinned_samples(log, len(prepared), robot, settings, most=10_000) for log in prepared])
    return before, _swinging(take(samples, np.isin(samples.time, before.time)), robot)


def _swinging(samples: FrictionSamples, robot: Robot) -> FrictionSamples:
    """Mark only samples of free and swinging limbs as usable."""
    feet = [tuple(foot for foot in name.split("+") if foot in robot.contacts) for name in samples.support_names]
    standing = np.array([robot.standing(standing) for standing in feet])
    swinging = ~standing[:, robot.torque_controlled][samples.support]
    return replace(samples, usable=samples.usable & swinging)


def _with_model_armature(fit: JointFit, name: str, robot: Robot) -> JointFit:
    """Add the model's rotor inertia to the fitted one, which is the difference from the model."""
    rotor = np.array([parameter.name == "armature" for parameter in fit.parameters])
    if name not in robot.joint_names or not rotor.any():
        return fit
    added = float(robot.armature[robot.joint_names.index(name)]) * rotor
    parameters = [replace(p, lower=p.lower + more) for p, more in zip(fit.parameters, added.tolist(), strict=True)]
    intervals = fit.intervals + added[:, None]
    return replace(fit, parameters=tuple(parameters), values=fit.values + added, intervals=intervals)

"""The result and its evidence, from what a method found and the friction torque that shows it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from stribeck.errors import NothingIdentifiedError
from stribeck.friction import FrictionLaw
from stribeck.friction_torque.stage import FrictionSamples, thinned_samples
from stribeck.friction_torque.thinning import join_logs
from stribeck.identification.joint_fit import JointFit
from stribeck.identification.judgement.own_friction import own_friction
from stribeck.identification.judgement.verdict import judge
from stribeck.identification.whole_log.terms.selection import with_terms
from stribeck.methods import Finding, Method
from stribeck.preparation import PreparedLog
from stribeck.result import CouplingResult, Evidence, JointResult, Result
from stribeck.result.provenance import log_summary, provenance
from stribeck.robot import Robot
from stribeck.samples import Samples
from stribeck.settings import Settings
from stribeck.version import __version__

MOST_ADDED = 0.4
"""Share of samples with positive friction power above which a joint's signals or model must be wrong."""


def compose(
    finding: Finding,
    friction: FrictionSamples,
    prepared: Sequence[PreparedLog],
    robot: Robot,
    law: FrictionLaw,
    settings: Settings,
    method: Method,
) -> Result:
    """Put the findings together.

    Parameters
    ----------
    finding, friction
        Of the method, and the friction torque of its robot and logs.
    prepared, robot
        As they were given.
    law, settings, method
        That were asked for.

    Raises
    ------
    NothingIdentifiedError
        If no joint moves enough for any number.
    """
    couplings = {name: robot.couplings[name] for name in finding.couplings}
    samples, close_up = (
        own_friction(part, finding.fits, law, couplings) for part in (friction.samples, friction.logs[0].close_up)
    )
    fits = {name: _with_model_armature(fit, name, robot) for name, fit in finding.fits.items()}
    found = _joints(finding, fits, samples, law, settings)
    joints = {name: found[name] for name in friction.samples.joint_names}
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
        joints=joints,
        couplings={name: CouplingResult(**vars(found[name]), joints=own) for name, own in couplings.items()},
        warnings=[
            *robot.warnings,
            *(warning for part in friction.logs for warning in part.warnings),
            *_passivity_violated(found),
            *finding.warnings,
        ],
        corrections=finding.corrections,
        stribeck=__version__,
        evidence=_evidence(
            finding,
            friction,
            (samples, close_up),
            prepared,
            robot,
            provenance(settings, method.uses, robot.path, _choices(friction, prepared)),
        ),
    )


def _joints(
    finding: Finding, fits: Mapping[str, JointFit], samples: Samples, law: FrictionLaw, settings: Settings
) -> dict[str, JointResult]:
    """Return what is said of every joint and coupling, with the terms of the law "auto"."""
    joints = judge(fits, samples, law, settings, finding.validations, finding.criteria)
    if all(joint.verdict == "not excited" for joint in joints.values()):
        reasons = "; ".join(f"{name}: {joint.reason}" for name, joint in list(joints.items())[:3])
        raise NothingIdentifiedError(f"no joint can be identified from this log: {reasons}")
    for name, (terms, load, direction, per_turn) in finding.terms.items():
        if joints[name].parameters:
            joints[name] = with_terms(joints[name], terms, load, direction, per_turn)
    return joints


def _choices(friction: FrictionSamples, prepared: Sequence[PreparedLog]) -> list[tuple[str, str]]:
    """Return label and text of what was chosen by the logs."""
    filters = dict.fromkeys(part.filter_name for part in friction.logs)
    sources = dict.fromkeys(part.support.source for part in prepared)
    return [("Filter", "; ".join(filters)), ("Contact modes from", "; ".join(sources))]


def _evidence(
    finding: Finding,
    friction: FrictionSamples,
    shown: tuple[Samples, Samples],
    prepared: Sequence[PreparedLog],
    robot: Robot,
    origin: list[tuple[str, str]],
) -> Evidence:
    """Return what the report draws."""
    samples, close_up = shown
    return Evidence(
        samples=samples,
        covariance={joint: fit.covariance for joint, fit in finding.fits.items()},
        phases=[phase for part in friction.logs for phase in part.phases],
        close_up=close_up,
        provenance=origin,
        prismatic=frozenset(name for column, name in enumerate(samples.joint_names) if samples.slides(column)),
        notes=[
            *(note for part in prepared for note in part.notes),
            *finding.notes,
            *friction.notes,
            *(note for part in friction.logs for note in part.notes),
        ],
        correction=None if finding.robot is robot else _before_and_after(friction, prepared, robot),
    )


def _before_and_after(
    friction: FrictionSamples, prepared: Sequence[PreparedLog], robot: Robot
) -> tuple[Samples, Samples]:
    """Return the samples of free and swinging limbs by robot and logs as given, and as corrected.

    These limbs show best what a model does to friction.
    """
    settings, samples = friction.settings.model_copy(update={"standing_legs": False}), friction.samples
    before = join_logs([thinned_samples(log, len(prepared), robot, settings) for log in prepared])
    feet = [tuple(foot for foot in name.split("+") if foot in robot.contacts) for name in samples.support_names]
    standing = np.array([robot.standing(standing) for standing in feet])
    swinging = ~standing[:, robot.torque_controlled][samples.support]
    return before, replace(samples, usable=samples.usable & swinging)


def _passivity_violated(joints: dict[str, JointResult]) -> list[str]:
    """Return a warning about joints whose friction adds power nearly as often as it takes it (7.9).

    In noise and at rest a joint does so too: where the curve is known to resist, or to be next to nothing, all is well.
    """
    weak = {name: joint for name, joint in joints.items() if joint.verdict == "weak"}
    names = [name for name, joint in weak.items() if (joint.positive_power_fraction or 0.0) > MOST_ADDED]
    if not names:
        return []
    return [
        f"passivity violated, friction adds power in over {100 * MOST_ADDED:.0f} % of the samples: {', '.join(names)}; "
        "they have hardly any friction, or signs, delays ('stribeck inspect') or inertias are wrong"
    ]


def _with_model_armature(fit: JointFit, name: str, robot: Robot) -> JointFit:
    """Add what the model already has to a fitted rotor inertia, which is what it lacks."""
    rotor = np.array([parameter.name == "armature" for parameter in fit.parameters])
    if name not in robot.joint_names or not rotor.any():
        return fit
    added = float(robot.armature[robot.joint_names.index(name)]) * rotor
    parameters = [replace(p, lower=p.lower + more) for p, more in zip(fit.parameters, added.tolist(), strict=True)]
    intervals = fit.intervals + added[:, None]
    return replace(fit, parameters=tuple(parameters), values=fit.values + added, intervals=intervals)

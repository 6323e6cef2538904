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
from stribeck.identification.judgement.verdict import judge
from stribeck.identification.whole_log.terms.selection import with_terms
from stribeck.methods import Finding, Method
from stribeck.preparation import PreparedLog
from stribeck.result import Evidence, JointResult, Result
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
    joints = _joints(finding, friction.samples, law, settings)
    return Result(
        robot=robot.name,
        log=log_summary(
            [part.log.path for part in prepared],
            [float(part.log.time[-1] - part.log.time[0]) for part in prepared],
            prepared[0].sampling.rate,
            sum(part.used for part in friction.logs),
            sum(len(part.log.time) for part in prepared),
        ),
        law=settings.law,
        method=method.name,
        joints=_with_model_armature(joints, robot),
        warnings=[
            *robot.warnings,
            *(warning for part in prepared for warning in part.warnings),
            *(warning for part in friction.logs for warning in part.warnings),
            *_passivity_violated(joints),
            *finding.warnings,
        ],
        corrections=finding.corrections,
        stribeck=__version__,
        evidence=_evidence(
            finding,
            friction,
            prepared,
            robot,
            provenance(settings, method.uses, robot.path, _choices(friction, prepared)),
        ),
    )


def _joints(finding: Finding, samples: Samples, law: FrictionLaw, settings: Settings) -> dict[str, JointResult]:
    """Return what is said of every joint, with the terms of the law "auto"."""
    joints = judge(finding.fits, samples, law, settings, finding.validations, finding.criteria)
    if all(joint.verdict == "not excited" for joint in joints.values()):
        reasons = "; ".join(f"{name}: {joint.reason}" for name, joint in list(joints.items())[:3])
        raise NothingIdentifiedError(f"no joint can be identified from this log: {reasons}")
    for name, (terms, load) in finding.terms.items():
        if joints[name].parameters:
            joints[name] = with_terms(joints[name], terms, load)
    return joints


def _choices(friction: FrictionSamples, prepared: Sequence[PreparedLog]) -> list[tuple[str, str]]:
    """Return label and text of what was chosen by the logs."""
    filters = dict.fromkeys(part.filter_name for part in friction.logs)
    sources = dict.fromkeys(part.support.source for part in prepared)
    return [("Filter", "; ".join(filters)), ("Contact modes from", "; ".join(sources))]


def _evidence(
    finding: Finding,
    friction: FrictionSamples,
    prepared: Sequence[PreparedLog],
    robot: Robot,
    origin: list[tuple[str, str]],
) -> Evidence:
    """Return what the report draws."""
    slides = zip(robot.joint_names, robot.prismatic, strict=True)
    return Evidence(
        samples=_without_armature(friction.samples, finding.fits),
        covariance={joint: fit.covariance for joint, fit in finding.fits.items()},
        phases=[phase for part in friction.logs for phase in part.phases],
        close_up=_without_armature(friction.logs[0].close_up, finding.fits),
        provenance=origin,
        prismatic=frozenset(name for name, prismatic in slides if prismatic),
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
    """Return a warning about joints whose friction adds power nearly as often as it takes it (7.9)."""
    names = [name for name, joint in joints.items() if (joint.positive_power_fraction or 0.0) > MOST_ADDED]
    if not names:
        return []
    return [
        f"passivity violated, friction adds power in over {100 * MOST_ADDED:.0f} % of the samples: {', '.join(names)}; "
        "they have hardly any friction, or signs, delays ('stribeck inspect') or inertias are wrong"
    ]


def _without_armature(samples: Samples, fits: Mapping[str, JointFit]) -> Samples:
    """Take the torque of fitted rotor inertias out of the friction torque."""
    friction = samples.friction_torque.copy()
    for joint, fit in fits.items():
        if "armature" in fit.names:
            column = samples.joint_names.index(joint)
            friction[:, column] -= fit.values[fit.names.index("armature")] * samples.acceleration[:, column]
    return replace(samples, friction_torque=friction)


def _with_model_armature(joints: dict[str, JointResult], robot: Robot) -> dict[str, JointResult]:
    """Add what the model already has to the fitted rotor inertias, which are what it lacks."""
    changed = dict(joints)
    for name, joint in joints.items():
        if (lacking := joint.parameters.get("armature")) is not None:
            modelled = float(robot.armature[robot.joint_names.index(name)])
            low, high = lacking.interval_95
            interval = (low + modelled, high + modelled)
            total = replace(lacking, value=lacking.value + modelled, interval_95=interval)
            changed[name] = replace(joint, parameters={**joint.parameters, "armature": total})
    return changed

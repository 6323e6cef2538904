"""The spine: from logs to a result, a line a stage."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np

from stribeck.collect import join_logs
from stribeck.errors import NothingIdentifiedError, SettingsError, findings_kept
from stribeck.friction import AUTO, get_law
from stribeck.friction_table import friction_table
from stribeck.identification.curve_fit import JointFit, fit_law
from stribeck.identification.selection import with_terms
from stribeck.identification.verdict import judge
from stribeck.log import RobotLog
from stribeck.provenance import log_summary, provenance
from stribeck.result import Evidence, JointResult, Result
from stribeck.robot import Robot
from stribeck.samples import Samples
from stribeck.settings import Settings
from stribeck.survey import Progress, Survey, quiet, survey, thinned_samples
from stribeck.threads import one_blas_thread
from stribeck.version import __version__
from stribeck.whole_log import WholeLog, find_whole_log

UNUSED = {"whole-log": ("loss", "averaged_law"), "curve-fit": ("intervals",)}
"""Settings by the method that does not use them."""

UNPHYSICAL = 0.4
"""Share of samples with positive friction power above which a joint's signals or model must be wrong."""


def identify(
    logs: RobotLog | str | Path | Sequence[RobotLog | str | Path],
    robot: Robot,
    settings: Settings | None = None,
    *,
    table: str | Path | None = None,
    progress: Progress = quiet,
) -> Result:
    """Find the friction of every joint of a robot from one log or several: the main job.

    Parameters
    ----------
    logs
        Logs or their paths. Paths are read one after another, so that one log at a time is in memory.
    robot
        The robot.
    settings
        The robot file's if None.
    table
        Where to write every sample's friction torque (friction_torque.parquet), if anywhere.
    progress
        Told how far the work is.

    Returns
    -------
    result
        With the evidence that `write_report` draws.

    Raises
    ------
    LogError, SettingsError
        If the input or the settings are wrong.
    NothingIdentifiedError
        If no joint moves enough for any number; what was found before an error are its notes.
    """
    settings = settings or robot.settings
    law = get_law(settings.law)
    _refuse_unknown_joints(settings, robot)
    _refuse_unused(settings)
    _refuse_auto(settings)
    sources = [logs] if isinstance(logs, RobotLog | str | Path) else list(logs)
    writer = friction_table(table) if table else nullcontext(_drop)
    with one_blas_thread(), findings_kept(robot.warnings) as findings, writer as write:
        found = find_whole_log(sources, robot, law, settings, progress) if settings.method == "whole-log" else None
        given, correction = robot, None
        as_used: Iterable[RobotLog | str | Path] = sources
        if found:
            robot, as_used = found.robot, map(found.corrected, found.given)
            settings = settings.model_copy(update={"standing_legs": True, "double_support": "skip"})
        surveys: list[Survey] = []
        for k, log in enumerate(as_used):
            surveys.append(survey(log, k, len(sources), robot, settings, write, progress))
            findings += [*surveys[-1].notes, *surveys[-1].warnings]
            # One filter for all logs: parameters from different bandwidths do not mix.
            settings = settings.model_copy(update={"filter": surveys[0].filter_settings})
        progress("fitting", 0.0)
        samples = join_logs([part.samples for part in surveys])
        fits = found.fits if found else fit_law(samples, law, settings)
        joints = judge(fits, samples, law, settings, found.validations if found else None)
        joints = _with_terms(joints, found) if found else joints
        if all(joint.verdict == "not excited" for joint in joints.values()):
            reasons = "; ".join(f"{name}: {joint.reason}" for name, joint in list(joints.items())[:3])
            raise NothingIdentifiedError(f"no joint can be identified from this log: {reasons}")
        if found and settings.corrections != "none":
            progress("friction torque without corrections", 0.0)
            correction = _before_and_after(found, given, samples, settings)
    return _result(robot, settings, surveys, samples, fits, joints, found, correction)


def _refuse_unknown_joints(settings: Settings, robot: Robot) -> None:
    """Refuse rotor inertias of joints that get no friction."""
    asked = [] if isinstance(settings.fit_armature, bool) else settings.fit_armature
    known = [robot.joint_names[column] for column in robot.torque_controlled]
    unknown = [joint for joint in asked if joint not in known]
    if unknown:
        raise SettingsError(
            f"[identify] fit_armature names joint '{unknown[0]}'; the torque-controlled joints are {', '.join(known)}"
        )


def _refuse_unused(settings: Settings) -> None:
    """Refuse settings that the method does not listen to, and that would be taken to have done something."""
    for key in UNUSED[settings.method]:
        value = getattr(settings, key)
        if value != Settings.model_fields[key].default:
            raise SettingsError(
                f"[identify] {key} is {value!r}, which the method '{settings.method}' does not use; leave it out"
            )


def _refuse_auto(settings: Settings) -> None:
    """Refuse the law auto where nothing can choose it."""
    if settings.law == AUTO and settings.method != "whole-log":
        raise SettingsError(
            f"law '{AUTO}' needs method 'whole-log', found '{settings.method}'; set --method whole-log, or name a law"
        )


def _drop(*_: object) -> None:
    """Write nowhere."""


def _result(
    robot: Robot,
    settings: Settings,
    surveys: list[Survey],
    samples: Samples,
    fits: dict[str, JointFit],
    joints: dict[str, JointResult],
    found: WholeLog | None,
    correction: tuple[Samples, Samples] | None,
) -> Result:
    """Put the findings together."""
    filters = tuple(dict.fromkeys(part.filter_name for part in surveys))
    supports = tuple(dict.fromkeys(part.support_source for part in surveys))
    choices = [("Filter", "; ".join(filters)), ("Support from", "; ".join(supports))]
    first = surveys[0]
    return Result(
        robot=robot.name,
        log=log_summary(
            [part.path for part in surveys],
            [part.duration for part in surveys],
            first.rate,
            sum(part.used for part in surveys),
        ),
        law=settings.law,
        method=settings.method,
        joints=_with_model_armature(joints, robot),
        warnings=[
            *robot.warnings,
            *(warning for part in surveys for warning in part.warnings),
            *_energy_fed_in(joints),
            *(found.warnings if found else ()),
        ],
        corrections=found.corrections if found else None,
        stribeck=__version__,
        evidence=Evidence(
            samples=_without_armature(samples, fits),
            covariance={joint: fit.covariance for joint, fit in fits.items()},
            phases=[phase for part in surveys for phase in part.phases],
            stretch=_without_armature(first.stretch, fits),
            provenance=provenance(settings, robot.path, choices),
            prismatic=frozenset(
                name for name, slides in zip(robot.joint_names, robot.prismatic, strict=True) if slides
            ),
            notes=[note for part in surveys for note in part.notes],
            correction=correction,
        ),
    )


def _before_and_after(found: WholeLog, given: Robot, samples: Samples, settings: Settings) -> tuple[Samples, Samples]:
    """Return the samples of free and swinging limbs by robot and logs as given, and as corrected.

    These limbs show best what a model does to friction.
    """
    settings = settings.model_copy(update={"standing_legs": False})
    before = join_logs([thinned_samples(log, len(found.given), given, settings) for log in found.given])
    feet = [tuple(foot for foot in name.split("+") if foot in given.contacts) for name in samples.support_names]
    standing = np.array([given.standing(standing) for standing in feet])
    swinging = ~standing[:, given.torque_controlled][samples.support]
    return before, replace(samples, usable=samples.usable & swinging)


def _with_terms(joints: dict[str, JointResult], found: WholeLog) -> dict[str, JointResult]:
    """Add which terms were chosen, and why, to joints of the law auto."""
    changed = dict(joints)
    for name, (terms, load) in found.terms.items():
        if joints[name].parameters:
            changed[name] = with_terms(joints[name], terms, load)
    return changed


def _energy_fed_in(joints: dict[str, JointResult]) -> list[str]:
    """Return a warning about joints whose friction would push as often as it resists (7.9)."""
    names = [name for name, joint in joints.items() if (joint.positive_power_fraction or 0.0) > UNPHYSICAL]
    if not names:
        return []
    return [
        f"friction would feed energy in at over {100 * UNPHYSICAL:.0f} % of the samples, which none can: "
        f"{', '.join(names)}; they have none to speak of, or signs, delays ('stribeck inspect') or inertias are wrong"
    ]


def _without_armature(samples: Samples, fits: dict[str, JointFit]) -> Samples:
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
        if (found := joint.parameters.get("armature")) is not None:
            known = float(robot.armature[robot.joint_names.index(name)])
            low, high = found.interval_95
            total = replace(found, value=found.value + known, interval_95=(low + known, high + known))
            changed[name] = replace(joint, parameters={**joint.parameters, "armature": total})
    return changed

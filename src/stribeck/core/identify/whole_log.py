"""The method `whole-log`: friction of all joints, and corrections of the model, from the weak form of whole logs.

docs/estimator.md explains the mathematics.
"""

from collections import ChainMap
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import chain
from typing import Literal

import numpy as np

from stribeck.core.base.spans import Span, listed_spans, runs_of
from stribeck.core.equations.constants import ROUNDS
from stribeck.core.equations.friction_torque.preparation import Logs, PreparedLog, Progress, quiet
from stribeck.core.equations.whole_log.build import weak_form
from stribeck.core.equations.whole_log.equation_sequence import equation_sequence
from stribeck.core.equations.whole_log.noise import SMALLEST, without_spikes
from stribeck.core.errors import NothingIdentifiedError
from stribeck.core.estimator.describe import describe_corrections, joint_terms
from stribeck.core.estimator.estimate import WholeLogFit, fit_whole_log
from stribeck.core.estimator.fit_checks.competing_causes import find_causes
from stribeck.core.estimator.fit_checks.validation import validate
from stribeck.core.estimator.uncertainty.intervals import joint_fits
from stribeck.core.friction import AUTO, LAWS, FrictionLaw
from stribeck.core.friction.auto import AutoLaw
from stribeck.core.identify.causes_of_spans import FEW, find_causes_of_spans
from stribeck.core.identify.contract import SHARED, Fitted, FrictionTorque, Method, Unseen, cut
from stribeck.core.identify.corrected import LogCorrection, corrected_robot
from stribeck.core.identify.moving import joints_that_move
from stribeck.core.identify.whole_log_findings import find_problems
from stribeck.core.judgement.excitation import NOISE_FACTOR
from stribeck.core.judgement.weakness import Criteria
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.core.settings import Priors, Settings

CRITERIA = Criteria(assumes_exact_law=False, shares_shapes=True)
"""Intervals know how little a Stribeck velocity that is not cleared lets them say; shapes have a group prior."""


def identify_whole_log(
    prepared: Logs, robot: Robot, law: FrictionLaw, settings: Settings, progress: Callable[[float], None] = quiet
) -> WholeLogFit:
    """Fit a law to all joints that move enough, together with the model's corrections.

    Raises
    ------
    NothingIdentifiedError
        If no joint moves enough, or no segment can be used.
    """
    columns, couplings, top_speed = joints_that_move(prepared, robot, law, settings)
    wrenches = all(part.log.foot_wrench is not None for part in prepared)  # corrections are the same for all logs
    forms = [weak_form(robot, part, columns, settings, wrenches=wrenches, couplings=couplings) for part in prepared]
    noise = np.max([form.velocity_noise for form in forms], axis=0)
    rest = np.maximum(settings.rest * top_speed, NOISE_FACTOR * noise) * ~forms[0].bare
    equations, load = equation_sequence(forms, top_speed), np.zeros(4)
    if not equations:
        raise NothingIdentifiedError(
            "no joint can be identified from this log: every support phase is shorter than the filters' windows"
        )
    rounds = ROUNDS if any(form.floats for form in forms) else 0
    for turn in range(rounds + 1):
        fit = fit_whole_log(equations, law, rest, settings.priors, progress)
        load, before = fit.bodies[:1, :4], load
        if turn == rounds or np.abs(load - before).max(initial=0.0) < 1.0:  # prior standard deviation
            break
        corrected = corrected_robot(robot, equations.corrections, fit.corrections)
        equations = equation_sequence([replace(form, corrected=corrected) for form in forms], top_speed)
    return fit


def find(
    prepared: Logs, robot: Robot, law: FrictionLaw, settings: Settings, _: FrictionTorque, progress: Progress
) -> Fitted:
    """Run `identify_whole_log`, and correct the robot and logs.

    The report shows standing legs without the minimum-norm guess if the fit did not use it.
    """
    cleaned = [_without_spikes(part) for part in prepared]
    prepared = [part for part, _ in cleaned]
    if settings.corrections == "auto":
        settings = settings.model_copy(update={"corrections": usual_corrections(prepared, robot)})
    fit = identify_whole_log(prepared, robot, law, settings, lambda share: progress("fitting the whole log", share))
    fitted, correct = described(fit), _corrected(fit)[1]
    fitted = replace(
        fitted,
        unseen=_unseen(fit, prepared, fitted.set_aside),
        settings=settings.model_copy(update={"standing_legs": True}),
        notes=[*(note for _, note in cleaned if note), *fitted.notes],
    )
    del fit  # memory for the corrected logs
    return replace(fitted, logs=[replace(part, log=correct(part.log, k)) for k, part in enumerate(prepared)])


def described(fit: WholeLogFit) -> Fitted:
    """Describe a fit to whole logs by joint, with its findings."""
    aside, causes, of_spans = fit.read.spans(used=False), find_causes(fit), find_causes_of_spans(fit)
    largest = np.abs(causes.bodies).max(axis=1, initial=0.0).tolist()
    robot, correct = _corrected(fit)
    fitted = Fitted(
        fits=joint_fits(fit),
        validations=dict(zip(fit.joints, validate(fit.read, fit.trained.values), strict=True)),
        robot=robot,
        logs=(),
        correct=correct,
        criteria=CRITERIA,
        corrections=describe_corrections(fit),
        body_corrections=dict(zip(fit.fit.model.layout.bodies, largest, strict=True)),
        terms=joint_terms(fit),
        couplings=tuple(robot.couplings),
        set_aside=aside,
        disturbed=f"from {listed_spans(list(chain(*aside)))}" if fit.read.set_aside > FEW else "",
        rubbing=of_spans.rubbing,
        notes=_notes(fit, aside),
    )
    return replace(fitted, findings=find_problems(fit, fitted, causes, of_spans))


def _corrected(fit: WholeLogFit) -> tuple[Robot, LogCorrection]:
    """Correct the robot, and make the function that removes the estimated sensor errors from a log."""
    layout, columns = fit.fit.model.layout, fit.read.equations.forms[0].joints
    robot = corrected_robot(fit.robot, layout, fit.corrections)
    return robot, LogCorrection(robot, columns, layout, fit.corrections, fit.delay)


def _notes(fit: WholeLogFit, aside: Sequence[Sequence[Span]]) -> list[str]:
    """Write notes on segments that were skipped, outliers, and compensation by the drives."""
    read, whole = len(fit.read.windows), len(fit.read.equations)
    notes = [f"{read} of {whole} segments of the log are read, evenly spread."] if read < whole else []
    if 0 < fit.read.set_aside <= FEW:
        notes.append(f"Outliers are set aside: {listed_spans(list(chain(*aside)))}.")
    if fit.robot.torque_source == "command":
        notes.append("The commanded torques are assumed to include any friction compensation of the drives.")
    return notes


def _unseen(fit: WholeLogFit, prepared: Logs, aside: Sequence[Sequence[Span]]) -> Unseen | None:
    """Evaluate the fit without the held-out segments on their undisturbed parts, with the delay of the whole logs."""
    if not fit.read.held_out:
        return None
    before = replace(fit, fit=fit.trained)
    robot, correct = _corrected(before)
    rows: list[list[slice]] = [[] for _ in prepared]
    for log, segment in fit.read.held_out:
        rows[log].append(slice(segment.first, segment.last))
    logs = [
        replace(part, support=cut(part.support, _without(part.log, parts, spans)))
        for part, parts, spans in zip(prepared, rows, aside, strict=True)
    ]
    return Unseen(fits=joint_fits(before), robot=robot, logs=logs, correct=correct)


def _without(log: RobotLog, parts: Sequence[slice], spans: Sequence[Span]) -> list[slice]:
    """Cut spans of a log out of parts of it."""
    kept, since = np.zeros(len(log.time), dtype=bool), log.time - log.start
    for part in parts:
        kept[part] = True
    for span in spans:
        kept[(since >= span.start) & (since <= span.end)] = False
    return [slice(*run) for run in runs_of(kept).tolist()]


def usual_corrections(prepared: Logs, robot: Robot) -> Literal["inertia", "calibration"]:
    """Choose the default corrections: calibration is included if the robot stands on one sole at a time.

    On a fixed base and on both feet, gains and friction are correlated; loops of point feet cannot be used with encoder
    zeros.
    """
    if robot.loops:  # encoder zeros of a chain that is closed are not independent
        return "inertia"
    rows = dict.fromkeys(("single", "double"), 0)
    for phase in (phase for part in prepared for phase in part.support.phases if phase.kind in rows):
        rows[phase.kind] += phase.stop - phase.start
    soles = {contact.kind for contact in robot.contacts.values()} == {"surface"}
    return "calibration" if soles and rows["single"] > 0.1 * rows["double"] else "inertia"


def _without_spikes(prepared: PreparedLog) -> tuple[PreparedLog, str]:
    """Remove spikes from positions and torques of a log, and write a note, empty if there were none."""
    log, unbroken = prepared.log, prepared.sampling.segments
    position, of_position = without_spikes(log.position, unbroken, SMALLEST.position, smooth=True)
    torque, of_torque = without_spikes(log.torque, unbroken, SMALLEST.torque, smooth=False)
    external = log.external_torque
    if external is not None:
        external, of_external = without_spikes(external, unbroken, SMALLEST.torque, smooth=False)
        of_torque += of_external
    if not of_position + of_torque:
        return prepared, ""
    note = f"Spikes are replaced by interpolation: {of_position} in positions, {of_torque} in torques."
    return replace(prepared, log=replace(log, position=position, torque=torque, external_torque=external)), note


WHOLE_LOG = Method(
    name="whole-log",
    uses=(SHARED - {"standing_legs"})
    | {"double_support", "corrections"}
    | {f"priors.{key}" for key in Priors.model_fields},
    laws=ChainMap[str, type[FrictionLaw]](LAWS, {AUTO: AutoLaw}),
    defaults=lambda _: {"law": AUTO},
    find=find,
    loops=True,
)

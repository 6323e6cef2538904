"""The method `whole-log`: friction of all joints, and corrections of the model, from the weak form of whole logs.

docs/estimator.md explains the mathematics.
"""

from collections import ChainMap
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Literal

import numpy as np

from stribeck.core.base.spans import Span
from stribeck.core.base.typing import IntArray
from stribeck.core.equations.constants import ROUNDS
from stribeck.core.equations.friction_torque.preparation import Logs, PreparedLog, Progress, quiet
from stribeck.core.equations.whole_log.build import WeakForm, weak_form
from stribeck.core.equations.whole_log.equation_sequence import equation_sequence
from stribeck.core.equations.whole_log.noise import SMALLEST, without_spikes
from stribeck.core.errors import NothingIdentifiedError
from stribeck.core.estimator.estimate import WholeLogFit, fit_whole_log
from stribeck.core.friction import AUTO, LAWS, FrictionLaw
from stribeck.core.friction.auto import AutoLaw
from stribeck.core.identify.causes_of_spans import find_causes_of_spans
from stribeck.core.identify.contract import SHARED, Fitted, FrictionTorque, Method, Unseen, cut
from stribeck.core.identify.corrected import corrected_robot
from stribeck.core.identify.moving import joints_that_move
from stribeck.core.identify.whole_log_findings import find_problems
from stribeck.core.identify.whole_log_fitted import FEW, WholeLog
from stribeck.core.judgement.excitation import NOISE_FACTOR
from stribeck.core.judgement.weakness import Criteria
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.core.settings import Priors, Settings

CRITERIA = Criteria(assumes_exact_law=False, shares_shapes=True)
"""Intervals know how little a Stribeck velocity that is not cleared lets them say; shapes have a group prior."""


def identify_whole_log(
    prepared: Logs, robot: Robot, law: FrictionLaw, settings: Settings, progress: Callable[[float], None] = quiet
) -> WholeLog:
    """Fit a law to all joints that move enough, together with the model's corrections.

    Raises
    ------
    NothingIdentifiedError
        If no joint moves enough, or no segment can be used.
    """
    columns, couplings, top_speed = joints_that_move(prepared, robot, law, settings)
    forms = weak_forms(prepared, robot, columns, couplings, settings)
    noise = np.max([form.velocity_noise for form in forms], axis=0)
    rest = np.maximum(settings.rest * top_speed, NOISE_FACTOR * noise) * ~forms[0].bare
    equations, load = equation_sequence(forms, top_speed), np.zeros(4)
    if not equations:
        raise NothingIdentifiedError(
            "no joint can be identified from this log: every support phase is shorter than the filters' windows"
        )
    fit = fit_whole_log(equations, law, rest, settings.priors, progress)
    for _ in range(ROUNDS if any(form.floats for form in forms) else 0):
        load, before = fit.bodies[:1, :4], load
        if np.abs(load - before).max(initial=0.0) < 1.0:  # prior standard deviation
            break
        corrected = corrected_robot(robot, equations.corrections, fit.corrections)
        equations = equation_sequence([replace(form, corrected=corrected) for form in forms], top_speed)
        fit = fit_whole_log(equations, law, rest, settings.priors, progress)
    held_out: list[list[slice]] = [[] for _ in forms]
    for log, segment in fit.read.held_out:
        held_out[log].append(slice(segment.first, segment.last))
    aside, used = (_spans(prepared, fit, used=kind) for kind in (False, True))
    clear = fit.read.set_aside <= FEW
    carried, causes, rubbing = ([], {}, {}) if clear else find_causes_of_spans(robot, fit, aside, list(chain(*used)))
    robot = corrected_robot(robot, equations.corrections, fit.corrections)
    return WholeLog(
        **vars(fit),
        columns=columns,
        couplings=couplings,
        robot=robot,
        held_out=held_out,
        set_aside=aside,
        used=used,
        carried=carried,
        disturbances=causes,
        rubbing=rubbing,
    )


def _spans(prepared: Logs, fit: WholeLogFit, *, used: bool) -> list[list[Span]]:
    """Find the spans of each log whose windows are used, or set aside."""
    names = [Path(part.log.path).name if len(prepared) > 1 else "" for part in prepared]
    return [
        [Span(start - part.log.start, end - part.log.start, name) for start, end in fit.read.spans(k, used=used)]
        for k, (part, name) in enumerate(zip(prepared, names, strict=True))
    ]


def weak_forms(
    prepared: Logs, robot: Robot, columns: IntArray, couplings: Sequence[str], settings: Settings
) -> list[WeakForm]:
    """Build the equations of motion of logs, with foot wrenches if every log has them."""
    wrenches = all(part.log.foot_wrench is not None for part in prepared)  # corrections are the same for all logs
    return [weak_form(robot, part, columns, settings, wrenches=wrenches, couplings=couplings) for part in prepared]


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
    fitted = Fitted(
        fits=fit.fits,
        validations=dict(zip(fit.joints, fit.validation, strict=True)),
        unseen=_unseen(fit, prepared, robot),
        robot=fit.robot,
        logs=(),
        correct=(correct := fit.correct),
        settings=settings.model_copy(update={"standing_legs": True}),
        criteria=CRITERIA,
        corrections=fit.described,
        body_corrections=fit.body_corrections,
        terms=fit.joint_terms,
        couplings=tuple(robot.couplings),
        set_aside=fit.set_aside,
        disturbed=fit.disturbed,
        rubbing={joint: rub.where for joint, rub in fit.rubbing.items()},
        findings=find_problems(fit),
        notes=[*(note for _, note in cleaned if note), *fit.notes],
    )
    del fit  # memory for the corrected logs
    return replace(fitted, logs=[replace(part, log=correct(part.log, k)) for k, part in enumerate(prepared)])


def _unseen(fit: WholeLog, prepared: Logs, robot: Robot) -> Unseen | None:
    """Evaluate the fit without the held-out segments on their undisturbed parts, with the delay of the whole logs."""
    if not any(fit.held_out):
        return None
    before = replace(fit, fit=fit.trained)
    robot = corrected_robot(robot, before.fit.model.layout, before.corrections)
    before = replace(before, robot=robot)
    logs = [
        replace(part, support=cut(part.support, _without(part.log, rows, aside)))
        for part, rows, aside in zip(prepared, fit.held_out, fit.set_aside, strict=True)
    ]
    return Unseen(fits=before.fits, robot=robot, logs=logs, correct=before.correct)


def _without(log: RobotLog, parts: Sequence[slice], spans: Sequence[Span]) -> list[slice]:
    """Cut spans of a log out of parts of it."""
    kept, since = np.zeros(len(log.time), dtype=bool), log.time - log.start
    for part in parts:
        kept[part] = True
    for span in spans:
        kept[(since >= span.start) & (since <= span.end)] = False
    edges = np.flatnonzero(np.diff(kept, prepend=False, append=False))
    return [slice(*pair) for pair in edges.reshape(-1, 2).tolist()]


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

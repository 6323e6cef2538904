"""Friction of all joints, and the model's corrections, from whole logs: joins the weak form with its fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stribeck.corrected import corrected_log, corrected_robot
from stribeck.equations import WRENCH_SIZE
from stribeck.errors import NothingIdentifiedError, errors_about, findings_kept
from stribeck.friction import FrictionLaw
from stribeck.identification.excitation import NOISE_FACTOR, excitation
from stribeck.identification.joint_fit import JointFit
from stribeck.identification.problem import FitProblem
from stribeck.identification.whole_log.describe import describe_corrections
from stribeck.identification.whole_log.estimate import WholeLogFit, fit_whole_log
from stribeck.identification.whole_log.intervals import joint_fits
from stribeck.identification.whole_log.lack_of_fit import lack_warnings
from stribeck.log import Array, RobotLog
from stribeck.pseudo_inertia import SIZE
from stribeck.result import Corrections as Found
from stribeck.result import TermVerdict, Validation
from stribeck.robot import Robot
from stribeck.settings import FilterSettings, Settings
from stribeck.survey import PreparedLog, Progress, prepare
from stribeck.weak_form.base_parameters import base_parameters
from stribeck.weak_form.build import WeakForm, weak_form
from stribeck.weak_form.lazily import all_equations
from stribeck.weak_form.stretches import cut_stretches

PLAIN = FilterSettings(kind="savitzky-golay", window=31)

SUSPICIOUS = 1.5
"""Chi^2 a degree of freedom [1] from which a warning is given."""

DISAGREEING = 4.0
"""Disagreement about the model [1] from which a warning is given: parts differ by twice as much as errors make them."""

FAR = 10.0
"""Corrections of bodies [1], over how wrong a model is believed to be, from which no model is as wrong as that."""

TOP_SPEED = 99.9
"""Percentile of |v| [%] that the nodes of the friction curves reach to; impacts are faster."""

SPEED_SPACING = 0.010
"""Over which speeds are looked at beforehand [s]."""

MOST_SPEEDS = 200_000
"""Speeds [1] that are looked at: of longer logs, one of some stretches."""

FEWEST = 5
"""Speeds in a stretch [1]; less is not worth the trouble."""


@dataclass(frozen=True, eq=False, kw_only=True)
class WholeLog:
    """What whole logs say.

    Attributes
    ----------
    fit, columns
        The fit, and the columns of the joints that it is of.
    robot
        Without the errors that were found.
    given
        The logs, evenly sampled, as they are; `corrected` takes the errors that were found out of one.
    """

    fit: WholeLogFit
    columns: NDArray[np.int64]
    robot: Robot
    given: tuple[RobotLog, ...]

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints that the fit is of."""
        return tuple(self.robot.joint_names[column] for column in self.columns)

    def corrected(self, log: RobotLog) -> RobotLog:
        """Return a log without the errors of its sensors that were found."""
        return corrected_log(log, self.robot, self.columns, self.fit.model.corrections, self.fit.corrections)

    @property
    def fits(self) -> dict[str, JointFit]:
        """What it says of each joint's friction."""
        return joint_fits(self.fit, self.joints)

    @property
    def validations(self) -> dict[str, Validation | None]:
        """How the law does on stretches that it was not fitted to."""
        return dict(zip(self.joints, self.fit.validation, strict=True))

    @property
    def terms(self) -> dict[str, tuple[dict[str, TermVerdict], float]]:
        """Which terms each joint has, of the law "auto", and the torque that it carries [N m]."""
        load = np.zeros(0) if self.fit.mean_load is None else self.fit.mean_load
        return dict(zip(self.joints, zip(self.fit.terms, load.tolist(), strict=True), strict=False))

    @property
    def corrections(self) -> Found:
        """What it says of model and calibration."""
        return describe_corrections(self.fit, self.joints, self.robot.joint_names)

    @property
    def warnings(self) -> list[str]:
        """A sentence where errors are not what they were taken to be, or bodies or friction not what they can be."""
        found = []
        if self.fit.chi_square >= SUSPICIOUS:
            found.append(
                f"chi^2 a degree of freedom is {self.fit.chi_square:.2g}: the equations of motion are off by more than "
                "noise and the model's measured errors explain; look at delays, calibration and contacts, or set "
                "corrections to 'calibration'; the intervals are widened accordingly"
            )
        if self.fit.disagreement >= DISAGREEING:
            found.append(
                f"what parts of the log say about the model differs {np.sqrt(self.fit.disagreement):.0f} times as much "
                "as noise would make it: bodies would be made to explain errors of other kinds, such as friction "
                "beyond the law, cables, or motors that log no torque; corrections are kept small accordingly"
            )
        if bodies := self._bodies_far_off():
            found.append(
                f"the log would have {', '.join(bodies)} over {FAR:.0f} times as far from the model as models are "
                "wrong: the equations of motion are wrong in another way, and the friction found with them may be; "
                "look at the signs and units of the torques and at motors that log none, or set corrections to 'none'"
            )
        if self._wrenches_far_off():
            found.append(
                f"the wrench sensors of the feet would be over {FAR:.0f} times as far off as such sensors are: "
                "foot_wrench is not that of the ground on the foot, in the frame of the contact, or not in N and N m"
            )
        return found + lack_warnings(self.fit.lacks, self.joints)

    def _wrenches_far_off(self) -> bool:
        """Return whether zeros and gains of wrench sensors are beyond belief."""
        there = self.fit.model.corrections
        first = there.size - len(there.rotors) - WRENCH_SIZE * there.wrenches
        own = self.fit.solution.corrections[first : there.size - len(there.rotors)]
        return bool(np.any(np.abs(own) > FAR))

    def _bodies_far_off(self) -> list[str]:
        """Return the bodies whose corrections are beyond belief."""
        bodies = self.fit.model.corrections.bodies
        coordinates = self.fit.undoubted[: SIZE * len(bodies)].reshape(-1, SIZE)
        furthest = np.abs(coordinates).max(axis=1, initial=0.0)
        return [name for name, far in zip(bodies, furthest, strict=True) if far > FAR]


def find_whole_log(
    sources: Sequence[RobotLog | str | Path], robot: Robot, law: FrictionLaw, settings: Settings, progress: Progress
) -> WholeLog:
    """Read logs, prepare them, and run `identify_whole_log` on them.

    Raises
    ------
    LogError, SettingsError, NothingIdentifiedError
        If a log cannot be used.
    """
    plain = settings.model_copy(update={"filter": PLAIN})  # the weak form has windows of its own
    prepared = []
    for k, source in enumerate(sources):
        with errors_about(source.path if isinstance(source, RobotLog) else str(source)):
            progress(f"reading log {k + 1} of {len(sources)}", 0.0)
            prepared.append(prepare(source, robot, plain))
    progress("fitting the whole log", 0.0)
    with findings_kept([note for part in prepared for note in part.notes]):
        return identify_whole_log(prepared, robot, law, settings)


def identify_whole_log(prepared: Sequence[PreparedLog], robot: Robot, law: FrictionLaw, settings: Settings) -> WholeLog:
    """Fit a law to all joints that move enough, and the model's corrections with it.

    Raises
    ------
    NothingIdentifiedError
        If no joint moves enough, or no stretch can be used.
    """
    columns, top_speed = _joints_that_move(prepared, robot, law)
    forms = weak_forms(prepared, robot, columns, settings)
    corrections = forms[0].corrections
    if corrections.bodies:
        supports = {feet: support for form in forms for feet, support in form.supports.items()}  # of all logs, once
        independent, sums = base_parameters(robot, supports.values())
        corrections = replace(corrections, independent=independent, sums=sums)
    equations = all_equations(forms)
    noise = np.max([form.velocity_noise for form in forms], axis=0)
    rest = np.maximum(settings.rest * top_speed, NOISE_FACTOR * noise)
    fit = fit_whole_log(
        equations,
        equations.supports,
        equations.gaits,
        corrections,
        law,
        top_speed,
        rest,
        settings.intervals == "bootstrap",
    )
    return WholeLog(
        fit=fit,
        columns=columns,
        robot=corrected_robot(robot, corrections, fit.corrections),
        given=tuple(_with_notes(part) for part in prepared),
    )


def weak_forms(
    prepared: Sequence[PreparedLog], robot: Robot, columns: NDArray[np.int64], settings: Settings
) -> list[WeakForm]:
    """Return the equations of motion of logs: foot wrenches are in them if every log has them."""
    wrenches = all(part.log.foot_wrench is not None for part in prepared)  # corrections are the same for all logs
    return [
        weak_form(
            robot,
            part.log,
            columns,
            part.support.phases,
            part.sampling.segments,
            part.sampling.period,
            settings,
            wrenches=wrenches,
        )
        for part in prepared
    ]


def _joints_that_move(
    prepared: Sequence[PreparedLog], robot: Robot, law: FrictionLaw
) -> tuple[NDArray[np.int64], Array]:
    """Return the columns of the torque-controlled joints that move enough, and their top speeds [rad/s]."""
    velocity, block = _some_speeds(prepared, robot)
    reasons = []
    for k, column in enumerate(robot.torque_controlled):
        problem = FitProblem(
            law=law,
            parameters=law.parameters,
            velocity=velocity[:, k],
            friction_torque=np.zeros(len(velocity)),
            acceleration=None,
            block=block,
        )
        reasons.append(excitation(problem, robot.prismatic[column]).reason)
    moves = np.array([not reason for reason in reasons])
    if not moves.any():
        names = [robot.joint_names[column] for column in robot.torque_controlled[:3]]
        why = "; ".join(f"{name}: {reason}" for name, reason in zip(names, reasons, strict=False))
        raise NothingIdentifiedError(f"no joint can be identified from this log: {why}")
    return robot.torque_controlled[moves], np.percentile(np.abs(velocity[:, moves]), TOP_SPEED, axis=0)


def _some_speeds(prepared: Sequence[PreparedLog], robot: Robot) -> tuple[Array, NDArray[np.int64]]:
    """Return speeds of the torque-controlled joints, shape (N, n), and the stretches that they are from, shape (N,)."""
    found = []
    for part in prepared:
        period = part.sampling.period
        step = max(1, round(SPEED_SPACING / period))
        stretches = cut_stretches(part.support.phases, part.sampling.segments, period, 0, FEWEST * step)
        found += [(part, step, stretch) for stretch in stretches]
    if not found:
        raise NothingIdentifiedError(
            "no joint can be identified from this log: no support phase is longer than what is left out around contact "
            "changes"
        )
    many = sum((stretch.last - stretch.first) // step for _, step, stretch in found)
    speeds: list[Array] = []
    blocks: list[NDArray[np.int64]] = []
    for part, step, stretch in found[:: -(-many // MOST_SPEEDS)]:
        position = part.log.position[stretch.first : stretch.last : step, robot.torque_controlled]
        speeds.append(np.diff(position, axis=0) / (step * part.sampling.period))
        blocks.append(np.full(len(position) - 1, len(blocks)))
    return np.concatenate(speeds), np.concatenate(blocks)


def _with_notes(part: PreparedLog) -> RobotLog:
    """Return a prepared log that still says what was done to it: it is even now, and would not be told again."""
    return replace(part.log, notes=(*part.log.notes, *part.sampling.notes))

"""The method `whole-log`: friction of all joints, and corrections of the model, from the weak form of whole logs.

Its mathematics stands in docs/estimator.md.
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stribeck.equations.build import WeakForm, weak_form
from stribeck.equations.constants import POSITION_FLOOR, TORQUE_FLOOR
from stribeck.equations.equation_sequence import equation_sequence
from stribeck.equations.spikes import without_spikes
from stribeck.friction import AUTO, LAWS, FrictionLaw
from stribeck.friction.assembled import Assembled
from stribeck.identification.joint_fit import JointFit
from stribeck.identification.judgement.excitation import NOISE_FACTOR
from stribeck.identification.judgement.weakness import Criteria
from stribeck.identification.whole_log.describe import describe_corrections
from stribeck.identification.whole_log.estimate import WholeLogFit, fit_whole_log
from stribeck.identification.whole_log.tests_of_fit.score_tests import score_test_warnings
from stribeck.identification.whole_log.uncertainty.intervals import joint_fits
from stribeck.log import RobotLog
from stribeck.methods.contract import SHARED, Finding, FrictionTorque, Method
from stribeck.methods.corrected import corrected_log, corrected_robot
from stribeck.methods.moving import joints_that_move
from stribeck.preparation import PreparedLog, Progress
from stribeck.result import Corrections, TermVerdict, Validation
from stribeck.robot import Robot
from stribeck.settings import Priors, Settings

CRITERIA = Criteria(widest=0.33, assumes_exact_law=False, shares_shapes=True)
"""The width finds what is over 25 % wrong on a straight walk and leaves most of what is within 10 %
(studies/verdicts.py)."""

SUSPICIOUS = 1.5
"""Chi^2 per degree of freedom [1] from which a warning is given."""

HETEROGENEOUS = 4.0
"""Heterogeneity over folds [1] from which a warning is given: folds differ by twice as much as errors explain."""

FAR = 10.0
"""Corrections [1], in prior standard deviations, from which a warning is given: no model is as wrong as that."""

MUCH_SET_ASIDE = 0.1
"""Share of the log [1] that is set aside, from which a warning is given."""


@dataclass(frozen=True, eq=False, kw_only=True)
class WholeLog:
    """The fit to whole logs, as the method needs it.

    Attributes
    ----------
    fit, columns
        The fit, and the columns of its joints.
    robot
        With the corrections that were found.
    """

    fit: WholeLogFit
    columns: NDArray[np.int64]
    robot: Robot

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints that the fit is of."""
        return tuple(self.robot.joint_names[column] for column in self.columns)

    def corrected(self, log: RobotLog) -> RobotLog:
        """Return a log without the errors of its sensors that were found."""
        return corrected_log(log, self.robot, self.columns, self.fit.model.corrections, self.fit.corrections)

    @property
    def fits(self) -> dict[str, JointFit]:
        """Fits of each joint's friction."""
        return joint_fits(self.fit, self.joints)

    @property
    def validations(self) -> dict[str, Validation | None]:
        """Validation of each joint on held-out segments."""
        return dict(zip(self.joints, self.fit.validation, strict=True))

    @property
    def terms(self) -> dict[str, tuple[dict[str, TermVerdict], float]]:
        """Which terms each joint has, of the law "auto", and the torque that it carries [N m]."""
        load = np.zeros(0) if self.fit.mean_load is None else self.fit.mean_load
        return dict(zip(self.joints, zip(self.fit.terms, load.tolist(), strict=True), strict=False))

    @property
    def corrections(self) -> Corrections:
        """Corrections of model and calibration."""
        return describe_corrections(self.fit, self.joints, self.robot.joint_names)

    @property
    def notes(self) -> list[str]:
        """A sentence on the windows that are set aside, if there are any."""
        share = self.fit.set_aside
        if not share:
            return []
        return [f"{100 * share:.2g} % of the log is set aside: torques far from all that the rest of it explains."]

    @property
    def warnings(self) -> list[str]:
        """Sentences on errors larger than their covariance, corrections that are implausible, and score tests."""
        texts = []
        if self.fit.set_aside > MUCH_SET_ASIDE:
            texts.append(
                f"{100 * self.fit.set_aside:.0f} % of the log is set aside, as its torques are far from all that the "
                "rest of it explains: the robot was pushed or touched something, or model or contacts are wrong at times"
            )
        if self.fit.chi_square >= SUSPICIOUS:
            texts.append(
                f"chi^2 per degree of freedom is {self.fit.chi_square:.2g}: residuals are larger than the estimated "
                "variance components explain; check delays, calibration and contacts, or set corrections to "
                "'calibration'; intervals are widened by the overdispersion"
            )
        if self.fit.heterogeneity >= HETEROGENEOUS:
            texts.append(
                "heterogeneity over folds: parts of the log differ about the model "
                f"{np.sqrt(self.fit.heterogeneity):.0f} times as much as noise explains, e.g. by friction beyond the "
                "law, cables, or motors that log no torque; corrections are kept small accordingly"
            )
        if bodies := [name for name, size in self.fit.bodies_off.items() if size > FAR]:
            texts.append(
                f"the corrections of {', '.join(bodies)} exceed {FAR:.0f} prior standard deviations: something else "
                "than inertias is wrong, and the friction may be wrong with it; check signs and units of the torques "
                "and motors that log none, or set corrections to 'none'"
            )
        if np.any(self.fit.wrenches_off > FAR):
            texts.append(
                f"the corrections of the feet's wrench sensors exceed {FAR:.0f} prior standard deviations: "
                "foot_wrench is not that of the ground on the foot, in the frame of the contact, or not in N and N m"
            )
        return texts + score_test_warnings(self.fit.score_tests, self.joints)


def identify_whole_log(prepared: Sequence[PreparedLog], robot: Robot, law: FrictionLaw, settings: Settings) -> WholeLog:
    """Fit a law to all joints that move enough, and the model's corrections with it.

    Raises
    ------
    NothingIdentifiedError
        If no joint moves enough, or no segment can be used.
    """
    columns, top_speed = joints_that_move(prepared, robot, law)
    forms = weak_forms(prepared, robot, columns, settings)
    corrections = forms[0].corrections
    equations = equation_sequence(forms)
    noise = np.max([form.velocity_noise for form in forms], axis=0)
    rest = np.maximum(settings.rest * top_speed, NOISE_FACTOR * noise)
    fit = fit_whole_log(
        equations,
        equations.feet,
        equations.gaits,
        corrections,
        law,
        top_speed,
        rest,
        settings.priors,
    )
    return WholeLog(fit=fit, columns=columns, robot=corrected_robot(robot, corrections, fit.corrections))


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


def find(
    prepared: Sequence[PreparedLog],
    robot: Robot,
    law: FrictionLaw,
    settings: Settings,
    friction_torque: FrictionTorque,  # noqa: ARG001 - it uses the weak form
    progress: Progress,
) -> Finding:
    """Run `identify_whole_log`, and correct robot and logs by it.

    Standing legs are shown, as they are fitted, without the minimum-norm guess where they were fitted without it.
    """
    progress("fitting the whole log", 0.0)
    cleaned = [_without_spikes(part) for part in prepared]
    prepared = [part for part, _ in cleaned]
    found = identify_whole_log(prepared, robot, law, settings)
    guess = "skip" if settings.double_support == "fit" else settings.double_support
    return Finding(
        fits=found.fits,
        validations=found.validations,
        robot=found.robot,
        logs=[replace(part, log=found.corrected(part.log)) for part in prepared],
        settings=settings.model_copy(update={"standing_legs": True, "double_support": guess}),
        criteria=CRITERIA,
        corrections=found.corrections,
        terms=found.terms,
        warnings=found.warnings,
        notes=[*(note for _, note in cleaned if note), *found.notes],
    )


def _without_spikes(prepared: PreparedLog) -> tuple[PreparedLog, str]:
    """Return a log whose positions and torques have no spikes, and a note, empty if there were none."""
    log, unbroken = prepared.log, prepared.sampling.segments
    position, of_position = without_spikes(log.position, unbroken, POSITION_FLOOR)
    torque, of_torque = without_spikes(log.torque, unbroken, TORQUE_FLOOR)
    if not of_position + of_torque:
        return prepared, ""
    note = (
        f"Spikes are replaced by what is between their neighbours: {of_position} of positions, {of_torque} of torques."
    )
    return replace(prepared, log=replace(log, position=position, torque=torque)), note


WHOLE_LOG = Method(
    name="whole-log",
    uses=(SHARED - {"standing_legs"}) | {"corrections"} | {f"priors.{key}" for key in Priors.model_fields},
    laws=ChainMap[str, type[FrictionLaw]](LAWS, {AUTO: Assembled}),
    find=find,
)

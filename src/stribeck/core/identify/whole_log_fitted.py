"""The fit to whole logs, with spans, corrections and friction of joints for the method."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain

import numpy as np

from stribeck.core.base.spans import Span, listed_spans
from stribeck.core.base.typing import IntArray
from stribeck.core.estimator.describe import describe_corrections
from stribeck.core.estimator.estimate import WholeLogFit
from stribeck.core.estimator.fit_checks.competing_causes import Causes, find_causes
from stribeck.core.estimator.terms.selection import JointTerms
from stribeck.core.estimator.uncertainty.intervals import joint_fits
from stribeck.core.identify.causes_of_spans import Carried, Rub
from stribeck.core.identify.corrected import LogCorrection
from stribeck.core.judgement.joint_fit import JointFit, without_friction
from stribeck.core.result import Corrections
from stribeck.core.robot import Robot

FEW = 0.01
"""Share of windows that are set aside [1] from which a warning is given."""


@dataclass(frozen=True, eq=False, kw_only=True)
class WholeLog(WholeLogFit):
    """The fit to whole logs, with spans, corrected logs and results by joint.

    Attributes
    ----------
    columns, couplings
        Columns of the fitted joints, and the couplings behind them.
    robot
        Robot with the estimated corrections.
    held_out
        Rows of each log that `trained` has not seen.
    set_aside, used
        Spans of each log that are set aside, and used.
    carried
        Payloads that explain spans set aside.
    disturbances
        Words on the cause of other spans set aside, if it is clear.
    rubbing
        Joints that rub in spans set aside.
    """

    columns: IntArray
    couplings: tuple[str, ...]
    robot: Robot
    held_out: Sequence[Sequence[slice]]
    set_aside: Sequence[Sequence[Span]]
    used: Sequence[Sequence[Span]]
    carried: Sequence[Carried] = ()
    disturbances: Mapping[Span, str] = field(default_factory=dict)
    rubbing: Mapping[str, Rub] = field(default_factory=dict)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the fitted joints and couplings."""
        return *(self.robot.joint_names[column] for column in self.columns), *self.couplings

    @property
    def correct(self) -> LogCorrection:
        """Function that removes the estimated sensor errors from a log."""
        return LogCorrection(self.robot, self.columns, self.fit.model.layout, self.corrections, self.delay)

    @cached_property
    def fits(self) -> dict[str, JointFit]:
        """Fits of each joint's friction."""
        fits = joint_fits(self, self.joints)
        return fits | {name: without_friction(fits[name]) for name in self.robot.bare & fits.keys()}

    @property
    def joint_terms(self) -> dict[str, JointTerms]:
        """Terms of the law "auto", by joint; empty for other laws."""
        if not self.terms:
            return {}
        terms, whole = self.read.terms, self.read.whole
        warm = terms.mean_temperature
        return {
            joint: JointTerms(
                verdicts=self.terms[k],
                mean_load=float(whole.mean_load[k]),
                load_deviation=float(whole.load_deviation[k]),
                mean_direction=tuple(terms.direction[k].tolist()) if np.isfinite(terms.direction[k]).all() else None,
                mean_temperature=float(warm[k]) if warm is not None and np.isfinite(warm[k]) else None,
                settings={name: float(values[k]) for name, values in terms.settings.items()},
            )
            for k, joint in enumerate(self.joints)
        }

    @cached_property
    def described(self) -> Corrections:
        """Corrections of model and calibration in a result's units and names."""
        return describe_corrections(self, self.joints, self.robot.joint_names)

    @cached_property
    def causes(self) -> Causes:
        """Single errors of sensors or model that compete for what the priors do not allow."""
        names = self.robot.joint_names
        columns = [names.index(joint) if joint in names else -1 for joint in self.joints]
        limbs = {foot: np.append(self.robot.standing((foot,)), False)[columns] for foot in self.robot.contacts}
        return find_causes(self.fit, self.read.whole, limbs, max(1.0, self.chi_square, self.heterogeneity))

    @property
    def body_corrections(self) -> dict[str, float]:
        """Largest correction of each body's inertia [prior standard deviations]."""
        largest = np.abs(self.causes.bodies).max(axis=1, initial=0.0).tolist()
        return dict(zip(self.fit.model.layout.bodies, largest, strict=True))

    @cached_property
    def paced(self) -> set[int]:
        """Numbers of the joints whose speed rises or falls with time, as in a chirp: friction seems to drift there."""
        least, parts = 0.8, self.read.pilot.parts  # smallest correlation of the logarithm of the speed with time [1]
        rows = [[part.time.mean(), *np.log(np.maximum(part.velocity.std(axis=0), 1e-9))] for part in parts]
        with np.errstate(all="ignore"):  # speeds may be constant
            return set(np.flatnonzero(np.abs(np.corrcoef(rows, rowvar=False)[0, 1:]) > least)) if rows[3:] else set()

    @property
    def notes(self) -> list[str]:
        """Notes on segments that were skipped, outliers, and compensation by the drives."""
        read, whole = len(self.read.windows), len(self.read.equations)
        notes = [f"{read} of {whole} segments of the log are read, evenly spread."] if read < whole else []
        if 0 < self.read.set_aside <= FEW:
            notes.append(f"Outliers are set aside: {listed_spans(list(chain(*self.set_aside)))}.")
        if self.robot.torque_source == "command":
            notes.append("The commanded torques are assumed to include any friction compensation of the drives.")
        return notes

    @property
    def disturbed(self) -> str:
        """Phrase on the spans in which something else acts; "" without any."""
        return f"from {listed_spans(list(chain(*self.set_aside)))}" if self.read.set_aside > FEW else ""

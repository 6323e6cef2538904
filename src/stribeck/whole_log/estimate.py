"""The spine of the whole-log fit: pilot, accumulation, fits of the laws, terms, empirical Bayes, covariance.

The steps follow docs/estimator.md in the same order.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from stribeck.base.typing import Array, BoolArray, IntArray
from stribeck.friction import AUTO, FrictionLaw
from stribeck.result import TermVerdict, Validation
from stribeck.robot.inertial_parameters import SIZE
from stribeck.settings import Priors
from stribeck.whole_log.equations.equation_sequence import EquationSequence
from stribeck.whole_log.equations.filters import WINDOW_LENGTH
from stribeck.whole_log.equations.segments import Segment
from stribeck.whole_log.fit_checks.misfits import Misfit, find_misfits
from stribeck.whole_log.fit_checks.validation import friction_residual_rms, validate
from stribeck.whole_log.model.terms import Columns, Terms
from stribeck.whole_log.model.unexplained import unsupported
from stribeck.whole_log.noise.variance_components import VarianceComponents
from stribeck.whole_log.reading import read_with_pilot, remaining_delay
from stribeck.whole_log.solver.elimination import Fit
from stribeck.whole_log.solver.empirical_bayes import group_mean_covariance, solve_with_empirical_bayes
from stribeck.whole_log.solver.pilot import Pilot
from stribeck.whole_log.solver.statistics import Statistics, total
from stribeck.whole_log.terms.term_selection import Choice, make_trials, select_terms
from stribeck.whole_log.uncertainty.covariance_budget import CovarianceBudget, covariance_budget
from stribeck.whole_log.uncertainty.heterogeneity import heterogeneity, overdispersion_of
from stribeck.whole_log.uncertainty.reml import random_effect_covariance

REST = 1.0
"""Longest pause of a disturbance [s]: joints that rest between two moves hide a hand or a payload."""


def _runs(flags: BoolArray) -> IntArray:
    """Find the runs of true flags: first place, and the place after the last, shape (runs, 2)."""
    return np.flatnonzero(np.diff(flags, prepend=False, append=False)).reshape(-1, 2)


@dataclass(frozen=True, eq=False, kw_only=True)
class WholeLogFit:
    """The fit to whole logs.

    Attributes
    ----------
    fit, trained
        Fit of all laws and corrections to all segments, and the same without the held-out segments.
    budget
        Parts of the fit's covariance.
    components
        Standard deviations of errors other than sensor noise.
    statistics
        Normal equations of all segments.
    segments, of_segments
        Number of segments read, and of all segments.
    windows
        Log, centers [s] and flags of the used windows of each segment read.
    residual_rms
        Root mean square residual of each joint's friction torque in the segments of the pilot [N m], shape (n,).
    validation
        Validation of each joint on the held-out segments by a fit to all others; None with too few segments.
    held_out
        Log and number of each held-out segment.
    delay
        Delay of the torques [s].
    beside
        Scales of the terms.
    terms
        Terms of each joint with the law "auto".
    misfits
        Effects that the law of each joint does not describe.
    heterogeneity
        D of equation (26) for the model [1].
    """

    fit: Fit
    trained: Fit
    budget: CovarianceBudget
    components: VarianceComponents
    statistics: Statistics
    segments: int
    of_segments: int
    windows: tuple[tuple[int, Array, BoolArray], ...]
    residual_rms: Array
    validation: tuple[Validation | None, ...]
    held_out: tuple[tuple[int, Segment], ...]
    delay: float
    beside: Terms
    terms: tuple[dict[str, TermVerdict], ...]
    misfits: tuple[tuple[Misfit, ...], ...]
    heterogeneity: float

    @property
    def values(self) -> Array:
        """Parameters of the laws, shape (n, w)."""
        return self.fit.laws.external(self.fit.internal)

    @property
    def corrections(self) -> Array:
        """Corrections in the order of `CorrectionLayout`, shape (c,)."""
        return self.fit.model.values(self.fit.corrections)

    @property
    def bodies(self) -> Array:
        """Coordinates of the bodies' corrections, shape (L, 10)."""
        return self.fit.corrections[self.fit.model.layout.part("bodies")].reshape(-1, SIZE)

    @property
    def wrenches_off(self) -> Array:
        """Corrections of wrench sensors in units of their prior standard deviation [1]."""
        return np.abs(self.fit.corrections[self.fit.model.layout.part("wrenches")])

    @property
    def chi_square(self) -> float:
        """Chi^2 per degree of freedom [1]: one if the errors match their covariance."""
        return self.fit.chi_square / max(self.statistics.count - int(self.fit.laws.free.sum()), 1)

    @property
    def set_aside(self) -> float:
        """Share of the windows that are set aside [1]."""
        return 1 - float(np.mean(np.concatenate([used for _, _, used in self.windows])))

    def spans(self, log: int, *, used: bool) -> list[tuple[float, float]]:
        """Find the spans of a log whose windows are used, or set aside: first and last stamp [s].

        Used windows count as set aside if a joint rests there between two disturbances, so that none is visible.
        """
        own = [(time, kept) for number, time, kept in self.windows if number == log]
        if not own:
            return []
        time, kept = (np.concatenate(each) for each in zip(*own, strict=True))
        for first, last in _runs(kept):
            if first > 0 and last < len(kept) and time[last] - time[first] < REST:
                kept[first:last] = False
        half = WINDOW_LENGTH / 2
        return [(float(time[a]) - half, float(time[b - 1]) + half) for a, b in _runs(kept == used)]


def fit_whole_log(
    equations: EquationSequence,
    law: FrictionLaw,
    top_speed: Array,
    rest: Array,
    priors: Priors,
    progress: Callable[[float], None] = lambda _: None,
) -> WholeLogFit:
    """Fit a law to all joints at once, and the model's corrections with it.

    Parameters
    ----------
    equations
        Equations of all segments; computed on access, so that they are never all in memory.
    law
        Friction law.
    top_speed
        Top speed of each joint [rad/s], shape (n,).
    rest
        Speed [rad/s] below which a joint is at rest, for laws that jump there, shape (n,).
    priors
        Priors of friction, model and sensors.
    progress
        Callback `progress(fraction)`.
    """
    speed = np.maximum(top_speed, 1e-9)
    read = read_with_pilot(equations, law, speed, rest * law.jumps, priors, progress)
    pilot, terms, columns, fit = read.pilot, read.terms, read.columns, read.fit
    folds, known, sample = read.folds, total(read.folds), total(read.folds[: read.sampled])
    root_turns = pilot.components.root_turns

    def effects(fit: Fit) -> Array:
        return random_effect_covariance(sample, known.count, fit, root_turns)[1]

    refused = unsupported([each.part for each in pilot.groups], terms, known.mean_load, known.load_deviation)
    if law.name == AUTO:
        choice = select_terms(known, folds, fit, refused, effects)
    else:
        choice = Choice([{} for _ in speed], make_trials(known, folds, fit), fit)
    fit = solve_with_empirical_bayes(known, choice.start)
    of_model = heterogeneity(known, folds, fit).model
    if of_model > 1:
        model = replace(fit.model, overdispersion=overdispersion_of(of_model, len(folds)))
        fit = solve_with_empirical_bayes(known, replace(fit, model=model))
    trained, whole = fit, total([known, *read.held])
    validation = validate(read.unseen, known, columns, pilot.components, trained.values)
    if read.held:
        fit = solve_with_empirical_bayes(whole, fit)
    (residual_rms,) = friction_residual_rms(
        [each.part for each in pilot.groups], columns, pilot.components, fit.values, fit.values[None, : whole.friction]
    )
    effect_std, effect_covariance = random_effect_covariance(sample, whole.count, fit, root_turns, residual_rms)
    differing = heterogeneity(known, folds, trained)
    budget = covariance_budget(
        fit, effect_covariance, group_mean_covariance(fit), differing, known.count / max(whole.count, 1)
    )
    curvature, fit = fit.covariance, replace(fit, covariance=budget.total)
    return WholeLogFit(
        fit=fit,
        trained=trained,
        budget=budget,
        components=pilot.components,
        statistics=whole,
        segments=len(read.windows),
        of_segments=len(equations),
        windows=read.windows,
        residual_rms=residual_rms,
        validation=validation,
        held_out=read.held_out,
        delay=pilot.delay + remaining_delay(fit),
        beside=terms,
        terms=tuple(choice.verdicts) if law.name == AUTO else (),
        misfits=find_misfits(
            choice.trials,
            choice.kept,
            choice.decided,
            replace(fit, covariance=budget.total - budget.heterogeneity),
            curvature * (whole.count / known.count),
            known,
            sample,
            effect_std,
            of_model,
            _units(pilot, columns, terms, whole.mean_load),
        ),
        heterogeneity=of_model,
    )


def _units(pilot: Pilot, columns: Columns, terms: Terms, mean_load: Array) -> Array:
    """Compute the unit of each term's coefficient, shape (n, T), for `find_misfits`."""
    first = columns.basis.functions.shape[1]
    largest = np.max([np.abs(columns.by_joint(each.part)[:, :, first:]).max(axis=0) for each in pilot.groups], axis=0)
    largest[:, 0], largest[:, -1] = mean_load, terms.delay
    return np.asarray(largest)

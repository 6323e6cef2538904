"""The spine of the whole-log fit: pilot, accumulation, fits of the laws, terms, empirical Bayes, covariance.

The steps follow docs/estimator.md in the same order.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.friction import AUTO, FrictionLaw
from stribeck.friction.presliding import SMOOTH_SIGN
from stribeck.result import TermVerdict, Validation
from stribeck.robot.inertial_parameters import SIZE
from stribeck.settings import Priors
from stribeck.whole_log.constants import (
    ENOUGH,
    FOLDS,
    LEAST_SEGMENTS,
    MOST_EQUATIONS,
    MOST_SEGMENTS,
    PILOT_SEGMENTS,
    ROUNDS,
)
from stribeck.whole_log.equations.equation_sequence import EquationSequence
from stribeck.whole_log.equations.filters import WINDOW_LENGTH
from stribeck.whole_log.equations.segments import Segment
from stribeck.whole_log.fit_checks.misfits import Misfit, find_misfits
from stribeck.whole_log.fit_checks.validation import friction_residual_rms, validate
from stribeck.whole_log.model.basis import Basis, make_basis
from stribeck.whole_log.model.laws import Laws
from stribeck.whole_log.model.search import by_joint, presliding_travels, ripples_per_turn
from stribeck.whole_log.model.terms import NO_TERM, Columns, Terms, find_terms, unsupported
from stribeck.whole_log.noise.variance_components import VarianceComponents
from stribeck.whole_log.solver.elimination import Fit, eliminate, inverse_of, solve
from stribeck.whole_log.solver.empirical_bayes import (
    best_of_linear,
    blocks,
    group_mean_covariance,
    solve_with_empirical_bayes,
    with_other_starts,
)
from stribeck.whole_log.solver.pilot import (
    LINEAR,
    Pilot,
    fit_pilot,
    friction_error,
    pilot_places,
    secant_step,
    with_terms,
)
from stribeck.whole_log.solver.statistics import Statistics, accumulate, total
from stribeck.whole_log.terms.term_selection import Choice, make_trials, overdispersion, select_terms
from stribeck.whole_log.uncertainty.covariance_budget import CovarianceBudget, covariance_budget
from stribeck.whole_log.uncertainty.heterogeneity import heterogeneity, overdispersion_of
from stribeck.whole_log.uncertainty.reml import random_effect_covariance
from stribeck.whole_log.weak_equations import WeakEquations

WRONG = 50.0
"""Chi^2 per equation [1] above which the pilot is repeated without setting segments aside."""


REST = 1.0
"""Longest pause of a disturbance [s]: joints that rest between two moves hide a hand or a payload."""


def _runs(flags: NDArray[np.bool_]) -> NDArray[np.int64]:
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
    heterogeneity, joint_heterogeneity
        D of equation (26) for the model [1] and for each joint's parameters, shape (n, w).
    undiscounted
        Coordinates of the corrections from a fit without overdispersion (27), shape (c,).
    """

    fit: Fit
    trained: Fit
    budget: CovarianceBudget
    components: VarianceComponents
    statistics: Statistics
    segments: int
    of_segments: int
    windows: tuple[tuple[int, Array, NDArray[np.bool_]], ...]
    residual_rms: Array
    validation: tuple[Validation | None, ...]
    held_out: tuple[tuple[int, Segment], ...]
    delay: float
    beside: Terms
    terms: tuple[dict[str, TermVerdict], ...]
    misfits: tuple[tuple[Misfit, ...], ...]
    heterogeneity: float
    joint_heterogeneity: Array
    undiscounted: Array

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
    def bodies_off(self) -> dict[str, float]:
        """Largest correction of each body, without overdispersion, in units of its prior standard deviation [1]."""
        coordinates = self.undiscounted[self.fit.model.layout.part("bodies")].reshape(-1, SIZE)
        furthest = np.abs(coordinates).max(axis=1, initial=0.0)
        return dict(zip(self.fit.model.corrections.bodies, furthest.tolist(), strict=True))

    @property
    def bodies_moved(self) -> dict[str, float]:
        """Correction of each body's mass or centre of mass, in units of its prior standard deviation [1]."""
        moved = np.maximum(np.abs(self.bodies[:, 0]), np.linalg.norm(self.bodies[:, 1:4], axis=1))
        return dict(zip(self.fit.model.corrections.bodies, moved.tolist(), strict=True))

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

    @property
    def widening(self) -> float:
        """Overdispersion [1], by which variances are multiplied."""
        return max(1.0, self.chi_square)


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
    read = _read_with_pilot(equations, law, speed, rest * law.jumps, priors, progress)
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
    undiscounted = fit.corrections
    of_model, of_joints = heterogeneity(known, folds, fit)
    if of_model > 1:
        model = replace(fit.model, overdispersion=overdispersion_of(of_model, len(folds)))
        fit = solve_with_empirical_bayes(known, replace(fit, model=model))
    trained, whole = fit, total([known, *read.held])
    validation = validate(read.unseen, known, columns, pilot.components, trained.values)
    if read.held:
        fit = solve_with_empirical_bayes(whole, fit)
    effect_std, effect_covariance = random_effect_covariance(sample, whole.count, fit, root_turns)
    budget = covariance_budget(fit, effect_covariance, group_mean_covariance(fit))
    fit = replace(fit, covariance=budget.total)
    residual_rms = friction_residual_rms(
        [each.part for each in pilot.groups], columns, pilot.components, fit.values, fit.values[None, : whole.friction]
    )
    return WholeLogFit(
        fit=fit,
        trained=trained,
        budget=budget,
        components=pilot.components,
        statistics=whole,
        segments=read.segments,
        of_segments=len(equations),
        windows=read.windows,
        residual_rms=residual_rms[0],
        validation=validation,
        held_out=read.held_out,
        delay=pilot.delay + _delay(fit),
        beside=terms,
        terms=tuple(choice.verdicts) if law.name == AUTO else (),
        misfits=find_misfits(
            choice.trials,
            choice.kept,
            choice.decided,
            fit,
            (budget.noise + budget.model) * (whole.count / known.count),
            known,
            sample,
            effect_std,
            of_model,
            _units(pilot, columns, terms, whole.mean_load),
        ),
        heterogeneity=of_model,
        joint_heterogeneity=of_joints,
        undiscounted=undiscounted,
    )


@dataclass(frozen=True, eq=False)
class _Read:
    """Pilot and laws, statistics of a log by folds, some of them `sampled`, held-out segments, and the first fit."""

    pilot: Pilot
    terms: Terms
    columns: Columns
    fit: Fit
    folds: list[Statistics]
    sampled: int
    held: list[Statistics]
    held_out: tuple[tuple[int, Segment], ...]
    unseen: list[WeakEquations]
    windows: tuple[tuple[int, Array, NDArray[np.bool_]], ...]

    @property
    def segments(self) -> int:
        return len(self.windows)


def _read_with_pilot(
    equations: EquationSequence,
    law: FrictionLaw,
    speed: Array,
    rest: Array,
    priors: Priors,
    progress: Callable[[float], None],
) -> _Read:
    """Fit the pilot and read the log; repeat both if the whole log contradicts the pilot's variances or delay."""
    basis = make_basis(law, speed)

    @lru_cache(maxsize=1)
    def segments(delay: float, count: int) -> list[WeakEquations]:
        late = equations.delayed(delay)
        return [late[place] for place in pilot_places(late.feet, count)]

    size = max(PILOT_SEGMENTS, 240 // len(speed))  # few joints need more segments, and take less time

    def start(robust: bool, delay: float = 0.0) -> tuple[Laws, Terms, Pilot]:
        pilot = fit_pilot(segments, size, equations.corrections, basis, speed, rest, priors, robust, delay)
        return _with_terms(pilot, law, basis, speed, priors)

    robust, tried = True, list[tuple[float, float]]()
    laws, terms, pilot = start(robust)
    while True:
        read = _read(equations.delayed(pilot.delay), pilot, basis, terms, laws, progress)
        known, late = total(read.folds), _delay(read.fit)
        if robust and read.fit.chi_square > WRONG * known.count:
            robust, tried = False, []
            laws, terms, pilot = start(robust)
            continue
        own = read.fit.layout.places("delays")[:1]
        error = np.sqrt(read.fit.covariance[own, own].sum() * overdispersion(known, read.fit)) * priors.torque_delay
        tried.append((pilot.delay, late))
        if not pilot.delay and len(tried) == 1 and abs(late) > 3 * priors.torque_delay:  # less may be presliding
            laws, terms, pilot = start(robust, late)
        elif not pilot.delay or len(tried) > ROUNDS or abs(late) < max(LINEAR, 3 * error):
            return read
        else:
            pilot = pilot.later(secant_step(tried))


def _read(
    late: EquationSequence,
    pilot: Pilot,
    basis: Basis,
    terms: Terms,
    laws: Laws,
    progress: Callable[[float], None],
) -> _Read:
    """Compute the statistics of a log, of some segments in `FOLDS` and the held-out ones, and fit the laws to them."""
    columns = Columns(basis, terms)
    held_out = pilot_places(late.feet)[: len(late) // 4]
    equations = np.mean([each.part.residual.size for each in pilot.groups])  # of a segment
    needed = (friction_error(pilot, columns) / ENOUGH) ** 2 * sum(each.count for each in pilot.groups) / equations
    enough = max(LEAST_SEGMENTS, int(min(MOST_SEGMENTS, float(needed))))
    most = min(MOST_SEGMENTS, enough, max(FOLDS, int(MOST_EQUATIONS / equations)))
    training = _spread([k for k in range(len(late)) if k not in held_out], most)
    count = min(FOLDS, len(training))
    sampled = min(count, 2 * max(1, round(15 * count / len(training))))  # about 30 segments; left and right alternate
    folds = [*(training[k::count] for k in range(count)), held_out]
    found, unseen, windows = accumulate(
        late, folds, sampled, columns, pilot.prediction, lambda share: progress(0.2 + 0.6 * share)
    )
    return _Read(
        pilot=pilot,
        terms=terms,
        columns=columns,
        fit=_first_fit(total(found[:count]), laws, pilot),
        folds=found[:count],
        sampled=sampled,
        held=found[count:],
        held_out=tuple(late.parts[place][:2] for place in held_out),
        unseen=[unseen[place] for place in held_out],
        windows=tuple((late.parts[place][0], *windows[place]) for place in sorted(windows)),
    )


def _delay(fit: Fit) -> float:
    """Find the torques' delay in addition to the one that the equations assume [s]."""
    return float(fit.model.values(fit.corrections)[fit.model.layout.part("delays")][:1].sum())


def _spread(places: list[int], most: int) -> list[int]:
    """Select at most `most` places, evenly spread."""
    every = np.linspace(0, len(places) - 1, min(most, len(places))).round().astype(int)
    return [places[k] for k in every]


def _with_terms(
    pilot: Pilot, law: FrictionLaw, basis: Basis, speed: Array, priors: Priors
) -> tuple[Laws, Terms, Pilot]:
    """Build the laws with all terms, the scales of the terms, and the pilot with their columns."""
    joints, functions = basis.velocity.shape[0], basis.functions.shape[1]
    parts = [each.part for each in pilot.groups]
    size = len(pilot.prediction.values) - pilot.model.layout.size
    friction = pilot.prediction.values[:size].reshape(joints, -1)[:, :functions]
    left = []
    for part in parts:
        windows = basis.windows(part.velocity, part.taps, part.step, len(part.residual))
        fitted = np.einsum("kmj,kjr,jr->km", part.weights, windows, friction, optimize=True)
        if part.regressors is not None:
            fitted += part.regressors @ pilot.prediction.values[size:]
        left.append((part, part.residual - fitted, pilot.components.marginal(part)))
    scores, known = by_joint(left)
    offsets = np.array([parameter.name != "offset" for parameter in law.parameters])
    free = offsets | (np.arange(joints) < parts[0].joints)[:, None]  # couplings have none: the joints have
    laws = Laws(law, basis, (), speed, np.full(joints, pilot.torque), priors, free)
    slope = 1 / (SMOOTH_SIGN * speed)
    if law.name == AUTO:  # choose the shape of the pilot's curves
        own = blocks(pilot.prediction.covariance[:size, :size], joints)[:, :functions, :functions]
        internal = best_of_linear(laws, friction, own)
        slope = laws.external(internal)[:, [parameter.name for parameter in law.parameters].index("slope")]
    squares = (scores**2 / np.maximum(known, 1e-300)).sum(axis=0)
    terms = find_terms(
        parts,
        slope=slope,
        per_turn=ripples_per_turn(left),
        travel=presliding_travels(left, basis, speed),
        friction=friction,
        top_speed=speed,
        unexplained=np.sqrt(squares / np.maximum(known.sum(axis=0), 1e-300)),
        delay=priors.torque_delay,
    )
    own_terms = [parameter.name not in NO_TERM and law.name == AUTO for parameter in terms.parameters]
    free = np.hstack([free, np.tile(own_terms, (joints, 1))])
    return replace(laws, terms=terms.parameters, free=free), terms, with_terms(pilot, Columns(basis, terms))


def _first_fit(known: Statistics, laws: Laws, pilot: Pilot) -> Fit:
    """Fit laws with all terms, starting from a linear fit of friction and corrections."""
    joints, size = len(laws.top_speed), pilot.model.layout.size
    left = eliminate(known, pilot.model, np.zeros(size))
    covariance = inverse_of(left.information + np.diag(pilot.precision))
    theta = (covariance @ left.right).reshape(joints, -1)
    internal = best_of_linear(laws, theta, blocks(covariance, joints))
    start = Fit(
        laws=laws,
        model=pilot.model,
        internal=internal,
        corrections=np.zeros(size),
        covariance=np.zeros((internal.size + size,) * 2),
        at_bound=np.zeros(internal.shape, dtype=bool),
        chi_square=0.0,
        converged=False,
    )
    return with_other_starts(known, solve(known, start))


def _units(pilot: Pilot, columns: Columns, terms: Terms, mean_load: Array) -> Array:
    """Compute the unit of each term's coefficient, shape (n, T), for `find_misfits`."""
    first = columns.basis.functions.shape[1]
    largest = np.max([np.abs(columns.by_joint(each.part)[:, :, first:]).max(axis=0) for each in pilot.groups], axis=0)
    largest[:, 0], largest[:, -1] = mean_load, terms.delay
    return np.asarray(largest)

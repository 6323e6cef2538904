"""The spine of the whole-log fit: pilot fit, normal equations, terms, empirical Bayes, covariance budget.

The steps are those of docs/estimator.md, in the order in which they stand there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.friction import AUTO, FrictionLaw
from stribeck.result import TermVerdict, Validation
from stribeck.robot.inertial_parameters import SIZE
from stribeck.settings import Priors
from stribeck.whole_log.constants import (
    FOLDS,
    RIPPLE_SEGMENTS,
    SAMPLED_SEGMENTS,
    SAMPLED_STEPS,
    SEGMENTS_PER_HELD_OUT,
    SELECTION_SEGMENTS,
)
from stribeck.whole_log.fit_checks.alternative_terms import find_alternatives
from stribeck.whole_log.fit_checks.score_tests import Misfit, run_score_tests
from stribeck.whole_log.fit_checks.validation import friction_residual_rms, remaining, validate
from stribeck.whole_log.model.covariates import unsupported
from stribeck.whole_log.model.friction_curves import Curves
from stribeck.whole_log.model.model_corrections import ModelCorrections
from stribeck.whole_log.model.presliding import presliding_travels
from stribeck.whole_log.model.ripple import ripples_per_turn
from stribeck.whole_log.model.varying_curves import VaryingCurves
from stribeck.whole_log.noise.variance_components import VarianceComponents
from stribeck.whole_log.solver.accumulation import accumulate, accumulate_folds
from stribeck.whole_log.solver.empirical_bayes import group_mean_covariance, solve_with_empirical_bayes
from stribeck.whole_log.solver.multistart import with_other_starts
from stribeck.whole_log.solver.normal_equations import NormalEquations, merged
from stribeck.whole_log.solver.pilot_fit import PilotFit, fit_pilot, pilot_places, with_all_terms
from stribeck.whole_log.solver.reduction import reduced, reduced_basis
from stribeck.whole_log.solver.solve import Solution, solve
from stribeck.whole_log.terms.term_selection import Choice, select_terms
from stribeck.whole_log.uncertainty.covariance_budget import CovarianceBudget, covariance_budget
from stribeck.whole_log.uncertainty.heterogeneity import (
    heterogeneity,
    offsets_that_differ,
    overdispersion_of,
)
from stribeck.whole_log.uncertainty.reml import random_effect_covariance
from stribeck.whole_log.weak_equations import CorrectionLayout, WeakEquations


@dataclass(frozen=True, eq=False, kw_only=True)
class WholeLogFit:
    """The fit to whole logs.

    Attributes
    ----------
    curves, model
        The coordinates of friction and of the model's corrections.
    solution
        Values of these, and their covariance.
    budget
        The parts of this covariance.
    components
        Standard deviations of the errors that no sensor makes.
    normal_equations
        Of all segments.
    segments
        Number of them.
    residual_rms
        Root mean square residual of each joint's friction torque in the segments of the pilot fit [N m], shape (n,).
    validation
        Of each joint, in some segments of the pilot fit, by a fit to all others; None where there are too few segments.
    held_out, training
        The places of those segments, and the fit to all others.
    terms, mean_load, load_deviation, mean_direction, per_turn, travel, mean_temperature
        Of the law "auto": which terms each joint has, the torque that it carries, mean and standard deviation of its
        size [N m], shape (n,) each, the means of
        cosine and sine of its position, shape (n, 2), the periods of its torque ripple a turn and the travel of its
        presliding [rad], if any, and its mean temperature [deg C], NaN where none is logged, shape (n,) each.
    heterogeneity, joint_heterogeneity
        D of equation (26), of the model [1], and of each joint's parameters, shape (n, p).
    undiscounted
        Coordinates of the corrections by a fit without overdispersion (27), shape (c,).
    misfits
        What the law of each joint does not describe, by the score tests.
    """

    curves: Curves
    model: ModelCorrections
    solution: Solution
    budget: CovarianceBudget
    components: VarianceComponents
    normal_equations: NormalEquations
    segments: int
    residual_rms: Array
    validation: tuple[Validation | None, ...]
    held_out: tuple[int, ...]
    training: PilotFit
    misfits: tuple[Misfit | None, ...]
    heterogeneity: float
    joint_heterogeneity: Array
    undiscounted: Array
    terms: tuple[dict[str, TermVerdict], ...] = ()
    mean_load: Array | None = None
    load_deviation: Array | None = None
    mean_direction: Array | None = None
    per_turn: Array | None = None
    mean_temperature: Array | None = None
    travel: Array | None = None

    @property
    def without_held_out(self) -> WholeLogFit:
        """The fit to all segments but the held-out ones; of its numbers the values alone are without them."""
        fit = self.training
        return replace(self, curves=fit.curves, model=fit.model, solution=fit.solution)

    @property
    def values(self) -> Array:
        """Parameters of the law, shape (n, p)."""
        return self.curves.external(self.solution.internal)

    @property
    def corrections(self) -> Array:
        """Corrections in the order of `CorrectionLayout`, shape (c,)."""
        return self.model.values(self.solution.corrections)

    @property
    def torque_delay(self) -> float:
        """Delay of the torques beside the one that the equations assume [s]."""
        return float(self.corrections[self.model.layout.part("delays")][:1].sum())

    @property
    def wrenches_off(self) -> Array:
        """Corrections of wrench sensors in units of their prior standard deviation [1]."""
        return np.abs(self.solution.x[self.solution.layout.part("wrenches")])

    @property
    def bodies_off(self) -> dict[str, float]:
        """Largest correction of each body, without overdispersion, in units of its prior standard deviation [1]."""
        coordinates = self.undiscounted[self.model.layout.part("bodies")].reshape(-1, SIZE)
        furthest = np.abs(coordinates).max(axis=1, initial=0.0)
        return dict(zip(self.model.corrections.bodies, furthest.tolist(), strict=True))

    @property
    def bodies_moved(self) -> dict[str, float]:
        """Correction of each body's mass or centre of mass, in units of its prior standard deviation [1]."""
        coordinates = np.abs(self.solution.corrections[self.model.layout.part("bodies")].reshape(-1, SIZE))
        moved = np.maximum(coordinates[:, 0], np.linalg.norm(coordinates[:, 1:4], axis=1))
        return dict(zip(self.model.corrections.bodies, moved.tolist(), strict=True))

    @property
    def chi_square(self) -> float:
        """Chi^2 per degree of freedom [1]: one if the errors are as large as their covariance says."""
        free = self.normal_equations.count - self.solution.internal.size
        return self.solution.chi_square / max(free, 1)

    @property
    def set_aside(self) -> float:
        """Share of the windows that are set aside [1]."""
        return self.normal_equations.set_aside / max(self.normal_equations.windows, 1)

    @property
    def widening(self) -> float:
        """Overdispersion [1], by which variances are multiplied."""
        return max(1.0, self.chi_square)


def fit_whole_log(
    equations: Sequence[WeakEquations],
    supports: Sequence[tuple[str, ...]],
    gaits: int,
    corrections: CorrectionLayout,
    law: FrictionLaw,
    top_speed: Array,
    rest: Array,
    priors: Priors,
    differ: NDArray[np.bool_] | None = None,
) -> WholeLogFit:
    """Fit a law to all joints at once, and the model's corrections with it.

    Parameters
    ----------
    equations
        Of all segments; computed when they are asked for, so that they are never all in memory.
    supports
        The feet that each of them stands on.
    gaits
        Number of their gait phases.
    corrections
        What the columns of their regressors correct.
    law
        Friction law.
    top_speed
        Of each joint [rad/s], shape (n,).
    rest
        Speed [rad/s] below which a joint is at rest, for laws that jump there, shape (n,).
    priors
        Of friction, model and sensors.
    differ
        Which joints' offsets differ from log to log, shape (joints,); found out if None.
    """
    places = pilot_places(supports)
    some = [equations[k] for k in places]
    pilot, pilot_equations = fit_pilot(some, corrections, law, top_speed, rest, priors, differ)
    (per_turn, travel), modulated = _ripples(equations, pilot), None
    if law.name == AUTO:
        modulated, pilot, pilot_equations = with_all_terms(equations, pilot_equations, pilot, per_turn, travel)
        equations = modulated
    held_out = dict(list(zip(places, pilot_equations, strict=True))[: len(equations) // SEGMENTS_PER_HELD_OUT])
    training = [k for k in range(len(equations)) if k not in held_out]
    alternatives = find_alternatives(
        pilot_equations,
        [remaining(part, pilot.curves.basis, *pilot.known) for part in pilot_equations],
        [pilot.components.marginal(part) for part in pilot_equations],
        pilot.curves.top_speed,
        priors.torque_gain,
        priors.torque_delay,
        per_turn,
    )
    first, others = _folds(training, gaits)
    folds, sampled = accumulate_folds(equations, first, pilot.prediction, gaits, alternatives)
    if differ is None and np.any(differ := _offsets_that_differ(pilot, folds)):  # variance components have to know
        plain = modulated.equations if modulated else equations
        return fit_whole_log(plain, supports, gaits, corrections, law, top_speed, rest, priors, differ)
    steps, normal_equations = sampled.without("alternatives"), merged(folds)
    pilot, choice = _with_terms(pilot, normal_equations, folds, steps, pilot_equations, per_turn, travel)
    part = normal_equations
    if any(others):
        pilot, folds = _with_rest(pilot, equations, part, folds, others)
        normal_equations = merged(folds)
        pilot = _with_empirical_bayes(pilot, normal_equations)
    undiscounted = pilot.solution.corrections
    pilot, of_model, joint_heterogeneity = _with_overdispersion(pilot, normal_equations, folds)
    unseen = list(held_out.values())
    trained = pilot.unreduced
    validation = validate(unseen, part, trained.curves, trained.components, *trained.known)
    normal_equations.merge(accumulate(unseen, pilot.components, pilot.curves, pilot.model))
    pilot = _with_empirical_bayes(pilot, normal_equations).unreduced
    curves, model, solution = pilot.curves, pilot.model, pilot.solution
    effect_std, effect_covariance = random_effect_covariance(
        steps, normal_equations.count, curves, model, solution, pilot.components.root_turns
    )
    budget = covariance_budget(
        solution, model.overdispersion, effect_covariance, group_mean_covariance(curves, solution)
    )
    return WholeLogFit(
        curves=curves,
        model=model,
        solution=replace(solution, covariance=budget.total),
        budget=budget,
        components=pilot.components,
        normal_equations=normal_equations,
        segments=len(equations),
        residual_rms=friction_residual_rms(
            pilot_equations, curves, pilot.components, *pilot.known, pilot.known[0][None]
        )[0],
        validation=validation,
        held_out=tuple(held_out),
        training=trained,
        heterogeneity=of_model,
        joint_heterogeneity=joint_heterogeneity,
        undiscounted=undiscounted,
        terms=choice.verdicts if choice else (),
        mean_load=normal_equations.mean_load if choice else None,
        load_deviation=normal_equations.load_deviation if choice else None,
        mean_direction=modulated.direction if modulated else None,
        per_turn=per_turn,
        mean_temperature=modulated.mean_temperature if modulated else None,
        travel=travel,
        misfits=run_score_tests(
            sampled, normal_equations.count, curves, model, solution, effect_std, budget.total, of_model
        ),
    )


def _ripples(equations: Sequence[WeakEquations], pilot: PilotFit) -> tuple[Array, Array]:
    """Return the periods a turn of each joint's ripple, and, for the law "auto", the travel of its presliding [rad].

    Segments of the pilot fit alone are too few.
    """
    many = [equations[k] for k in range(0, len(equations), -(-len(equations) // RIPPLE_SEGMENTS))]
    residuals = [remaining(part, pilot.curves.basis, *pilot.known) for part in many]
    variances = [pilot.components.marginal(part) for part in many]
    per_turn, curves = ripples_per_turn(many, residuals, variances), pilot.curves
    if curves.law.name != AUTO:
        return per_turn, np.full_like(per_turn, np.nan)
    return per_turn, presliding_travels(many, residuals, variances, curves.basis, curves.top_speed)


def _offsets_that_differ(pilot: PilotFit, folds: list[NormalEquations]) -> NDArray[np.bool_]:
    """Return which joints' offsets differ from log to log, shape (joints,); the pilot fit has the same in all logs."""
    curves, joints = pilot.curves, pilot.model.corrections.log_offsets[1]
    if not joints:
        return np.zeros(0, dtype=bool)
    total, model = merged(folds), pilot.model.with_log_offsets(np.ones(joints, dtype=bool))
    return offsets_that_differ(total, folds, curves, model, solve(total, curves, model, pilot.solution))


def _with_terms(
    pilot: PilotFit,
    normal_equations: NormalEquations,
    folds: list[NormalEquations],
    steps: NormalEquations,
    pilot_equations: list[WeakEquations],
    per_turn: Array,
    travel: Array,
) -> tuple[PilotFit, Choice | None]:
    """Return the fit to all folds, and the terms of its joints if these are to be selected."""
    curves, model = pilot.curves, pilot.model
    solution = solve(normal_equations, curves, model, pilot.solution)
    solution = with_other_starts(normal_equations, curves, model, solution)
    choice = None
    if isinstance(curves, VaryingCurves):
        refused = unsupported(pilot_equations, curves.slow, per_turn, travel, normal_equations.loads)
        root_turns = pilot.components.root_turns
        choice = select_terms(normal_equations, folds, steps, curves, model, solution, root_turns, refused)
        curves, solution = choice.curves, choice.start
    return _with_empirical_bayes(replace(pilot, curves=curves, solution=solution), normal_equations), choice


def _with_overdispersion(
    pilot: PilotFit, normal_equations: NormalEquations, folds: list[NormalEquations]
) -> tuple[PilotFit, float, Array]:
    """Return the fit with what the folds differ by about the model, and that heterogeneity, of model and joints."""
    of_model, of_joints = heterogeneity(normal_equations, folds, pilot.curves, pilot.model, pilot.solution)
    if of_model > 1:
        model = replace(pilot.model, overdispersion=overdispersion_of(of_model, len(folds)))
        pilot = _with_empirical_bayes(replace(pilot, model=model), normal_equations)
    return pilot, of_model, of_joints


def _with_empirical_bayes(pilot: PilotFit, normal_equations: NormalEquations) -> PilotFit:
    """Return the fit to a log with priors by empirical Bayes."""
    curves, model, solution = solve_with_empirical_bayes(normal_equations, pilot.curves, pilot.model, pilot.solution)
    return replace(pilot, curves=curves, model=model, solution=solution)


def _with_rest(
    pilot: PilotFit,
    equations: Sequence[WeakEquations],
    part: NormalEquations,
    folds: list[NormalEquations],
    others: list[list[int]],
) -> tuple[PilotFit, list[NormalEquations]]:
    """Return a fit to a part of a log in fewer coefficients, and in these the folds with the rest of the log."""
    whole = 1 + sum(map(len, others)) / SELECTION_SEGMENTS
    curves = replace(pilot.curves, basis=reduced_basis(part, pilot.curves, pilot.solution, whole))
    pilot = replace(pilot, curves=curves)
    rest, _ = accumulate_folds(equations, [([], own) for own in others], pilot.prediction)
    return pilot, [merged([reduced(fold, curves.basis), more]) for fold, more in zip(folds, rest, strict=True)]


def _folds(training: list[int], gaits: int) -> tuple[list[tuple[list[int], list[int]]], list[list[int]]]:
    """Return the folds of the part of a log that terms are selected on, and for each fold the rest of it.

    A fold is the places of its segments that are sampled for random effects and score tests, and of its others.
    """
    count, every = min(FOLDS, len(training)), -(-len(training) // SELECTION_SEGMENTS)
    part = [place for k, place in enumerate(training) if k // count % every == 0]
    stride = max(1, len(part) // max(SAMPLED_SEGMENTS, SAMPLED_STEPS * gaits))
    share = set(part[:: stride | 1])  # odd, as left and right alternate
    folds = [part[k::count] for k in range(count)]
    own = [([k for k in fold if k in share], [k for k in fold if k not in share]) for fold in folds]
    return own, [[place for place in training[k::count] if place not in part] for k in range(count)]

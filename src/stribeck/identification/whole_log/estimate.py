"""The spine of the whole-log fit: pilot fit, normal equations, terms, empirical Bayes, covariance budget."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stribeck.friction import AUTO, FrictionLaw
from stribeck.identification.whole_log.model.covariates import unsupported
from stribeck.identification.whole_log.model.friction_curves import Curves
from stribeck.identification.whole_log.model.model_corrections import ModelCorrections
from stribeck.identification.whole_log.model.varying_curves import VaryingCurves
from stribeck.identification.whole_log.noise.variance_components import VarianceComponents
from stribeck.identification.whole_log.solver.accumulation import accumulate, accumulate_folds
from stribeck.identification.whole_log.solver.empirical_bayes import group_mean_covariance, solve_with_empirical_bayes
from stribeck.identification.whole_log.solver.normal_equations import NormalEquations, merged
from stribeck.identification.whole_log.solver.pilot_fit import PilotFit, fit_pilot, pilot_places, with_all_terms
from stribeck.identification.whole_log.solver.solve import Solution, solve
from stribeck.identification.whole_log.terms.term_selection import FOLDS, Choice, select_terms
from stribeck.identification.whole_log.tests_of_fit.alternative_terms import find_alternatives
from stribeck.identification.whole_log.tests_of_fit.score_tests import ScoreTest, run_score_tests
from stribeck.identification.whole_log.tests_of_fit.validation import left_over, validate
from stribeck.identification.whole_log.uncertainty.covariance_budget import CovarianceBudget, covariance_budget
from stribeck.identification.whole_log.uncertainty.heterogeneity import heterogeneity, overdispersion_of
from stribeck.identification.whole_log.uncertainty.reml import random_effect_covariance
from stribeck.inertial_parameters import SIZE
from stribeck.result import TermVerdict, Validation
from stribeck.settings import Priors
from stribeck.typing import Array
from stribeck.weak_equations import Corrections, WeakEquations

LEAST_TRAINING = 4
"""Segments [1] in all for each one that is held out for the validation."""

FEWEST, FEWEST_STEPS = 30, 5
"""Segments in all, and a gait phase [1], that are tested for random effects and alternative terms."""


@dataclass(frozen=True, eq=False, kw_only=True)
class WholeLogFit:
    """What the whole log says.

    Attributes
    ----------
    curves, model
        The coordinates of friction and of the model's corrections.
    solution
        Their values and covariance.
    budget
        The terms of this covariance.
    components
        Of the errors that no sensor makes.
    normal_equations
        The log, summed up.
    segments
        Number of them.
    residual_rms
        What the fit leaves of each joint's friction torque on those that the levels were measured on [N m], shape (n,).
    validation
        Of each joint, on some of the segments that the levels were measured on, by a fit of all others; None where
        there are too few segments.
    terms, mean_load
        Of the law "auto": which terms each joint has, and the torque that it carries [N m], shape (n,).
    heterogeneity, joint_heterogeneity
        How much more the parts of the log disagree about the model than errors would make them [1], squared, and about
        each joint's parameters, shape (n, p).
    undiscounted
        Coordinates of the corrections that the log would have if its parts agreed, shape (c,).
    score_tests
        Of each joint, friction that no law of velocity describes.
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
    score_tests: tuple[tuple[ScoreTest, ...], ...]
    heterogeneity: float
    joint_heterogeneity: Array
    undiscounted: Array
    terms: tuple[dict[str, TermVerdict], ...] = ()
    mean_load: Array | None = None

    @property
    def values(self) -> Array:
        """Parameters of the law, shape (n, p)."""
        return self.curves.external(self.solution.internal)

    @property
    def corrections(self) -> Array:
        """Corrections in the order of `Corrections`, shape (c,)."""
        return self.model.values(self.solution.corrections)[0]

    @property
    def wrenches_off(self) -> Array:
        """How far wrench sensors are off, over how far such sensors are [1]."""
        return np.abs(self.solution.x[self.solution.layout.part("wrenches")])

    @property
    def bodies_off(self) -> dict[str, float]:
        """How far each body would be off if parts of the log agreed, over how far models are [1]."""
        coordinates = self.undiscounted[self.model.layout.part("bodies")].reshape(-1, SIZE)
        furthest = np.abs(coordinates).max(axis=1, initial=0.0)
        return dict(zip(self.model.corrections.bodies, furthest.tolist(), strict=True))

    @property
    def chi_square(self) -> float:
        """Chi^2 a degree of freedom [1]: one if the errors are as large as they are taken to be."""
        free = self.normal_equations.count - self.solution.internal.size
        return self.solution.chi_square / max(free, 1)

    @property
    def widening(self) -> float:
        """What variances are multiplied by as errors are larger than they were taken to be [1]."""
        return max(1.0, self.chi_square)


def fit_whole_log(
    equations: Sequence[WeakEquations],
    supports: Sequence[tuple[str, ...]],
    gaits: int,
    corrections: Corrections,
    law: FrictionLaw,
    top_speed: Array,
    rest: Array,
    priors: Priors,
) -> WholeLogFit:
    """Fit a law to all joints at once, and the model's corrections with it.

    Parameters
    ----------
    equations
        Of all segments; worked out when they are asked for, so that they are never all in memory.
    supports
        The feet that each of them stands on.
    gaits
        Number of their gait phases.
    corrections
        What their columns correct.
    law
        Friction law.
    top_speed
        Of each joint [rad/s], shape (n,).
    rest
        Speed [rad/s] below which a joint is at rest, for laws that jump there, shape (n,).
    priors
        Of friction, model and sensors.
    """
    places = pilot_places(supports)
    some = [equations[k] for k in places]
    pilot, auto = fit_pilot(some, corrections, law, top_speed, rest, priors), law.name == AUTO
    if auto:
        modulated, pilot = with_all_terms(equations, some, pilot)
        equations, some = modulated, [modulated.of(part) for part in some]
    held_out = dict(list(zip(places, some, strict=True))[: len(equations) // LEAST_TRAINING])
    seen = [k for k in range(len(equations)) if k not in held_out]
    alternatives = find_alternatives(some, pilot.curves.top_speed, priors.torque_gain)
    folds, repeating = accumulate_folds(
        equations, _folds(seen, gaits), pilot.components, pilot.curves, pilot.model, gaits, alternatives
    )
    steps, normal_equations = repeating.without("alternatives"), merged(folds)
    pilot, choice = _with_terms(pilot, normal_equations, folds, steps, some)
    undiscounted = pilot.solution.corrections
    of_model, joint_heterogeneity = heterogeneity(normal_equations, folds, pilot.curves, pilot.model, pilot.solution)
    if of_model > 1:
        pilot = _with_empirical_bayes(
            replace(pilot, model=replace(pilot.model, overdispersion=overdispersion_of(of_model, len(folds)))),
            normal_equations,
        )
    unseen = list(held_out.values())
    none = (None,) * len(top_speed)
    validation = validate(unseen, normal_equations, pilot.curves, pilot.components, *pilot.known) if unseen else none
    normal_equations.merge(accumulate(unseen, pilot.components, pilot.curves, pilot.model))
    pilot = _with_empirical_bayes(pilot, normal_equations)
    curves, model, solution = pilot.curves, pilot.model, pilot.solution
    effect_std, added = random_effect_covariance(
        steps, normal_equations.count, curves, model, solution, pilot.components.root_turns
    )
    budget = covariance_budget(solution, model.overdispersion, added, group_mean_covariance(curves, solution))
    return WholeLogFit(
        curves=curves,
        model=model,
        solution=replace(solution, covariance=budget.total),
        budget=budget,
        components=pilot.components,
        normal_equations=normal_equations,
        segments=len(equations),
        residual_rms=left_over(some, curves, pilot.components, *pilot.known, pilot.known[0][None])[0],
        validation=validation,
        heterogeneity=of_model,
        joint_heterogeneity=joint_heterogeneity,
        undiscounted=undiscounted,
        terms=choice.verdicts if choice else (),
        mean_load=normal_equations.loads[1] / normal_equations.loads[0] if choice else None,
        score_tests=run_score_tests(repeating, normal_equations.count, curves, model, solution, effect_std),
    )


def _with_terms(
    pilot: PilotFit,
    normal_equations: NormalEquations,
    folds: list[NormalEquations],
    steps: NormalEquations,
    some: list[WeakEquations],
) -> tuple[PilotFit, Choice | None]:
    """Return the solution of what is seen, and the terms that its joints have, if these are to be chosen."""
    curves, model = pilot.curves, pilot.model
    solution = solve(normal_equations, curves, model, pilot.solution)
    choice = None
    if isinstance(curves, VaryingCurves):
        refused = unsupported(some, curves.slow, normal_equations.loads)
        root_turns = pilot.components.root_turns
        choice = select_terms(normal_equations, folds, steps, curves, model, solution, root_turns, refused)
        curves, solution = choice.curves, choice.start
    return _with_empirical_bayes(replace(pilot, curves=curves, solution=solution), normal_equations), choice


def _with_empirical_bayes(pilot: PilotFit, normal_equations: NormalEquations) -> PilotFit:
    """Return the solution of a log, and what is believed with it."""
    curves, model, solution = solve_with_empirical_bayes(normal_equations, pilot.curves, pilot.model, pilot.solution)
    return replace(pilot, curves=curves, model=model, solution=solution)


def _folds(seen: list[int], gaits: int) -> list[tuple[list[int], list[int]]]:
    """Return folds of what is seen: places that are looked at, and the others."""
    stride = max(1, len(seen) // max(FEWEST, FEWEST_STEPS * gaits))
    share = set(seen[:: stride | 1])  # odd, as left and right alternate
    count = min(FOLDS, len(seen))
    folds = [seen[k::count] for k in range(count)]
    return [([k for k in fold if k in share], [k for k in fold if k not in share]) for fold in folds]

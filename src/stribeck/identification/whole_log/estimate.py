"""The spine of the whole-log fit: listen to some stretches, sum up all of them, solve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stribeck.friction import AUTO, FrictionLaw
from stribeck.identification.whole_log.believed import by_what_is_common, solve_and_believe
from stribeck.identification.whole_log.bootstrap import bootstrap_covariance
from stribeck.identification.whole_log.choose import FOLDS, Choice, settle_terms
from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.disagreement import by_doubt, disagreement, doubt_of
from stribeck.identification.whole_log.factors import unsupported
from stribeck.identification.whole_log.lack_of_fit import Lack, lacks_of_fit
from stribeck.identification.whole_log.levels import ErrorLevels
from stribeck.identification.whole_log.listening import Heard, listen, places_to_listen, with_all_terms
from stribeck.identification.whole_log.model import ModelCorrections
from stribeck.identification.whole_log.narrowing import narrowings
from stribeck.identification.whole_log.repeated import spread_of_repeated
from stribeck.identification.whole_log.restarts import with_restarts
from stribeck.identification.whole_log.solve import Solution, solve
from stribeck.identification.whole_log.statistic import Statistic, merged
from stribeck.identification.whole_log.summing import sum_up, sum_up_folds
from stribeck.identification.whole_log.suspects import find_suspects
from stribeck.identification.whole_log.validation import left_over, validate
from stribeck.identification.whole_log.varying import VaryingCurves
from stribeck.result import TermVerdict, Validation
from stribeck.typing import Array
from stribeck.weak_equations import Corrections, WeakEquations

LEAST_TRAINING = 4
"""Stretches [1] in all for each one that is held out for the validation."""

FEWEST, FEWEST_STEPS = 30, 5
"""Stretches in all, and a gait phase [1], that are looked at for errors that every step repeats, and for suspects."""


@dataclass(frozen=True, eq=False, kw_only=True)
class WholeLogFit:
    """What the whole log says.

    Attributes
    ----------
    curves, model
        The coordinates of friction and of the model's corrections.
    solution
        Their values and covariance.
    levels
        Of the errors that no sensor makes.
    statistic
        The log, summed up.
    stretches
        Number of them.
    residual_rms
        What the fit leaves of each joint's friction torque on those that the levels were measured on [N m], shape (n,).
    validation
        Of each joint, on some of the stretches that the levels were measured on, by a fit of all others; None where
        there are too few stretches.
    bootstrapped
        Whether the covariance is that of logs drawn from this log's stretches, however large errors were taken to be.
    terms, mean_load
        Of the law "auto": which terms each joint has, and the torque that it carries [N m], shape (n,).
    disagreement, differing
        How much more the parts of the log disagree about the model than errors would make them [1], squared, and about
        each joint's parameters, shape (n, p).
    undoubted
        Coordinates of the corrections that the log would have if its parts agreed, shape (c,).
    lacks
        Of each joint, friction that no law of velocity describes.
    """

    curves: Curves
    model: ModelCorrections
    solution: Solution
    levels: ErrorLevels
    statistic: Statistic
    stretches: int
    residual_rms: Array
    validation: tuple[Validation | None, ...]
    lacks: tuple[tuple[Lack, ...], ...]
    disagreement: float
    differing: Array
    undoubted: Array
    bootstrapped: bool = False
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
    def chi_square(self) -> float:
        """Chi^2 a degree of freedom [1]: one if the errors are as large as they are taken to be."""
        free = self.statistic.count - self.solution.internal.size
        return self.solution.chi_square / max(free, 1)

    @property
    def widening(self) -> float:
        """What variances are multiplied by as errors are larger than they were taken to be [1]."""
        return 1.0 if self.bootstrapped else max(1.0, self.chi_square)


def fit_whole_log(
    equations: Sequence[WeakEquations],
    supports: Sequence[tuple[str, ...]],
    gaits: int,
    corrections: Corrections,
    law: FrictionLaw,
    top_speed: Array,
    rest: Array,
    bootstrapped: bool = False,
) -> WholeLogFit:
    """Fit a law to all joints at once, and the model's corrections with it.

    Parameters
    ----------
    equations
        Of all stretches; worked out when they are asked for, so that they are never all in memory.
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
    bootstrapped
        Whether the covariance is that of logs drawn from this log's stretches.
    """
    places = places_to_listen(supports)
    some = [equations[k] for k in places]
    heard, auto = listen(some, corrections, law, top_speed, rest), law.name == AUTO
    if auto:
        factored, heard = with_all_terms(equations, some, heard)
        equations, some = factored, [factored.of(part) for part in some]
    held_out = dict(list(zip(places, some, strict=True))[: len(equations) // LEAST_TRAINING])
    seen = [k for k in range(len(equations)) if k not in held_out]
    suspects = find_suspects(some, heard.curves.top_speed)
    parts = _folds(seen, gaits)
    for narrow in narrowings(heard.curves, corrections, heard.statistic, heard.solution, len(some) / len(equations)):
        folds, repeating = sum_up_folds(equations, parts, heard.levels, heard.curves, narrow, gaits, suspects)
        steps, statistic = repeating.without_last(suspects.size, gaits), merged(folds)
        settled, choice = _settled(heard, statistic, folds, steps, some)
        if narrow.holds(settled.known[0]):
            break
    heard = settled
    undoubted = heard.solution.corrections
    differ, differing = disagreement(statistic, folds, heard.curves, heard.model, heard.solution)
    if differ > 1:
        heard = _believed(replace(heard, model=replace(heard.model, doubt=doubt_of(differ, len(folds)))), statistic)
    unseen = list(held_out.values())
    none = (None,) * len(top_speed)
    validation = validate(unseen, statistic, heard.curves, heard.levels, *heard.known) if unseen else none
    statistic.merge(sum_up(unseen, heard.levels, heard.curves, heard.model, narrow))
    heard = _believed(heard, statistic)
    curves, model = heard.curves, heard.model
    solution = with_restarts(statistic, curves, model, heard.solution)  # by all that is believed by now
    heard = replace(heard, solution=solution)
    repeated, covariance = _spread(equations, steps, statistic.count, heard, bootstrapped)
    return WholeLogFit(
        curves=curves,
        model=model,
        solution=replace(solution, covariance=covariance),
        levels=heard.levels,
        statistic=statistic,
        stretches=len(equations),
        residual_rms=left_over(some, curves, heard.levels, *heard.known, heard.known[0][None])[0],
        validation=validation,
        disagreement=differ,
        differing=np.ones_like(differing) if bootstrapped else differing,
        undoubted=undoubted,
        bootstrapped=bootstrapped,
        terms=choice.verdicts if choice else (),
        mean_load=statistic.loads[1] / statistic.loads[0] if choice else None,
        lacks=lacks_of_fit(repeating, statistic.count, curves, model, solution, repeated),
    )


def _settled(
    heard: Heard, statistic: Statistic, folds: list[Statistic], steps: Statistic, some: list[WeakEquations]
) -> tuple[Heard, Choice | None]:
    """Return the solution of what is seen, and the terms that its joints have, if these are to be chosen."""
    curves, model = heard.curves, heard.model
    solution = with_restarts(statistic, curves, model, solve(statistic, curves, model, heard.solution))
    choice = None
    if isinstance(curves, VaryingCurves):
        refused = unsupported(some, curves.slow, statistic.loads)
        rocking = heard.levels.rocking
        choice = settle_terms(statistic, folds, steps, curves, model, solution, rocking, refused)
        curves, solution = choice.curves, choice.start
    return _believed(replace(heard, curves=curves, solution=solution), statistic), choice


def _believed(heard: Heard, statistic: Statistic) -> Heard:
    """Return the solution of a log, and what is believed with it."""
    curves, model, solution = solve_and_believe(statistic, heard.curves, heard.model, heard.solution)
    return replace(heard, curves=curves, model=model, solution=solution)


def _spread(
    equations: Sequence[WeakEquations], steps: Statistic, total: int, heard: Heard, bootstrapped: bool
) -> tuple[Array, Array]:
    """Return the repeated errors' standard deviations, and the covariance of all coordinates.

    Beside the solution's, or that of logs drawn from this one, it is of repeated errors, of what is not known of what
    joints have in common, and of a model that is doubted.
    """
    curves, model, solution = heard.curves, heard.model, heard.solution
    repeated, covariance = spread_of_repeated(steps, total, curves, model, solution, heard.levels.rocking)
    if bootstrapped:
        drawn = bootstrap_covariance(equations, heard.levels, curves, model, solution)
        covariance = covariance - solution.covariance + drawn
    covariance = covariance + by_what_is_common(curves, solution)
    if model.doubt > 1:
        covariance = covariance + by_doubt(model, solution)
    return repeated, covariance


def _folds(seen: list[int], gaits: int) -> list[tuple[list[int], list[int]]]:
    """Return folds of what is seen: places that are looked at, and the others."""
    stride = max(1, len(seen) // max(FEWEST, FEWEST_STEPS * gaits))
    share = set(seen[:: stride | 1])  # odd, as left and right alternate
    count = min(FOLDS, len(seen))
    folds = [seen[k::count] for k in range(count)]
    return [([k for k in fold if k in share], [k for k in fold if k not in share]) for fold in folds]

"""The spine of the whole-log fit: measure the errors on some stretches, sum up all of them, solve."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stribeck.equations import Corrections, WeakEquations
from stribeck.friction import AUTO, FrictionLaw
from stribeck.identification.whole_log.believed import solve_and_believe
from stribeck.identification.whole_log.bootstrap import bootstrap_covariance
from stribeck.identification.whole_log.choose import FOLDS, settle_terms
from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.errors import update_levels
from stribeck.identification.whole_log.factors import Factored, unsupported, with_factors
from stribeck.identification.whole_log.lack_of_fit import Lack, lacks_of_fit
from stribeck.identification.whole_log.levels import ErrorLevels, first_levels
from stribeck.identification.whole_log.model import ModelCorrections, model_corrections
from stribeck.identification.whole_log.nodes import make_nodes
from stribeck.identification.whole_log.repeated import spread_of_repeated, without_repeated
from stribeck.identification.whole_log.solve import Solution, solve
from stribeck.identification.whole_log.statistic import Statistic, design, merged
from stribeck.identification.whole_log.summing import sum_up
from stribeck.identification.whole_log.suspects import Suspects, find_suspects
from stribeck.identification.whole_log.validation import left_over, validate
from stribeck.identification.whole_log.varying import VaryingCurves, rising, varying_curves
from stribeck.log import Array
from stribeck.result import TermVerdict, Validation

LISTEN = 8
"""Stretches [1], spread over the log, on which the levels of the errors are measured."""

LEAST_TRAINING = 4
"""Stretches [1] in all for each one that is held out for the validation."""

STRIDE = 3
"""One stretch of so many [1] is looked at for errors that every step repeats; odd, as left and right alternate."""

FEWEST_STEPS = 15
"""Stretches a gait phase [1] below which all are."""

ROUNDS = 3
"""Of measuring them [1]; each needs a fit of its own."""


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
    repeated
        Standard deviation of each joint's errors that come back with every step [N m], shape (n,).
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
    lacks
        Of each joint, friction that no law of velocity describes.
    """

    curves: Curves
    model: ModelCorrections
    solution: Solution
    levels: ErrorLevels
    repeated: Array
    statistic: Statistic
    stretches: int
    residual_rms: Array
    validation: tuple[Validation | None, ...]
    lacks: tuple[tuple[Lack, ...], ...]
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
    heard = np.unique(np.linspace(0, len(equations) - 1, LISTEN).astype(int)).tolist()
    some = [equations[k] for k in heard]
    model = model_corrections(corrections, _loads(some, corrections))
    torque = max(float(np.sqrt(np.mean(np.concatenate([_torques(part) for part in some]) ** 2))), 1e-9)
    speed = np.maximum(top_speed, 1e-9)
    curves = Curves(law, make_nodes(law, speed), speed, np.full(len(speed), torque))
    jumps = np.full(len(speed), float(law.jumps))
    first = first_levels(some[0], rest * jumps, torque * jumps, corrections.wrenches > 0)
    levels, solution = _measure_levels(some, first, curves, model)
    choice, auto = None, law.name == AUTO
    if auto:
        factored, curves, levels, solution = _with_all_terms(equations, some, curves, model, levels, solution)
        equations, some = factored, [factored.of(part) for part in some]
    held_out = dict(list(zip(heard, some, strict=True))[: len(equations) // LEAST_TRAINING])
    seen = [k for k in range(len(equations)) if k not in held_out]
    suspects = find_suspects(some, speed)
    folds, repeating = _sum_up_all(equations, seen, gaits, levels, curves, model, suspects, FOLDS if auto else 1)
    steps = repeating.without_last(suspects.size, gaits)
    statistic = merged(folds)
    solution = solve(statistic, curves, model, solution)
    if isinstance(curves, VaryingCurves):
        refused = unsupported(some, curves.slow, statistic.loads)
        choice = settle_terms(statistic, folds, steps, curves, model, solution, refused)
        curves, solution = choice.curves, choice.start
    curves, model, solution = solve_and_believe(statistic, curves, model, solution)
    unseen = list(held_out.values())
    known = curves.coefficients(solution.internal), model.values(solution.corrections)[0]
    validation = validate(unseen, statistic, curves, levels, *known) if unseen else (None,) * len(speed)
    statistic.merge(sum_up(unseen, levels, curves, model, 0))
    curves, model, solution = solve_and_believe(statistic, curves, model, solution)
    repeated, covariance = spread_of_repeated(steps, statistic.count, curves, model, solution)
    if bootstrapped:
        drawn = bootstrap_covariance(equations, levels, curves, model, solution)
        covariance = covariance - solution.covariance + drawn
    known = curves.coefficients(solution.internal), model.values(solution.corrections)[0]
    return WholeLogFit(
        curves=curves,
        model=model,
        solution=replace(solution, covariance=covariance),
        levels=levels,
        repeated=repeated,
        statistic=statistic,
        stretches=len(equations),
        residual_rms=left_over(some, curves, levels, *known, known[0][None])[0],
        validation=validation,
        bootstrapped=bootstrapped,
        terms=choice.verdicts if choice else (),
        mean_load=statistic.loads[1] / statistic.loads[0] if choice else None,
        lacks=lacks_of_fit(repeating, statistic.count, curves, model, solution, repeated),
    )


def _torques(equations: WeakEquations) -> Array:
    """Return the left side where friction acts [N m], of all windows."""
    return equations.residual[:, len(equations.wrench_noise) :].ravel()


def _loads(some: list[WeakEquations], corrections: Corrections) -> Array:
    """Return the torque that each sensor sees whose gain is corrected, root mean square [N m]."""
    first = corrections.inertial_parameters.size
    own = slice(first, first + corrections.gains)
    squares = [(part.columns[:, :, own] ** 2).sum(axis=1) for part in some if part.columns is not None]
    return np.sqrt(np.concatenate(squares).mean(axis=0)) if corrections.gains else np.zeros(0)


def _measure_levels(
    some: list[WeakEquations], levels: ErrorLevels, curves: Curves, model: ModelCorrections
) -> tuple[ErrorLevels, Solution]:
    """Return the levels of the errors and the last solution on some stretches, by turns."""
    solution = None
    for _ in range(ROUNDS):
        solution = solve(sum_up(some, levels, curves, model, 0), curves, model, solution)
        levels = update_levels(levels, _left_over(some, curves, model, solution))
    assert solution is not None
    return levels, solution


def _with_all_terms(
    equations: Sequence[WeakEquations],
    some: list[WeakEquations],
    plain: Curves,
    model: ModelCorrections,
    levels: ErrorLevels,
    solution: Solution,
) -> tuple[Factored, VaryingCurves, ErrorLevels, Solution]:
    """Return equations with factors, curves with all terms, and the levels that these leave.

    The load is the measured torque less friction: first that of a law of velocity alone, then that of all terms.
    """
    joints = len(plain.top_speed)
    friction = plain.coefficients(solution.internal).reshape(joints, -1)
    first = with_factors(equations, some, rising(plain.nodes), friction)
    curves = varying_curves(plain, first.nodes, first.slow)
    levels, solution = _measure_levels([first.of(part) for part in some], levels, curves, model)
    refined = curves.coefficients(solution.internal).reshape(joints, -1)
    return replace(first, refined=refined), curves, levels, solution


def _sum_up_all(
    equations: Sequence[WeakEquations],
    seen: list[int],
    gaits: int,
    levels: ErrorLevels,
    curves: Curves,
    model: ModelCorrections,
    suspects: Suspects,
    most: int,
) -> tuple[list[Statistic], Statistic]:
    """Return statistics of parts of what is seen, and that of a share of it with repeated torques and suspects."""
    stride = STRIDE if len(seen) >= FEWEST_STEPS * gaits else 1
    share = set(seen[::stride])
    folds, repeating = [], []
    for k in range(count := min(most, len(seen))):
        own, others = ([place for place in seen[k::count] if (place in share) == shared] for shared in (True, False))
        repeating.append(sum_up((equations[place] for place in own), levels, curves, model, gaits, suspects))
        folds.append(without_repeated(repeating[-1].without_last(suspects.size, gaits)))
        folds[-1].merge(sum_up((equations[place] for place in others), levels, curves, model, 0))
    return folds, merged(repeating)


def _left_over(
    equations: Iterable[WeakEquations], curves: Curves, model: ModelCorrections, solution: Solution
) -> Iterator[tuple[WeakEquations, Array]]:
    """Yield equations and what a solution leaves of them, shape (K m,)."""
    values = np.concatenate([curves.coefficients(solution.internal), model.values(solution.corrections)[0]])
    for part in equations:
        yield part, part.residual.ravel() - design(part, curves.nodes) @ values

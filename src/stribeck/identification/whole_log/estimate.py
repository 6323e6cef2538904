"""The spine of the whole-log fit: measure the errors on some stretches, sum up all of them, solve."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from stribeck.equations import Corrections, WeakEquations
from stribeck.friction import FrictionLaw
from stribeck.identification.whole_log.cosines import COSINES
from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.errors import update_levels
from stribeck.identification.whole_log.levels import ErrorLevels, first_levels
from stribeck.identification.whole_log.model import ModelCorrections, model_corrections
from stribeck.identification.whole_log.nodes import make_nodes
from stribeck.identification.whole_log.repeated import spread_of_repeated, without_repeated
from stribeck.identification.whole_log.solve import Solution, solve
from stribeck.identification.whole_log.statistic import Statistic, design
from stribeck.identification.whole_log.validation import left_over, validate
from stribeck.log import Array
from stribeck.result import Validation

LISTEN = 8
"""Stretches [1], spread over the log, on which the levels of the errors are measured."""

LEAST_TRAINING = 4
"""Stretches [1] in all for each one that is held out for the validation."""

STRIDE = 3
"""One stretch of so many [1] is looked at for errors that every step repeats; odd, as left and right alternate."""

FEWEST_STEPS = 15
"""Stretches a gait phase [1] below which all are."""

WORKERS = 2
"""Threads [1] that weigh equations: linear algebra lets other threads run."""

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


def fit_whole_log(
    equations: Sequence[WeakEquations], gaits: int, corrections: Corrections, law: FrictionLaw, top_speed: Array
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
    """
    nodes, model = make_nodes(law, top_speed), model_corrections(corrections)
    heard = np.unique(np.linspace(0, len(equations) - 1, LISTEN).astype(int)).tolist()
    some = [equations[k] for k in heard]
    torque = np.sqrt(np.mean(np.concatenate([part.residual.reshape(-1) for part in some]) ** 2))
    curves = Curves(law, nodes, np.maximum(top_speed, 1e-9), np.full(len(top_speed), max(float(torque), 1e-9)))
    levels, solution = first_levels(some[0]), None
    for _ in range(ROUNDS):
        solution = solve(_sum_up(some, levels, curves, model, 0), curves, model, solution)
        levels = update_levels(levels, _left_over(some, curves, model, solution))
    held_out = dict(list(zip(heard, some, strict=True))[: len(equations) // LEAST_TRAINING])
    others = [k for k in range(len(equations)) if k not in held_out]
    stride = STRIDE if len(others) >= FEWEST_STEPS * gaits else 1
    with_repeated = others[::stride] if gaits else []
    repeating = _sum_up((equations[k] for k in with_repeated), levels, curves, model, gaits)
    rest = (equations[k] for k in others if k not in set(with_repeated))
    statistic = without_repeated(repeating)
    statistic.merge(_sum_up(rest, levels, curves, model, 0))
    solution = solve(statistic, curves, model, solution)
    values = curves.coefficients(solution.internal), model.values(solution.corrections)[0]
    unseen = list(held_out.values())
    validation = validate(unseen, statistic, curves, levels, *values) if unseen else (None,) * len(top_speed)
    statistic.merge(_sum_up(unseen, levels, curves, model, 0))
    solution = solve(statistic, curves, model, solution)
    values = curves.coefficients(solution.internal), model.values(solution.corrections)[0]
    repeated, covariance = np.zeros(len(top_speed)), solution.covariance
    if gaits:
        share = repeating.count / statistic.count
        repeated, covariance = spread_of_repeated(repeating, share, curves, model, solution)
    return WholeLogFit(
        curves=curves,
        model=model,
        solution=replace(solution, covariance=covariance),
        levels=levels,
        repeated=repeated,
        statistic=statistic,
        stretches=len(equations),
        residual_rms=left_over(some, curves, levels, *values, values[0][None])[0],
        validation=validation,
    )


def _sum_up(
    equations: Iterable[WeakEquations], levels: ErrorLevels, curves: Curves, model: ModelCorrections, gaits: int
) -> Statistic:
    """Return the statistic of equations: worked out here, added up by threads, in an order that never changes."""
    size = model.size + gaits * COSINES * len(curves.top_speed)
    statistics = [Statistic(curves.nodes, size, gaits) for _ in range(WORKERS)]
    waiting: list[Future[None] | None] = [None] * WORKERS
    with ThreadPoolExecutor(WORKERS) as pool:
        for k, part in enumerate(equations):
            if (before := waiting[k % WORKERS]) is not None:
                before.result()  # so that few stretches are in memory
            waiting[k % WORKERS] = pool.submit(statistics[k % WORKERS].add, part, levels)
        for last in waiting:
            if last is not None:
                last.result()
    for other in statistics[1:]:
        statistics[0].merge(other)
    return statistics[0]


def _left_over(
    equations: Iterable[WeakEquations], curves: Curves, model: ModelCorrections, solution: Solution
) -> Iterator[tuple[WeakEquations, Array]]:
    """Yield equations and what a solution leaves of them, shape (K m,)."""
    values = np.concatenate([curves.coefficients(solution.internal), model.values(solution.corrections)[0]])
    for part in equations:
        yield part, part.residual.ravel() - design(part, curves.nodes) @ values

"""The spine of the whole-log fit: measure the errors on some stretches, sum up all of them, solve."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from stribeck.equations import Corrections, WeakEquations
from stribeck.friction import FrictionLaw
from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.errors import update_levels
from stribeck.identification.whole_log.levels import ErrorLevels, first_levels
from stribeck.identification.whole_log.model import ModelCorrections, model_corrections
from stribeck.identification.whole_log.nodes import make_nodes
from stribeck.identification.whole_log.solve import Solution, solve
from stribeck.identification.whole_log.statistic import Statistic, design
from stribeck.identification.whole_log.validation import validate
from stribeck.log import Array
from stribeck.result import Validation

LISTEN = 12
"""Stretches [1], spread over the log, on which the levels of the errors are measured."""

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
    statistic
        The log, summed up.
    stretches
        Number of them.
    validation
        Of each joint, on the stretches that the levels were measured on, by a fit of all others.
    """

    curves: Curves
    model: ModelCorrections
    solution: Solution
    levels: ErrorLevels
    statistic: Statistic
    stretches: int
    validation: tuple[Validation, ...]

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
    equations: Sequence[WeakEquations], corrections: Corrections, law: FrictionLaw, top_speed: Array
) -> WholeLogFit:
    """Fit a law to all joints at once, and the model's corrections with it.

    Parameters
    ----------
    equations
        Of all stretches; worked out when they are asked for, so that they are never all in memory.
    corrections
        What their columns correct.
    law
        Friction law.
    top_speed
        Of each joint [rad/s], shape (n,).
    """
    nodes, model = make_nodes(top_speed), model_corrections(corrections)
    heard = np.unique(np.linspace(0, len(equations) - 1, LISTEN).astype(int)).tolist()
    some = [equations[k] for k in heard]
    torque = np.sqrt(np.mean(np.concatenate([part.residual.reshape(-1) for part in some]) ** 2))
    curves = Curves(law, nodes, np.maximum(top_speed, 1e-9), np.full(len(top_speed), max(float(torque), 1e-9)))
    levels, solution = first_levels(some[0]), None
    for _ in range(ROUNDS):
        solution = solve(_sum_up(some, levels, curves, model), curves, model, solution)
        levels = update_levels(levels, _left_over(some, curves, model, solution))
    others = (equations[k] for k in range(len(equations)) if k not in heard)
    statistic = _sum_up(others, levels, curves, model)
    solution = solve(statistic, curves, model, solution)
    values = curves.torque_at_nodes(solution.internal), model.values(solution.corrections)[0]
    validation = validate(some, statistic, curves, levels, *values)
    statistic.merge(_sum_up(some, levels, curves, model))
    return WholeLogFit(
        curves=curves,
        model=model,
        solution=solve(statistic, curves, model, solution),
        levels=levels,
        statistic=statistic,
        stretches=len(equations),
        validation=validation,
    )


def _sum_up(
    equations: Iterable[WeakEquations], levels: ErrorLevels, curves: Curves, model: ModelCorrections
) -> Statistic:
    statistic = Statistic(curves.nodes, model.corrections.size)
    for part in equations:
        statistic.add(part, levels)
    return statistic


def _left_over(
    equations: Iterable[WeakEquations], curves: Curves, model: ModelCorrections, solution: Solution
) -> Iterator[tuple[WeakEquations, Array]]:
    """Yield equations and what a solution leaves of them, shape (K m,)."""
    values = np.concatenate([curves.torque_at_nodes(solution.internal), model.values(solution.corrections)[0]])
    for part in equations:
        columns, matrix = design(part, curves.nodes)
        yield part, part.residual.ravel() - matrix @ values[columns]

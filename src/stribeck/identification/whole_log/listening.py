"""What some stretches of a log tell before all are summed up: how large the errors are, and where a fit may begin."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stribeck.friction import FrictionLaw
from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.errors import update_levels
from stribeck.identification.whole_log.factors import Factored, with_factors
from stribeck.identification.whole_log.levels import ErrorLevels, first_levels
from stribeck.identification.whole_log.model import ModelCorrections, model_corrections
from stribeck.identification.whole_log.nodes import make_nodes
from stribeck.identification.whole_log.solve import Solution, solve
from stribeck.identification.whole_log.statistic import Statistic, design
from stribeck.identification.whole_log.summing import sum_up
from stribeck.identification.whole_log.varying import rising, varying_curves
from stribeck.typing import Array
from stribeck.weak_equations import Corrections, WeakEquations

STRETCHES = 8
"""About so many [1] are listened to."""

ROUNDS = 3
"""Of measuring the errors [1]; each needs a fit of its own."""


@dataclass(frozen=True, eq=False)
class Heard:
    """Coordinates of friction and of the model's corrections, levels of the errors, the last solution, and what of."""

    curves: Curves
    model: ModelCorrections
    levels: ErrorLevels
    solution: Solution
    statistic: Statistic

    @property
    def known(self) -> tuple[Array, Array]:
        """Coefficients of the curves [N m], shape (n r,), and corrections, shape (c,), of the solution."""
        return self.curves.coefficients(self.solution.internal), self.model.values(self.solution.corrections)[0]


def places_to_listen(supports: Sequence[tuple[str, ...]]) -> list[int]:
    """Return the places of stretches that are listened to, given the feet that each stretch stands on.

    Every support has its share, one at least, spread over its own stretches: errors of a leg that stands show while it
    stands. Evenly spaced stretches of a walk could all stand on the same foot.
    """
    found: set[int] = set()
    for support in set(supports):
        own = [place for place, feet in enumerate(supports) if feet == support]
        share = max(1, round(STRETCHES * len(own) / len(supports)))
        found.update(own[k] for k in np.linspace(0, len(own) - 1, share).astype(int))
    return sorted(found)


def listen(
    some: list[WeakEquations], corrections: Corrections, law: FrictionLaw, top_speed: Array, rest: Array
) -> Heard:
    """Return what some stretches tell of the errors; parameters are those of `fit_whole_log`."""
    model = model_corrections(corrections, _loads(some, corrections))
    torque = max(float(np.sqrt(np.mean(np.concatenate([_torques(part) for part in some]) ** 2))), 1e-9)
    speed = np.maximum(top_speed, 1e-9)
    curves = Curves(law, make_nodes(law, speed), speed, np.full(len(speed), torque))
    jumps = np.full(len(speed), float(law.jumps))
    levels = first_levels(some[0], rest * jumps, torque * jumps, corrections.wrenches > 0)
    return _measured(some, curves, model, levels)


def with_all_terms(
    equations: Sequence[WeakEquations], some: list[WeakEquations], heard: Heard
) -> tuple[Factored, Heard]:
    """Return equations with factors, and curves with all terms beside the levels that these leave.

    The load is the measured torque less friction: first that of a law of velocity alone, then that of all terms.
    """
    plain = heard.curves
    joints = len(plain.top_speed)
    friction = plain.coefficients(heard.solution.internal).reshape(joints, -1)
    first = with_factors(equations, some, rising(plain.nodes), friction)
    curves = varying_curves(plain, first.nodes, first.slow)
    found = _measured([first.of(part) for part in some], curves, heard.model, heard.levels)
    refined = curves.coefficients(found.solution.internal).reshape(joints, -1)
    return replace(first, refined=refined), found


def _measured(some: list[WeakEquations], curves: Curves, model: ModelCorrections, levels: ErrorLevels) -> Heard:
    """Measure the levels of the errors and solve, by turns."""
    solution = None
    for _ in range(ROUNDS):
        statistic = sum_up(some, levels, curves, model)
        solution = solve(statistic, curves, model, solution)
        levels = update_levels(levels, _left_over(some, curves, model, solution))
    assert solution is not None
    return Heard(curves, model, levels, solution, statistic)


def _torques(equations: WeakEquations) -> Array:
    """Return the left side where friction acts [N m], of all windows."""
    return equations.residual[:, len(equations.wrench_noise) :].ravel()


def _loads(some: list[WeakEquations], corrections: Corrections) -> Array:
    """Return the torque that each sensor sees whose gain is corrected, root mean square [N m]."""
    first = corrections.inertial_parameters.size
    own = slice(first, first + corrections.gains)
    squares = [(part.columns[:, :, own] ** 2).sum(axis=1) for part in some if part.columns is not None]
    return np.sqrt(np.concatenate(squares).mean(axis=0)) if corrections.gains else np.zeros(0)


def _left_over(
    equations: Iterable[WeakEquations], curves: Curves, model: ModelCorrections, solution: Solution
) -> Iterator[tuple[WeakEquations, Array]]:
    """Yield equations and what a solution leaves of them, shape (K m,)."""
    values = np.concatenate([curves.coefficients(solution.internal), model.values(solution.corrections)[0]])
    for part in equations:
        yield part, part.residual.ravel() - design(part, curves.nodes) @ values

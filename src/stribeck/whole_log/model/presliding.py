"""Presliding: friction that builds up over some travel after a reversal (Dahl 1968; docs/estimator.md).

With s(v) a smooth sign of the velocity, Dahl's deflection z follows it within a travel d,

    dz/dt = (s(v) - z) |v| / d

and what is missing of friction that is there at once is proportional to z - s(v).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.whole_log.constants import PRESLIDING_GRID, RESOLVED_STEPS
from stribeck.whole_log.model.basis import Basis
from stribeck.whole_log.model.ripple import by_joint
from stribeck.whole_log.solver.normal_equations import curve_windows
from stribeck.whole_log.weak_equations import WeakEquations


def shortest_travel(equations: WeakEquations) -> Array:
    """Return the travel that the encoders resolve [rad], shape (n,)."""
    if equations.position_noise is None:
        return np.zeros(equations.velocity.shape[1])
    return np.asarray(RESOLVED_STEPS * np.sqrt(12) * equations.position_noise)  # of a rounded position


def presliding_travels(
    equations: Sequence[WeakEquations],
    residuals: Sequence[Array],
    variances: Sequence[Array],
    basis: Basis,
    top_speed: Array,
) -> Array:
    """Return the travel that explains most of each joint's residual torque beside its curve [rad], shape (n,).

    NaN where that is the shortest that the encoder resolves, or the longest: what is there has no such travel then.

    Parameters
    ----------
    equations
        Segments, without covariates.
    residuals, variances
        Of a fit to each, and those that it expects, shape (K, m).
    basis, top_speed
        Of the friction curves; [rad/s], shape (n,).
    """
    travels = np.array(PRESLIDING_GRID)[:, None] * top_speed
    information, right = 0.0, 0.0
    for part, residual, variance in zip(equations, residuals, variances, strict=True):
        score, known = by_joint([part], [residual], [variance])
        columns = np.concatenate(
            [curve_windows(part, basis), part.presliding(top_speed, travels).transpose(1, 2, 0)], axis=2
        )
        information = information + np.einsum("kj,kjr,kjs->jrs", known, columns, columns)
        right = right + np.einsum("kj,kjr->jr", score, columns)
    resolved = travels >= np.max([shortest_travel(part) for part in equations], axis=0)
    each = zip(np.asarray(information), np.asarray(right), resolved.T, strict=True)
    places = [_best(*own) for own in each]
    grid = np.log(PRESLIDING_GRID)
    return np.asarray(top_speed * np.exp([np.interp(place, np.arange(len(grid)), grid) for place in places]))


def _best(information: Array, right: Array, resolved: NDArray[np.bool_]) -> float:
    """Return the place in the grid that lowers chi^2 most, by a parabola through three; NaN at an end."""
    r = len(right) - len(resolved)
    ridge = 1e-9 * np.trace(information[:r, :r]) * np.eye(r)
    beside = np.linalg.solve(information[:r, :r] + ridge, np.column_stack([information[:r, r:], right[:r]]))
    left = np.diag(information[r:, r:] - information[r:, :r] @ beside[:, :-1])
    score = right[r:] - information[r:, :r] @ beside[:, -1]
    falls = np.where(resolved & (left > 1e-6), np.maximum(score, 0.0) ** 2 / np.maximum(left, 1e-6), 0.0)
    best = int(np.argmax(falls))
    if not 0 < best < len(falls) - 1 or not resolved[best - 1]:
        return np.nan
    before, here, after = falls[best - 1 : best + 2]
    return best + 0.5 * float((before - after) / (before - 2 * here + after))

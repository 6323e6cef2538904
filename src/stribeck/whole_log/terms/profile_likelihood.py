"""Profile likelihood of one joint's coefficients, all else being fitted along (docs/estimator.md, equation 21).

Terms of one joint are tried many times. So everything else, the other joints' friction and the corrections, is
eliminated beforehand, by one Newton step from a fit of all joints with all terms; with i the joint and o all else,

    A_i = A_ii - A_io H_oo^-1 A_oi,    b_i = A_i theta_i - (g_i - A_io H_oo^-1 g_o)

(Murphy and van der Vaart 2000).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from stribeck.base.typing import Array
from stribeck.whole_log.model.model_corrections import ModelCorrections
from stribeck.whole_log.model.parametrisation import Parametrisation
from stribeck.whole_log.model.varying_curves import VaryingCurves
from stribeck.whole_log.solver.normal_equations import NormalEquations
from stribeck.whole_log.solver.solve import Solution, inverse_of


@dataclass(frozen=True, eq=False)
class Quadratic:
    """Chi^2 but for a constant: x^T A x - 2 b^T x of a joint's coefficients x; shapes (R, R) and (R,)."""

    information: Array
    right_hand_side: Array

    def at(self, x: Array) -> float:
        """Return its value."""
        return float(x @ (self.information @ x - 2 * self.right_hand_side))


@dataclass(frozen=True, eq=False)
class JointFold:
    """Of one joint: the profile likelihood of the training folds, and that of the held-out fold of the same fit."""

    training: Quadratic
    held_out: Quadratic


@dataclass(frozen=True, eq=False)
class _Around:
    """The fit of all joints that the elimination is linear around.

    Attributes
    ----------
    values
        Coefficients, then corrections, shape (D,).
    slopes
        Their derivatives by the m coordinates that no bound holds, shape (D, m).
    precision, prior_gradient
        Of the prior: shape (m, m), and its gradient (m,).
    joint
        Joint of each coordinate, shape (m,); -1 of corrections.
    """

    values: Array
    slopes: csr_array
    precision: Array
    prior_gradient: Array
    joint: NDArray[np.int64]


def joint_folds(
    total: NormalEquations,
    folds: list[NormalEquations],
    curves: VaryingCurves,
    model: ModelCorrections,
    solution: Solution,
) -> list[list[JointFold]]:
    """Return for each joint its folds: first the whole log with nothing held out, then with each fold held out.

    Parameters
    ----------
    total, folds
        The log, and its folds.
    curves, model, solution
        A fit of all joints with all terms to the whole of it.
    """
    around = _linearise(curves, model, solution)
    total_slopes = np.asarray((around.slopes.T @ total.information).T)
    nothing = NormalEquations(total.basis, total.layout)
    parts = [list(_eliminate(total, total_slopes, fold, around)) for fold in (nothing, *folds)]
    return [list(own) for own in zip(*parts, strict=True)]


def _linearise(curves: VaryingCurves, model: ModelCorrections, solution: Solution) -> _Around:
    parameters, layout = Parametrisation(curves, model), solution.layout
    mean, precision = parameters.prior
    free = np.ones(layout.size, dtype=bool)
    free[layout.friction] = (curves.having & ~solution.at_bound).ravel()
    owner = np.full(layout.size, -1)
    owner[layout.friction] = np.repeat(np.arange(layout.joints), layout.per_joint)
    values = parameters.values(solution.x)
    return _Around(
        values=values,
        slopes=csr_array(parameters.times_jacobian(np.eye(len(values)), parameters.blocks(solution.x))[:, free]),
        precision=precision[np.ix_(free, free)],
        prior_gradient=(precision @ (solution.x - mean))[free],
        joint=owner[free],
    )


def _eliminate(
    total: NormalEquations, total_slopes: Array, fold: NormalEquations, around: _Around
) -> Iterator[JointFold]:
    """Yield each joint's quadratics with a fold held out; `total_slopes` is the total information times the slopes."""
    J, y = around.slopes, around.values
    FJ = np.asarray((J.T @ fold.information).T)
    JFJ = np.asarray(J.T @ FJ)
    GJ, G = total_slopes - FJ, total.information - fold.information
    slope, beyond = G @ y - (total.right_hand_side - fold.right_hand_side), fold.information @ y - fold.right_hand_side
    inverse = inverse_of(J.T @ GJ + around.precision)
    gradient, push = J.T @ slope + around.prior_gradient, J.T @ beyond
    for joint in range(total.layout.joints):
        rows = total.layout.joint(joint)
        own, rest = around.joint == joint, around.joint != joint
        cross = GJ[rows][:, rest]  # of the joint's coefficients and all else
        follow = _without(inverse, own, rest, np.column_stack([cross.T, gradient[rest]]))
        back, shift = follow[:, :-1], -follow[:, -1]  # all else is shift - back times the joint's change
        information = G[rows, rows] - cross @ back
        right = information @ y[rows] - slope[rows] - cross @ shift
        left = FJ[rows][:, rest] @ back
        curved = fold.information[rows, rows] - left - left.T + back.T @ JFJ[np.ix_(rest, rest)] @ back
        tilt = beyond[rows] + FJ[rows][:, rest] @ shift
        tilt = tilt - back.T @ (push[rest] + JFJ[np.ix_(rest, rest)] @ shift)
        yield JointFold(Quadratic(information, right), Quadratic(curved, curved @ y[rows] - tilt))


def _without(inverse: Array, own: NDArray[np.bool_], rest: NDArray[np.bool_], vectors: Array) -> Array:
    """Return the inverse of a matrix without some rows and columns, times vectors, from the inverse of the whole."""
    cross = inverse[np.ix_(own, rest)]
    return np.asarray(
        inverse[np.ix_(rest, rest)] @ vectors - cross.T @ np.linalg.solve(inverse[np.ix_(own, own)], cross @ vectors)
    )

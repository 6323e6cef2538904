"""Fits of single joints' curves to their profile likelihoods (docs/estimator.md, equation 21), many at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.whole_log.model.friction_curves import Curves
from stribeck.whole_log.solver.gauss_newton import minimise
from stribeck.whole_log.terms.profile_likelihood import Quadratic


@dataclass(frozen=True, eq=False)
class JointCosts:
    """Half of chi^2 but for a constant, with the prior's share, of n joints, shapes (n, R, R) and (n, R)."""

    information: Array
    right_hand_side: Array
    curves: Curves

    def of(self, rows: NDArray[np.int64]) -> JointCosts:
        """Return those of some of the joints."""
        return JointCosts(self.information[rows], self.right_hand_side[rows], self.curves.of(rows))

    def costs(self, x: Array) -> Array:
        """Return the costs at internal coordinates, shape (n, p) -> (n,)."""
        mean, deviation = self.curves.prior
        values = self.curves.coefficients(x).reshape(self.right_hand_side.shape)
        squares = np.sum(values * (_times(self.information, values) - 2 * self.right_hand_side), axis=1)
        return np.asarray(squares + np.sum(((x - mean) / deviation) ** 2, axis=1)) / 2

    def derivatives(self, x: Array) -> tuple[Array, Array]:
        """Return gradients, shape (n, p), and Gauss-Newton's second derivatives, shape (n, p, p)."""
        mean, deviation = self.curves.prior
        jacobians = self.curves.jacobians(x)
        slope = (
            _times(self.information, self.curves.coefficients(x).reshape(self.right_hand_side.shape))
            - self.right_hand_side
        )
        gradient = _times(jacobians.transpose(0, 2, 1), slope) + (x - mean) / deviation**2
        hessian = jacobians.transpose(0, 2, 1) @ self.information @ jacobians
        hessian += np.eye(x.shape[1]) * deviation[:, None] ** -2.0
        return gradient, hessian


def joint_costs(logs: Sequence[Quadratic], curves: Curves) -> JointCosts:
    """Return the costs of joints from profile likelihoods of n logs, or of one log n times."""
    return JointCosts(
        np.stack([log.information for log in logs]), np.stack([log.right_hand_side for log in logs]), curves
    )


def descend_joints(logs: Sequence[Quadratic], curves: Curves, start: Array) -> tuple[Array, Array]:
    """Return where descents end, shape (n, p), and half of chi^2 there but for a constant, shape (n,).

    Parameters
    ----------
    logs
        Profile likelihoods of n logs, or of one log n times.
    curves
        Those of n joints, some of whose parameters may be fixed; a joint may be there more than once.
    start
        Internal coordinates, shape (n, p).
    """
    low, high = (np.broadcast_to(bound, start.shape) for bound in curves.bounds)
    found = minimise(joint_costs(logs, curves), start, low, high)
    return found.x, found.cost


def _times(matrices: Array, vectors: Array) -> Array:
    """Return the product of each matrix, shape (n, a, b), and its vector, shape (n, b), shape (n, a)."""
    return np.asarray((matrices @ vectors[:, :, None])[:, :, 0])

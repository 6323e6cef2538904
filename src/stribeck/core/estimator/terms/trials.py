"""Trials of terms: held-out scores of a joint's law in closed form (docs/estimator-fit.md, equation 21).

Terms of one joint are tried many times. Therefore everything else, the other joints' friction and the corrections, is
eliminated first, by one Newton step from a fit of all joints; for the joint i and all else o,

    A_i = S_ii - S_io H_oo^-1 S_oi,    b_i = A_i theta_i - (g_i - S_io H_oo^-1 g_o)

(Murphy and van der Vaart 2000). The law is then fitted to each set of training folds, once for each shape at
standstill: a jump, a rise, a rise with a Stribeck effect. Terms are linear and add to the law. Therefore one Newton
step yields the fit with some of them, and a quadratic function its chi^2 on the held-out fold.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.estimator.model.laws import Laws
from stribeck.core.estimator.model.terms import NO_TERM
from stribeck.core.estimator.solver.elimination import EachJoint, best_starts, eliminate, linearised, times_blocks
from stribeck.core.estimator.solver.fit import Fit
from stribeck.core.estimator.solver.positive_definite import inverse_of
from stribeck.core.estimator.solver.statistics import Statistics
from stribeck.core.friction import AUTO
from stribeck.core.friction.terms import LADDER

PARAMETERS = {term.name: term.names for term in LADDER}
"""Parameters of each term; the first is zero without the term."""

SEEN = 1e-4
"""Share of the held-out fold's information [1] that the fit of the other coordinates keeps.

A wheel may roll backward only once: without that part of the log its offset is unknown, and with it all joints' scores.
"""

SHAPES = ("stribeck", "rounding", "")
"""Terms that determine a law's shape at standstill; the last shape is a jump."""


def _eliminated(whole: Statistics, fold: Statistics | None, fit: Fit) -> Iterable[tuple[Array, Array, Array, Array]]:
    """Yield A and b of each joint for the training folds, then for the held-out fold."""
    laws, u, f = fit.laws, fit.corrections, whole.friction
    training = whole if fold is None else whole.without(fold)
    system = eliminate(training, fit.model, u)
    theta = laws.coefficients(fit.internal)
    free = (laws.free & ~fit.at_bound).ravel()
    blocks, y = laws.jacobians(fit.internal), theta.ravel()
    mean, deviation = laws.prior
    SJ = times_blocks(system.information, blocks)[:, free]
    slope = system.information @ y - system.right
    gradient = times_blocks(slope[None], blocks)[0, free] + ((fit.internal - mean) / deviation**2).ravel()[free]
    held, held_right = np.zeros((f, f)), np.zeros(f)
    if fold is not None:
        cross, inner, right = linearised(fold, fit.model, u)
        across = (cross - 0.5 * inner @ system.follow).T @ system.follow
        held = fold.information[:f, :f] - across - across.T
        held_right = right[:f] - cross.T @ system.alone - system.follow.T @ (right[f:] - inner @ system.alone)
    FJ, beyond = times_blocks(held, blocks)[:, free], held @ y - held_right
    JFJ, tilted = times_blocks(FJ.T, blocks)[:, free], times_blocks(beyond[None], blocks)[0, free]
    hessian = times_blocks(SJ.T, blocks)[:, free] + np.diag(deviation.ravel()[free] ** -2.0)
    inverse = inverse_of(hessian + SEEN * JFJ)
    owner, q = np.repeat(np.arange(len(theta)), fit.internal.shape[1])[free], theta.shape[1]
    for joint, own_theta in enumerate(theta):
        rows, own = slice(joint * q, (joint + 1) * q), owner == joint
        vectors = np.column_stack([SJ[rows].T, gradient])
        vectors[own] = 0.0  # rows of the joint itself stay zero in all that follows
        follow = inverse @ vectors  # by the inverse without these rows, given the inverse of the whole
        follow -= inverse[:, own] @ np.linalg.solve(inverse[np.ix_(own, own)], follow[own])
        follow[own] = 0.0
        back, shift = follow[:, :-1], -follow[:, -1]  # all else is shift - back times the joint's change
        information = system.information[rows, rows] - SJ[rows] @ back
        bent = FJ[rows] @ back
        curved = held[rows, rows] - bent - bent.T + back.T @ JFJ @ back
        tilt = beyond[rows] + FJ[rows] @ shift - back.T @ (tilted + JFJ @ shift)
        yield information, information @ own_theta - slope[rows] - SJ[rows] @ shift, curved, curved @ own_theta - tilt


@dataclass(frozen=True, eq=False)
class Around:
    """Fits of all joints with one shape: first to the whole log, then without each fold.

    Attributes
    ----------
    internal
        Internal coordinates, shape (n, F + 1, w).
    gradient, curvature
        Derivatives of half of the training folds' chi^2 with the prior, shape (n, F + 1, w) and (n, F + 1, w, w).
    score, tilt, curved
        Chi^2 of the held-out fold, half of its gradient, and half of its second derivatives: shape (n, F), (n, F, w)
        and (n, F, w, w).
    """

    internal: Array
    gradient: Array
    curvature: Array
    score: Array
    tilt: Array
    curved: Array


@dataclass(frozen=True, eq=False)
class Tried:
    """Trial of a joint with some terms: coordinates for the whole log, shape (w,), and each held-out chi^2, (F,)."""

    internal: Array
    scores: Array


@dataclass(frozen=True, eq=False)
class Trials:
    """Laws of the joints with all terms that are not excluded, and the equations of the folds.

    Attributes
    ----------
    information, right
        A and b of the joints' coefficients for the training folds, where the first has nothing held out: chi^2 except a
        constant is theta^T A theta - 2 b^T theta, with all else refitted, shape (n, F + 1, q, q) and (n, F + 1, q).
    held_information, held_right
        The same for the held-out folds, shape (n, F, q, q) and (n, F, q).
    laws
        Laws with all terms.
    scale
        Overdispersion [1].
    """

    information: Array
    right: Array
    held_information: Array
    held_right: Array
    laws: Laws
    scale: float

    @cached_property
    def names(self) -> list[str]:
        """Names of a joint's parameters."""
        return [parameter.name for parameter in self.laws.parameters]

    def having(self, kept: Iterable[str]) -> BoolArray:
        """Mark the parameters of a joint with these terms, shape (w,)."""
        without = {name for names in PARAMETERS.values() for name in names} | NO_TERM
        if self.laws.law.name != AUTO:  # the shape is fixed
            without -= {parameter.name for parameter in self.laws.law.parameters}
        without -= {name for term in kept for name in PARAMETERS.get(term, (term,))}
        return np.array([name not in without for name in self.names])

    @cached_property
    def around(self) -> dict[str, Around]:
        """Fits by shape; a law without a choice of terms has one shape."""
        if self.laws.law.name != AUTO:
            return {"": self._fits(self.having(()))}
        others = [name for name in PARAMETERS if name not in SHAPES]
        return {shape: self._fits(self.having([*others, shape])) for shape in SHAPES}

    def _fits(self, having: BoolArray) -> Around:
        laws, (n, count, q) = self.laws.only(having), self.right.shape
        whole, _ = best_starts(laws, self.information[:, 0], self.right[:, 0])
        owners = np.repeat(np.arange(n), count)
        problem = EachJoint(laws.of(owners), self.information.reshape(-1, q, q), self.right.reshape(-1, q))
        ends, _ = problem.best(whole[owners])
        return self._near(np.arange(n), ends.reshape(n, count, -1))

    def _near(self, joints: IntArray, internal: Array) -> Around:
        """Expand chi^2 around coordinates of some joints in each fold, shape (j, F + 1, w)."""
        mean, deviation = (moment[joints, None] for moment in self.laws.prior)
        j, count, w = internal.shape
        laws, x = self.laws.of(np.repeat(joints, count)), internal.reshape(-1, w)
        theta, jacobians = laws.coefficients(x).reshape(j, count, -1), laws.jacobians(x).reshape(j, count, -1, w)
        transposed = jacobians.transpose(0, 1, 3, 2)
        slope = (self.information[joints] @ theta[..., None])[..., 0] - self.right[joints]
        held = (self.held_information[joints] @ theta[:, 1:, :, None])[..., 0]
        held_right = self.held_right[joints]
        return Around(
            internal,
            (transposed @ slope[..., None])[..., 0] + (internal - mean) / deviation**2,
            transposed @ self.information[joints] @ jacobians + np.eye(w) * deviation[..., None] ** -2.0,
            np.sum(theta[:, 1:] * (held - 2 * held_right), axis=2),
            (transposed[:, 1:] @ (held - held_right)[..., None])[..., 0],
            transposed[:, 1:] @ self.held_information[joints] @ jacobians[:, 1:],
        )

    def try_terms(self, joint: int, kept: Iterable[str]) -> Tried:
        """Fit a joint with some terms; a change of shape by a tenth requires a second Newton step."""
        wanted, (low, high) = self.having(kept) & self.laws.free[joint], self.laws.bounds[:, joint]
        shape = next(iter(set(kept) & set(SHAPES)), "") if self.laws.law.name == AUTO else ""
        near, place = self.around[shape], joint
        step = _step(near, place, wanted, low, self.laws.neutral)
        if np.abs(step[:, self.laws.logarithmic & wanted]).max(initial=0.0) > 0.1:
            new = np.clip(near.internal[place] + step, np.where(wanted, low, -np.inf), np.where(wanted, high, np.inf))
            near, place = self._near(np.array([joint]), new[None]), 0
            step = _step(near, place, wanted, low, self.laws.neutral)
        held = step[1:]
        scores = near.score[place] + np.sum(held * (2 * near.tilt[place]), axis=1)
        scores = scores + (held[:, None] @ near.curved[place] @ held[..., None])[:, 0, 0]
        return Tried(near.internal[place, 0] + step[0], scores / self.scale)


def make_trials(whole: Statistics, folds: Sequence[Statistics], fit: Fit) -> Trials:
    """Prepare the trials of all terms with columns from a fit of all joints with all terms to the whole log."""
    splits = [list(_eliminated(whole, None, fit)), *(list(_eliminated(whole, fold, fit)) for fold in folds)]
    A, b, held, held_right = (np.stack([[joint[k] for joint in joints] for joints in splits], axis=1) for k in range(4))
    free = fit.laws.free.copy()
    free[:, len(fit.laws.law.parameters) :] = True
    overdispersion = max(1.0, fit.chi_square / max(whole.count - fit.internal.size, 1))
    return Trials(A, b, held[:, 1:], held_right[:, 1:], replace(fit.laws, free=free), overdispersion)


def _step(around: Around, joint: int, wanted: BoolArray, low: Array, neutral: Array) -> Array:
    """Compute a joint's Newton step in each fold, shape (F + 1, w), with absent terms at their neutral values."""
    x, curvature = around.internal[joint], around.curvature[joint]
    target = np.where(wanted, np.nan, neutral)
    while True:  # fix coordinates that would fall below their bound
        on = np.isnan(target)
        step = np.where(on, 0.0, target - x)
        push = around.gradient[joint] + (curvature @ step[..., None])[..., 0]
        step[:, on] = -np.linalg.solve(curvature[:, on][:, :, on], push[:, on, None])[..., 0]
        below = on & (x[0] + step[0] < low - 1e-9)
        if not below.any():
            return np.asarray(step)
        target[below] = low[below]

"""Fewer columns that say as much: what of the equations is worth weighing and summing up.

The functions of velocity that a law's curves are sums of serve all parameters that the law may have. Some stretches of
the log already say which curves each joint may have, and how well the whole log will tell them apart: with G the
information of all stretches about a joint's coefficients c, curves whose c differ by less than one standard deviation,
d^T G d < 1, are the same to it. The singular vectors of G^(1/2) c over curves near the first fit are the few sums that
are needed. Inertial parameters are summed over base parameters alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.nodes import Nodes
from stribeck.identification.whole_log.solve import Solution
from stribeck.identification.whole_log.statistic import Statistic
from stribeck.typing import Array
from stribeck.weak_equations import Corrections

NEIGHBOURS = 100
"""Curves [1] of each joint that the sums must hold."""

FAR = 2.0
"""How far they are drawn around the first fit, in its standard deviations [1] of every coordinate."""

MISSED = 0.3
"""What may be missing of each of them, in standard deviations of the whole log [1]."""

LOST = 1.0
"""What the fit's own curves may miss [1]: more, and all functions are summed up."""

UNSEEN = 1e-12
"""Share of a joint's information [1] that is as good as none."""


@dataclass(frozen=True, eq=False)
class Narrowing:
    """Columns that are summed up instead of all.

    Attributes
    ----------
    nodes
        With the fewer functions.
    kept
        Which columns of corrections, shape (b,).
    lift
        All columns as sums of those kept, functions first, shape (nodes.size + b, D).
    losses
        Rows whose products with a joint's coefficients are lost, in standard deviations of the whole log, shape
        (n, any, r).
    """

    nodes: Nodes
    kept: NDArray[np.int64]
    lift: Array
    losses: Array

    def holds(self, coefficients: Array) -> bool:
        """Return whether curves, shape (n r,), are as good as among what is summed up."""
        lost = self.losses @ coefficients.reshape(len(self.losses), -1, 1)
        return bool(np.linalg.norm(lost, axis=1).max(initial=0.0) < LOST)

    def widened(self, narrow: Statistic, nodes: Nodes) -> Statistic:
        """Return a statistic of the fewer columns as one of all; columns behind these stay as they are."""
        core, size = self.lift.shape
        wide = Statistic(nodes, size - nodes.size + len(narrow.right) - core, narrow.gaits, narrow.suspects)
        wide.gram[:size, :size] = self.lift.T @ narrow.gram[:core, :core] @ self.lift
        wide.gram[:size, size:] = self.lift.T @ narrow.gram[:core, core:]
        wide.gram[size:, :size] = wide.gram[:size, size:].T
        wide.gram[size:, size:] = narrow.gram[core:, core:]
        wide.right[:size], wide.right[size:] = self.lift.T @ narrow.right[:core], narrow.right[core:]
        wide.square, wide.count, wide.loads = narrow.square, narrow.count, narrow.loads
        return wide


def all_functions(nodes: Nodes, corrections: Corrections) -> Narrowing:
    """Return what sums up all functions of velocity, and of inertial parameters the base parameters."""
    kept, lift = _base(corrections)
    joints = len(nodes.velocity)
    nothing = np.zeros((joints, 1, nodes.size // joints))
    return Narrowing(nodes, kept, block_diag(np.eye(nodes.size), lift), nothing)


def narrowings(
    curves: Curves, corrections: Corrections, heard: Statistic, solution: Solution, share: float
) -> Iterator[Narrowing]:
    """Yield what to sum up: the functions that curves near a first fit need, and all, should these not be enough.

    Parameters
    ----------
    curves, corrections
        What is fitted.
    heard, solution
        Statistic of some stretches, and the fit to it.
    share
        How much of the whole log these are [1].
    """
    if not curves.nodes.factors:
        yield _near_curves(curves, corrections, heard, solution, share)
    yield all_functions(curves.nodes, corrections)


def _near_curves(
    curves: Curves, corrections: Corrections, heard: Statistic, solution: Solution, share: float
) -> Narrowing:
    joints, functions = len(curves.top_speed), curves.nodes.functions.shape[-1]
    size = joints * functions
    blocks = heard.gram[:size, :size].reshape(joints, functions, joints, functions)
    information = np.einsum("jajb->jab", blocks) / share
    level = np.trace(information, axis1=1, axis2=2)[:, None, None]
    root = np.linalg.cholesky(information + UNSEEN * level * np.eye(functions)).transpose(0, 2, 1)
    family = root @ _neighbours(curves, solution)
    left = np.linalg.svd(family, full_matrices=False)[0]
    missed = (family**2).sum(axis=1)[:, None] - np.cumsum((left.transpose(0, 2, 1) @ family) ** 2, axis=1)
    enough = missed.max(axis=(0, 2)) < MISSED**2
    count = 1 + int(np.argmax(enough)) if enough.any() else functions
    left = left[:, :, :count]
    sums = np.linalg.solve(root, left)
    lift = left.transpose(0, 2, 1) @ root
    nodes = replace(curves.nodes, functions=curves.nodes.functions @ sums, factored=np.zeros((count, 0)))
    kept, base = _base(corrections)
    return Narrowing(nodes, kept, block_diag(*lift, base), root - left @ lift)


def _base(corrections: Corrections) -> tuple[NDArray[np.int64], Array]:
    """Return which columns of corrections are kept, shape (b,), and all as sums of them, shape (b, c)."""
    first = corrections.inertial_parameters.size
    if not len(corrections.independent):
        return np.arange(corrections.size), np.eye(corrections.size)
    kept = np.concatenate([corrections.independent, np.arange(first, corrections.size)])
    return kept, block_diag(corrections.sums, np.eye(corrections.size - first))


def _neighbours(curves: Curves, solution: Solution) -> Array:
    """Return coefficients of curves near a solution, shape (n, r, N); a constant, Coulomb and viscous friction, too."""
    generator = np.random.default_rng(1)
    joints, count = solution.internal.shape
    low, high = curves.bounds
    found = [curves.coefficients(solution.internal).reshape(joints, -1)]
    spread = np.stack([solution.covariance[k : k + count, k : k + count] for k in range(0, joints * count, count)])
    factor = np.linalg.cholesky(spread)
    for _ in range(NEIGHBOURS):
        away = factor @ generator.standard_normal((joints, count, 1))
        near = np.clip(solution.internal + FAR * away[:, :, 0], low, high)
        found.append(curves.coefficients(near).reshape(joints, -1))
    size = np.linalg.norm(found[0], axis=1)[:, None, None]
    simple = [
        curves.nodes.coefficients(np.column_stack([np.ones_like(v), np.sign(v), v / v.max()]))
        for v in curves.nodes.velocity
    ]
    return np.concatenate([np.stack(found, axis=2), size * np.stack(simple)], axis=2)

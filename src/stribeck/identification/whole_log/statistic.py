"""What a whole log says about friction and model, summed up once: a Gaussian likelihood of fixed size."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from stribeck.equations import WeakEquations
from stribeck.identification.whole_log.levels import ErrorLevels
from stribeck.identification.whole_log.nodes import Nodes
from stribeck.identification.whole_log.whitening import make_whitener
from stribeck.log import Array


@dataclass(eq=False)
class Statistic:
    """Normal equations of the node values of all friction curves, then of the model's c corrections.

        chi^2(x) = square - 2 right^T x + x^T gram x

    Any law is fitted to this without another look at the log, and the statistics of several stretches or logs add up.

    Attributes
    ----------
    nodes
        Of the friction curves.
    corrections
        Number c.
    gram, right
        Shape (D, D) and (D,), with D = nodes.size + c.
    square, count
        Sum of squared whitened residuals without friction, and their number.
    """

    nodes: Nodes
    corrections: int
    gram: Array = field(init=False)
    right: Array = field(init=False)
    square: float = 0.0
    count: int = 0

    def __post_init__(self) -> None:
        size = self.nodes.size + self.corrections
        self.gram, self.right = np.zeros((size, size)), np.zeros(size)

    def add(self, equations: WeakEquations, levels: ErrorLevels) -> None:
        """Take in the equations of a stretch."""
        columns, matrix = design(equations, self.nodes)
        whitener = make_whitener(equations, levels)
        white = whitener.apply(np.column_stack([matrix, equations.residual.ravel()]))
        gram = white.T @ white
        self.gram[np.ix_(columns, columns)] += gram[:-1, :-1]
        self.right[columns] += gram[:-1, -1]
        self.square += float(gram[-1, -1])
        self.count += equations.residual.size

    def merge(self, other: Statistic) -> None:
        """Take in another statistic of the same nodes and corrections."""
        self.gram += other.gram
        self.right += other.right
        self.square += other.square
        self.count += other.count


def design(equations: WeakEquations, nodes: Nodes) -> tuple[NDArray[np.int64], Array]:
    """Return the columns that a stretch touches, and its equations' derivatives by them, shape (K m, columns)."""
    windows, rows = equations.residual.shape
    curves = _window_matrix(equations) @ nodes.weights(equations.velocity)
    touched = np.unique(curves.indices).astype(np.int64)
    dense = curves[:, touched].toarray()
    matrix = (equations.weights[:, :, nodes.joint_of(touched)] * dense[:, None, :]).reshape(windows * rows, -1)
    if equations.columns is None:
        return touched, matrix
    corrections = equations.columns.reshape(windows * rows, -1)
    columns = np.concatenate([touched, nodes.size + np.arange(corrections.shape[1])])
    return columns, np.column_stack([matrix, corrections])


def _window_matrix(equations: WeakEquations) -> csr_array:
    """Return the windows as a sparse matrix, shape (K, T)."""
    windows, length = len(equations.residual), len(equations.taps)
    columns = equations.step * np.arange(windows)[:, None] + np.arange(length)
    starts = length * np.arange(windows + 1)
    weights = np.tile(equations.taps, windows)
    return csr_array((weights, columns.ravel(), starts), shape=(windows, len(equations.velocity)))

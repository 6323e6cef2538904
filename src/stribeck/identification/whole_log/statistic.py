"""What a whole log says about friction and model, summed up once: a Gaussian likelihood of fixed size."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from stribeck.equations import WeakEquations
from stribeck.identification.whole_log.cosines import repeated_columns
from stribeck.identification.whole_log.levels import ErrorLevels
from stribeck.identification.whole_log.nodes import Nodes
from stribeck.identification.whole_log.whitening import make_whitener
from stribeck.log import Array


@dataclass(eq=False)
class Statistic:
    """Normal equations of the coefficients of all friction curves, then of c corrections and repeated errors.

        chi^2(x) = square - 2 right^T x + x^T gram x

    A law is fitted to this without another look at the log, and the statistics of several stretches or logs add up.

    Attributes
    ----------
    nodes
        And functions that the friction curves are sums of.
    corrections
        Number c, the repeated errors of all gait phases included.
    gaits
        Number of gait phases whose repeated errors are looked for.
    gram, right
        Shape (D, D) and (D,), with D = nodes.size + c.
    square, count
        Sum of squared whitened residuals without friction, and their number.
    """

    nodes: Nodes
    corrections: int
    gaits: int = 0
    gram: Array = field(init=False)
    right: Array = field(init=False)
    square: float = 0.0
    count: int = 0

    def __post_init__(self) -> None:
        size = self.nodes.size + self.corrections
        self.gram, self.right = np.zeros((size, size)), np.zeros(size)

    def add(self, equations: WeakEquations, levels: ErrorLevels) -> None:
        """Take in the equations of a stretch."""
        whitener = make_whitener(equations, levels)
        columns = design(equations, self.nodes)
        if self.gaits:
            columns = np.column_stack([columns, repeated_columns(equations, self.gaits)])
        white = whitener.apply(columns)
        residual = whitener.apply(equations.residual.reshape(-1, 1))[:, 0]
        self.gram += white.T @ white  # NumPy knows the product to be symmetric
        self.right += residual @ white
        self.square += float(residual @ residual)
        self.count += equations.residual.size

    def merge(self, other: Statistic) -> None:
        """Take in another statistic of the same nodes and corrections."""
        self.gram += other.gram
        self.right += other.right
        self.square += other.square
        self.count += other.count


def design(equations: WeakEquations, nodes: Nodes) -> Array:
    """Return the equations' derivatives by coefficients, then corrections, shape (K m, D)."""
    windows, rows = equations.residual.shape
    curves = nodes.windows(equations.velocity, equations.taps, equations.step, windows)
    matrix = (equations.weights[:, :, :, None] * curves[:, None]).reshape(windows * rows, nodes.size)
    if equations.columns is None:
        return matrix
    return np.column_stack([matrix, equations.columns.reshape(windows * rows, -1)])

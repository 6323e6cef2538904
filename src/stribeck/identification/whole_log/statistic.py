"""What a whole log says about friction and model, summed up once: a Gaussian likelihood of fixed size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from stribeck.identification.whole_log.cosines import repeated_columns
from stribeck.identification.whole_log.levels import ErrorLevels
from stribeck.identification.whole_log.nodes import Nodes
from stribeck.identification.whole_log.suspects import Suspects
from stribeck.identification.whole_log.whitening import make_whitener
from stribeck.typing import Array
from stribeck.weak_equations import WeakEquations


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
        Number c, the repeated errors of all gait phases and the suspects included.
    gaits
        Number of gait phases whose repeated errors are looked for.
    suspects
        Friction beyond the law that is looked for, if any.
    kept
        Which columns of the equations' corrections are summed up, shape (b,); None if all.
    gram, right
        Shape (D, D) and (D,), with D = nodes.size + c.
    square, count
        Sum of squared whitened residuals without friction, and their number.
    loads
        Number of windows, and sums of the joints' loads [N m] and of their squares, shape (3, n); zeros without loads.
    """

    nodes: Nodes
    corrections: int
    gaits: int = 0
    suspects: Suspects | None = None
    kept: NDArray[np.int64] | None = None
    gram: Array = field(init=False)
    right: Array = field(init=False)
    loads: Array = field(init=False)
    square: float = 0.0
    count: int = 0

    def __post_init__(self) -> None:
        size = self.nodes.size + self.corrections
        self.gram, self.right = np.zeros((size, size)), np.zeros(size)
        self.loads = np.zeros((3, len(self.nodes.velocity)))

    def add(self, equations: WeakEquations, levels: ErrorLevels, core: Statistic | None = None) -> None:
        """Take in the equations of a stretch; `core`, a statistic without further columns, takes them in as well."""
        end = len(self.right) - (self.suspects.size if self.suspects else 0)
        further: list[tuple[int, Array]] = []  # by the place of their first column
        if self.gaits and equations.gait >= 0:
            own = repeated_columns(equations)
            further.append((end - (self.gaits - equations.gait) * own.shape[1], own))
        if self.suspects:
            further.append((end, self.suspects.columns(equations)))
        behind = [*(columns for _, columns in further), equations.residual.reshape(-1, 1)]
        white = design(equations, self.nodes, self.kept, behind)
        make_whitener(equations, levels).whiten(white)
        product = white.T @ white  # NumPy knows it to be symmetric
        size = white.shape[1] - sum(columns.shape[1] for columns in behind)
        places = [(slice(0, size), slice(0, size))]  # in the product, and here
        for first, columns in further:
            last = places[-1][0].stop
            places.append((slice(last, last + columns.shape[1]), slice(first, first + columns.shape[1])))
        for here, place in places:
            self.right[place] += product[here, -1]
            for other, there in places:
                self.gram[place, there] += product[here, other]
        self._count(equations, product[-1, -1])
        if core is not None:
            core.gram += product[:size, :size]
            core.right += product[:size, -1]
            core._count(equations, product[-1, -1])

    def _count(self, equations: WeakEquations, square: float) -> None:
        self.square += float(square)
        self.count += equations.residual.size
        if equations.factors is not None:
            load = equations.factors[:, :, 0]
            self.loads += [np.full(load.shape[1], len(load)), load.sum(axis=0), (load**2).sum(axis=0)]

    def merge(self, other: Statistic) -> None:
        """Take in another statistic of the same nodes and corrections."""
        self.gram += other.gram
        self.right += other.right
        self.square += other.square
        self.count += other.count
        self.loads += other.loads

    def without_last(self, columns: int, gaits: int = 0) -> Statistic:
        """Return the statistic as if its last columns had never been, some gait phases being left."""
        kept = Statistic(self.nodes, self.corrections - columns, gaits)
        size = len(kept.right)
        kept.gram, kept.right = self.gram[:size, :size].copy(), self.right[:size].copy()
        kept.square, kept.count, kept.loads = self.square, self.count, self.loads.copy()
        return kept


def merged(parts: Sequence[Statistic]) -> Statistic:
    """Return the statistic of all parts together, of the same nodes and corrections."""
    first = parts[0]
    whole = Statistic(first.nodes, first.corrections, first.gaits, first.suspects, first.kept)
    for part in parts:
        whole.merge(part)
    return whole


def design(
    equations: WeakEquations, nodes: Nodes, kept: NDArray[np.int64] | None = None, behind: Sequence[Array] = ()
) -> Array:
    """Return the equations' derivatives by coefficients, then corrections, those kept or all, shape (K m, D).

    More columns, shape (K m, any) each, may stand `behind` them.
    """
    windows, rows = equations.residual.shape
    curves = curve_windows(equations, nodes)
    columns = equations.columns if equations.columns is None or kept is None else equations.columns[:, :, kept]
    end = nodes.size + (0 if columns is None else columns.shape[2])
    matrix = np.empty((windows, rows, end + sum(each.shape[1] for each in behind)))
    friction = matrix[:, :, : nodes.size].reshape(windows, rows, *curves.shape[1:])  # a view: its last axis in two
    if equations.projection is None:
        friction[:] = 0.0
        np.einsum("kjjr->kjr", friction)[:] = curves
    else:
        np.multiply(equations.projection[:, :, :, None], curves[:, None], out=friction)
    if columns is not None:
        matrix[:, :, nodes.size : end] = columns
    whole = matrix.reshape(windows * rows, -1)
    if behind:
        np.concatenate(behind, axis=1, out=whole[:, end:])
    return whole


def curve_windows(equations: WeakEquations, nodes: Nodes) -> Array:
    """Return the windows of all functions of velocity, those that factors multiply after the others, (K, n, R)."""
    plain = nodes.windows(equations.velocity, equations.taps, equations.step, len(equations.residual))
    return plain if equations.factors is None else times_factors(plain, equations.factors, nodes)


def times_factors(plain: Array, factors: Array, nodes: Nodes) -> Array:
    """Return windows (K, n, r) with those of the functions that factors (K, n, f) multiply, shape (K, n, R)."""
    changed = factors[:, :, :, None] * (plain @ nodes.factored)[:, :, None]
    return np.concatenate([plain, changed.reshape(*plain.shape[:2], -1)], axis=2)

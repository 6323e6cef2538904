"""Normal equations of a whole log: sufficient statistics of fixed size (docs/estimator.md, equations 12 and 13)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from stribeck.base.typing import Array
from stribeck.whole_log.fit_checks.alternative_terms import AlternativeTerms
from stribeck.whole_log.model.basis import Basis
from stribeck.whole_log.model.layout import ModelLayout
from stribeck.whole_log.noise.outliers import Prediction
from stribeck.whole_log.noise.variance_components import VarianceComponents
from stribeck.whole_log.noise.whitening import make_whitener
from stribeck.whole_log.uncertainty.random_effects import random_effect_columns
from stribeck.whole_log.weak_equations import WeakEquations


@dataclass(eq=False)
class NormalEquations:
    """Normal equations of the coefficients of all friction curves, then of corrections and random effects.

        chi^2(theta) = s - 2 b^T theta + theta^T A theta

    A law is fitted to these without another look at the log, and those of several segments or logs add up.

    Attributes
    ----------
    basis
        Of the friction curves.
    layout
        Of the D values theta.
    alternatives
        That are tested, if any.
    information, right_hand_side
        A and b, shape (D, D) and (D,).
    square, count
        s, the sum of squares of the whitened left sides, and the number of those that count.
    windows, set_aside
        Number of windows, and of those that are set aside.
    loads
        Number of windows, and sums of the joints' loads [N m] and of their squares, shape (3, n); zeros without loads.
    """

    basis: Basis
    layout: ModelLayout
    alternatives: AlternativeTerms | None = None
    information: Array = field(init=False)
    right_hand_side: Array = field(init=False)
    loads: Array = field(init=False)
    square: float = 0.0
    count: int = 0
    windows: int = 0
    set_aside: int = 0

    def __post_init__(self) -> None:
        size = self.layout.size
        self.information, self.right_hand_side = np.zeros((size, size)), np.zeros(size)
        self.loads = np.zeros((3, self.layout.joints))

    def add(
        self,
        equations: WeakEquations,
        components: VarianceComponents,
        core: NormalEquations | None = None,
        prediction: Prediction | None = None,
    ) -> None:
        """Add the equations of a segment but for windows far from a prediction, and to `core` without more columns."""
        further: list[tuple[slice, Array]] = []  # by the place of their columns
        if self.layout.gaits and equations.gait >= 0:
            further.append((self.layout.gait(equations.gait), random_effect_columns(equations)))
        if self.alternatives:
            further.append((self.layout.part("alternatives"), self.alternatives.columns(equations)))
        behind = [*(columns for _, columns in further), equations.residual.reshape(-1, 1)]
        white = design(equations, self.basis, behind)
        if prediction:
            equations = prediction.set_aside(equations, white)
        make_whitener(equations, components).whiten(white)
        product = white.T @ white  # NumPy knows it to be symmetric
        size = self.layout.corrections.stop
        places = [(slice(0, size), slice(0, size))]  # in the product, and here
        for place, columns in further:
            last = places[-1][0].stop
            places.append((slice(last, last + columns.shape[1]), place))
        for here, place in places:
            self.right_hand_side[place] += product[here, -1]
            for other, there in places:
                self.information[place, there] += product[here, other]
        self._count(equations, product[-1, -1])
        if core is not None:
            core.information += product[:size, :size]
            core.right_hand_side += product[:size, -1]
            core._count(equations, product[-1, -1])

    def _count(self, equations: WeakEquations, square: float) -> None:
        self.square += float(square)
        self.count += int(equations.used.sum()) * equations.residual.shape[1]
        self.windows += len(equations.time)
        self.set_aside += int((~equations.used).sum())
        if equations.covariates is not None:
            load = equations.covariates[:, :, 0]
            self.loads += [np.full(load.shape[1], len(load)), load.sum(axis=0), (load**2).sum(axis=0)]

    @property
    def mean_load(self) -> Array:
        """Of each joint [N m], shape (n,)."""
        return np.asarray(self.loads[1] / self.loads[0])

    @property
    def load_deviation(self) -> Array:
        """Standard deviation of each joint's load [N m], shape (n,)."""
        return np.asarray(np.sqrt(np.maximum(self.loads[2] / self.loads[0] - self.mean_load**2, 0.0)))

    def merge(self, other: NormalEquations) -> None:
        """Add other normal equations of the same basis and layout."""
        self.information += other.information
        self.right_hand_side += other.right_hand_side
        self.square += other.square
        self.count += other.count
        self.windows += other.windows
        self.set_aside += other.set_aside
        self.loads += other.loads

    def without(self, *names: str) -> NormalEquations:
        """Return the normal equations without their last columns, by fields of their layout."""
        kept = NormalEquations(self.basis, self.layout.without(*names))
        size = kept.layout.size
        kept.information, kept.right_hand_side = (
            self.information[:size, :size].copy(),
            self.right_hand_side[:size].copy(),
        )
        kept.windows, kept.set_aside = self.windows, self.set_aside
        kept.square, kept.count, kept.loads = self.square, self.count, self.loads.copy()
        return kept


def merged(parts: Sequence[NormalEquations]) -> NormalEquations:
    """Return the normal equations of all parts together, of the same basis and layout."""
    whole = NormalEquations(parts[0].basis, parts[0].layout, parts[0].alternatives)
    for part in parts:
        whole.merge(part)
    return whole


def design(equations: WeakEquations, basis: Basis, behind: Sequence[Array] = ()) -> Array:
    """Return the equations' derivatives by coefficients, then corrections, shape (K m, D).

    More columns, shape (K m, any) each, may stand `behind` them.
    """
    windows, rows = equations.residual.shape
    curves = curve_windows(equations, basis)
    columns = equations.regressors
    end = basis.size + (0 if columns is None else columns.shape[2])
    matrix = np.empty((windows, rows, end + sum(each.shape[1] for each in behind)))
    friction, corrections, further = np.split(matrix, [basis.size, end], axis=2)  # views
    friction = friction.reshape(windows, rows, *curves.shape[1:])  # a view too: its last axis in two
    if equations.projection is None:
        friction[:] = 0.0
        np.einsum("kjjr->kjr", friction)[:] = curves
    else:
        np.multiply(equations.projection[:, :, :, None], curves[:, None], out=friction)
    if columns is not None:
        corrections[:] = columns
    if behind:
        further[:] = np.concatenate(behind, axis=1).reshape(further.shape)
    return matrix.reshape(windows * rows, -1)


def curve_windows(equations: WeakEquations, basis: Basis) -> Array:
    """Return the windows of the basis, functions that covariates multiply after the others, shape (K, n, R or m)."""
    windows = basis.windows(equations.velocity, equations.taps, equations.step, len(equations.residual))
    if equations.covariates is not None:
        windows = times_covariates(windows, equations.covariates, basis)
    return windows if basis.reduced is None else (windows.transpose(1, 0, 2) @ basis.reduced[0]).transpose(1, 0, 2)


def times_covariates(plain: Array, covariates: Array, basis: Basis) -> Array:
    """Return windows (K, n, r) with those of functions times covariates (K, n, f), shape (K, n, R)."""
    changed = [covariates[:, :, [k]] * (plain @ functions) for k, functions in enumerate(basis.modulated)]
    return np.concatenate([plain, *changed], axis=2)

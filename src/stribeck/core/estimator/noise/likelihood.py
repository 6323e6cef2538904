"""Variance components by restricted maximum likelihood, from groups of windows (docs/estimator-fit.md, equation 15).

A group contains as many windows as errors reach over, or all of a shorter segment. Every other group is used: these
share no error and are whitened individually, while each group contains the correlation of its errors.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy  # its linalg is slow to import: loaded at its first use
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.core.equations.weak_equations import WeakEquations
from stribeck.core.estimator.noise.variance_components import AWAY, BINS, VarianceComponents, bin_of
from stribeck.core.estimator.noise.whitening import covariance_of_groups


@dataclass(frozen=True, eq=False)
class Groups:
    """Every other group of windows of a segment, or fewer.

    Attributes
    ----------
    part
        The segment.
    first, step
        Index of the first group in the segment, and distance to the next group [1].
    design
        Derivatives by all coordinates, then left sides, shape (g, b, D + 1): b rows of `lags` windows.
    """

    part: WeakEquations
    first: int
    step: int
    design: Array

    @property
    def places(self) -> slice:
        """Indices among all complete groups of the segment."""
        return slice(self.first, len(self.part.time) // self.part.lags, self.step)

    def of_windows(self, values: NDArray[Any]) -> NDArray[Any]:
        """Arrange the values of windows (K, ...) by groups, shape (g, lags, ...)."""
        lags = self.part.lags
        whole = values[: len(values) // lags * lags]
        return whole.reshape(-1, lags, *values.shape[1:])[self.places]

    @property
    def count(self) -> int:
        """Number of equations that count."""
        return int(self.of_windows(self.part.used).sum() * self.part.residual.shape[1])

    def whitener(self, components: VarianceComponents) -> Array:
        """Compute L^-1 of each group, where L L^T is its covariance, shape (g, b, b)."""
        covariance = covariance_of_groups(components.by_groups(self.part), 0, self.places, self.places)
        scale = 1 / np.sqrt(np.einsum("gii->gi", covariance))
        factors = np.linalg.cholesky(covariance * scale[:, :, None] * scale[:, None])
        for k, factor in enumerate(factors):  # NumPy has no inverse of triangles
            factors[k] = scipy.linalg.lapack.dtrtri(factor, lower=1)[0]
        return np.asarray(factors * scale[:, None])


def make_groups(part: WeakEquations, first: int, step: int, design: Array) -> Groups:
    """Split the design of a segment, shape (K m, D + 1), into groups."""
    groups = Groups(part, first, step, np.zeros(0))
    by_window = groups.of_windows(design.reshape(*part.residual.shape, -1))
    rows = part.lags * part.residual.shape[1]
    return replace(groups, design=by_window.reshape(len(by_window), rows, design.shape[1]).copy())


def more_likely(
    components: VarianceComponents, parts: Iterable[tuple[Groups, Array, Array]], covariance: Array
) -> VarianceComponents:
    """Update variance components by one step of restricted maximum likelihood.

    `parts` are groups with their whitener by these components, shape (g, b, b), and residual of a fit, shape (g, b);
    `covariance` is C of the fit, shape (D, D).

    With Sigma = ... + s_c^2 V_c and the design X, the likelihood has its maximum where

        e^T Sigma^-1 V_c Sigma^-1 e = tr(P V_c),    P = Sigma^-1 - Sigma^-1 X C X^T Sigma^-1

    for every component c, because the fit has absorbed a part of each error (Patterson and Thompson 1971); each
    variance is multiplied by the ratio of both sides (Anderson 1973, iterated). Both sides are sums over windows: over
    all they give s_c, over those near contact changes the contact variance scale. The three directions of a linear or
    an angular acceleration, a force or a moment have the same component.
    """
    sums = np.zeros((2, len(components.away_from_contacts), BINS))
    encoder_sums = np.zeros((2, len(components.encoder_scale)))
    for groups, inverse, residual in parts:
        part = groups.part
        encoder, _, other = components.sources(part)
        white, design = inverse @ residual[:, :, None], inverse @ groups.design[:, :, :-1]
        absorbed = design @ covariance @ design.transpose(0, 2, 1)
        used, of_each = groups.of_windows(part.used)[:, :, None], []
        for source in (other, encoder):
            effect = inverse @ _innovations(groups.of_windows(source.response), source.correlation)
            squares = (effect.transpose(0, 2, 1) @ white)[:, :, 0] ** 2
            expected = (effect * (effect - absorbed @ effect)).sum(axis=1)
            size = (2, len(white), part.lags, effect.shape[2] // part.lags)
            of_each.append(used * np.stack([squares, expected]).reshape(size))
        bins, which = groups.of_windows(bin_of(part)), components.which(part)
        for k in range(2):
            np.add.at(sums[k], (which, bins[:, :, None]), of_each[0][k])
        encoder_sums += of_each[1].sum(axis=(1, 2))
    joints = components.model.size
    for first in range(joints, sums.shape[1], 3):  # one of each three directions that have the same component
        sums[:, first : first + 3] = sums[:, first : first + 3].sum(axis=1, keepdims=True)
    values = components.away_from_contacts * _ratio(*sums.sum(axis=2))
    by_kind = [sums[:, components.kinds == kind].sum(axis=1) for kind in (0, 1)]
    contact_scale = components.contact_scale * np.stack([_ratio(*sides) for sides in by_kind])
    for scale, (_, expected) in zip(contact_scale, by_kind, strict=True):
        reference = AWAY if expected[AWAY] else np.argmax(expected)  # fast gaits are never far from contact changes
        scale /= max(scale[reference], 1e-12)
        scale[expected == 0] = 1.0  # where no window is
    root, wrench = np.split(values[joints:], [len(components.root)])
    return replace(
        components,
        model=values[:joints].reshape(components.model.shape),
        root=root,
        wrench=wrench,
        contact_scale=contact_scale,
        encoder_scale=np.maximum(components.encoder_scale * _ratio(*encoder_sums), 1.0),
    )


def _innovations(response: Array, correlation: Array) -> Array:
    """Compute the effect of independent innovations on groups, shape (g, lags, m, c) -> (g, b, lags c)."""
    groups, lags, rows, kinds = response.shape
    apart = np.abs(np.arange(lags)[:, None] - np.arange(lags))
    factor = np.linalg.cholesky(correlation[apart] + 1e-6 * correlation[0] * np.eye(lags))
    return np.asarray(np.einsum("glmc,lk->glmkc", response, factor)).reshape(groups, lags * rows, lags * kinds)


def _ratio(squares: Array, expected: Array) -> Array:
    """Compute the factor of standard deviations; one if no window has the component.

    The factor is bounded, so that variances grow slowly and outliers stay visible.
    """
    known = expected > 0
    ratio = np.where(known, squares / np.where(known, expected, 1.0), 1.0)
    return np.asarray(np.sqrt(np.clip(ratio, 1 / 30, 30)))

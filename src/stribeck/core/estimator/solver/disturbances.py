"""Segments and windows of the pilot that disagree with the rest of the log (docs/estimator-fit.md, "Outliers")."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.core.equations.constants import MOST_ROUNDS, ROUNDS
from stribeck.core.estimator.noise.outliers import CONTRADICTS, without_outliers
from stribeck.core.estimator.solver.linear_fit import LinearFit, fitted, product_of, residuals

INCONSISTENT = 20.0
"""Chi^2 per equation relative to consistent segments, from which a segment is rejected [1]; undisturbed ones reach
17."""

ENOUGH_FOR_QUARTERS = 24
"""Fewest segments of a pilot that is searched for a consistent quarter [1]: six, more than their own fit explains."""


@dataclass(frozen=True, eq=False)
class _Trimmed:
    """Least trimmed squares over the G segments of a fit, with their contact modes, shape (G,), and a prior."""

    fit: LinearFit
    modes: NDArray[np.int64]
    prior: tuple[Array, Array]

    def sizes(self, masks: NDArray[np.bool_]) -> Array:
        """Compute all segments' chi^2 per equation for fits to some of them, shape (s, G)."""
        sums = np.tensordot(masks.astype(float), self.fit.products, axes=1)
        values = np.stack([fitted(product, *self.prior) for product in sums], axis=1)
        return np.asarray(np.sum((self.fit.products @ values) * values, axis=1).T / np.maximum(self.fit.counts, 1))

    def share(self, size: Array, parts: int) -> NDArray[np.bool_]:
        """Select the fraction 1 / `parts` of each contact mode's segments that each fit explains best."""
        masks = np.zeros(size.shape, dtype=bool)
        for mode in np.unique(self.modes):
            places = np.flatnonzero(self.modes == mode)
            best = np.argsort(size[:, places], axis=1, kind="stable")[:, : -(-len(places) // parts)]
            np.put_along_axis(masks, places[best], True, axis=1)
        return masks

    def best_explained(
        self, first: Array, parts: int, random: np.random.Generator
    ) -> tuple[float, NDArray[np.bool_], Array]:
        """Find the part that one model explains best: its mean chi^2, its segments, and the chi^2 of all segments.

        Disturbances rarely reach all of the six contiguous parts. `first` is chi^2 for a fit to all segments, (1, G).
        """
        everything, few = np.arange(len(self.modes)), max(3, len(self.modes) // 6)
        starts = [*(random.permutation(everything)[:few] for _ in range(11)), *np.array_split(everything, 6)]
        masks = np.vstack([self.share(first, parts), [np.isin(everything, start) for start in starts]])
        size, active = np.empty(masks.shape), np.arange(len(masks))
        for _ in range(MOST_ROUNDS):
            size[active] = self.sizes(masks[active])
            before = masks[active]
            masks[active] = self.share(size[active], parts)
            active = active[np.any(masks[active] != before, axis=1)]
            if not len(active):
                break
        means = [float(row[part].mean()) for row, part in zip(size, masks, strict=True)]
        best = int(np.argmin(means))
        return means[best], masks[best], size[best]


def consistent(fit: LinearFit) -> LinearFit:
    """Remove segments that disagree with the model of the largest consistent part.

    Least trimmed squares (Rousseeuw and Van Driessen 1999): from several starts, fits are repeated on the half of each
    contact mode's segments that the previous fit explained best, until this half is constant. The best of these fits
    may explain far more than half. If a quarter is explained four times better, most of the log is disturbed, and the
    quarter is used instead. Segments are candidates if their chi^2 per equation exceeds `INCONSISTENT` times the median
    of this part, for example due to a payload, a moving base or a guiding hand. They are rejected only if the others
    are predicted far better without them, by `CONTRADICTS`: the segments of a poor model differ as much, but teach
    about each other. Undisturbed logs reach a ratio of 6, payloads start at 60.
    """
    groups, widest, everything = fit.groups, fit.model.widest, np.arange(len(fit.groups))
    modes = np.unique([group.part.standing for group in groups], axis=0, return_inverse=True)[1]
    trimmed = _Trimmed(fit, modes, fit.prior(widest))
    random = np.random.default_rng(0)
    first = trimmed.sizes(np.ones((1, len(groups)), dtype=bool))
    if first.max() < 3.0:  # relative to the errors of a good model
        return fit
    least, chosen, size = trimmed.best_explained(first, 2, random)
    if least > 1.5 and len(groups) >= ENOUGH_FOR_QUARTERS:
        quarter = trimmed.best_explained(first, 4, random)
        least, chosen, size = quarter if 4 * quarter[0] < least else (least, chosen, size)
    far = size > INCONSISTENT * np.median(size[chosen])
    if not far.any():
        return fit
    of_all, of_rest = (fit.held_out(places, widest) for places in (everything, everything[~far]))
    of_all = of_all[~far]
    if np.median(of_all) < CONTRADICTS or np.median(of_all / np.maximum(of_rest, 1e-300)) < CONTRADICTS:
        return fit
    groups = [
        replace(each, part=replace(each.part, set_aside=np.ones(len(each.part.time), dtype=bool))) if aside else each
        for each, aside in zip(groups, far, strict=True)
    ]
    return replace(fit, groups=groups)


def undisturbed(fit: LinearFit) -> LinearFit:
    """Remove windows that a robust fit does not explain, because most segments may contain pushes.

    The weight of a group with a chi^2 above the median is reduced by their ratio (Holland and Welsch 1977).
    """
    used = np.concatenate([group.of_windows(group.part.used).any(axis=1) for group in fit.groups])
    if not used.any():
        return fit
    values, whitened = fit.values, list[Array]()
    for _ in range(2 * ROUNDS - 1):
        white = zip(fit.whiteners, residuals(fit.groups, values), strict=True)
        sizes = [np.mean((whitener @ residual[:, :, None]) ** 2, axis=(1, 2)) for whitener, residual in white]
        usual = np.median(np.concatenate(sizes)[used])
        if not whitened and max(size.max(initial=0.0) for size in sizes) < INCONSISTENT * usual:
            return fit
        whitened = whitened or list(fit.whitened())
        product = sum(
            product_of(columns / np.sqrt(np.maximum(size / usual, 1.0))[:, None, None])
            for columns, size in zip(whitened, sizes, strict=True)
        )
        values = fitted(np.asarray(product), *fit.prior(fit.model))
    return replace(fit, groups=without_outliers(fit.groups, residuals(fit.groups, values), fit.components))

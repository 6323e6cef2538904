"""Variance components by maximum likelihood from the residuals of a fit (docs/estimator.md, equation 19)."""

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.whole_log.constants import LARGEST_VARIANCE_RATIO, THREADS
from stribeck.whole_log.noise.autocorrelation import autocorrelation, innovation_weights
from stribeck.whole_log.noise.variance_components import AWAY, BINS, VarianceComponents, bin_of
from stribeck.whole_log.noise.whitening import make_whitener
from stribeck.whole_log.weak_equations import WeakEquations


def update_components(
    components: VarianceComponents, residuals: Iterable[tuple[WeakEquations, Array]]
) -> VarianceComponents:
    """Return variance components that are more likely, given equations and residuals of a fit, shape (K m,).

    With Sigma = ... + s_c^2 V_c, the likelihood has its maximum where

        e^T Sigma^-1 V_c Sigma^-1 e = tr(Sigma^-1 V_c)

    for every component c; each variance is multiplied by the ratio of both sides (Anderson 1973, iterated). Both sides
    are sums over windows: over all they give s_c, over those near contact changes the contact variance scale. The three
    directions of a linear or an angular acceleration, a force or a moment have the same component.
    """
    with ThreadPoolExecutor(THREADS) as pool:
        sums = list(pool.map(lambda part: _sums(components, *part), residuals))
    left, right, encoder_errors = (np.sum(parts, axis=0) for parts in zip(*sums, strict=True))
    joints = components.model.size
    away_from_contacts = _ratio(_shared(left.sum(axis=1), joints), _shared(right.sum(axis=1), joints))
    kinds = [components.kinds == kind for kind in (0, 1)]
    contact_scale = np.stack([_ratio(left[kind].sum(axis=0), right[kind].sum(axis=0)) for kind in kinds])
    contact_scale = components.contact_scale * contact_scale
    contact_scale /= np.maximum(contact_scale[:, [AWAY]], 1e-12)
    values = components.away_from_contacts * away_from_contacts
    model = values[:joints].reshape(components.model.shape)
    encoder_scale = np.maximum(components.encoder_scale * _ratio(*encoder_errors), 1.0)
    root, wrench = np.split(values[joints:], [len(components.root)])
    return replace(
        components, model=model, root=root, wrench=wrench, contact_scale=contact_scale, encoder_scale=encoder_scale
    )


def _sums(components: VarianceComponents, equations: WeakEquations, residual: Array) -> tuple[Array, Array, Array]:
    """Return both sides of each component and bin, (2 n + root, BINS) each, and of each encoder, (2, encoders)."""
    lags, windows = equations.lags, len(equations.time)
    response = components.response(equations) * components.at(equations)[:, None]
    innovations = (
        _innovations(response, autocorrelation(lags)),
        _innovations(components.encoder_errors(equations), equations.acceleration_overlap),
    )
    white = make_whitener(equations, components).apply(*innovations, residual[:, None])
    both = (white[:, -1] @ white[:, :-1]) ** 2, (white[:, :-1] ** 2).sum(axis=0)
    bins = bin_of(equations)[np.clip(_innovation_places(windows, lags), 0, windows - 1)]
    which = components.which(equations)
    sums = np.zeros((2, len(components.away_from_contacts), BINS))
    encoder_errors = []
    for total, side in zip(sums, both, strict=True):
        errors, encoders = np.split(side, [innovations[0].shape[1]])
        np.add.at(total, (which[None, :], bins[:, None]), errors.reshape(len(bins), len(which)))
        encoder_errors.append(encoders.reshape(len(bins), -1).sum(axis=0))
    return sums[0], sums[1], np.stack(encoder_errors)


def _ratio(left: Array, right: Array) -> Array:
    """Return the factor of standard deviations; one where no window has the component."""
    known = right > 0
    ratio = np.where(known, left / np.where(known, right, 1.0), 1.0)
    return np.asarray(np.sqrt(np.clip(ratio, 1 / LARGEST_VARIANCE_RATIO, LARGEST_VARIANCE_RATIO)))


def _shared(sums: Array, joints: int) -> Array:
    """Return sums over components: one of each three directions that have the same component."""
    shared = sums.copy()
    for first in range(joints, len(sums), 3):
        shared[first : first + 3] = sums[first : first + 3].sum()
    return shared


def _innovations(response: Array, overlap: Array) -> Array:
    """Return the columns Z_c of a response: the effect of innovations, shape (K m, innovations components)."""
    windows, rows, components = response.shape
    effect = innovation_weights(overlap)
    places = _innovation_places(windows, len(effect) - 1)
    innovations = np.zeros((windows, rows, len(places), components))
    for place, innovation in enumerate(places):
        reached = np.arange(max(0, innovation), min(windows, innovation + len(effect)))
        innovations[reached, :, place] = response[reached] * effect[reached - innovation, None, None]
    return innovations.reshape(windows * rows, -1)


def _innovation_places(windows: int, lags: int) -> NDArray[np.int64]:
    """Return the windows of the innovations that are used, a share of all; the first lie before the segment."""
    return np.arange(-lags, windows, lags)

"""How large the errors are that no sensor makes, measured from what a fit leaves over."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from stribeck.equations import WeakEquations
from stribeck.identification.whole_log.levels import ErrorLevels
from stribeck.identification.whole_log.whitening import make_whitener
from stribeck.log import Array

LARGEST_CHANGE = 30.0
"""Of a variance in one update [1]."""


def update_levels(levels: ErrorLevels, left_over: Iterable[tuple[WeakEquations, Array]]) -> ErrorLevels:
    """Return levels that are more likely, given equations and the residuals (K m,) that a fit leaves.

    With Sigma = ... + s_c^2 V_c, the likelihood has its maximum where r^T Sigma^-1 V_c Sigma^-1 r = tr(Sigma^-1 V_c)
    for every component c; each variance is multiplied by the ratio of both sides (Anderson 1973, iterated).
    The root's three directions share one level, of lines and of turns.
    """
    left, right = np.zeros((2, len(levels.values)))
    for equations, residual in left_over:
        whitener = make_whitener(equations, levels)
        drives = whitener.apply(_drives(equations, levels))
        white = whitener.apply(residual[:, None])[:, 0]
        components = len(levels.values)
        left += ((white @ drives).reshape(-1, components) ** 2).sum(axis=0)
        right += (drives**2).sum(axis=0).reshape(-1, components).sum(axis=0)
    joints = len(levels.model)
    for group in (slice(joints, joints + 3), slice(joints + 3, joints + 6)):
        left[group], right[group] = left[group].sum(), right[group].sum()
    ratio = np.clip(left / np.maximum(right, 1e-300), 1 / LARGEST_CHANGE, LARGEST_CHANGE)
    values = levels.values * np.sqrt(ratio)
    return ErrorLevels(values[:joints], values[joints:])


def _drives(equations: WeakEquations, levels: ErrorLevels) -> Array:
    """Return what white drives of each error do to the equations, shape (K m, (K + lags) components)."""
    response = levels.response(equations)
    windows, rows, components = response.shape
    lags = len(equations.torque_overlap) - 1
    drives = np.zeros((windows, rows, windows + lags, components))
    for lag in range(lags + 1):  # a running mean over lags + 1 drives
        k = np.arange(windows)
        drives[k, :, k + lag, :] = response / np.sqrt(lags + 1)
    return drives.reshape(windows * rows, -1)

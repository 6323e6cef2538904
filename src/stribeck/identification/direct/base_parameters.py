"""Base parameters: which inertial parameters a motion shows, by themselves or added up (docs/direct.md, 3)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from stribeck.typing import Array

TOLERANCE = 1e-8
"""Diagonal entry of the triangular factor below which a column is a sum of those before it [1], of columns of norm 1.

Columns that depend on one another by the robot's structure do so to rounding, 1e-12 and less, whatever the noise of the
motion; those that a motion hardly excites stay above 1e-5.
"""


@dataclass(frozen=True, eq=False)
class BaseParameters:
    """Places of the independent columns, shape (b,), and the condition number of these at norm 1 [1]."""

    columns: NDArray[np.int64]
    condition: float


def base_parameters(regressor: Array) -> BaseParameters:
    """Return the base parameters of a regressor, shape (N, p), by QR with column pivoting (Gautier 1991)."""
    norms = np.linalg.norm(regressor, axis=0)
    seen = np.flatnonzero(norms > TOLERANCE * norms.max(initial=0.0))
    if not len(seen):
        return BaseParameters(seen, 1.0)
    unit = regressor[:, seen] / norms[seen]
    factor, order = qr(unit, mode="r", pivoting=True, check_finite=False)
    size = np.abs(np.diag(factor[: len(seen)]))
    kept = order[: len(size)][size > TOLERANCE * size[0]]
    values = np.linalg.svd(unit[:, kept], compute_uv=False)
    return BaseParameters(np.sort(seen[kept]), float(values[0] / values[-1]))

"""Inertial parameters of a body, and its pseudo-inertia, which is positive definite for every physical body.

The ten parameters are Pinocchio's: mass m [kg], first moments m c [kg m], and Ixx, Ixy, Iyy, Ixz, Iyz, Izz [kg m^2]
about the origin. With Sigma = tr(I)/2 - I the pseudo-inertia is (Wensing, Kim, Slotine 2018)

    P = [ Sigma    m c ]
        [ (m c)^T  m   ]
"""

import numpy as np

from stribeck.core.base.typing import Array

SIZE = 10
"""Number of inertial parameters of a body."""

_ENTRIES = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))
"""Row and column of each of the six moments in I."""

_ABOVE = ((0, 1), (1, 2), (0, 2))
"""Entries above the diagonal of K, in the order of the shape coordinates."""


def pseudo_inertia(parameters: Array) -> Array:
    """Build the pseudo-inertia, shape (..., 4, 4), which is linear in the parameters, shape (..., 10)."""
    matrix = np.zeros((*parameters.shape[:-1], 4, 4))
    half_trace = 0.5 * (parameters[..., 4] + parameters[..., 6] + parameters[..., 9])
    for k, (i, j) in enumerate(_ENTRIES):
        matrix[..., i, j] = matrix[..., j, i] = -parameters[..., 4 + k]
    for i in range(3):
        matrix[..., i, i] += half_trace
    matrix[..., :3, 3] = matrix[..., 3, :3] = parameters[..., 1:4]
    matrix[..., 3, 3] = parameters[..., 0]
    return matrix


def inertial_parameters(matrix: Array) -> Array:
    """Extract the parameters, shape (..., 10), from a pseudo-inertia, shape (..., 4, 4)."""
    parameters = np.empty((*matrix.shape[:-2], SIZE))
    trace = matrix[..., 0, 0] + matrix[..., 1, 1] + matrix[..., 2, 2]
    parameters[..., 0] = matrix[..., 3, 3]
    parameters[..., 1:4] = matrix[..., :3, 3]
    for k, (i, j) in enumerate(_ENTRIES):
        parameters[..., 4 + k] = (trace if i == j else 0.0) - matrix[..., i, j]
    return parameters


def shape_coordinates(matrix: Array) -> Array:
    """Compute coordinates of a body's shape, shape (..., 6), from its pseudo-inertia, shape (..., 4, 4).

    With the second moments about the center of mass Sigma_c = m K K^T, K upper triangular, the coordinates are the
    logarithms of K's diagonal (K in meters) and K_01, K_12, K_02 [m]: log-Cholesky coordinates (Rucker and Wensing
    2022). All their values are physical bodies. They are NaN if Sigma_c is not positive definite.
    """
    mass = matrix[..., 3, 3]
    centre = matrix[..., :3, 3] / mass[..., None]
    moments = matrix[..., :3, :3] / mass[..., None, None] - centre[..., :, None] * centre[..., None, :]
    with np.errstate(invalid="ignore"):
        possible = np.linalg.eigvalsh(moments)[..., 0] > 0
    safe = np.where(possible[..., None, None], moments, np.eye(3))
    factor = np.linalg.cholesky(safe[..., ::-1, ::-1])[..., ::-1, ::-1]
    entries = [np.log(factor[..., i, i]) for i in range(3)] + [factor[..., i, j] for i, j in _ABOVE]
    return np.asarray(np.where(possible[..., None], np.stack(entries, axis=-1), np.nan))


def log_cholesky(matrix: Array) -> Array:
    """Compute log mass, center of mass [m] and shape, shape (..., 10), from pseudo-inertias, shape (..., 4, 4)."""
    mass = matrix[..., 3, 3:]
    return np.concatenate([np.log(mass), matrix[..., :3, 3] / mass, shape_coordinates(matrix)], axis=-1)


def inertia_of_shape(mass: float, coordinates: Array) -> Array:
    """Compute Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the center of mass, shape (6,), from mass [kg] and shape, (6,)."""
    factor = np.diag(np.exp(coordinates[:3]))
    for (i, j), value in zip(_ABOVE, coordinates[3:].tolist(), strict=True):
        factor[i, j] = value
    matrix = np.zeros((4, 4))
    matrix[:3, :3] = mass * factor @ factor.T
    return inertial_parameters(matrix)[4:]


def carried(homogeneous: Array) -> Array:
    """Compute the matrix, shape (10, 10), that transforms parameters from one frame to another.

    `homogeneous` is the pose of the first frame in the second, shape (4, 4): P becomes H P H^T.
    """
    basis = pseudo_inertia(np.eye(SIZE))
    return inertial_parameters(homogeneous @ basis @ homogeneous.T).T

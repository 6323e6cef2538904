"""A body's ten inertial parameters, and the 4 x 4 matrix that is positive definite for every body that can exist.

The parameters are Pinocchio's: mass m [kg], first moments m c [kg m], and Ixx, Ixy, Iyy, Ixz, Iyz, Izz [kg m^2] about
the origin. With Sigma = tr(I)/2 - I the pseudo-inertia is (Wensing, Kim, Slotine 2018)

    P = [ Sigma    m c ]
        [ (m c)^T  m   ]
"""

import numpy as np

from stribeck.base.typing import Array

SIZE = 10
"""Inertial parameters of a body."""

_ENTRIES = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))
"""Rows and columns of I in the order of the parameters."""

_ABOVE = ((0, 1), (1, 2), (0, 2))
"""Entries above the diagonal of K, in the order of the coordinates of a shape."""


def pseudo_inertia(parameters: Array) -> Array:
    """Return the pseudo-inertia, shape (..., 4, 4), of parameters, shape (..., 10); it is linear in them."""
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
    """Return the parameters, shape (..., 10), of a pseudo-inertia, shape (..., 4, 4)."""
    parameters = np.empty((*matrix.shape[:-2], SIZE))
    trace = matrix[..., 0, 0] + matrix[..., 1, 1] + matrix[..., 2, 2]
    parameters[..., 0] = matrix[..., 3, 3]
    parameters[..., 1:4] = matrix[..., :3, 3]
    for k, (i, j) in enumerate(_ENTRIES):
        parameters[..., 4 + k] = (trace if i == j else 0.0) - matrix[..., i, j]
    return parameters


def shape_coordinates(matrix: Array) -> Array:
    """Return the coordinates of a body's shape, shape (..., 6), of a pseudo-inertia, shape (..., 4, 4).

    With second moments about the centre of mass Sigma_c = m K K^T, K upper triangular, they are the logarithms of its
    diagonal, in meters, and K_01, K_12, K_02 [m]: log-Cholesky coordinates (Rucker and Wensing 2022), in which every
    value is a body that can exist. It has none if Sigma_c is not positive definite: NaN.
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
    """Return log mass, centre of mass [m] and shape of bodies, shape (..., 10), from pseudo-inertias, (..., 4, 4)."""
    mass = matrix[..., 3, 3:]
    return np.concatenate([np.log(mass), matrix[..., :3, 3] / mass, shape_coordinates(matrix)], axis=-1)


def inertia_of_shape(mass: float, coordinates: Array) -> Array:
    """Return Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the centre, shape (6,), of a body [kg] of such a shape, shape (6,)."""
    factor = np.diag(np.exp(coordinates[:3]))
    for (i, j), value in zip(_ABOVE, coordinates[3:].tolist(), strict=True):
        factor[i, j] = value
    matrix = np.zeros((4, 4))
    matrix[:3, :3] = mass * factor @ factor.T
    return inertial_parameters(matrix)[4:]


def carried(homogeneous: Array) -> Array:
    """Return the matrix, shape (10, 10), that turns parameters in one frame into those in another.

    `homogeneous` is the pose of the first frame in the second, shape (4, 4): P becomes H P H^T.
    """
    basis = pseudo_inertia(np.eye(SIZE))
    return inertial_parameters(homogeneous @ basis @ homogeneous.T).T

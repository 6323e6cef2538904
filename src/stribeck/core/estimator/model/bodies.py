"""Inertial parameters of bodies in coordinates whose values are always physically possible.

Equation (13) of docs/estimator.md: a body has the mass m = m_0 exp(alpha), the center c = c_0 + d, and the second
moments Sigma_c = E exp(S) E^T about it, with S symmetric and E E^T = Sigma_c0, the columns of E along the principal
axes. Mass and second moments stay positive for all alpha, d and S: this is physical consistency (12) (Wensing, Kim,
Slotine 2018).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.robot.inertial_parameters import SIZE, inertial_parameters, log_cholesky, pseudo_inertia
from stribeck.core.settings import Priors

LEAST_MASS, LEAST_RADIUS = 1e-6, 1e-3
"""Mass below which a body is not corrected [kg], and smallest radius of gyration of a body [m]."""

_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Entries of S in the order of the coordinates. A moment is a sum of two, so each entry has sqrt(2) of its prior."""


@dataclass(frozen=True, eq=False)
class Bodies:
    """L bodies of a model: masses (L,), centers (L, 3), and E, shape (L, 3, 3), with their priors."""

    mass: Array
    centre: Array
    factor: Array
    priors: Priors

    @property
    def parameters(self) -> Array:
        """Inertial parameters, shape (L, 10)."""
        return inertial_parameters(self._matrix)

    @cached_property
    def _matrix(self) -> Array:
        """Pseudo-inertias of the model, shape (L, 4, 4)."""
        return _matrix(self.mass, self.centre, self.factor @ self.factor.transpose(0, 2, 1))

    def _mass_and_centre(self, coordinates: Array) -> tuple[Array, Array]:
        mass = self.mass * np.exp(self.priors.mass * coordinates[:, 0])
        return mass, self.centre + self.priors.centre_of_mass * coordinates[:, 1:4]

    def corrections(self, coordinates: Array) -> Array:
        """Compute the corrections of the parameters, shape (L, 10).

        Coordinates have shape (L, 10): alpha, d, then S, each in units of its prior standard deviation.
        """
        exponential = _exponential(_symmetric(coordinates[:, 4:], self.priors.moments))
        moments = self.factor @ exponential @ self.factor.transpose(0, 2, 1)
        return inertial_parameters(_matrix(*self._mass_and_centre(coordinates), moments) - self._matrix)

    def slopes(self, coordinates: Array) -> Array:
        """Compute the derivatives of the corrections by coordinates of shape (L, 10), shape (L, 10, 10)."""
        mass, centre = self._mass_and_centre(coordinates)
        slopes = _exponential_slopes(_symmetric(coordinates[:, 4:], self.priors.moments), self.priors.moments)
        change = np.zeros((len(mass), SIZE, 4, 4))
        change[:, 0] = self.priors.mass * _matrix(mass, centre, np.zeros((len(mass), 3, 3)))
        for axis in range(3):
            shift = np.zeros((len(mass), 4, 4))
            arm = self.priors.centre_of_mass * mass[:, None] * np.eye(3)[axis]
            shift[:, :3, :3] = arm[:, :, None] * centre[:, None, :]
            shift[:, :3, :3] += shift[:, :3, :3].transpose(0, 2, 1).copy()
            shift[:, :3, 3] = shift[:, 3, :3] = arm
            change[:, 1 + axis] = shift
        change[:, 4:, :3, :3] = self.factor[:, None] @ slopes @ self.factor[:, None].transpose(0, 1, 3, 2)
        return inertial_parameters(change).transpose(0, 2, 1)

    def log_cholesky(self, coordinates: Array) -> Array:
        """Convert coordinates to log mass, center of mass and log-Cholesky coordinates, shape (L, 10) each."""
        return log_cholesky(self._matrix + pseudo_inertia(self.corrections(coordinates)))


def bodies_of(parameters: Array, priors: Priors) -> Bodies:
    """Build bodies from inertial parameters, shape (L, 10); impossible moments become just possible."""
    matrix = pseudo_inertia(parameters)
    mass = np.maximum(matrix[:, 3, 3], LEAST_MASS)
    centre = matrix[:, :3, 3] / mass[:, None]
    moments = matrix[:, :3, :3] - mass[:, None, None] * centre[:, :, None] * centre[:, None, :]
    values, axes = np.linalg.eigh(moments)
    values = np.maximum(values, mass[:, None] * LEAST_RADIUS**2)
    return Bodies(mass, centre, axes * np.sqrt(values)[:, None, :], priors)


def _matrix(mass: Array, centre: Array, moments: Array) -> Array:
    """Assemble pseudo-inertias, shape (L, 4, 4), from masses, centers, and second moments about them."""
    matrix = np.empty((len(mass), 4, 4))
    matrix[:, :3, :3] = moments + mass[:, None, None] * centre[:, :, None] * centre[:, None, :]
    matrix[:, :3, 3] = matrix[:, 3, :3] = mass[:, None] * centre
    matrix[:, 3, 3] = mass
    return matrix


def _symmetric(entries: Array, unit: float) -> Array:
    """Assemble S, shape (L, 3, 3), from coordinates in a unit, shape (L, 6)."""
    matrix = np.zeros((len(entries), 3, 3))
    for k, (i, j) in enumerate(_PAIRS):
        matrix[:, i, j] = matrix[:, j, i] = unit * (np.sqrt(2) if i == j else 1.0) * entries[:, k]
    return matrix


def _exponential(matrix: Array) -> Array:
    """Compute exp(S), shape (L, 3, 3)."""
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray((vectors * np.exp(values)[:, None, :]) @ vectors.transpose(0, 2, 1))


def _exponential_slopes(matrix: Array, unit: float) -> Array:
    """Compute derivatives of exp(S) by coordinates in a unit, shape (L, 6, 3, 3) (Daleckii, Krein; Higham 2008)."""
    values, vectors = np.linalg.eigh(matrix)
    powers = np.exp(values)
    gap = values[:, :, None] - values[:, None, :]
    near = np.abs(gap) < 1e-7
    quotient = np.where(
        near,
        np.exp(0.5 * (values[:, :, None] + values[:, None, :])),
        (powers[:, :, None] - powers[:, None, :]) / np.where(near, 1.0, gap),
    )
    transposed = vectors.transpose(0, 2, 1)
    directions = _symmetric(np.eye(6), unit)
    inner = transposed[:, None] @ directions @ vectors[:, None]
    return np.asarray(vectors[:, None] @ (quotient[:, None] * inner) @ transposed[:, None])

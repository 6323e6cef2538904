"""Finite differences (6.2), (6.3) of the paper, as kernels over five samples around the present one."""

import numpy as np

from stribeck.typing import Array

HALF_WIDTH = 2
"""Samples that the second difference needs before the present one (backward), or on each side (central)."""


def central_kernels(period: float) -> Array:
    """Return the kernels of position, velocity and acceleration, shape (3, 5), by (6.2) once and twice.

    Exact up to second-degree polynomials for the velocity and third-degree ones for the acceleration; no delay.
    """
    velocity = np.array([0.0, -1.0, 0.0, 1.0, 0.0]) / (2 * period)
    acceleration = np.array([1.0, 0.0, -2.0, 0.0, 1.0]) / (2 * period) ** 2
    return np.array([_present(), velocity, acceleration])


def backward_kernels(period: float, compensate_delay: bool) -> Array:
    """Return the kernels of position, velocity and acceleration, shape (3, 5), by (6.3) once and twice.

    A backward difference is the velocity of half a period ago, and the backward difference of that is the acceleration
    of a whole period ago. Uncompensated, both are taken for those of now, as a real-time system must. Compensated,
    all signals are those of one sample (6.1.2): the acceleration is shifted by a period, and the velocity is the mean
    of the two differences that lie half a period before and after.
    """
    if compensate_delay:
        velocity = np.array([0.0, -0.5, 0.0, 0.5, 0.0]) / period
        acceleration = np.array([0.0, 1.0, -2.0, 1.0, 0.0]) / period**2
    else:
        velocity = np.array([0.0, -1.0, 1.0, 0.0, 0.0]) / period
        acceleration = np.array([1.0, -2.0, 1.0, 0.0, 0.0]) / period**2
    return np.array([_present(), velocity, acceleration])


def _present() -> Array:
    return np.array([0.0, 0.0, 1.0, 0.0, 0.0])

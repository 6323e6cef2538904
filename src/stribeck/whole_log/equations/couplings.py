"""Couplings: friction on sums of joint speeds, which the weak form counts as that of further joints."""

from dataclasses import replace

import numpy as np

from stribeck.base.typing import Array
from stribeck.whole_log.weak_equations import WeakEquations


def acting(couplings: Array) -> Array:
    """Return how friction acts on n joints, [I B] of shape (n, n + c), from the coefficients B, shape (n, c)."""
    return np.hstack([np.eye(len(couplings)), couplings])


def with_couplings(plain: WeakEquations, couplings: Array) -> WeakEquations:
    """Return equations of n joints with the friction R(B^T v) of couplings too, which acts on them as B R.

    `couplings` are their coefficients B, shape (n, c).
    """
    if not couplings.size:
        return plain
    none = np.zeros((len(plain.torque), couplings.shape[1]))
    return replace(
        plain,
        velocity=plain.velocity @ acting(couplings),
        before=None if plain.before is None else plain.before @ acting(couplings),
        projection=plain.weights @ acting(couplings),
        standing=np.append(plain.standing, plain.standing @ (couplings != 0)),
        torque_noise=np.append(plain.torque_noise, none[0]),
        torque=np.hstack([plain.torque, none]),
        position=np.hstack([plain.position, np.full((len(plain.position), couplings.shape[1]), np.nan)]),
        position_noise=None if plain.position_noise is None else np.append(plain.position_noise, none[0]),
        temperature=None if plain.temperature is None else np.hstack([plain.temperature, np.nan * none]),
        couplings=couplings,
    )

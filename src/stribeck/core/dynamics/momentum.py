"""Generalized momentum of a rooted tree, and its change by gravity and velocity terms.

    p = M(q) v,    p' = tau - R + b,    b = C(q, v)^T v - g(q)

as M' = C + C^T. Only position and velocity are needed, no acceleration.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array
from stribeck.core.dynamics.rooted import RootMotion, rooted_inverse_dynamics
from stribeck.core.robot.rooting import RootedModel

STEP = 1e-5
"""Step [s] of the central difference of the inertia matrix; it leaves nine correct digits of M' v."""


@cache
def without_gravity(rooted: RootedModel) -> RootedModel:
    """Copy a tree without gravity; its inverse dynamics at rest with acceleration v is M v."""
    model = pin.Model(rooted.model)
    model.gravity.linear = np.zeros(3)
    return replace(rooted, model=model)


def momentum_balance(
    rooted: RootedModel, position: Array, velocity: Array, root: RootMotion | None = None
) -> tuple[Array, Array]:
    """Compute the joints' generalized momentum and b.

    `M' v`, which b contains in addition to `-C v - g`, is the central difference of M v over q ± `STEP` v, so all steps
    are compiled recursions. The velocity v includes a moving root; no torque acts on joints of limbs that hang freely
    on it.

    Parameters
    ----------
    rooted
        Rooted tree.
    position, velocity
        Motion of the joints in robot order, shape (T, n).
    root
        Gravity and velocity of a floating root (its acceleration is not used); None for a fixed root.

    Returns
    -------
    momentum
        M v [kg m^2/s], for prismatic joints [kg m/s], shape (T, n).
    change
        b [N m], [N], shape (T, n).
    """
    rest = np.zeros_like(velocity)
    weightless = moving = root
    if root is not None:
        weightless = RootMotion(np.zeros_like(root.gravity), acceleration=root.velocity)
        moving = RootMotion(root.gravity, root.velocity)

    def momentum(at: Array) -> Array:
        return rooted_inverse_dynamics(without_gravity(rooted), at, rest, velocity, weightless)[1]

    drift = (momentum(position + STEP * velocity) - momentum(position - STEP * velocity)) / (2 * STEP)
    return momentum(position), drift - rooted_inverse_dynamics(rooted, position, velocity, rest, moving)[1]

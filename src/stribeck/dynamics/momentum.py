"""The generalised momentum of a rooted tree, and what changes it beside joint torque and friction.

    p = M(q) v,    p' = tau - R + b,    b = C(q, v)^T v - g(q)

as M' = C + C^T. Only position and velocity are in it: no acceleration.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pinocchio as pin

from stribeck.base.typing import Array
from stribeck.dynamics.rooted import RootMotion, rooted_inverse_dynamics
from stribeck.robot.rooting import RootedModel

STEP = 1e-5
"""[s] to both sides, over which the inertia matrix is differenced: nine digits of M' v are right."""


@cache
def _weightless(rooted: RootedModel) -> RootedModel:
    """Return a tree without gravity of its own, whose inverse dynamics of rest and acceleration v is M v."""
    model = pin.Model(rooted.model)
    model.gravity.linear = np.zeros(3)
    return replace(rooted, model=model)


def momentum_balance(
    rooted: RootedModel, position: Array, velocity: Array, root: RootMotion | None = None
) -> tuple[Array, Array]:
    """Return the joints' generalised momentum, and b.

    `M' v`, of which b is what exceeds `C v + g`, is the difference of M v over q +- `STEP` v, so that all is compiled
    recursions. A root that moves has its velocity in v; nothing acts on the joints of limbs that hang on it freely.

    Parameters
    ----------
    rooted
        The tree.
    position, velocity
        Of the robot's joints, in the robot's order, shape (T, n).
    root
        Gravity and velocity of a floating root, its acceleration is not used; None for a fixed one.

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
        return rooted_inverse_dynamics(_weightless(rooted), at, rest, velocity, weightless)[1]

    drift = (momentum(position + STEP * velocity) - momentum(position - STEP * velocity)) / (2 * STEP)
    return momentum(position), drift - rooted_inverse_dynamics(rooted, position, velocity, rest, moving)[1]

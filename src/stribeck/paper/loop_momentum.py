"""Inertia and momentum balance of closed loops in the independent joints (`core.dynamics.loops` defines G)."""

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.dynamics.loops import loop_terms, passive_response, without_loop_forces
from stribeck.core.dynamics.momentum import STEP, momentum_balance
from stribeck.core.dynamics.rooted import RootMotion, joint_inertia
from stribeck.core.robot import Robot
from stribeck.core.robot.rooting import RootedModel


def loop_inertia(robot: Robot, rooted: RootedModel, position: Array) -> Array:
    """Compute G^T M G, shape (T, n, n), with zero rows and columns for passive joints; M without loops."""
    inertia = joint_inertia(rooted, position)
    if not robot.loops:
        return inertia
    half = without_loop_forces(robot, position, inertia).transpose(0, 2, 1)
    return without_loop_forces(robot, position, np.ascontiguousarray(half))


def loop_momentum_balance(
    robot: Robot, rooted: RootedModel, position: Array, velocity: Array, root: RootMotion | None = None
) -> tuple[Array, Array]:
    """Compute momentum and b of `momentum_balance` for a tree with closed loops: G^T p, and G^T b + G'^T p.

    Columns of passive joints are zero.
    """
    momentum, change = momentum_balance(rooted, position, velocity, root)
    if not robot.loops:
        return momentum, change
    after, before = (
        passive_response(robot, loop_terms(robot, position + step * velocity).jacobian) for step in (STEP, -STEP)
    )
    turning = np.einsum("tpi,tp->ti", (after - before) / (2 * STEP), momentum[:, robot.passive_columns])
    momentum, change = (without_loop_forces(robot, position, vector) for vector in (momentum, change))
    change[:, robot.independent] += turning
    return momentum, change

"""Inertia and momentum of a tree with loops, in its independent joints (`robot.loops`): G^T M G and G^T M v."""

import numpy as np

from stribeck.dynamics.momentum import STEP, momentum_balance
from stribeck.dynamics.rooted import RootMotion, joint_inertia
from stribeck.robot import Robot
from stribeck.robot.loops import loop_terms, passive_response, without_loop_forces
from stribeck.robot.rooting import RootedModel
from stribeck.typing import Array


def loop_inertia(robot: Robot, rooted: RootedModel, position: Array) -> Array:
    """Return G^T M G, shape (T, n, n); zero in rows and columns of passive joints. Without loops it is M."""
    inertia = joint_inertia(rooted, position)
    if not robot.loops:
        return inertia
    half = without_loop_forces(robot, position, inertia).transpose(0, 2, 1)
    return without_loop_forces(robot, position, np.ascontiguousarray(half))


def loop_momentum_balance(
    robot: Robot, rooted: RootedModel, position: Array, velocity: Array, root: RootMotion | None = None
) -> tuple[Array, Array]:
    """Return momentum and b of `momentum_balance`, of a tree whose loops are closed: G^T p, and G^T b + G'^T p.

    In the columns of independent joints, zero in others.
    """
    momentum, change = momentum_balance(rooted, position, velocity, root)
    if not robot.loops:
        return momentum, change
    after, before = (
        passive_response(robot, loop_terms(robot, position + step * velocity).jacobian) for step in (STEP, -STEP)
    )
    turning = np.einsum("tpi,tp->ti", (after - before) / (2 * STEP), momentum[:, robot.passive_columns])
    momentum, change = (without_loop_forces(robot, position, each) for each in (momentum, change))
    change[:, robot.independent] += turning
    return momentum, change

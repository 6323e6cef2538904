"""Which columns of inertial parameters are independent: the others are sums of these, whatever the robot does.

A joint's torque knows only some sums of the bodies' parameters, the base parameters (Gautier and Khalil 1990). They
follow from the columns of random motions: a QR decomposition with pivoting finds as many as are independent.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr, solve_triangular

from stribeck.dynamics.state import Orientation, State
from stribeck.equations.corrections import inertia_columns
from stribeck.equations.support import Support
from stribeck.robot import Robot
from stribeck.typing import Array

EQUATIONS = 3
"""Of random motions on each support [1] for every column: more than can be independent."""

INDEPENDENT = 1e-9
"""Share of the largest pivot [1] below which a column is a sum of others; rounding leaves about 1e-14."""


def base_parameters(robot: Robot, supports: Iterable[Support]) -> tuple[NDArray[np.int64], Array]:
    """Return columns of independent inertial parameters, shape (b,), and all as sums of them, shape (b, 10 bodies).

    With Y the columns of any motion on any of the supports, `Y = Y[:, independent] @ sums`.
    """
    columns = np.vstack([_columns(robot, support) for support in supports])
    norms = np.linalg.norm(columns, axis=0)
    seen = np.flatnonzero(norms > INDEPENDENT * norms.max(initial=1e-300))
    upper, order = qr(columns[:, seen] / norms[seen], mode="r", pivoting=True)
    pivots = np.abs(np.diag(upper))
    rank = int((pivots > INDEPENDENT * pivots.max(initial=0.0)).sum())
    sums = np.zeros((rank, columns.shape[1]))
    sums[:, seen[order]] = solve_triangular(upper[:rank, :rank], upper[:rank])
    independent = seen[order[:rank]]
    return independent, sums * norms / norms[independent, None]


def _columns(robot: Robot, support: Support) -> Array:
    """Return the columns of random motions, shape (rows, 10 bodies)."""
    generator = np.random.default_rng(1)
    joints, rows = len(robot.joint_names), max(len(support.rows), 1)
    count = -(-EQUATIONS * 10 * robot.tree.model.njoints // rows)
    position, velocity, acceleration = generator.uniform(-np.pi, np.pi, (3, count, joints))
    turn = None
    if robot.base == "floating":
        quaternion = generator.standard_normal((count, 4))
        rates = generator.standard_normal((2, count, 3))
        turn = Orientation(quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True), rates[0], rates[1])
    state = State(position, velocity, acceleration, turn)
    found = inertia_columns(robot, support.rooted, support.rows, state, support.root(state))
    return found.reshape(-1, found.shape[2])

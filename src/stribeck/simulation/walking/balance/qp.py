"""The quadratic program of whole-body balance.

With the accelerations a and one wrench w per standing foot, in the sole's frame:

    min   sum_k weight_k |J_k a + drift_k - wanted_k|^2  +  posture, wrench shares
    with  M_b a + h_b = sum J_b^T w                      (base rows of the equation of motion)
          J_c a + drift_c = -20/s J_c v                    (standing feet stay)
          G w <= 0                                        (wrench cones)
          |M_j a + h_j - sum J_j^T w| <= limit            (joint rows)

The rest of the first standing foot determines the base's acceleration from the joints' accelerations, and the base rows
determine this foot's wrench. The remaining program is small: its unknowns are the joints' accelerations and the wrench
of the second standing foot. On one foot it has no equalities, as for a tree that is rooted at the foot.
"""

from collections.abc import Sequence
from ctypes import c_int
from functools import cache
from typing import NamedTuple

import daqp
import numpy as np
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.simulation.robots.sole import Sole
from stribeck.simulation.walking.balance.terms import FootState, Terms


def wrench_cone(sole: Sole, friction: float, margin: float = 0.9) -> Array:
    """Compute G with `G w <= 0` for every wrench w that a sole can bear without slipping or tipping.

    The closed form of Caron, Pham and Nakamura, "Stability of surface contacts for humanoid robots" (ICRA 2015): four
    rows for the friction pyramid, four for the centre of pressure, eight for the yaw moment.

    Parameters
    ----------
    sole
        Sole with half length X and half width Y; the wrench refers to its center.
    friction
        Friction coefficient; the pyramid is inside the cone.
    margin
        Usable share of the rectangle [1].

    Returns
    -------
    G
        Matrix for force and moment in the sole's frame, shape (16, 6).
    """
    X, Y, mu = margin * sole.half_length, margin * sole.half_width, friction / np.sqrt(2)
    rows = [[-1, 0, -mu, 0, 0, 0], [1, 0, -mu, 0, 0, 0], [0, -1, -mu, 0, 0, 0], [0, 1, -mu, 0, 0, 0]]
    rows += [[0, 0, -Y, -1, 0, 0], [0, 0, -Y, 1, 0, 0], [0, 0, -X, 0, -1, 0], [0, 0, -X, 0, 1, 0]]
    bound = -(X + Y) * mu
    for a in (-1, 1):
        for b in (-1, 1):
            rows.append([a * Y, b * X, bound, -a * mu, -b * mu, -1])  # -tz + |Y fx - mu tx| + |X fy - mu ty|
            rows.append([a * Y, b * X, bound, a * mu, b * mu, 1])  # tz + |Y fx + mu tx| + |X fy + mu ty|
    return np.array(rows, dtype=float)


BASE = 6
STANCE_DAMPING = 20.0
"""Rate at which a standing foot's velocity decays [1/s]."""
INEQUALITY, EQUALITY = 0, 5
"""Codes of constraint types in daqp."""


class Task(NamedTuple):
    """Desired accelerations, `jacobian a = wanted`, and desired velocities, `jacobian v = velocity`."""

    jacobian: Array
    wanted: Array
    velocity: Array


class Wishes(NamedTuple):
    """Targets of the joints' accelerations, shape (n,), and the standing feet's wrenches, shape (feet, 6)."""

    joints: Array
    wrenches: Array


class Weights(NamedTuple):
    """Weights of the tasks' rows and the first foot's wrench, shape (rows + 6,), and of each unknown, shape (m,)."""

    rows: Array
    unknowns: Array


class Program(NamedTuple):
    """Program of one control period; its m unknowns z are the joints' accelerations and the second foot's wrench.

    Attributes
    ----------
    cost, gradient
        Matrix and vector of the objective `z^T cost z / 2 + gradient^T z`, shape (m, m) and (m,).
    rows, lower, upper, sense
        Constraints `lower <= rows z <= upper` in daqp's format: wrench cones, then the second foot's rest.
    base, base_rest
        Coefficients of the base's acceleration, `base z + base_rest`, shape (6, m) and (6,).
    wrench, wrench_rest
        Coefficients of the first foot's wrench, `wrench z + wrench_rest`, shape (6, m) and (6,).
    """

    cost: Array
    gradient: Array
    rows: Array
    lower: Array
    upper: Array
    sense: NDArray[np.intc]
    base: Array
    base_rest: Array
    wrench: Array
    wrench_rest: Array


def build(
    terms: Terms,
    standing: Sequence[FootState],
    cones: Sequence[Array],
    tasks: Sequence[Task],
    wishes: Wishes,
    weights: Weights,
) -> Program:
    """Build the program of one control period, without torque limits.

    Parameters
    ----------
    terms
        Terms at the robot's current state.
    standing, cones
        One or two standing feet, and their wrench cones.
    tasks, wishes, weights
        Desired accelerations and wrenches, and their weights.
    """
    root, others = standing[0], standing[1:]
    n, m = len(wishes.joints), len(weights.unknowns)
    asked = len(weights.rows)
    of_accelerations = np.concatenate(
        [*(task.jacobian for task in tasks), terms.inertia[:BASE], *(foot.jacobian for foot in others)]
    )
    base, base_rest = np.zeros((BASE, m)), root.to_base @ _stopping(root)
    base[:, :n] = root.to_base @ -root.jacobian[:, BASE:]
    reduced = of_accelerations[:, :BASE] @ base
    reduced[:, :n] += of_accelerations[:, BASE:]
    rest = of_accelerations[:, :BASE] @ base_rest
    balance = slice(asked - BASE, asked)
    for foot in others:
        reduced[balance, n:] -= foot.jacobian[:, :BASE].T
    wrench = reduced[balance] = root.to_base.T @ reduced[balance]
    wrench_rest = rest[balance] = root.to_base.T @ (rest[balance] + terms.bias[:BASE])

    wanted = np.concatenate([*(task.wanted for task in tasks), wishes.wrenches[0]]) - rest[:asked]
    targets = np.concatenate([wishes.joints, *wishes.wrenches[1:]])
    weighted = weights.rows[:, None] * reduced[:asked]
    cost = reduced[:asked].T @ weighted
    cost.ravel()[:: m + 1] += weights.unknowns
    gradient = -(wanted @ weighted) - weights.unknowns * targets

    size = len(cones[0])
    rows = np.zeros((size * len(cones) + len(reduced) - asked, m))
    lower, upper = np.full(len(rows), -1e30), np.zeros(len(rows))  # no lower bound
    rows[:size], upper[:size] = cones[0] @ wrench, cones[0] @ -wrench_rest
    if others:
        rows[size : 2 * size, n:] = cones[1]
        rows[2 * size :] = reduced[asked:]
        lower[2 * size :] = upper[2 * size :] = _stopping(others[0]) - rest[asked:]
    sense = _sense(size * len(cones), len(reduced) - asked)
    return Program(cost, gradient, rows, lower, upper, sense, base, base_rest, wrench, wrench_rest)


def _stopping(foot: FootState) -> Array:
    """Compute the desired acceleration of a standing sole minus its drift, which brings the sole to rest."""
    return -foot.drift - STANCE_DAMPING * foot.velocity


@cache
def _sense(inequalities: int, equalities: int) -> NDArray[np.intc]:
    return np.repeat([INEQUALITY, EQUALITY], [inequalities, equalities]).astype(c_int)


def solve(
    program: Program, terms: Terms, standing: Sequence[FootState], limit: Array, watched: NDArray[np.bool_]
) -> Array | None:
    """Solve the program for the joint torques, shape (n,); None if the constraints contradict each other.

    Parameters
    ----------
    program, terms, standing
        Program, terms and standing feet of this control period.
    limit
        Largest joint torques, shape (n,) [N m].
    watched
        Mask of joints whose limits are constraints, shape (n,); the caller checks all other limits.
    """
    rows, lower, upper, sense = program.rows, program.lower, program.upper, program.sense
    if watched.any():
        motion, bias = _torque_rows(program, terms, standing)
        motion, bias, most = motion[watched], bias[watched], limit[watched]
        rows, sense = np.concatenate([motion, rows]), np.concatenate([_sense(len(motion), 0), sense])
        lower, upper = np.concatenate([-most - bias, lower]), np.concatenate([most - bias, upper])
    solution, _, flag, _ = daqp.solve(program.cost, program.gradient, rows, upper, lower, sense)
    if flag <= 0:
        return None
    n = len(limit)
    acceleration = np.concatenate([program.base @ solution + program.base_rest, solution[:n]])
    torque = (terms.inertia @ acceleration + terms.bias)[BASE:]
    torque -= (program.wrench @ solution + program.wrench_rest) @ standing[0].jacobian[:, BASE:]
    for foot in standing[1:]:
        torque -= solution[n:] @ foot.jacobian[:, BASE:]
    return np.asarray(torque)


def _torque_rows(program: Program, terms: Terms, standing: Sequence[FootState]) -> tuple[Array, Array]:
    """Compute motion and bias of all joint torques `motion z + bias`, shape (n, m) and (n,)."""
    M, first = terms.inertia, standing[0].jacobian[:, BASE:].T
    n = len(M) - BASE
    motion = M[BASE:, :BASE] @ program.base - first @ program.wrench
    motion[:, :n] += M[BASE:, BASE:]
    for foot in standing[1:]:
        motion[:, n:] -= foot.jacobian[:, BASE:].T
    return motion, M[BASE:, :BASE] @ program.base_rest + terms.bias[BASE:] - first @ program.wrench_rest

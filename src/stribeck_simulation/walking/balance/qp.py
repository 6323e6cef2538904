"""Assembly of the quadratic program of whole-body balance, without its solution.

With the accelerations a and one wrench w per standing foot, in the sole's frame:

    min   sum_k weight_k |J_k a + drift_k - wanted_k|^2  +  posture, wrench shares
    with  M_b a + h_b = sum J_b^T w                      (base rows of the equation of motion)
          J_c a + drift_c = -20/s J_c v                    (standing feet stay)
          G w <= 0                                        (wrench cones)
          |M_j a + h_j - sum J_j^T w| <= limit            (joint rows)

The first standing foot yields the base's acceleration from the joints' accelerations, and the base rows yield that
foot's wrench. The remaining program is small: its unknowns are the joints' accelerations and the wrench of the second
standing foot. On one foot it has no equalities, as if the robot were rooted there.
"""

from collections.abc import Sequence
from ctypes import c_int
from functools import cache
from typing import NamedTuple

import daqp
import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck_simulation.robots.sole import Sole
from stribeck_simulation.walking.balance.terms import FootState, Terms


def wrench_cone(sole: Sole, friction: float, margin: float = 0.9) -> Array:
    """Compute G with `G w <= 0` for every wrench w that a sole can bear without slipping or tipping.

    The closed form of Caron, Pham and Nakamura, "Stability of surface contacts for humanoid robots" (ICRA 2015): four
    rows for the friction pyramid, four for the centre of pressure, eight for the yaw moment.

    Parameters
    ----------
    sole
        Its half length X and half width Y; the wrench is taken at its centre.
    friction
        Coefficient; the pyramid is inside the cone.
    margin
        Share of the rectangle that is used.

    Returns
    -------
    G
        Shape (16, 6), of force then moment in the sole's frame.
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
"""Names in daqp."""


class Task(NamedTuple):
    """Accelerations that are wanted, `jacobian a = wanted`, and the velocities that are, `jacobian v = velocity`."""

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
    """The program of one control period; its m unknowns z are the joints' accelerations and the second foot's wrench.

    Attributes
    ----------
    cost, gradient
        Of `z^T cost z / 2 + gradient^T z`, shape (m, m) and (m,).
    rows, lower, upper, sense
        `lower <= rows z <= upper`, as daqp has them: wrench cones, then the second foot's rest.
    base, base_rest
        The base's acceleration is `base z + base_rest`, shape (6, m) and (6,).
    wrench, wrench_rest
        The first foot's wrench is `wrench z + wrench_rest`, shape (6, m) and (6,).
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
        Of the robot now.
    standing, cones
        Feet that stand, one or two, and their wrench cones.
    tasks, wishes, weights
        What the accelerations and wrenches should be.
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
    own = np.concatenate([wishes.joints, *wishes.wrenches[1:]])
    weighted = weights.rows[:, None] * reduced[:asked]
    cost = reduced[:asked].T @ weighted
    cost.ravel()[:: m + 1] += weights.unknowns
    gradient = -(wanted @ weighted) - weights.unknowns * own

    size = len(cones[0])
    rows = np.zeros((size * len(cones) + len(reduced) - asked, m))
    lower, upper = np.full(len(rows), -1e30), np.zeros(len(rows))  # a bound that is none
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
    """Compute the joint torques, shape (n,), or None if the constraints contradict each other.

    Parameters
    ----------
    program, terms, standing
        Of this control period.
    limit
        Largest joint torques, shape (n,) [N m].
    watched
        Joints whose limits the program keeps, shape (n,): with few it is small; who solves it checks the others.
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

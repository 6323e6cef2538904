"""The quadratic program of whole-body balance, built apart from being solved.

Unknown are the accelerations a and one wrench w a standing foot, in the sole's frame:

    min   sum_k weight_k |J_k a + drift_k - wanted_k|^2  +  posture, wrench shares
    with  M_b a + h_b = sum J_b^T w                      (base rows of the equation of motion)
          J_c a + drift_c = -20/s J_c v                    (standing feet stay)
          G w <= 0                                        (wrench cones)
          |M_j a + h_j - sum J_j^T w| <= limit            (joint rows)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from qpsolvers import Problem, solve_problem

from stribeck.log import Array
from stribeck.simulation.walking.balance.terms import FootState, Terms

BASE = 6
SOLVER = "daqp"
"""The fastest of those that were measured on these programs: 0.05 ms, proxqp 0.2 ms."""
STANCE_DAMPING = 20.0
"""With which a standing foot's velocity is taken out [1/s]."""


@dataclass(frozen=True, eq=False)
class Task:
    """Accelerations that are wanted: `jacobian a = wanted`, as far as the weight of each row has it."""

    jacobian: Array
    wanted: Array
    weight: Array


@dataclass(frozen=True, eq=False)
class Wishes:
    """The least important wishes, a value an unknown: accelerations, then wrenches foot by foot.

    Attributes
    ----------
    wanted, weight
        Shape (nv + 6 feet,).
    """

    wanted: Array
    weight: Array


@dataclass(frozen=True, eq=False)
class Limits:
    """Largest joint torques, shape (n,), and the joints that the program watches, shape (n,).

    Where few joints are watched the program is small; whoever solves it checks the others.
    """

    torque: Array
    watched: NDArray[np.bool_]


def build(
    terms: Terms,
    standing: Sequence[FootState],
    cones: Sequence[Array],
    tasks: Sequence[Task],
    wishes: Wishes,
    limits: Limits,
) -> Problem:
    """Return the program of one control period.

    Parameters
    ----------
    terms
        Of the robot now.
    standing, cones
        Feet that stand, and their wrench cones.
    tasks, wishes
        What the accelerations and wrenches should be.
    limits
        What they must keep to.
    """
    nv = len(terms.bias)
    jacobian = np.concatenate([foot.jacobian for foot in standing])
    motion = np.hstack([terms.inertia, -jacobian.T])  # S^T tau = motion x + h
    P, q = _cost(tasks, wishes)
    A = np.zeros((BASE + len(jacobian), len(q)))
    A[:BASE] = motion[:BASE]
    A[BASE:, :nv] = jacobian
    still = [-foot.drift - STANCE_DAMPING * foot.velocity for foot in standing]
    b = np.concatenate([-terms.bias[:BASE], *still])
    G, h = _inequalities(motion[BASE:], terms.bias[BASE:], cones, limits)
    return Problem(P, q, G, h, A, b)


def _cost(tasks: Sequence[Task], wishes: Wishes) -> tuple[Array, Array]:
    """Return P and q of `x^T P x / 2 + q^T x`."""
    rows = np.concatenate([task.jacobian for task in tasks])
    wanted = np.concatenate([task.wanted for task in tasks])
    weighted = np.concatenate([task.weight for task in tasks])[:, None] * rows
    nv, size = rows.shape[1], len(wishes.weight)
    P = np.zeros((size, size))
    P[:nv, :nv] = rows.T @ weighted
    P.ravel()[:: size + 1] += wishes.weight
    q = -wishes.weight * wishes.wanted
    q[:nv] -= wanted @ weighted
    return P, q


def _inequalities(motion: Array, bias: Array, cones: Sequence[Array], limits: Limits) -> tuple[Array, Array]:
    """Return G and h of `G x <= h`: torques of the watched joints to both sides, then the wrench cones."""
    watched = np.flatnonzero(limits.watched)
    count, cone_size = len(watched), len(cones[0])
    column = motion.shape[1] - BASE * len(cones)
    G = np.zeros((2 * count + cone_size * len(cones), motion.shape[1]))
    h = np.zeros(len(G))
    if count:
        G[:count] = motion[watched]
        G[count : 2 * count] = -G[:count]
        h[:count] = limits.torque[watched] - bias[watched]
        h[count : 2 * count] = limits.torque[watched] + bias[watched]
    row = 2 * count
    for cone in cones:
        G[row : row + cone_size, column : column + BASE] = cone
        row, column = row + cone_size, column + BASE
    return G, h


def solve(problem: Problem, terms: Terms, standing: Sequence[FootState]) -> Array | None:
    """Return the joint torques, shape (n,), or None if the constraints contradict each other."""
    solution = solve_problem(problem, SOLVER)
    if not solution.found or solution.x is None:
        return None
    nv = len(terms.bias)
    acceleration, wrench = solution.x[:nv], solution.x[nv:].reshape(-1, BASE)
    torque = terms.inertia[BASE:] @ acceleration + terms.bias[BASE:]
    for foot, each in zip(standing, wrench, strict=True):
        torque -= foot.jacobian[:, BASE:].T @ each
    return np.asarray(torque)

"""Other places to start from, joint by joint: a descent of all joints may have left one of them in a dip of its own.

Where a joint's curve has no Stribeck effect, for one, its Stribeck velocity does nothing, and no slope leads back.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stribeck.identification.starts import shapes_of
from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.joint_descent import descend_joint, joint_cost
from stribeck.identification.whole_log.model import ModelCorrections
from stribeck.identification.whole_log.profile import Quadratic
from stribeck.identification.whole_log.solve import Solution, solve
from stribeck.identification.whole_log.statistic import Statistic

BEST = 4
"""Starts of each joint [1] that are followed: those whose linear fit is best."""

BETTER = 0.1
"""What chi^2 must fall by [1] for a joint to leave its place: more than descents that end in the same dip differ by."""


def with_restarts(statistic: Statistic, curves: Curves, model: ModelCorrections, solution: Solution) -> Solution:
    """Return the best solution after each joint has tried its starts, all else being as it is in a solution."""
    joints = len(curves.top_speed)
    values = np.concatenate([curves.coefficients(solution.internal), model.values(solution.corrections)[0]])
    size = statistic.nodes.size // joints
    internal = solution.internal.copy()
    for joint in range(joints):
        rows = slice(joint * size, (joint + 1) * size)
        own, gram = curves.joint(joint), statistic.gram[rows, rows]
        log = Quadratic(gram, statistic.right[rows] - statistic.gram[rows] @ values + gram @ values[rows])
        starts = [
            own.linear_start([shape], log.gram, log.right) for shape in shapes_of(own.law, float(own.top_speed[0]))
        ]
        starts.sort(key=lambda start: log.at(own.coefficients(start)))
        best = min((descend_joint(log, own, start) for start in starts[:BEST]), key=lambda found: found.cost)
        if best.cost < joint_cost(log, own, internal[[joint]]) - BETTER:
            internal[joint] = best.internal
    if np.array_equal(internal, solution.internal):
        return solution
    return min(solution, solve(statistic, curves, model, replace(solution, internal=internal)), key=lambda s: s.cost)

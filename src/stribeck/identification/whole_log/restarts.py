"""Other places to start from, joint by joint: a descent of all joints may have left one of them in a dip of its own.

Where a joint's curve has no Stribeck effect, for one, its Stribeck velocity does nothing, and no slope leads back.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stribeck.identification.curve_fit.starts import shapes_of
from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.joint_descent import descend_joints, joint_costs
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
    logs, owners, starts = [], [], []
    for joint in range(joints):
        rows = slice(joint * size, (joint + 1) * size)
        own, gram = curves.of([joint]), statistic.gram[rows, rows]
        log = Quadratic(gram, statistic.right[rows] - statistic.gram[rows] @ values + gram @ values[rows])
        tried = [
            own.linear_start([shape], log.gram, log.right) for shape in shapes_of(own.law, float(own.top_speed[0]))
        ]
        best = sorted(tried, key=lambda start: log.at(own.coefficients(start)))[:BEST]
        logs.append(log)
        owners += [joint] * len(best)
        starts += best
    ends, costs = descend_joints([logs[joint] for joint in owners], curves.of(owners), np.concatenate(starts))
    lowest = joint_costs(logs, curves, solution.internal) - BETTER
    internal = solution.internal.copy()
    for joint, end, cost in zip(owners, ends, costs, strict=True):
        if cost < lowest[joint]:
            internal[joint], lowest[joint] = end, cost
    if np.array_equal(internal, solution.internal):
        return solution
    return min(solution, solve(statistic, curves, model, replace(solution, internal=internal)), key=lambda s: s.cost)

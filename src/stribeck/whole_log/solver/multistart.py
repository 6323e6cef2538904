"""Other starts for single joints: a descent of all joints may leave one of them in a local minimum.

Where a joint's curve has no Stribeck effect, for one, its Stribeck velocity does nothing, and no gradient leads back.
Without multistart, the worst joint of a walk of the tuning study whose joints all differ is 12 % off instead of 4 %;
where joints have the same shapes nothing changes.
"""

from dataclasses import replace

import numpy as np

from stribeck.judgement.curve_fit.fit import shapes_of
from stribeck.whole_log.constants import LEAST_DECREASE, MULTISTART_STARTS
from stribeck.whole_log.model.friction_curves import Curves
from stribeck.whole_log.model.model_corrections import ModelCorrections
from stribeck.whole_log.solver.joint_descent import descend_joints, joint_costs
from stribeck.whole_log.solver.normal_equations import NormalEquations
from stribeck.whole_log.solver.solve import Solution, solve
from stribeck.whole_log.terms.profile_likelihood import Quadratic


def with_other_starts(
    normal_equations: NormalEquations, curves: Curves, model: ModelCorrections, solution: Solution
) -> Solution:
    """Return the best solution after each joint has tried its other starts, all else being as in a solution."""
    joints = len(curves.top_speed)
    values = np.concatenate([curves.coefficients(solution.internal), model.values(solution.corrections)])
    size = normal_equations.basis.size // joints
    quadratics, owners, starts = [], [], []
    for joint in range(joints):
        rows = slice(joint * size, (joint + 1) * size)
        one, information = curves.of([joint]), normal_equations.information[rows, rows]
        others = normal_equations.information[rows] @ values - information @ values[rows]
        quadratic = Quadratic(information, normal_equations.right_hand_side[rows] - others)
        tried = [
            one.linear_start([shape], information, quadratic.right_hand_side)
            for shape in shapes_of(one.law, float(one.top_speed[0]))
        ]
        best = sorted(tried, key=lambda start: quadratic.at(one.coefficients(start)))[:MULTISTART_STARTS]
        quadratics.append(quadratic)
        owners += [joint] * len(best)
        starts += best
    ends, costs = descend_joints([quadratics[joint] for joint in owners], curves.of(owners), np.concatenate(starts))
    lowest = joint_costs(quadratics, curves).costs(solution.internal) - LEAST_DECREASE
    internal = solution.internal.copy()
    for joint, end, cost in zip(owners, ends, costs, strict=True):
        if cost < lowest[joint]:
            internal[joint], lowest[joint] = end, cost
    if np.array_equal(internal, solution.internal):
        return solution
    other = solve(normal_equations, curves, model, replace(solution, x=np.r_[internal.ravel(), solution.corrections]))
    return min(solution, other, key=lambda each: each.cost)

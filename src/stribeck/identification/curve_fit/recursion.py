"""Recursive least squares: level and offset of a fitted law follow friction from block to block, with forgetting."""

import numpy as np

from stribeck.identification.curve_fit.problem import FitProblem
from stribeck.identification.joint_fit import JointFit
from stribeck.typing import Array

MEMORY = 30.0
"""Time over which older samples lose their weight to 1/e [s] of samples: some tens of steps, less than a warm-up."""

NO_ERROR = 1e-12
"""Least squared error over squared friction [1]: numerical guard, so that A has an inverse."""


def predict_in_turn(fit: JointFit, learnt: FitProblem, asked: FitProblem, interval: float) -> Array:
    """Return the friction torque of samples, by what was learnt from the blocks before theirs, shape (N,).

    The law that was fitted keeps its shape; its level and an offset are learnt: R = (R_fit(v), 1) theta. A block of m
    samples with friction torque R, Phi their rows (R_fit, 1), changes

        A = lambda^m A + Phi^T Phi,   b = lambda^m b + Phi^T R,   lambda = exp(-interval / MEMORY)

    and theta is A^-1 b: least squares with forgetting, in its information form. It begins at (1, 0), uncertain by all
    of the friction, against blocks whose samples all err alike. What comes before anything was learnt is NaN.

    Parameters
    ----------
    fit
        Of the joint.
    learnt, asked
        Problems of the joint, blocks ascending.
    interval
        Between samples [s].
    """
    inertias = [0.0 if each.acceleration is None else fit.values[-1] * each.acceleration for each in (learnt, asked)]
    rows, columns = (
        np.column_stack([each.predict(fit.values) - inertia, np.ones(len(each.velocity))])
        for each, inertia in zip((learnt, asked), inertias, strict=True)
    )
    torque = learnt.friction_torque - inertias[0]
    square = float(np.mean(torque**2))
    of_a_block = len(torque) / len(np.unique(learnt.block)) * fit.rms**2
    information = np.diag([1.0, 1.0 / square]) * max(of_a_block, NO_ERROR * square)
    right = information @ [1.0, 0.0]
    predicted = np.full(len(columns), np.nan)
    for block in np.union1d(learnt.block, asked.block):
        now = slice(*np.searchsorted(asked.block, [block, block + 1]))
        if block > learnt.block[0]:
            predicted[now] = columns[now] @ np.linalg.solve(information, right)
        new = slice(*np.searchsorted(learnt.block, [block, block + 1]))
        kept = np.exp(-(new.stop - new.start) * interval / MEMORY)
        information = kept * information + rows[new].T @ rows[new]
        right = kept * right + rows[new].T @ torque[new]
    return np.asarray(predicted + inertias[1])

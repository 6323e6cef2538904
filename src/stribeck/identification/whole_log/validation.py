"""How well the law explains stretches that its fit did not see."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stribeck.equations import WeakEquations
from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.levels import ErrorLevels
from stribeck.identification.whole_log.statistic import Statistic, design
from stribeck.log import Array
from stribeck.result import Validation


def validate(
    unseen: Sequence[WeakEquations],
    training: Statistic,
    curves: Curves,
    levels: ErrorLevels,
    friction: Array,
    corrections: Array,
) -> tuple[Validation, ...]:
    """Return a validation for each joint, in the order of the equations' joints.

    Parameters
    ----------
    unseen
        Equations that the fit did not see.
    training
        What it saw: for the Coulomb friction and offset that the law is compared with.
    curves, levels
        Nodes, and errors that equations are weighed by.
    friction, corrections
        Values at the nodes [N m], shape (n N,), and of the corrections, shape (c,), that the training gave.
    """
    joints = len(curves.top_speed)
    candidates = np.stack([friction, np.zeros_like(friction), coulomb_curves(training, corrections)])
    squares, weights = np.zeros((len(candidates), joints)), np.zeros(joints)
    for equations in unseen:
        columns, matrix = design(equations, curves.nodes)
        touched = np.flatnonzero(columns < curves.nodes.size)
        owner = curves.nodes.joint_of(columns[touched])
        values = np.concatenate([friction, corrections])
        left = equations.residual.ravel() - matrix @ values[columns]
        share = _shares(equations, levels)
        weights += share.sum(axis=0)
        for joint in range(joints):
            own = touched[owner == joint]
            block = matrix[:, own]
            for k, candidate in enumerate(candidates):
                error = left + block @ (friction - candidate)[columns[own]]
                squares[k, joint] += float(share[:, joint] @ error**2)
    rms = np.sqrt(squares / np.maximum(weights, 1e-300))
    return tuple(
        Validation(rms=float(own), rms_zero_friction=float(zero), rms_coulomb_only=float(coulomb))
        for own, zero, coulomb in rms.T
    )


def coulomb_curves(statistic: Statistic, corrections: Array) -> Array:
    """Return the best Coulomb friction and offset of all joints, at the nodes [N m], shape (n N,)."""
    nodes = statistic.nodes.velocity
    size, (joints, count) = nodes.size, nodes.shape
    bases = np.stack([np.sign(nodes), np.ones_like(nodes)], axis=2)
    gram = statistic.gram[:size, :size].reshape(size, joints, count).transpose(1, 0, 2) @ bases
    half = gram.transpose(1, 0, 2).reshape(joints, count, 2 * joints)
    matrix = (bases.transpose(0, 2, 1) @ half).reshape(2 * joints, 2 * joints)
    pull = statistic.right[:size] - statistic.gram[:size, size:] @ corrections
    vector = np.einsum("jnk,jn->jk", bases, pull.reshape(joints, count)).ravel()
    ridge = 1e-9 * float(np.diag(matrix).max()) * np.eye(2 * joints)
    coefficients = np.linalg.solve(matrix + ridge, vector).reshape(joints, 2)
    return np.asarray(np.einsum("jnk,jk->jn", bases, coefficients).ravel())


def _shares(equations: WeakEquations, levels: ErrorLevels) -> Array:
    """Return how much each equation says about each joint's friction torque [1/(N m)^2], shape (K m, n)."""
    encoder = ((equations.encoder_response * equations.encoder_noise) ** 2).sum(axis=2)
    torque = ((equations.weights * equations.torque_noise) ** 2).sum(axis=2)
    other = ((levels.response(equations) * levels.values) ** 2).sum(axis=2)
    variance = equations.acceleration_overlap[0] * encoder + equations.torque_overlap[0] * torque + other
    shares = equations.weights**2 / variance[:, :, None]
    return np.asarray(shares.reshape(-1, shares.shape[2]))

"""Friction curves by their values at fixed velocities: what lets a whole log be summed up before any law is chosen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from stribeck.log import Array

FINEST = 1.5e-3
"""Distance of the nodes around standstill, as a share of the top speed [1]."""

GROWTH = 0.12
"""What the distance grows by a unit of velocity [1]: friction bends most around standstill."""

REACH = 1.05
"""Outermost nodes over the top speed [1]; what lies beyond is taken to be there."""

ORDER = 4
"""Nodes [1] that a value in between is interpolated from, by Lagrange's cubic polynomial."""


@dataclass(frozen=True, eq=False)
class Nodes:
    """Velocities [rad/s] of each joint's nodes, shape (n, N): `R(v) = sum_j weights(v)_j R(node_j)`."""

    velocity: Array

    @property
    def size(self) -> int:
        """Number of node values of all joints."""
        return int(self.velocity.size)

    def weights(self, velocity: Array) -> csr_array:
        """Return the interpolation weights of velocities (T, n) as a sparse matrix, shape (T, n N)."""
        samples, joints = velocity.shape
        count = self.velocity.shape[1]
        first = np.empty((samples, joints), dtype=np.int64)
        weights = np.empty((samples, joints, ORDER))
        for k, nodes in enumerate(self.velocity):
            v = np.clip(velocity[:, k], nodes[0], nodes[-1])
            first[:, k] = np.clip(np.searchsorted(nodes, v) - ORDER // 2, 0, count - ORDER)
            weights[:, k] = _lagrange(nodes[first[:, k, None] + np.arange(ORDER)], v)
        columns = (first + count * np.arange(joints))[:, :, None] + np.arange(ORDER)
        starts = np.arange(samples + 1) * joints * ORDER
        return csr_array((weights.ravel(), columns.ravel(), starts), shape=(samples, self.size))

    def joint_of(self, columns: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the joint that each column of `weights` belongs to."""
        return np.asarray(columns // self.velocity.shape[1])


def make_nodes(top_speed: Array) -> Nodes:
    """Return nodes for joints with these top speeds [rad/s], shape (n,)."""
    count = int(np.ceil(np.log1p(GROWTH / FINEST * REACH) / GROWTH))
    positive = np.expm1(np.arange(1, count + 1) * np.log1p(GROWTH / FINEST * REACH) / count) * FINEST / GROWTH
    shape = np.concatenate([-positive[::-1], [0.0], positive])
    return Nodes(np.maximum(top_speed, 1e-9)[:, None] * shape)


def _lagrange(nodes: Array, velocity: Array) -> Array:
    """Return Lagrange's weights of the nodes, shape (T, ORDER), at velocities (T,)."""
    weights = np.ones_like(nodes)
    for i in range(ORDER):
        for j in range(ORDER):
            if i != j:
                weights[:, i] *= (velocity - nodes[:, j]) / (nodes[:, i] - nodes[:, j])
    return weights

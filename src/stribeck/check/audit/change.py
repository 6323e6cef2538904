"""Changes of a log's columns: another order, and factors of positions and torques, such as signs, units and gears."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.log import RobotLog


@dataclass(frozen=True, eq=False)
class ColumnChange:
    """Column of the log for each joint, and factors of its position and torque [1], shape (n,) each."""

    order: tuple[int, ...]
    position: Array
    torque: Array

    @classmethod
    def none(cls, joints: int) -> ColumnChange:
        """Keep the order and the values of all columns."""
        return cls(tuple(range(joints)), np.ones(joints), np.ones(joints))

    def times(self, position: Array | float = 1.0, torque: Array | float = 1.0) -> ColumnChange:
        """Multiply positions and torques by further factors, shape (n,)."""
        return replace(self, position=self.position * position, torque=self.torque * torque)

    def inverted(self, columns: Sequence[int]) -> ColumnChange:
        """Invert positions and torques of columns."""
        sign = np.where(np.isin(np.arange(len(self.order)), columns), -1.0, 1.0)
        return self.times(sign, sign)

    def apply(self, log: RobotLog) -> RobotLog:
        """Change the columns of a log, also those of the derivatives of its positions."""
        factors = dict.fromkeys(("position", "velocity", "acceleration"), self.position)
        factors |= {"torque": self.torque, "external_torque": np.ones(len(self.order))}
        given = {name: array for name in factors if (array := getattr(log, name)) is not None}
        return replace(log, **{name: array[:, list(self.order)] * factors[name] for name, array in given.items()})

    def since(self, before: ColumnChange) -> BoolArray:
        """Find joints whose column or factor differs from before, shape (n,)."""
        order = np.array(self.order) != np.array(before.order)
        return np.asarray(order | (self.position != before.position) | (self.torque != before.torque))

"""What the columns of a CSV without a line of names are, by their numbers alone."""

from pathlib import Path

import numpy as np

from stribeck.log.readers.table import first_line, is_data
from stribeck.typing import Array

ROWS = 5000
"""That are looked at."""
FOLLOWS = 0.9
"""Correlation of a velocity with the slope of its position, in their middle [1]."""


def name_columns(path: Path, joints: int) -> list[str] | None:
    """Return names for the columns of a CSV file that has none, None if it has some or they cannot be told.

    Time grows; positions come first, of as many columns as there are joints, then torques, and velocities before or
    behind those.
    """
    if path.suffix.lower() != ".csv" or not path.is_file():
        return None
    first, separator = first_line(path)
    if not is_data(first):
        return None
    try:
        values = np.loadtxt(path, delimiter=separator, max_rows=ROWS, ndmin=2)
    except ValueError:
        return None
    timed = len(values) > 1 and bool(np.all(np.diff(values[:, 0]) > 0))
    blocks, left = divmod(values.shape[1] - timed, joints)
    if left or blocks not in (2, 3):
        return None
    kinds = ["position", "torque"]
    if blocks == 3:
        position, *others = np.split(values[:, int(timed) :], 3, axis=1)
        likely = [_is_velocity(position, other) for other in others]
        if sum(likely) != 1:
            return None
        kinds.insert(1 + likely.index(True), "velocity")
    return ["time"] * timed + [f"{kind}_{k}" for kind in kinds for k in range(joints)]


def _is_velocity(position: Array, other: Array) -> bool:
    """Return whether columns follow the slopes of others."""
    slope = position[2:] - position[:-2]
    slope, other = slope - slope.mean(axis=0), other[1:-1] - other[1:-1].mean(axis=0)
    size = np.sqrt(np.sum(slope**2, axis=0) * np.sum(other**2, axis=0))
    return bool(np.median(np.sum(slope * other, axis=0) / np.maximum(size, 1e-30)) > FOLLOWS)

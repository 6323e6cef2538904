"""Arguments of `OnlineFriction.update` as arrays of T samples, after a check of their shapes."""

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from stribeck.core.base.typing import Array
from stribeck.core.dynamics.contact.phases import HUNG
from stribeck.core.errors import LogError
from stribeck.core.robot import Robot


def joined(shape: tuple[int, int], **channels: object) -> Array:
    """Join channels of the joints, shape (c, T, n); a single sample may have shape (n,)."""
    return np.array([rows_of(name, values, shape) for name, values in channels.items()])


def standing_contacts(robot: Robot, contact: ArrayLike | Literal["hung"] | None, samples: int) -> list[tuple[str, ...]]:
    """Name the standing contacts of each sample."""
    if robot.base == "fixed":
        return [()] * samples
    if contact is None:
        raise LogError("contact: none was given, and the base floats; expected the standing contacts")
    if isinstance(contact, str) and contact == HUNG:
        return [(HUNG,)] * samples
    flags = rows_of("contact", contact, (samples, len(robot.contacts))).tolist()
    return [tuple(name for name, stands in zip(robot.contacts, row, strict=True) if stands > 0.5) for row in flags]


def rows_of(name: str, values: object, shape: tuple[int, ...] | None = None) -> Array:
    """Convert an argument to one row per sample, of a given shape (T, ...), or to shape (T,).

    Raises
    ------
    LogError
        If the values are not real numbers, or have another shape.
    """
    try:
        rows = np.asarray(values)
    except ValueError as error:
        raise LogError(f"{name}: its rows have different lengths; expected an array of numbers") from error
    shape = shape or np.shape(np.ravel(rows))
    if rows.dtype.kind not in "biuf" or (rows.shape != shape and (rows.shape != shape[1:] or shape[0] != 1)):
        raise LogError(f"{name}: found {rows.dtype} of shape {rows.shape}, expected real numbers of shape {shape}")
    return rows.astype(np.float64).reshape(shape)


def base_motion(base: object, samples: int) -> tuple[Array | None, Array | None]:
    """Convert orientation, shape (T, 4), and angular velocity, (T, 3), of a base; None for unknown ones."""
    if base is not None and not (isinstance(base, tuple | list) and len(base) == 2):
        raise LogError("base: expected a pair of orientation and angular velocity")
    turn, spin = base or (None, None)
    omega = None if spin is None else rows_of("angular velocity", spin, (samples, 3))
    return None if turn is None else rows_of("base orientation", turn, (samples, 4)), omega

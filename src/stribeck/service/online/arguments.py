"""Arguments of `OnlineFriction.update` as arrays of T samples, after a check of their shapes."""

from contextlib import suppress
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from stribeck.core.base.typing import Array
from stribeck.core.dynamics.contact.phases import HUNG
from stribeck.core.errors import LogError
from stribeck.core.robot import Robot


def joined(shape: tuple[int, int], **channels: ArrayLike) -> Array:
    """Join channels of the joints, shape (c, T, n); a single sample may have shape (n,)."""
    with suppress(ValueError):  # channels of different shapes
        signals = np.array(list(channels.values()), dtype=np.float64)
        if signals.shape[1:] in (shape, shape[1:][: shape[0] == 1]):
            return signals.reshape(len(channels), *shape)
    return np.array([rows_of(name, values, shape) for name, values in channels.items()])


def standing_contacts(robot: Robot, contact: ArrayLike | Literal["hung"] | None, samples: int) -> list[tuple[str, ...]]:
    """Name the standing contacts of each sample."""
    if robot.base == "fixed":
        return [()] * samples
    if contact is None:
        raise LogError("contact: none was given, and the base floats; expected the standing contacts")
    if isinstance(contact, str):
        return [(HUNG,)] * samples
    flags = rows_of("contact", contact, (samples, len(robot.contacts))).tolist()
    return [tuple(name for name, stands in zip(robot.contacts, row, strict=True) if stands > 0.5) for row in flags]


def rows_of(name: str, values: object, shape: tuple[int, int]) -> Array:
    """Convert an argument to one row per sample."""
    rows = np.asarray(values, dtype=np.float64)
    if rows.shape != shape and (rows.shape != shape[1:] or shape[0] != 1):
        raise LogError(f"{name}: found shape {rows.shape}, expected {shape[1:]} or {shape}")
    return rows.reshape(shape)

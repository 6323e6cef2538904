"""Rectangular contact area of a foot, in the contact's frame."""

from typing import Annotated

import mujoco
import numpy as np
from pydantic import Field

from stribeck.core.base.checked_table import Finite, Positive, Table
from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError

Vector = Annotated[list[Finite], Field(min_length=3, max_length=3)]


class Sole(Table):
    """`[soles.<foot>]`: a rectangle parallel to the contact frame's xy plane.

    Attributes
    ----------
    centre
        Center in the contact frame [m].
    half_length, half_width
        Half lengths along x and y of the contact frame [m].
    """

    centre: Vector = [0.0, 0.0, 0.0]
    half_length: Positive
    half_width: Positive


def sole_under(model: mujoco.MjModel, body: int, rotation: Array, translation: Array, where: str) -> Sole:
    """Compute the rectangle that a body's colliding boxes, spheres and capsules cover on flat ground.

    Parameters
    ----------
    model
        Compiled model.
    body
        Index of the foot's body.
    rotation, translation
        Pose of the contact frame in the body, shape (3, 3) and (3,).
    where
        Name of the contact in the error.

    Raises
    ------
    SettingsError
        If the body has no such shape.
    """
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for geom in range(model.ngeom):
        if model.geom_bodyid[geom] != body or not model.geom_contype[geom]:
            continue
        kind, size = model.geom_type[geom], model.geom_size[geom]
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
        axes = rotation.T @ turn.reshape(3, 3)
        if kind == mujoco.mjtGeom.mjGEOM_BOX:
            reach, pad = np.abs(axes) @ size, np.zeros(3)
        elif kind == mujoco.mjtGeom.mjGEOM_SPHERE:
            reach, pad = np.zeros(3), np.array([0, 0, size[0]])
        elif kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
            reach, pad = np.abs(axes[:, 2]) * size[1], np.array([0, 0, size[0]])
        else:
            continue
        centre = rotation.T @ (model.geom_pos[geom] - translation)
        low, high = np.minimum(low, centre - reach - pad), np.maximum(high, centre + reach + pad)
    if not np.all(high > low):
        raise SettingsError(f"{where}: the model has no box, sphere or capsule there that collides; give its sole")
    middle, half = (low + high) / 2, (high - low) / 2
    return Sole(centre=[*middle[:2].tolist(), float(low[2])], half_length=float(half[0]), half_width=float(half[1]))

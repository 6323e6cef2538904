"""Joint motion of a limb whose end stays where it is while the base moves."""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from stribeck.errors import SettingsError
from stribeck.robot import Contact
from stribeck.typing import Array
from stribeck_simulation.prescribed.limb import BodyMotion, Limb, end_motion
from stribeck_simulation.prescribed.trajectory import Trajectory

COARSE = 25
"""Newton first solves one of this many samples, and starts from there for the others."""


def place_end(limb: Limb, contact: Contact, base: BodyMotion, rotation: Array, place: Array, start: Array) -> Array:
    """Return the joint positions that put a limb's end at a pose of the world, by Newton's method, shape (T, k).

    Parameters
    ----------
    limb
        With as many joints as the contact has constraints.
    contact
        A surface is placed and turned, a point only placed.
    base
        Motion of the root link at T samples.
    rotation, place
        Where the end shall be: shape (3, 3), and [m], shape (3,).
    start
        Joint positions to start from, shape (k,).

    Raises
    ------
    SettingsError
        If the limb does not reach there.
    """
    position: Array = _start(limb, contact, base, rotation, place, start)
    zero = np.zeros_like(position)
    for _ in range(60):
        end, jacobian = end_motion(limb, base, position, zero, zero)
        error = np.empty((len(position), 6))
        error[:, :3] = place - end.position
        error[:, 3:] = Rotation.from_matrix(rotation @ end.rotation.transpose(0, 2, 1)).as_rotvec()
        try:
            step = np.linalg.solve(jacobian[:, : contact.size], error[:, : contact.size, None])[:, :, 0]
        except np.linalg.LinAlgError:
            break
        largest = np.abs(step).max(axis=1, keepdims=True)
        # Newton steps are cut to this [rad], for starts far from the solution
        position = position + step * np.minimum(1.0, 0.3 / np.maximum(largest, 1e-300))
        if largest.max() < 1e-13:  # Newton ends when no joint moves by more [rad]; it converges quadratically
            return position
        if not np.abs(position).max() < 100:
            break
    raise SettingsError(
        f"posture: foot '{contact.name}' cannot be put level on the ground near this posture; "
        "give a posture with bent knees and about level feet"
    )


def _start(limb: Limb, contact: Contact, base: BodyMotion, rotation: Array, place: Array, start: Array) -> Array:
    """Return joint positions near the solution, shape (T, k): a spline through that of every few samples."""
    samples = len(base.position)
    if samples < 100 * COARSE:  # fewer samples than this many times `COARSE` are solved at once
        return np.tile(start, (samples, 1))
    rows = np.append(np.arange(0, samples - 1, COARSE), samples - 1)
    some = BodyMotion(base.rotation[rows], base.position[rows], base.velocity[rows], base.acceleration[rows])
    return np.asarray(CubicSpline(rows, place_end(limb, contact, some, rotation, place, start))(np.arange(samples)))


def planted_motion(
    limb: Limb, contact: Contact, base: BodyMotion, rotation: Array, place: Array, start: Array
) -> Trajectory:
    """Return the joint motion that keeps a limb's end at a pose of the world, shape (T, k).

    With J the limb's Jacobian, its velocity follows from `J v + (base's share) = 0` and its acceleration from
    `J a + (base's share) + J' v = 0`. Parameters as for `place_end`.
    """
    position = place_end(limb, contact, base, rotation, place, start)
    zero = np.zeros_like(position)
    rows = slice(contact.size)
    carried, jacobian = end_motion(limb, base, position, zero, zero)
    velocity = np.asarray(np.linalg.solve(jacobian[:, rows], -carried.velocity[:, rows, None])[:, :, 0], dtype=float)
    carried, _ = end_motion(limb, base, position, velocity, zero)
    acceleration = np.linalg.solve(jacobian[:, rows], -carried.acceleration[:, rows, None])[:, :, 0]
    return Trajectory(position, velocity, np.asarray(acceleration, dtype=float))

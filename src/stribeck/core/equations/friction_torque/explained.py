"""Friction torque in each contact mode, R = tau - inverse_dynamics(q, v, a) (5.13)."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.dynamics.contact.mode import ContactMode
from stribeck.core.dynamics.loops import without_loop_forces
from stribeck.core.dynamics.rooted import rooted_inverse_dynamics
from stribeck.core.dynamics.state import State
from stribeck.core.equations.friction_torque.foot_wrenches import effect_on_joints
from stribeck.core.filters.averaging import Nodes
from stribeck.core.settings import Settings


class Explained(NamedTuple):
    """Friction torque of N samples of all joints.

    Attributes
    ----------
    friction
        Friction torque [N m], NaN where it is unknown, shape (N, n).
    usable
        Samples that a fit may use, shape (N, n).
    wrench
        Ground reaction, as in `Chunk`.
    velocity, acceleration, torque
        Signals that match the friction torque [rad/s], [rad/s^2], [N m], shape (N, n).
    nodes, jerk, snap
        Nodes and derivatives for an averaged friction torque, see `FrictionSamples`, shape (N, n).
    """

    friction: Array
    usable: BoolArray
    wrench: Array
    velocity: Array
    acceleration: Array
    torque: Array
    nodes: Nodes | None = None
    jerk: Array | None = None
    snap: Array | None = None


def by_inverse_dynamics(
    modes: tuple[ContactMode, ...],
    mode: IntArray,
    state: State,
    torque: Array,
    measured: Mapping[str, Array],
    settings: Settings,
) -> Explained:
    """Subtract inverse dynamics from the measured torque, sample by sample."""
    friction = np.full(torque.shape, np.nan)
    usable = np.zeros(torque.shape, dtype=bool)
    wrench = np.full((len(torque), 6), np.nan)
    for k in np.unique(mode):
        rows: slice | IntArray = np.flatnonzero(mode == k)
        if len(rows) == len(torque):  # type: ignore[arg-type]
            rows = slice(None)
        part = state if isinstance(rows, slice) else state.take(rows)
        wrenches = {foot: of_foot[rows] for foot, of_foot in measured.items()}
        friction[rows], usable[rows], wrench[rows] = _explain(modes[k], part, torque[rows], wrenches, settings)
    return Explained(friction, usable, wrench, state.velocity, state.acceleration, torque)


def _explain(
    mode: ContactMode, state: State, torque: Array, measured: Mapping[str, Array], settings: Settings
) -> tuple[Array, BoolArray, Array | float]:
    """Compute friction torque (N, n), joints that a fit may use (n,), and the wrench on a single foot (N, 6) or NaN."""
    motion = state.position, state.velocity, state.acceleration
    wrench, needed = rooted_inverse_dynamics(mode.rooted, *motion, mode.root(state))
    friction, usable, robot = torque - needed, mode.seen(settings), mode.robot
    if robot.base == "fixed":
        return without_loop_forces(robot, state.position, friction), usable, np.nan
    if measured and mode.feet:
        standing_on = {foot: measured[foot] for foot in mode.feet}
        friction += effect_on_joints(robot, state.position, standing_on, mode.surface, wrench)
    friction = without_loop_forces(robot, state.position, friction)
    if not mode.leaves_open:
        return friction, usable, wrench
    if not measured:
        friction[:, mode.standing] = np.nan
    return friction, usable, np.nan

"""Friction torque by contact mode: what is known of the joints while some feet stand (5.13).

    R = tau - inverse_dynamics(q, v, a)

On one standing surface the tree is rooted at that foot and every joint is known. On several, and on point feet, the
wrenches on the feet are not known one by one: the joints between them are left open, and the limbs that swing are known
all the same. Where the wrenches are measured, the joints between base and feet follow from them
(docs/other-methods.md).
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.contact import SupportPhase
from stribeck.differentiation.averaging import Nodes
from stribeck.dynamics.loops import without_loop_forces
from stribeck.dynamics.root_motion import base_root, standing_root
from stribeck.dynamics.rooted import RootMotion, rooted_inverse_dynamics
from stribeck.dynamics.state import State
from stribeck.friction_torque.foot_wrenches import effect_on_joints
from stribeck.robot import Robot
from stribeck.robot.rooting import RootedModel
from stribeck.settings import Settings


class Explained(NamedTuple):
    """What is known of N samples of all joints.

    Attributes
    ----------
    friction
        Friction torque [N m], NaN where it is not known, shape (N, n).
    usable
        Which of it a fit may use, shape (N, n).
    wrench
        As in `Chunk`.
    velocity, acceleration, torque
        That the friction torque belongs to [rad/s], [rad/s^2], [N m], shape (N, n).
    nodes, jerk, snap
        As in `FrictionSamples`, where the friction torque is an average of its own kind, shape (N, n).
    """

    friction: Array
    usable: NDArray[np.bool_]
    wrench: Array
    velocity: Array
    acceleration: Array
    torque: Array
    nodes: Nodes | None = None
    jerk: Array | None = None
    snap: Array | None = None


class StandingFeet(NamedTuple):
    """Which feet stand, and which of them has stood longest: that one has come to rest."""

    feet: tuple[str, ...]
    rested: str


def contact_modes(phases: tuple[SupportPhase, ...]) -> tuple[StandingFeet, ...]:
    """Return the contact mode of each phase."""
    modes: list[StandingFeet] = []
    for k, phase in enumerate(phases):
        modes.append(next_mode(modes[-1] if k and phases[k - 1].stop == phase.start else None, phase.feet))
    return tuple(modes)


def next_mode(before: StandingFeet | None, feet: tuple[str, ...]) -> StandingFeet:
    """Return the contact mode of standing feet, after another one."""
    stayed = [foot for foot in feet if before and foot in before.feet]
    return StandingFeet(feet, before.rested if before and before.rested in stayed else next(iter([*stayed, *feet]), ""))


def contact_root(robot: Robot, mode: StandingFeet, state: State) -> tuple[RootedModel, RootMotion | None]:
    """Return the tree of a contact mode, rooted at the foot that has stood longest, and how its root moves.

    A robot on point feet keeps its own root; the root of a fixed base does not move, and has None.
    """
    if robot.base == "fixed":
        return robot.tree, None
    surface = _root_foot(robot, mode)
    if surface is None:
        return robot.tree, base_root(robot, mode.feet, state)
    return robot.rooted_at(surface), standing_root(robot, surface, state)


def _root_foot(robot: Robot, mode: StandingFeet) -> str | None:
    """Return the standing surface that has stood longest, None if only points stand."""
    by_rest = sorted(mode.feet, key=lambda foot: foot != mode.rested)
    return next((foot for foot in by_rest if robot.contacts[foot].kind == "surface"), None)


def seen_joints(robot: Robot, feet: tuple[str, ...], settings: Settings) -> NDArray[np.bool_]:
    """Return the joints whose friction torque a fit may use while these feet stand, shape (n,)."""
    if robot.base == "fixed" or takes_wrenches(robot, settings):
        return np.ones(len(robot.joint_names), dtype=bool)
    if leaves_open(robot, feet):
        return ~robot.standing(feet)
    return ~robot.standing(feet) | bool(settings.standing_legs)


def swinging_joints(robot: Robot, feet: tuple[str, ...]) -> NDArray[np.bool_]:
    """Return the joints of legs whose feet do not stand, shape (n,); there are none on a fixed base."""
    legs = robot.standing(tuple(robot.contacts))
    return legs & ~robot.standing(tuple(foot for foot in feet if foot in robot.contacts))


def takes_wrenches(robot: Robot, settings: Settings) -> bool:
    """Return whether standing legs follow from measured wrenches."""
    return robot.base == "floating" and settings.standing_legs == "measured"


def leaves_open(robot: Robot, feet: tuple[str, ...]) -> bool:
    """Return whether the joints of the standing limbs are not known: not on a fixed base or one standing surface."""
    return robot.base == "floating" and (len(feet) > 1 or robot.contacts[feet[0]].kind == "point")


def by_inverse_dynamics(
    robot: Robot,
    modes: tuple[StandingFeet, ...],
    mode: NDArray[np.int64],
    state: State,
    torque: Array,
    measured: Mapping[str, Array],
    settings: Settings,
) -> Explained:
    """Return measured torque less inverse dynamics, sample by sample."""
    friction = np.full(torque.shape, np.nan)
    usable = np.zeros(torque.shape, dtype=bool)
    wrench = np.full((len(torque), 6), np.nan)
    for k in np.unique(mode):
        rows: slice | NDArray[np.int64] = np.flatnonzero(mode == k)
        if len(rows) == len(torque):  # type: ignore[arg-type]
            rows = slice(None)
        part = state if isinstance(rows, slice) else state.take(rows)
        wrenches = {foot: of_foot[rows] for foot, of_foot in measured.items()}
        friction[rows], usable[rows], wrench[rows] = _one_mode(robot, modes[k], part, torque[rows], wrenches, settings)
    return Explained(friction, usable, wrench, state.velocity, state.acceleration, torque)


def _one_mode(
    robot: Robot, mode: StandingFeet, state: State, torque: Array, measured: Mapping[str, Array], settings: Settings
) -> tuple[Array, NDArray[np.bool_], Array | float]:
    """Return friction torque (N, n), which joints a fit may use (n,), and the wrench on an only foot (N, 6) or NaN."""
    rooted, root = contact_root(robot, mode, state)
    wrench, needed = rooted_inverse_dynamics(rooted, state.position, state.velocity, state.acceleration, root)
    friction, usable = torque - needed, seen_joints(robot, mode.feet, settings)
    if robot.base == "fixed":
        return without_loop_forces(robot, state.position, friction), usable, np.nan
    if measured:
        standing_on = {foot: measured[foot] for foot in mode.feet}
        friction += effect_on_joints(robot, state.position, standing_on, _root_foot(robot, mode), wrench)
    friction = without_loop_forces(robot, state.position, friction)
    if not leaves_open(robot, mode.feet):
        return friction, usable, wrench
    if measured:
        return friction, usable, np.nan
    friction[:, robot.standing(mode.feet)] = np.nan
    return friction, usable, np.nan

"""Friction torque in each contact mode (5.13).

    R = tau - inverse_dynamics(q, v, a)

On one standing surface, the tree is rooted at that foot and all joints are known. They are also known while the robot
hangs, and in flight, because the base falls freely. On several surfaces, and on point feet, the individual foot
wrenches are unknown, so only swinging limbs are known. If wrenches are measured, they determine the joints between base
and feet (docs/other-methods.md).
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from stribeck.base.typing import Array, BoolArray, IntArray
from stribeck.contact import SupportPhase
from stribeck.differentiation.averaging import Nodes
from stribeck.dynamics.loops import without_loop_forces
from stribeck.dynamics.root_motion import base_root, flying_root, hung_root, standing_root
from stribeck.dynamics.rooted import RootMotion, rooted_inverse_dynamics
from stribeck.dynamics.state import State
from stribeck.friction_torque.foot_wrenches import effect_on_joints
from stribeck.robot import Robot
from stribeck.robot.rooting import RootedModel
from stribeck.settings import Settings


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


class StandingFeet(NamedTuple):
    """Standing feet, and the foot that has stood longest and is therefore at rest."""

    feet: tuple[str, ...]
    rested: str


def contact_modes(phases: tuple[SupportPhase, ...]) -> tuple[StandingFeet, ...]:
    """Find the contact mode of each phase."""
    modes: list[StandingFeet] = []
    for k, phase in enumerate(phases):
        modes.append(next_mode(modes[-1] if k and phases[k - 1].stop == phase.start else None, phase.feet))
    return tuple(modes)


def next_mode(before: StandingFeet | None, feet: tuple[str, ...]) -> StandingFeet:
    """Find the contact mode of standing feet, given the previous mode."""
    stayed = [foot for foot in feet if before and foot in before.feet]
    return StandingFeet(feet, before.rested if before and before.rested in stayed else next(iter([*stayed, *feet]), ""))


def contact_root(robot: Robot, mode: StandingFeet, state: State) -> tuple[RootedModel, RootMotion | None]:
    """Select the tree of a contact mode, rooted at the foot that has stood longest, and compute its root motion.

    A robot on point feet or in flight keeps its own root. The root motion of a fixed base is None.
    """
    if robot.base == "fixed":
        return robot.tree, None
    if robot.carried(mode.feet):
        return robot.tree, hung_root(robot, state)
    if not mode.feet:
        return robot.tree, flying_root(robot.tree, state)
    surface = root_foot(robot, mode)
    if surface is None:
        return robot.tree, base_root(robot, mode.feet, state)
    return robot.rooted_at(surface), standing_root(robot, surface, state)


def root_foot(robot: Robot, mode: StandingFeet) -> str | None:
    """Select the standing surface that has stood longest; None if only points stand."""
    by_rest = sorted(mode.feet, key=lambda foot: foot != mode.rested)
    return next((foot for foot in by_rest if robot.contacts[foot].kind == "surface"), None)


def seen_joints(robot: Robot, feet: tuple[str, ...], settings: Settings) -> BoolArray:
    """Find the joints whose friction torque a fit may use while these feet stand, shape (n,)."""
    if robot.base == "fixed" or takes_wrenches(robot, settings):
        return np.ones(len(robot.joint_names), dtype=bool)
    if leaves_open(robot, feet):
        return ~robot.standing(feet)
    return ~robot.standing(feet) | bool(settings.standing_legs)


def swinging_joints(robot: Robot, feet: tuple[str, ...]) -> BoolArray:
    """Find the joints of legs whose feet do not stand, shape (n,); none for a fixed base."""
    legs = robot.standing(tuple(robot.contacts))
    return legs & ~robot.standing(tuple(foot for foot in feet if foot in robot.contacts))


def takes_wrenches(robot: Robot, settings: Settings) -> bool:
    """Return whether the settings use measured wrenches for standing legs."""
    return robot.base == "floating" and settings.standing_legs == "measured"


def leaves_open(robot: Robot, feet: tuple[str, ...]) -> bool:
    """Return whether joints of standing limbs are unknown: on several feet or on points, unless the base is held."""
    return bool(robot.standing(feet).any()) and (len(feet) > 1 or robot.contacts[feet[0]].kind != "surface")


def by_inverse_dynamics(
    robot: Robot,
    modes: tuple[StandingFeet, ...],
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
        friction[rows], usable[rows], wrench[rows] = _explain(robot, modes[k], part, torque[rows], wrenches, settings)
    return Explained(friction, usable, wrench, state.velocity, state.acceleration, torque)


def _explain(
    robot: Robot, mode: StandingFeet, state: State, torque: Array, measured: Mapping[str, Array], settings: Settings
) -> tuple[Array, BoolArray, Array | float]:
    """Compute friction torque (N, n), joints that a fit may use (n,), and the wrench on a single foot (N, 6) or NaN."""
    rooted, root = contact_root(robot, mode, state)
    wrench, needed = rooted_inverse_dynamics(rooted, state.position, state.velocity, state.acceleration, root)
    friction, usable = torque - needed, seen_joints(robot, mode.feet, settings)
    if robot.base == "fixed":
        return without_loop_forces(robot, state.position, friction), usable, np.nan
    if measured and mode.feet:
        standing_on = {foot: measured[foot] for foot in mode.feet}
        friction += effect_on_joints(robot, state.position, standing_on, root_foot(robot, mode), wrench)
    friction = without_loop_forces(robot, state.position, friction)
    if not leaves_open(robot, mode.feet):
        return friction, usable, wrench
    if measured:
        return friction, usable, np.nan
    friction[:, robot.standing(mode.feet)] = np.nan
    return friction, usable, np.nan

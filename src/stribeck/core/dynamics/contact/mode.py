"""Contact modes: the standing feet, the tree that suits them, and the joints that they leave unknown (5.13).

On one standing surface, the tree is rooted at that foot and all joints are known. They are also known while the robot
hangs, and in flight, because the base falls freely. On several surfaces, and on point feet, the individual foot
wrenches are unknown, so only swinging limbs are known. If wrenches are measured, they determine the joints between base
and feet (docs/other-methods.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from stribeck.core.base.typing import BoolArray
from stribeck.core.dynamics.contact.phases import SupportPhase
from stribeck.core.dynamics.root_motion import base_root, flying_root, hung_root, standing_root
from stribeck.core.dynamics.rooted import RootMotion
from stribeck.core.dynamics.state import State
from stribeck.core.robot import Robot
from stribeck.core.robot.rooting import RootedModel
from stribeck.core.settings import Settings


@dataclass(frozen=True)
class ContactMode:
    """Standing feet of a robot.

    Attributes
    ----------
    robot, feet
        The robot and its standing feet.
    rested
        Foot that has stood longest, and is therefore at rest; empty if unknown.
    rocks
        Whether the equations treat the base as carried in an unknown way although feet stand.
    gyroscope
        Whether a gyroscope measures how a carried base turns.
    """

    robot: Robot = field(compare=False, repr=False)
    feet: tuple[str, ...]
    rested: str = ""
    rocks: bool = False
    gyroscope: bool = False

    def followed_by(self, feet: tuple[str, ...]) -> ContactMode:
        """Find the contact mode after this one."""
        if feet == self.feet:
            return self
        stayed = [foot for foot in feet if foot in self.feet]
        rested = self.rested if self.rested in stayed else next(iter([*stayed, *feet]), "")
        return ContactMode(self.robot, feet, rested)

    @cached_property
    def hung(self) -> bool:
        """Whether the base is carried in an unknown way, or the equations treat it as such."""
        return self.rocks or self.robot.carried(self.feet)

    @property
    def flies(self) -> bool:
        """Whether nothing stands, so that the root's acceleration follows from the joints'."""
        return self.robot.base == "floating" and not self.feet

    @cached_property
    def surface(self) -> str | None:
        """Standing surface that has stood longest; None for a fixed base, if only points stand, or if it hangs."""
        if self.robot.base == "fixed" or self.hung:
            return None
        by_rest = sorted(self.feet, key=lambda foot: foot != self.rested)
        return next((foot for foot in by_rest if self.robot.contacts[foot].kind == "surface"), None)

    @cached_property
    def rooted(self) -> RootedModel:
        """Tree, rooted at the standing surface; with its own root without one, and if the base hangs or is fixed."""
        return self.robot.rooted_at(self.surface) if self.surface else self.robot.tree

    def root(self, state: State) -> RootMotion | None:
        """Compute how the root moves; None for a fixed base."""
        if self.robot.base == "fixed":
            return None
        if self.hung:
            return hung_root(self.robot, state, self.gyroscope)
        if self.flies:
            return flying_root(self.robot.tree, state)
        surface = self.surface
        return standing_root(self.robot, surface, state) if surface else base_root(self.robot, self.feet, state)

    @cached_property
    def standing(self) -> BoolArray:
        """Joints between the base and a standing foot, shape (n,)."""
        return self.robot.standing(self.feet)

    @cached_property
    def leaves_open(self) -> bool:
        """Whether joints of standing limbs are unknown: on several feet or on points, unless the base is held."""
        some = bool(self.standing.any())
        return some and (len(self.feet) > 1 or self.robot.contacts[self.feet[0]].kind != "surface")

    @cached_property
    def swinging(self) -> BoolArray:
        """Joints of legs whose feet do not stand, shape (n,); none for a fixed base."""
        return self.robot.standing(tuple(self.robot.contacts)) & ~self.standing

    def seen(self, settings: Settings) -> BoolArray:
        """Find the joints whose friction torque a fit may use, shape (n,)."""
        if self.robot.base == "fixed" or takes_wrenches(self.robot, settings):
            return np.ones(len(self.robot.joint_names), dtype=bool)
        return ~self.standing | (bool(settings.standing_legs) and not self.leaves_open)


def contact_modes(robot: Robot, phases: Sequence[SupportPhase]) -> tuple[ContactMode, ...]:
    """Find the contact mode of each phase."""
    modes: list[ContactMode] = []
    for k, phase in enumerate(phases):
        before = modes[-1] if k and phases[k - 1].stop == phase.start else ContactMode(robot, ())
        modes.append(before.followed_by(phase.feet))
    return tuple(modes)


def takes_wrenches(robot: Robot, settings: Settings) -> bool:
    """Return whether the settings use measured wrenches for standing legs."""
    return robot.base == "floating" and settings.standing_legs == "measured"

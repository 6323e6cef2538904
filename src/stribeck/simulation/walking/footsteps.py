"""Footsteps: sequences of steps straight, sideways, turning or in place; and pushes during a walk."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from pydantic import Field

from stribeck.core.base.checked_table import Finite, NonNegative, Positive, Table
from stribeck.core.base.typing import Array
from stribeck.simulation.robots.sole import Vector

FEET = 2


class Steps(Table):
    """`[[walk]]`: steps of one kind; the last step brings the feet side by side.

    Attributes
    ----------
    count
        Number of steps, 0 or at least 2.
    forward
        Distance from one footprint to the next [m].
    sideways
        Sideways distance of every second step [m], positive to the left; steps in between close the feet.
    turn
        Rotation of each step [rad], positive to the left.
    width
        Distance between the feet side by side [m]; the initial distance if None.
    height
        Height of the swing foot [m].
    single_support, double_support
        Durations of each step's phases [s].
    stand
        Duration of standing before the first step [s].
    """

    count: int = Field(ge=0, le=10_000)
    forward: Finite = 0.0
    sideways: Finite = 0.0
    turn: Finite = 0.0
    width: Positive | None = None
    height: Positive = 0.05
    single_support: Positive = 0.8
    double_support: Positive = 0.2
    stand: NonNegative = 0.5


class Push(Table):
    """`[[push]]`: a temporary force on the base.

    Attributes
    ----------
    start, duration
        Start and duration [s].
    force
        Force in the world [N].
    """

    start: NonNegative
    duration: Positive
    force: Vector


@dataclass(frozen=True)
class Footprint:
    """Pose of a foot on the ground: x, y [m] and heading [rad]."""

    x: float
    y: float
    yaw: float

    @property
    def place(self) -> Array:
        """Position x and y [m], shape (2,)."""
        return np.array([self.x, self.y])


@dataclass(frozen=True)
class Step:
    """Motion of one foot to its next footprint, while the other foot stands."""

    foot: int
    start: Footprint
    goal: Footprint
    stance: Footprint
    kind: Steps


def plan_steps(walk: Sequence[Steps], feet: tuple[Footprint, Footprint]) -> list[Step]:
    """Build the steps of a walk.

    Parameters
    ----------
    walk
        Groups of steps in their order.
    feet
        Initial footprints of feet 0 and 1, in the robot's order of contacts.
    """
    centre, sides = _centre_of(feet)
    now, steps = list(feet), []
    for kind in walk:
        foot = _first_foot(kind, sides)
        for k in range(kind.count):
            if k < kind.count - 1:
                sideways = kind.sideways if k % 2 == 0 else 0.0
                centre = _place(centre, Footprint(kind.forward, sideways, kind.turn))
            goal = _place(centre, _at_width(sides[foot], kind.width))
            steps.append(Step(foot, now[foot], goal, now[1 - foot], kind))
            now[foot] = goal
            foot = 1 - foot
    return steps


def _centre_of(feet: tuple[Footprint, Footprint]) -> tuple[Footprint, tuple[Footprint, Footprint]]:
    """Find the middle of two feet, and each foot's pose relative to it."""
    yaw = (feet[0].yaw + feet[1].yaw) / 2
    x, y = (feet[0].place + feet[1].place) / 2
    cosine, sine = np.cos(yaw), np.sin(yaw)
    turn = np.array([[cosine, sine], [-sine, cosine]])
    seen = [(turn @ (foot.place - (x, y)), foot.yaw - yaw) for foot in feet]
    sides = [Footprint(float(place[0]), float(place[1]), heading) for place, heading in seen]
    return Footprint(float(x), float(y), yaw), (sides[0], sides[1])


def _first_foot(kind: Steps, sides: tuple[Footprint, Footprint]) -> int:
    """Find the foot that steps first, on the side that the robot moves or turns to."""
    left = 0 if sides[0].y > sides[1].y else 1
    towards = kind.sideways or kind.turn
    return left if towards >= 0 else 1 - left


def _at_width(side: Footprint, width: float | None) -> Footprint:
    """Compute a foot's pose relative to the middle of the feet for this distance between them [m]."""
    return side if width is None else replace(side, y=float(np.copysign(width / 2, side.y)))


def _place(centre: Footprint, seen: Footprint) -> Footprint:
    """Convert a pose relative to `centre` to a pose on the ground."""
    cosine, sine = np.cos(centre.yaw), np.sin(centre.yaw)
    return Footprint(
        float(centre.x + cosine * seen.x - sine * seen.y),
        float(centre.y + sine * seen.x + cosine * seen.y),
        centre.yaw + seen.yaw,
    )

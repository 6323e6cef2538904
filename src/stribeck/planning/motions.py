"""Motions that may make a joint's friction known: one joint at a time, all others at rest."""

from dataclasses import dataclass

import numpy as np

from stribeck.dynamics.state import State
from stribeck.identification.judgement.excitation import MIN_REVERSALS, MIN_SPEED
from stribeck.result import JointResult
from stribeck.typing import Array

PERIOD = 0.005
"""Between samples of a motion [s]."""

DURATION = 30.0
"""Of a motion that is compared with others [s]."""

FASTEST = 1.0
"""Frequency of a swing that no joint exceeds [Hz]."""

TURNS = 1.5 * MIN_REVERSALS
"""Reversals that a motion has at least [1]."""


@dataclass(frozen=True, kw_only=True)
class Reach:
    """How a joint may move: between two positions [rad], [m], up to a speed [rad/s], [m/s]."""

    low: float
    high: float
    speed: float

    @property
    def middle(self) -> float:
        """Of the positions."""
        return (self.low + self.high) / 2

    @property
    def amplitude(self) -> float:
        """Largest distance from the middle."""
        return (self.high - self.low) / 2


@dataclass(frozen=True, kw_only=True)
class Motion:
    """A motion of one joint that swings between speeds [rad/s], [m/s], so often a log of `DURATION`."""

    name: str
    slowest: float
    fastest: float
    reversals: int
    position: Array
    velocity: Array
    acceleration: Array

    def state(self, column: int, rest: Array) -> State:
        """Return the motion of all joints, the others at rest, shape (n,)."""
        position = np.tile(rest, (len(self.position), 1))
        velocity, acceleration = np.zeros((2, *position.shape))
        position[:, column], velocity[:, column], acceleration[:, column] = (
            self.position,
            self.velocity,
            self.acceleration,
        )
        return State(position, velocity, acceleration)


def slow_speed(joint: JointResult, prismatic: bool, fastest: float) -> float:
    """Return a speed at which friction of slow motion shows: half the Stribeck velocity, or next to the least."""
    found = joint.parameters.get("stribeck_velocity")
    wanted = found.value / 2 if found else 2 * MIN_SPEED[prismatic]
    return float(np.clip(wanted, MIN_SPEED[prismatic], fastest / 2))


def motions_of(joint: JointResult, prismatic: bool, reach: Reach) -> list[Motion]:
    """Return slow and fast sweeps, one from slow to fast, and one that turns round often."""
    fast = min(reach.speed, 2 * np.pi * FASTEST * reach.amplitude)
    slow = slow_speed(joint, prismatic, fast)
    often = min(fast, np.sqrt(slow * fast))
    return [
        _sweep("slow", slow, slow, reach, TURNS),
        _sweep("fast", fast, fast, reach, TURNS),
        _sweep("slow to fast", slow, fast, reach, TURNS),
        _sweep("turning often", often, often, reach, 2 * DURATION),
    ]


def _sweep(name: str, slow: float, fast: float, reach: Reach, turns: float) -> Motion:
    """Return a swing about the middle whose top speed grows from slow to fast, with so many reversals or more."""
    time = np.arange(0, DURATION, PERIOD)
    speed = slow * (fast / slow) ** (time / DURATION)
    amplitude = min(reach.amplitude, float(speed.sum()) * PERIOD / (np.pi * turns))
    angle = np.cumsum(speed) * PERIOD / amplitude
    velocity = speed * np.sin(angle)
    return Motion(
        name=name,
        slowest=slow,
        fastest=fast,
        reversals=int(angle[-1] / np.pi),
        position=reach.middle - amplitude * np.cos(angle),
        velocity=velocity,
        acceleration=np.gradient(velocity, PERIOD),
    )

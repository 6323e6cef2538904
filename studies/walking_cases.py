"""Cases of the walking study: three humanoids and their walks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from stribeck import Robot
from stribeck.simulation.robots.sole import Sole
from stribeck.simulation.run import POSTURES
from stribeck.simulation.walking.footsteps import Push, Steps
from studies.changes import EXAMPLES, packaged, robot_from

SIDES = ("left", "right")
JOINTS = {"hip_roll": 1.0, "hip_pitch": 0.75, "hip_yaw": 0.75, "knee": 1.0, "ankle_roll": 0.1, "ankle_pitch": 0.2}
"""Coulomb friction and offset [N m], Table 6.2 of the paper."""
PUSH, PUSHED_FOR = 200.0, 0.1
"""Force [N] and duration [s] of a push that the standing foot cannot balance without a step."""


@dataclass(frozen=True, kw_only=True)
class Walker:
    """Text of the robot file, Coulomb friction and offset [N m] by joint pattern, posture [rad], soles of meshes."""

    robot_file: str
    friction: Mapping[str, float]
    posture: Mapping[str, float]
    soles: Mapping[str, Sole] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Case:
    """One walk and its difficulties; each seed is a separate run."""

    walk: Sequence[Steps]
    robot: str = "TORO-like"
    sensors: str = "realistic"
    seeds: Sequence[int] = (0,)
    model_error: float = 0.0
    pushes: Sequence[Push] = ()


def _example(name: str, model: str, frame: str) -> str:
    feet = "".join(f'[contacts.{side}]\nframe = "{frame.format(side)}"\nkind = "surface"\n' for side in SIDES)
    return f'[robot]\nname = "{name}"\nmodel = "{EXAMPLES}/{model}"\n{feet}'


def _posture(names: str, *values: tuple[str, float]) -> dict[str, float]:
    return {names.format(side, joint): q for side in SIDES for joint, q in values}


WALKERS = {
    "TORO-like": Walker(
        robot_file=packaged("toro.toml", "toro.xml"),
        friction={f"*_{joint}": level for joint, level in JOINTS.items()},
        posture=POSTURES["toro"],
    ),
    "TALOS": Walker(
        robot_file=_example("TALOS", "talos_data/robots/talos_reduced.urdf", "{}_sole_link"),
        friction={"leg_*": 0.5},
        posture=_posture("leg_{}_{}_joint", ("3", -0.5), ("4", 1.0), ("5", -0.5)),
        soles={side: Sole(half_length=0.1, half_width=0.06) for side in SIDES},
    ),
    "G1": Walker(
        robot_file=_example("G1", "g1_description/urdf/g1_29dof_rev_1_0.urdf", "{}_ankle_roll_link"),
        friction={"*_hip_*": 0.2, "*_knee_*": 0.2, "*_ankle_*": 0.2},
        posture=_posture("{}_{}_joint", ("hip_roll", 0.0), ("hip_pitch", -0.4), ("knee", 0.8), ("ankle_pitch", -0.4)),
    ),
}


def robot_of(name: str) -> Robot:
    """Read a walker's robot."""
    return robot_from(WALKERS[name].robot_file)


def _there_and_back(sideways: float, **kind: Any) -> list[Steps]:
    return [Steps(sideways=way, **kind) for way in (sideways, -sideways)]


def _usual(single_support: float = 0.8) -> list[Steps]:
    """Describe 20 steps straight and 10 to each side."""
    straight = Steps(count=20, forward=0.3, single_support=single_support)
    return [straight, *_there_and_back(0.25, count=10, width=0.16, single_support=single_support)]


def _all_ways(forward: float, sideways: float, width: float | None = None) -> list[Steps]:
    """Describe steps straight, to each side, and turning to each side."""
    turning = [Steps(count=6, forward=forward / 2, turn=way, width=width) for way in (0.2, -0.2)]
    straight = Steps(count=10, forward=forward, width=width)
    return [straight, *_there_and_back(sideways, count=6, width=width), *turning]


def _pushed(x: float, y: float) -> Case:
    """Describe a straight walk with pushes early in its fourth and seventh swing, one per foot."""
    pushes = [Push(start=start, duration=PUSHED_FOR, force=[PUSH * x, PUSH * y, 0.0]) for start in (4.0, 7.0)]
    return Case(walk=[Steps(count=10, forward=0.3)], pushes=pushes)


CASES = {
    "100 steps of 0.3 m, then 24 of 0.25 m to each side, ten seeds": Case(
        walk=[Steps(count=100, forward=0.3), *_there_and_back(0.25, count=24, width=0.16)], seeds=range(10)
    ),
    "20 steps and 10 to each side, single support 0.6 s": Case(walk=_usual(0.6)),
    "the same, 0.8 s": Case(walk=_usual(0.8)),
    "the same, 1.0 s": Case(walk=_usual(1.0)),
    "the controller's masses 5 % off, three seeds": Case(walk=_usual(), model_error=0.05, seeds=range(3)),
    "`harsh` sensors, three seeds": Case(walk=_usual(), sensors="harsh", seeds=range(3)),
    "`harsh` sensors and masses 5 % off": Case(walk=_usual(), sensors="harsh", model_error=0.05),
    **{
        f"pushed {way} by {PUSH:.0f} N for {PUSHED_FOR} s, twice": _pushed(x, y)
        for way, x, y in (("ahead", 1, 0), ("back", -1, 0), ("left", 0, 1), ("right", 0, -1))
    },
    "8 steps turning left by 0.2 rad each, 8 to the right": Case(
        walk=[Steps(count=8, forward=0.2, turn=way) for way in (0.2, -0.2)]
    ),
    "in place, turning by 0.3 rad, in place, standing between": Case(
        walk=[Steps(count=6), Steps(count=4, turn=0.3, stand=2.0), Steps(count=6, stand=2.0)]
    ),
    "feet lifted by 0.03 m and by 0.10 m": Case(walk=[Steps(count=6, forward=0.3, height=z) for z in (0.03, 0.1)]),
    "double support 0.1 s and 0.4 s": Case(walk=[Steps(count=6, forward=0.3, double_support=t) for t in (0.1, 0.4)]),
    "TALOS: straight 0.3 m, sideways 0.2 m, turning": Case(walk=_all_ways(0.3, 0.2), robot="TALOS"),
    "G1: straight 0.2 m, sideways 0.1 m, turning": Case(walk=_all_ways(0.2, 0.1, width=0.16), robot="G1"),
}

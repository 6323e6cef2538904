"""What friction compensation does for humanoids that walk, with the friction that their own noisy walks show.

    python -m studies.walking_compensation --save studies/walking_compensation.json

Each robot walks ten steps on its estimated state, with friction in all leg joints as in `studies.walking`; the friction
is identified from that walk's log, by default, exported as a C header, compiled, and compensated in the loop at 500 Hz.
Then friction is made larger until the robot falls: without compensation, with the friction identified at that size, and
with the true one. Runs that the file holds already are not repeated.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypedDict

from stribeck import Robot, identify
from stribeck.errors import StribeckError
from stribeck.friction import Stribeck
from stribeck.outputs import whole_or_not_at_all
from stribeck.result import Result
from stribeck.typing import Array
from stribeck_simulation.friction import FrictionTruth, LawFriction
from stribeck_simulation.friction.parameters import Parameters
from stribeck_simulation.mujoco.model import compile_body
from stribeck_simulation.scenario import by_joint
from stribeck_simulation.sensors.profiles import get_profile
from stribeck_simulation.walking.footsteps import Steps
from stribeck_simulation.walking.simulate import Conditions, FellError, Walk, simulate_walk
from studies.compensation import compiled
from studies.walking import COMMON, how_it_went
from studies.walking_cases import WALKERS

ROBOTS = {"TORO-like": 0.3, "TALOS": 0.3, "G1": 0.2}
"""Robot -> length of its steps [m]."""

FACTORS = (1.0, 4.0, 8.0, 12.0)
"""Friction over that of `WALKERS` [1]."""

KINDS = ("none", "identified", "true", "half as much again", "wrong sign")
PERIOD = 2e-3
"""Of the controller [s]."""


class Run(TypedDict):
    """What one walk came to; nothing but `fell` if it fell."""

    fell: bool
    tilt: float  # largest of the base [deg]
    slip: float  # largest of a standing foot [mm]
    error: float  # largest of the DCM [mm]


def robot_of(name: str, folder: Path) -> Robot:
    """Return a robot, whose file the simulator reads too."""
    path = folder / f"{name}.toml"
    path.write_text(WALKERS[name].robot_file, encoding="utf-8")
    return Robot.from_file(path)


def truth_of(name: str, robot: Robot, factor: float) -> Parameters:
    """Return the friction of every leg joint."""
    levels = {
        pattern: {"coulomb": factor * level, "offset": level} for pattern, level in WALKERS[name].friction.items()
    }
    joints = tuple(robot.joint_names[column] for column in robot.tree.columns)
    return by_joint(levels, COMMON | {"viscous": factor * COMMON["viscous"]}, joints, "friction")


def walk_with(name: str, robot: Robot, factor: float, compensate: Callable[[Array], Array] | None) -> Walk:
    """Return a walk of ten steps."""
    joints = tuple(robot.joint_names[column] for column in robot.tree.columns)
    friction = LawFriction(joints, Stribeck(), truth_of(name, robot, factor))
    conditions = Conditions(
        friction=FrictionTruth(len(joints), [friction]),
        profile=get_profile("realistic"),
        soles=WALKERS[name].soles,
        compensation=compensate,
    )
    steps = [Steps(count=10, forward=ROBOTS[name], width=0.16 if name == "G1" else None)]
    return simulate_walk(robot, steps, WALKERS[name].posture, conditions)


def run(name: str, robot: Robot, factor: float, result: Result | None, sign: float = 1.0) -> Run:
    """Let a robot walk with the compensation that a result says, or none."""
    try:
        walk = walk_with(name, robot, factor, None if result is None else in_the_tree(result, robot, sign))
    except StribeckError:
        return Run(fell=True, tilt=0.0, slip=0.0, error=0.0)
    tilt, slip, error = how_it_went(robot, walk, compile_body(robot, WALKERS[name].soles).soles)
    return Run(fell=False, tilt=round(tilt, 2), slip=round(slip, 1), error=round(error, 1))


def in_the_tree(result: Result, robot: Robot, sign: float) -> Callable[[Array], Array]:
    """Return the compiled compensation by velocities in the tree's order; nothing but these is known to a balancer."""
    own, columns = compiled(result, robot, sign, PERIOD), robot.tree.columns

    def compensate(velocity: Array) -> Array:
        measured = velocity.copy()
        measured[columns] = velocity
        return own(measured, measured)[columns]

    return compensate


def identified(name: str, robot: Robot, factor: float) -> Result | None:
    """Return what the robot's own walk shows; None if it falls without compensation."""
    try:
        return identify(walk_with(name, robot, factor, None).log, robot)
    except FellError:
        return None


def with_truth(result: Result, truth: Parameters, factor: float) -> Result:
    """Return a result with the true friction, times a factor."""
    joints = {}
    some = next(p for joint in result.joints.values() for p in joint.parameters.values())
    for name, values in truth.items():
        scaled = {key: value * (factor if key in ("coulomb", "viscous") else 1.0) for key, value in values.items()}
        parameters = {key: replace(some, value=value) for key, value in scaled.items()}
        joints[name] = replace(result.joints[name], parameters=parameters, verdict="identified", law="stribeck")
    return replace(result, law="stribeck", joints=joints)


def measure(folder: Path, kept: dict[str, Run], save: Callable[[dict[str, Run]], None]) -> dict[str, Run]:
    """Return all runs by robot, factor and kind, those that are kept among them."""
    for name in ROBOTS:
        robot, before = robot_of(name, folder), None
        for factor in FACTORS:
            kinds = KINDS if factor == 1.0 else KINDS[:3]
            labels = {kind: f"{name}, {factor:g} times, {kind}" for kind in kinds}
            if all(label in kept for label in labels.values()):
                continue
            result = identified(name, robot, factor) or before  # that of less friction, if it falls without any
            before = result
            if result is None:
                break
            truth = truth_of(name, robot, factor)
            made: dict[str, tuple[Result | None, float]] = {
                "none": (None, 1.0),
                "identified": (result, 1.0),
                "true": (with_truth(result, truth, 1.0), 1.0),
                "half as much again": (with_truth(result, truth, 1.5), 1.0),
                "wrong sign": (result, -1.0),
            }
            for kind, label in labels.items():
                kept[label] = run(name, robot, factor, *made[kind])
                print(f"{label}: {kept[label]}", flush=True)
                save(kept)
    return kept


def table(runs: dict[str, Run]) -> str:
    """Return the table of the docs: the largest error of the DCM [mm], or that the robot fell."""
    lines = [f"| robot | friction | {' | '.join(KINDS)} |", "|---|---|" + "---|" * len(KINDS)]
    for name in ROBOTS:
        for factor in FACTORS:
            row = [runs.get(f"{name}, {factor:g} times, {kind}") for kind in KINDS]
            cells = ["" if own is None else "falls" if own["fell"] else f"{own['error']:.0f}" for own in row]
            if any(cells):
                lines.append(f"| {name} | {factor:g} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> None:
    """Let robots walk, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--save", type=Path, metavar="FILE", help="keep the runs as JSON, and go on from there")
    options = parser.parse_args()

    def save(runs: dict[str, Run]) -> None:
        if options.save:
            with whole_or_not_at_all(options.save) as temporary:
                temporary.write_text(json.dumps(runs, indent=1) + "\n", encoding="utf-8")

    kept = json.loads(options.save.read_text()) if options.save and options.save.exists() else {}
    with tempfile.TemporaryDirectory() as folder:
        print(table(measure(Path(folder), kept, save)))


if __name__ == "__main__":
    main()

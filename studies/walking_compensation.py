"""What friction compensation does for humanoids that walk, with the friction that their own noisy walks show.

    python -m studies.walking_compensation --save studies/walking_compensation.json

Each robot walks six steps on its estimated state, with friction in all leg joints as in `studies.walking`; the friction
is identified from that walk's log, by default, exported as a C header, compiled, and compensated in the loop at 500 Hz,
by the velocities that the plan wants. Then friction is made larger until the robot falls: without compensation, with
the friction identified at that size, and with the true one. Where it falls without compensation, the walk that friction
is identified from is compensated by what was identified at the size before. Overestimated friction, the wrong sign and
measured velocities are tried at the usual friction, and in standing too. Robots that the file holds already are not
repeated.
"""

import argparse
import json
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Literal, NamedTuple, TypedDict

import numpy as np
from numpy.typing import NDArray

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
from stribeck_simulation.walking.plan import BOTH
from stribeck_simulation.walking.simulate import HELD, Conditions, Walk, simulate_walk
from studies.compensation import SETTINGS, compiled
from studies.walking import COMMON, how_it_went
from studies.walking_cases import WALKERS

STEPS = {
    "TORO-like": Steps(count=6, forward=0.2),
    "TALOS": Steps(count=6, forward=0.3),
    "G1": Steps(count=6, forward=0.2, width=0.16),
}
"""All with the knees bent: the TORO-like robot's rear knee snaps through at steps of 0.3 m, which friction brakes."""

FACTORS = (1.0, 2.0, 4.0, 8.0, 16.0)
"""Friction over that of `WALKERS` [1]."""

KINDS = ("none", "identified", "true", "measured velocity", "half as much again", "wrong sign")
"""Of compensation; the last three with the usual friction alone."""

Measure = Literal["error", "com", "foot", "torque", "rate"]
MEASURES: dict[Measure, str] = {
    "error": "DCM [mm]",
    "com": "centre of mass [mm]",
    "foot": "swing foot [mm]",
    "torque": "torque [N m]",
    "rate": "its rate [N m/s]",
}
"""What the tables show of a walk."""

PERIOD = 2e-3
"""Of the controller [s]."""

WALKING_SETTINGS = SETTINGS | {"near": 2.0}
"""The desired velocity counts at nearly all speeds: that was best in walks sideways, which are not judged here."""

STANDING, SETTLED = Steps(count=0, stand=4.0), 3.0
"""What is done at rest, and how long it takes to settle [s]."""


class Run(TypedDict):
    """What one walk came to; nothing but `fell` if it fell."""

    fell: bool
    tilt: float  # largest of the base [deg]
    slip: float  # largest of a standing foot [mm]
    error: float  # largest of the DCM [mm]
    com: float  # of the centre of mass, root mean square [mm]
    foot: float  # of the swing foot, root mean square [mm]
    torque: float  # of the legs, root mean square [N m]
    rate: float  # of its change from one control period to the next, root mean square [N m/s]


class Found(TypedDict):
    """Of one robot: its walks by factor and kind; how far joints swing in standing, peak to peak [mrad], by kind."""

    walks: dict[str, dict[str, Run]]
    standing: dict[str, float | None]  # None if it fell


class Made(NamedTuple):
    """A compensation to try: a result, the sign it is added with, and whether measured velocities are all it has."""

    result: Result
    sign: float = 1.0
    measured: bool = False


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


def walk_with(name: str, robot: Robot, factor: float, made: Made | None, steps: Steps | None = None) -> Walk:
    """Return a walk."""
    joints = tuple(robot.joint_names[column] for column in robot.tree.columns)
    friction = LawFriction(joints, Stribeck(), truth_of(name, robot, factor))
    conditions = Conditions(
        friction=FrictionTruth(len(joints), [friction]),
        profile=get_profile("realistic"),
        soles=WALKERS[name].soles,
        compensation=None if made is None else in_the_tree(made, robot),
    )
    return simulate_walk(robot, [steps or STEPS[name]], WALKERS[name].posture, conditions)


def in_the_tree(made: Made, robot: Robot) -> Callable[[Array, Array], Array]:
    """Return the compiled compensation by measured and desired velocities in the tree's order."""
    own, columns = compiled(made.result, robot, made.sign, PERIOD, WALKING_SETTINGS), robot.tree.columns

    def compensate(measured: Array, desired: Array) -> Array:
        velocities = np.empty((2, len(columns)))
        velocities[:, columns] = measured, measured if made.measured else desired
        return own(*velocities)[columns]

    return compensate


def legs_of(name: str, robot: Robot) -> NDArray[np.int64]:
    """Return which joints of the log have friction."""
    return np.array([robot.joint_names.index(joint) for joint in truth_of(name, robot, 1.0)])


def run(name: str, robot: Robot, walk: Walk | None) -> Run:
    """Return what a walk came to, None being a fall."""
    if walk is None:
        return Run(fell=True, tilt=0.0, slip=0.0, error=0.0, com=0.0, foot=0.0, torque=0.0, rate=0.0)
    course = how_it_went(robot, walk, compile_body(robot, WALKERS[name].soles).soles)
    assert walk.swing_error is not None
    torque = walk.log.torque[::HELD, legs_of(name, robot)]
    return Run(
        fell=False,
        tilt=round(course.tilt, 2),
        slip=round(course.slip, 1),
        error=round(course.error, 1),
        com=round(course.com, 1),
        foot=round(1e3 * _rms(np.linalg.norm(walk.swing_error[walk.plan.swing != BOTH], axis=1)), 2),
        torque=round(_rms(torque), 2),
        rate=round(_rms(np.diff(torque, axis=0) / PERIOD)),
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def walked(name: str, robot: Robot, factor: float, made: Made | None) -> Walk | None:
    """Return a walk, None if the robot fell."""
    try:
        return walk_with(name, robot, factor, made)
    except StribeckError:
        return None


def swayed(name: str, robot: Robot, made: Made | None) -> float | None:
    """Return how far the joints swing in standing, that of them which swings most, peak to peak [mrad]."""
    try:
        walk = walk_with(name, robot, 1.0, made, STANDING)
    except StribeckError:
        return None
    settled = walk.log.position[walk.log.time > SETTLED][:, legs_of(name, robot)]
    return round(1e3 * float(np.ptp(settled, axis=0).max()), 2)


def with_truth(result: Result, truth: Parameters, factor: float) -> Result:
    """Return a result with the true friction, times a factor."""
    joints = {}
    some = next(p for joint in result.joints.values() for p in joint.parameters.values())
    for name, values in truth.items():
        scaled = {key: value * (factor if key in ("coulomb", "viscous") else 1.0) for key, value in values.items()}
        parameters = {key: replace(some, value=value) for key, value in scaled.items()}
        joints[name] = replace(result.joints[name], parameters=parameters, verdict="identified", law="stribeck")
    return replace(result, law="stribeck", joints=joints)


def measure(name: str, folder: Path) -> Found:
    """Return all that is tried with a robot."""
    robot = robot_of(name, folder)
    found, result = Found(walks={}, standing={}), None
    for factor in FACTORS:
        bare = walked(name, robot, factor, None)
        shown = bare or (None if result is None else walked(name, robot, factor, Made(result)))
        result = result if shown is None else identify(shown.log, robot)
        assert result is not None, f"{name} falls with its usual friction"
        truth = truth_of(name, robot, factor)
        made = {"identified": Made(result), "true": Made(with_truth(result, truth, 1.0))}
        walks = {"none": run(name, robot, bare)}
        if factor == 1.0:
            made["measured velocity"] = Made(result, measured=True)
            made["half as much again"] = Made(with_truth(result, truth, 1.5))
            made["wrong sign"] = Made(result, sign=-1.0)
            found["standing"] = {kind: swayed(name, robot, made.get(kind)) for kind in KINDS}
            print(f"{name}, standing: {found['standing']}", flush=True)
        walks |= {kind: run(name, robot, walked(name, robot, factor, own)) for kind, own in made.items()}
        found["walks"][f"{factor:g}"] = walks
        for kind, own_run in walks.items():
            print(f"{name}, {factor:g} times, {kind}: {own_run}", flush=True)
        if walks["true"]["fell"]:
            break
    return found


def gain(walks: dict[str, Run], measure: Measure) -> float:
    """Return how much of what the true friction gains over no compensation the identified one does [1]."""
    none, own, true = (walks[kind][measure] for kind in KINDS[:3])
    return (none - own) / (none - true)


def table(found: dict[str, Found]) -> str:
    """Return the table of the docs: every measure without compensation, with the identified and the true friction."""
    lines = [f"| robot | friction | {' | '.join(MEASURES.values())} |", "|---|---|" + "---|" * len(MEASURES)]
    for name, each in found.items():
        for factor, walks in each["walks"].items():
            cells = [" / ".join(_shown(walks[kind], measure) for kind in KINDS[:3]) for measure in MEASURES]
            lines.append(f"| {name} | {factor} | {' | '.join(cells)} |")
    return "\n".join(lines)


def table_of_wrong(found: dict[str, Found]) -> str:
    """Return the table of compensation done wrong, with the usual friction."""
    lines = [f"| robot | | {' | '.join(KINDS)} |", "|---|---|" + "---|" * len(KINDS)]
    for name, each in found.items():
        for measure in ("error", "foot"):
            cells = [_shown(each["walks"]["1"][kind], measure) for kind in KINDS]
            lines.append(f"| {name} | {MEASURES[measure]} | {' | '.join(cells)} |")
        swings = ["falls" if swing is None else f"{swing:.2g}" for swing in each["standing"].values()]
        lines.append(f"| {name} | at rest [mrad] | {' | '.join(swings)} |")
    return "\n".join(lines)


def _shown(own: Run, measure: Measure) -> str:
    value = own[measure]
    return "falls" if own["fell"] else f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def main() -> None:
    """Let robots walk, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--save", type=Path, metavar="FILE", help="keep what is found as JSON, and go on from there")
    options = parser.parse_args()
    found: dict[str, Found] = json.loads(options.save.read_text()) if options.save and options.save.exists() else {}
    with tempfile.TemporaryDirectory() as folder:
        for name in STEPS:
            if name not in found:
                found[name] = measure(name, Path(folder))
                if options.save:
                    with whole_or_not_at_all(options.save) as temporary:
                        temporary.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print(table(found), table_of_wrong(found), sep="\n\n")


if __name__ == "__main__":
    main()

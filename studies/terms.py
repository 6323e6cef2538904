"""Which terms the law auto finds where they are, and where they are not.

    python -m studies.terms --seeds 3 --save studies/terms.json

An arm of six joints moves at random; its torques are exact but for white noise (A: encoders 2e-5 rad, torque sensors
0.1 N m; B: 1e-4 rad, 0.3 N m). All joints have Coulomb and viscous friction and an offset, and one more term. Then a
humanoid like TORO walks in contact with `examples/scenarios/beyond-the-laws.toml`, 40 steps long, noise as in A.
"""

import argparse
import json
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from stribeck import Robot, Settings, identify
from stribeck.friction import get_law
from stribeck.log import RobotLog
from stribeck.result import JointResult, TermVerdict
from stribeck.typing import Array
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.robots.biped import MODELS
from stribeck_simulation.run import run_scenario
from stribeck_simulation.scenario import StepsTable, read_scenario
from stribeck_simulation.sensors.measure import with_noise

ROOT = Path(__file__).parents[1]
SCENARIO = ROOT / "examples" / "scenarios" / "beyond-the-laws.toml"
STEPS = StepsTable(count=40, forward=0.3)
BASE = {"viscous": 0.3, "coulomb": 1.2, "offset": 0.2}
NOISE = {"A": (2e-5, 0.1), "B": (1e-4, 0.3)}
DURATIONS = (10.0, 30.0)
TRUTHS: dict[str, tuple[set[str], dict[str, float]]] = {
    "no other": ({"viscous"}, BASE),
    "Stribeck effect, 0.3": (
        {"viscous", "stribeck"},
        BASE | {"stribeck_gain": 0.3, "stribeck_velocity": 0.15, "slope": 50.0},
    ),
    "asymmetry, 0.2": ({"viscous", "asymmetry"}, BASE | {"viscous_asymmetry": 0.2}),
    "load, 0.05": ({"viscous", "load"}, BASE | {"load": 0.05}),
    "drift, -0.2 N m": ({"viscous", "coulomb_drift"}, BASE | {"coulomb_drift": -0.2}),
}
"""What all joints have beside Coulomb friction and an offset: terms, and parameters."""


def arm_log(truth: dict[str, float], robot: Robot, duration: float, seed: int) -> RobotLog:
    """Return an exact log with friction of these parameters in all joints."""
    law = get_law("stribeck" if "slope" in truth else "coulomb-viscous")
    given = {parameter.name: truth[parameter.name] for parameter in law.parameters}
    log, known = exact_log(robot, law, dict.fromkeys(robot.joint_names, given), duration=duration, seed=seed)
    assert log.velocity is not None
    sign, load = np.sign(log.velocity), np.abs(log.torque - known.friction_torque)
    run: Array = (log.time / log.time[-1] - 0.5)[:, None]
    more = truth.get("load", 0.0) * load * sign + truth.get("coulomb_drift", 0.0) * run * sign
    more += truth.get("viscous_asymmetry", 0.0) * truth["viscous"] * np.abs(log.velocity)
    return replace(log, torque=log.torque + more)


def said(joint: JointResult) -> Iterable[tuple[str, TermVerdict]]:
    """Return what is said of each term."""
    return (joint.terms or {}).items()


def counted(joints: list[JointResult], terms: set[str], truth: dict[str, float]) -> dict[str, int]:
    """Return how many joints have all terms that they should, how many others, and their coverage."""
    kept = [{name for name, verdict in said(joint) if verdict.kept} for joint in joints]
    right = [joint for joint, own in zip(joints, kept, strict=True) if own == terms]
    held = [
        joint.parameters[name].interval_95[0] <= value <= joint.parameters[name].interval_95[1]
        for joint in right
        for name, value in truth.items()
    ]
    return {
        "joints": len(joints),
        "found": sum(own >= terms for own in kept),
        "other": sum(len(own - terms) for own in kept),
        "asked": sum(tried.gain is not None for joint in joints for name, tried in said(joint) if name not in terms),
        "held": sum(held),
        "intervals": len(held),
    }


def on_the_arm(seeds: int) -> dict[str, dict[str, int]]:
    """Return the counts by truth, log and noise; printed row by row."""
    robot, found = Robot.from_file(MODELS / "arm.toml"), {}
    settings = Settings(corrections="none")
    for title, (terms, truth) in TRUTHS.items():
        for duration in DURATIONS:
            for noise, (encoder, torque) in NOISE.items():
                joints: list[JointResult] = []
                for seed in range(seeds):
                    log = with_noise(arm_log(truth, robot, duration, seed), position=encoder, torque=torque, seed=seed)
                    joints += identify(log, robot, settings).joints.values()
                key = f"{title} | {duration:.0f} s | {noise}"
                found[key] = counted(joints, terms, truth)
                print(row_of(key, found[key]), flush=True)
    return found


def row_of(key: str, counts: dict[str, int]) -> str:
    """Return a row of the arm's table, in Markdown."""
    c, held = counts, f"{100 * counts['held'] / counts['intervals']:.0f} %" if counts["intervals"] else "–"
    return f"| {key} | {c['found']} of {c['joints']} | {c['other']} of {c['asked']} | {held} |"


def on_the_walk() -> dict[str, str]:
    """Return what is found of each leg joint of the walk."""
    scenario = read_scenario(SCENARIO).model_copy(update={"walk": [STEPS]})
    walk = run_scenario(scenario, SCENARIO.parent)
    encoder, torque = NOISE["A"]
    log = with_noise(walk.log, position=encoder, torque=torque, seed=1)
    result = identify(log, walk.robot, Settings(corrections="inertia"))
    legs = {name: joint for name, joint in result.joints.items() if name.startswith("right_") and _is_leg(name)}
    return {name: ", ".join(_shown(joint)) or "none" for name, joint in legs.items()}


def _is_leg(name: str) -> bool:
    return any(part in name for part in ("hip", "knee", "ankle"))


def _shown(joint: JointResult) -> list[str]:
    """Return the significant parameters, the offset left out."""
    return [
        f"{name} {found.value:.3g} ± {found.standard_error:.1g}{'' if found.unit == '1' else ' ' + found.unit}"
        for name, found in joint.parameters.items()
        if name != "offset" and not found.interval_95[0] <= 0 <= found.interval_95[1]
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=3, help="of motion and noise")
    parser.add_argument("--save", type=Path, help="write both tables as JSON")
    arguments = parser.parse_args()
    print("| truth | log | noise | found | others kept | coverage |")
    print("| --- | --- | --- | ---: | ---: | ---: |")
    arm = on_the_arm(arguments.seeds)
    print("\n| joint | found |\n| --- | --- |")
    walk = on_the_walk()
    for name, found in walk.items():
        print(f"| {name} | {found} |")
    if arguments.save:
        arguments.save.write_text(json.dumps({"arm": arm, "walk": walk}, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

"""How far identified friction is from the truth: the paper's method and the whole log side by side.

    python studies/accuracy.py --seeds 2 --save studies/accuracy.json

A humanoid like TORO walks about 45 s straight on, 45 s to the left and 45 s to the right, simulated in MuJoCo with the
friction of Table 6.2 of the paper in its legs, by sensors without errors. Then white noise is added (A: encoders
2e-5 rad, torque sensors 0.1 N m; B: 1e-4 rad, 0.3 N m), and the estimators are given a model whose principal moments
are off by up to 20 %, centres of mass by 5 to 10 mm and masses by up to 5 %, or torque gains off by 1 % and encoder
zeros by 2 mrad.

Of all leg joints: Coulomb friction's relative error; how far the friction curves are apart without the offset, root
mean square over the velocities that a joint moves with (its middle 98 %), relative to the Coulomb friction; the
offset's error; and how many of the 95 % intervals hold the truth.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pinocchio as pin

from stribeck import Robot, Settings, identify
from stribeck.friction import get_law
from stribeck.log import Array, RobotLog
from stribeck.result import Result
from stribeck.simulation.run import Simulated, run_scenario
from stribeck.simulation.scenario import Scenario, StepsTable, read_scenario
from stribeck.simulation.sensors import with_noise

ROOT = Path(__file__).parents[1]
SCENARIO = ROOT / "examples" / "scenarios" / "straight-and-sideways.toml"
WALKS = {
    "straight": StepsTable(count=44, forward=0.3),
    "left": StepsTable(count=44, sideways=0.25, width=0.16),
    "right": StepsTable(count=44, sideways=-0.25, width=0.16),
}
LAW = "stribeck"
INTERVALS = ("coulomb", "viscous", "offset")


@dataclass(frozen=True)
class Case:
    """What is wrong, beside nothing: noise [rad], [N m], the model, the sensors' calibration."""

    encoder: float = 0.0
    torque: float = 0.0
    wrong_model: bool = False
    wrong_calibration: bool = False


CASES = {
    "clean": Case(),
    "A": Case(2e-5, 0.1),
    "B": Case(1e-4, 0.3),
    "A, wrong model": Case(2e-5, 0.1, True),
    "B, wrong model": Case(1e-4, 0.3, True),
    "A, wrong model and calibration": Case(2e-5, 0.1, True, True),
}


def methods(case: Case) -> dict[str, Settings]:
    """Return the settings that are compared: the paper's method, and the whole log with what may be wrong set free."""
    found = {"curve-fit": Settings(law=LAW), "whole-log": Settings(law=LAW, method="whole-log", corrections="inertia")}
    if case.wrong_calibration:
        found["whole-log"] = Settings(law=LAW, method="whole-log", corrections="calibration")
    elif not case.wrong_model:
        found["whole-log, model trusted"] = Settings(law=LAW, method="whole-log", corrections="none")
    return found


def walk_scenario(name: str) -> Scenario:
    """Return the scenario of one walk."""
    return read_scenario(SCENARIO).model_copy(update={"walk": [WALKS[name]]})


def exact_walks() -> list[Simulated]:
    """Return the walks as sensors without errors see them."""
    return [run_scenario(walk_scenario(name)) for name in WALKS]


def wrong_model(robot: Robot, seed: int) -> Robot:
    """Return the robot as the estimators believe it to be; its bodies can exist."""
    generator = np.random.default_rng([seed, 1])
    model = pin.Model(robot.tree.model)
    for joint in range(1, model.njoints):
        body = model.inertias[joint]
        moments, axes = np.linalg.eigh(body.inertia)
        wrong = moments * generator.uniform(0.8, 1.2, 3)
        while 2 * wrong.max() > wrong.sum():
            wrong = moments * generator.uniform(0.8, 1.2, 3)
        shift = generator.standard_normal(3)
        lever = body.lever + generator.uniform(0.005, 0.010) * shift / np.linalg.norm(shift)
        mass = body.mass * generator.uniform(0.95, 1.05)
        model.inertias[joint] = pin.Inertia(mass, lever, axes @ np.diag(wrong) @ axes.T)
    return replace(robot, tree=replace(robot.tree, model=model))


def measured(log: RobotLog, case: Case, seed: int, number: int) -> RobotLog:
    """Return a walk as the sensors of a case see it; calibration errors are the same in all walks."""
    log = with_noise(log, position=case.encoder, torque=case.torque, seed=10 * seed + number)
    if case.wrong_calibration:
        generator = np.random.default_rng([seed, 2])
        joints = len(log.joint_names)
        gains, zeros = 0.01 * generator.standard_normal(joints), 2e-3 * generator.standard_normal(joints)
        log = replace(log, torque=log.torque * (1 + gains), position=log.position + zeros)
    return log


def errors(result: Result, truth: dict[str, dict[str, float]], speeds: dict[str, Array]) -> dict[str, Array]:
    """Return the errors of all joints that got numbers, one entry a joint."""
    law = get_law(LAW)
    rows: dict[str, list[float]] = {
        name: [] for name in ("coulomb", "shape", "offset", *map("{}_held".format, INTERVALS))
    }
    for joint, known in truth.items():
        found = result.joints[joint].parameters
        if not found:
            continue
        names = [parameter.name for parameter in law.parameters]
        values, true = np.array([found[name].value for name in names]), np.array([known[name] for name in names])
        difference = law.torque(speeds[joint], values) - law.torque(speeds[joint], true)
        rows["coulomb"].append(abs(found["coulomb"].value / known["coulomb"] - 1))
        rows["shape"].append(float(np.std(difference)) / known["coulomb"])
        rows["offset"].append(abs(found["offset"].value - known["offset"]))
        for name in INTERVALS:
            low, high = found[name].interval_95
            rows[f"{name}_held"].append(float(low <= known[name] <= high))
    return {name: np.array(row) for name, row in rows.items()}


def run(case: Case, settings: Settings, robot: Robot, walks: list[RobotLog], seed: int) -> tuple[Result, float]:
    """Return what a method makes of a case, and the time it takes a second of the log [s]."""
    believed = wrong_model(robot, seed) if case.wrong_model else robot
    logs = [measured(log, case, seed, number) for number, log in enumerate(walks)]
    begin = time.perf_counter()
    result = identify(logs, believed, settings)
    return result, (time.perf_counter() - begin) / result.log.duration


def study(seeds: int, only: list[str]) -> dict[str, dict[str, dict[str, float]]]:
    """Return the table: case, method, number; printed row by row."""
    walked = exact_walks()
    robot, truth, walks = walked[0].robot, walked[0].truth.parameters, [walk.log for walk in walked]
    velocity = np.concatenate([np.gradient(log.position, log.time, axis=0) for log in walks])
    low, high = np.percentile(velocity, [1, 99], axis=0)
    speeds = {joint: np.linspace(low[k], high[k], 401) for k, joint in enumerate(robot.joint_names)}
    table: dict[str, dict[str, dict[str, float]]] = {}
    print(f"{'':32}{'':26}{'Coulomb %':>14}{'shape %':>14}{'offset N m':>16}{'intervals that hold':>22}{'s per s':>9}")
    for name in only or CASES:
        case, table[name] = CASES[name], {}
        for method, settings in methods(case).items():
            repetitions = seeds if case != Case() else 1
            runs = [run(case, settings, robot, walks, seed) for seed in range(repetitions)]
            found = [errors(result, truth, speeds) for result, _ in runs]
            row = summary(found, float(np.mean([seconds for _, seconds in runs])))
            table[name][method] = row
            print(
                f"{name:32}{method:26}{100 * row['coulomb']:6.2f} / {100 * row['coulomb_worst']:5.2f}"
                f"{100 * row['shape']:6.2f} / {100 * row['shape_worst']:5.2f}"
                f"{row['offset']:8.4f} / {row['offset_worst']:.3f}"
                + "".join(f"{row[f'{held}_held']:7.2f}" for held in INTERVALS)
                + f"{row['seconds']:9.3f}",
                flush=True,
            )
    return table


def summary(found: list[dict[str, Array]], seconds: float) -> dict[str, float]:
    """Return means over seeds of the mean and of the worst joint, shares of intervals, and the time."""
    row = {"joints": float(np.mean([len(errors["coulomb"]) for errors in found])), "seconds": seconds}
    for name in ("coulomb", "shape", "offset"):
        row[name] = float(np.mean([errors[name].mean() for errors in found]))
        row[f"{name}_worst"] = float(np.mean([errors[name].max() for errors in found]))
    for name in INTERVALS:
        row[f"{name}_held"] = float(np.mean([errors[f"{name}_held"].mean() for errors in found]))
    return {name: round(value, 5) for name, value in row.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--cases", nargs="*", default=[], choices=[*CASES, []], help="only these")
    parser.add_argument("--save", type=Path, help="write the table as JSON")
    arguments = parser.parse_args()
    table = study(arguments.seeds, arguments.cases)
    if arguments.save:
        document = {"seeds": arguments.seeds, "cases": table}
        arguments.save.write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

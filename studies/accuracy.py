"""How far identified friction is from the truth: the paper's method and the whole log side by side.

    python -m studies.accuracy --save studies/accuracy.json

Three humanoids walk about 45 s straight on, 45 s to the left and 45 s to the right, simulated in MuJoCo with the
friction of Table 6.2 of the paper in their legs, by sensors without errors. Then white noise is added (A: encoders
2e-5 rad, torque sensors 0.1 N m; B: 1e-4 rad, 0.3 N m), and the estimators are given a model whose principal moments
are off by up to 20 %, centres of mass by 5 to 10 mm and masses by up to 5 %, or torque gains off by 1 % and encoder
zeros by 2 mrad. In harder cases all parameters of all joints are drawn, 30 % from those of the table, for every seed,
and the motors' torques changed by what their friction takes; or there is only the first third of every walk, 45 s in
all. Noise and errors are drawn anew for every seed. The IMU's orientation and the contacts are exact;
wrenches of the feet are not logged.

Of the leg joints that get numbers: Coulomb friction's relative error; how far the friction curves are apart without
the offset, root mean square over the velocities that a joint moves with (its middle 98 %), relative to the Coulomb
friction; the errors of viscous friction and offset; the coverage of the 95 % intervals; and how many
parameters are called weak. Means over joints and seeds; the joint that is worst on average over the seeds; and the
worst of each seed, then the mean over the seeds.

Runs that the file holds already are not repeated: move it away when the estimator has changed. It keeps errors and
standard errors joint by joint. At the end the rows of both tables of docs/whole-log.md are printed, and how far errors
go beyond standard errors, parameter by parameter.
"""

import argparse
import time
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

import numpy as np

from stribeck import Robot, Settings, identify
from stribeck.friction import get_law
from stribeck.log import RobotLog
from stribeck.result import Result
from stribeck.typing import Array
from stribeck_simulation.run import Simulated
from studies.accuracy_cases import CASES, LAW, NAMES, ROBOTS, Case, as_walked, exact_walks, measured, wrong_model
from studies.accuracy_table import (
    CURVE_FIT,
    DEFAULT,
    DEVIATIONS_HEAD,
    HEAD,
    METHODS,
    TRUSTED,
    WHOLE_LOG,
    Key,
    Run,
    deviations,
    in_order,
    read_runs,
    table,
    write_runs,
)

SEEDS = 10
"""Of a case; half as many of a harder one, and one where nothing is drawn."""
SPEEDS = 401
"""At how many velocities curves are compared [1]."""
DIGITS = 4
"""Significant digits that are kept."""


def methods(case: Case) -> dict[str, Settings]:
    """Return the settings that are compared: the paper's method, the default, and the whole log with the law known.

    Nobody knows beforehand whether model or sensors are wrong: the settings are the same in all cases.
    """
    found = {CURVE_FIT: Settings(law=LAW, method="curve-fit"), DEFAULT: Settings(), WHOLE_LOG: Settings(law=LAW)}
    if not (case.wrong_model or case.harder):
        found[TRUSTED] = Settings(law=LAW, corrections="none")
    return found


def run(key: Key, walks: list[Simulated]) -> Run:
    """Return how a method does on walks without errors, made wrong as a case says."""
    _, name, method, seed = key
    case = CASES[name]
    walks = as_walked(walks, case, seed)
    robot = wrong_model(walks[0].robot, seed) if case.wrong_model else walks[0].robot
    logs = [measured(walk.log, case, seed, number) for number, walk in enumerate(walks)]
    return timed(key, walks, robot, logs, partial(identify, settings=methods(case)[method]))


def timed(
    key: Key,
    walks: list[Simulated],
    robot: Robot,
    logs: list[RobotLog],
    method: Callable[[list[RobotLog], Robot], Result],
) -> Run:
    """Return how a method does on the logs of walks."""
    begin = time.perf_counter()
    result = method(logs, robot)
    seconds = (time.perf_counter() - begin) / result.log.duration
    speeds = usual_speeds(robot, [walk.log for walk in walks])
    return compared(key, result, walks[0].truth.parameters, speeds, seconds)


def usual_speeds(robot: Robot, walks: list[RobotLog]) -> dict[str, Array]:
    """Return velocities that each joint moves with [rad/s], evenly spread over the middle 98 % of them."""
    velocity = np.concatenate([np.gradient(log.position, log.time, axis=0) for log in walks])
    low, high = np.percentile(velocity, [1, 99], axis=0)
    return {joint: np.linspace(low[k], high[k], SPEEDS) for k, joint in enumerate(robot.joint_names)}


def compared(
    key: Key, result: Result, truth: dict[str, dict[str, float]], speeds: dict[str, Array], seconds: float
) -> Run:
    """Return a result beside the truth."""
    law, joints = get_law(LAW), [joint for joint in truth if result.joints[joint].parameters]
    there = {
        name: [
            (result.joints[joint].parameters[name], truth[joint][name])
            for joint in joints
            if name in result.joints[joint].parameters
        ]
        for name in NAMES
    }
    levels = [truth[joint]["coulomb"] for joint in joints]
    differences = [
        result.joints[joint].friction(speeds[joint])
        - law.torque(speeds[joint], np.array([truth[joint][name] for name in NAMES]))
        for joint in joints
    ]
    robot, case, method, seed = key
    return Run(
        robot=robot,
        case=case,
        method=method,
        seed=seed,
        seconds=_rounded(seconds),
        chi_square=_rounded(result.corrections.chi_square) if result.corrections else None,
        joints=joints,
        relative=[_rounded(abs(found.value / known - 1)) for found, known in there["coulomb"]],
        shape=[_rounded(float(np.std(each)) / level) for each, level in zip(differences, levels, strict=True)],
        error={name: [_rounded(found.value - known) for found, known in pairs] for name, pairs in there.items()},
        standard_error={name: [_rounded(found.standard_error) for found, _ in pairs] for name, pairs in there.items()},
        held={
            name: [int(found.interval_95[0] <= known <= found.interval_95[1]) for found, known in pairs]
            for name, pairs in there.items()
        },
        weak={name: [int(found.verdict == "weak") for found, _ in pairs] for name, pairs in there.items()},
    )


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def keys(robots: Iterable[str], cases: Iterable[str], seeds: int) -> list[Key]:
    """Return which runs there are to make."""
    return [
        (robot, case, method, seed)
        for robot in ROBOTS
        if robot in robots
        for case in CASES
        if case in cases
        for method in methods(CASES[case])
        for seed in range(_seeds(CASES[case], seeds))
    ]


def _seeds(case: Case, seeds: int) -> int:
    if case == Case():
        return 1  # where nothing is drawn, one says all
    return -(-seeds // 2) if case.harder else seeds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=SEEDS, help="of a case; half as many of a harder one")
    parser.add_argument("--robots", nargs="+", default=list(ROBOTS), choices=ROBOTS, help="only these")
    parser.add_argument("--cases", nargs="+", default=list(CASES), choices=CASES, help="only these")
    parser.add_argument("--methods", nargs="+", default=list(METHODS), choices=METHODS, help="only these")
    parser.add_argument("--save", type=Path, help="JSON that is read at first, and written after every run")
    arguments = parser.parse_args()
    runs = read_runs(arguments.save) if arguments.save else {}
    walked: dict[str, list[Simulated]] = {}
    for key in keys(arguments.robots, arguments.cases, arguments.seeds):
        if key in runs or key[2] not in arguments.methods:
            continue
        if key[0] not in walked:
            walked = {key[0]: exact_walks(key[0])}  # of one robot at a time
        runs[key] = run(key, walked[key[0]])
        print(f"seed {key[3]}: {table([runs[key]])[0]}", flush=True)
        if arguments.save:
            write_runs(arguments.save, runs)
    found = in_order(runs)
    print(HEAD, *table(found), "\nErrors over standard errors:\n", DEVIATIONS_HEAD, *deviations(found), sep="\n")


if __name__ == "__main__":
    main()

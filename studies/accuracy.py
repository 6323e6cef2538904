"""How far identified friction is from the truth: the paper's method and the whole log side by side.

    python -m studies.accuracy --save studies/accuracy.json

Three humanoids walk about 45 s straight on, 45 s to the left and 45 s to the right, simulated in MuJoCo with the
friction of Table 6.2 of the paper in their legs, by sensors without errors. Then white noise is added (A: encoders
2e-5 rad, torque sensors 0.1 N m; B: 1e-4 rad, 0.3 N m), and the estimators are given a model whose principal moments
are off by up to 20 %, centres of mass by 5 to 10 mm and masses by up to 5 %, or torque gains off by 1 % and encoder
zeros by 2 mrad. Noise and errors are drawn anew for every seed.

Of the leg joints that get numbers: Coulomb friction's relative error; how far the friction curves are apart without
the offset, root mean square over the velocities that a joint moves with (its middle 98 %), relative to the Coulomb
friction; the errors of viscous friction and offset; how many of the 95 % intervals hold the truth; and how many
parameters are called weak. Mean and worst joint of each seed, then the mean over the seeds.

Runs that the file holds already are not repeated; at the end the table of docs/whole-log.md is printed. The file keeps
errors and standard errors joint by joint. Move it away when the estimator has changed.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Literal, TypedDict

import numpy as np

from stribeck import Robot, Settings, identify
from stribeck.friction import get_law
from stribeck.log import Array, RobotLog
from stribeck.result import Result, whole_or_not_at_all
from stribeck.simulation.run import Simulated
from studies.accuracy_cases import CASES, ROBOTS, Case, exact_walks, measured, wrong_model

LAW = "stribeck"
NAMES = tuple(parameter.name for parameter in get_law(LAW).parameters)
INTERVALS = ("coulomb", "viscous", "offset")
METHODS = CURVE_FIT, WHOLE_LOG, TRUSTED = "curve-fit", "whole-log", "whole-log, model trusted"
SEEDS = 5
SPEEDS = 401
"""At how many velocities curves are compared [1]."""
DIGITS = 4
"""Significant digits that are kept."""


class Run(TypedDict):
    """What a method makes of one robot, case and seed; lists are over the leg joints that got numbers."""

    robot: str
    case: str
    method: str
    seed: int
    seconds: float  # a second of the log
    chi_square: float | None
    joints: list[str]
    relative: list[float]  # Coulomb friction's error [1]
    shape: list[float]  # [1]
    error: dict[str, list[float]]  # found less true, by parameter
    standard_error: dict[str, list[float]]
    held: dict[str, list[int]]  # whether the 95 % interval holds the truth
    weak: dict[str, list[int]]


Key = tuple[str, str, str, int]
"""Robot, case, method and seed of a run."""


def methods(case: Case) -> dict[str, Settings]:
    """Return the settings that are compared: the paper's method, and the whole log with what may be wrong set free."""
    free: Literal["inertia", "calibration"] = "calibration" if case.wrong_calibration else "inertia"
    found = {CURVE_FIT: Settings(law=LAW), WHOLE_LOG: Settings(law=LAW, method="whole-log", corrections=free)}
    if not case.wrong_model:
        found[TRUSTED] = Settings(law=LAW, method="whole-log", corrections="none")
    return found


def run(key: Key, walks: list[Simulated]) -> Run:
    """Return how a method does on walks without errors, made wrong as a case says."""
    _, name, method, seed = key
    case = CASES[name]
    robot = wrong_model(walks[0].robot, seed) if case.wrong_model else walks[0].robot
    logs = [measured(walk.log, case, seed, number) for number, walk in enumerate(walks)]
    begin = time.perf_counter()
    result = identify(logs, robot, methods(case)[method])
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
    joints = [joint for joint in truth if result.joints[joint].parameters]
    found = [result.joints[joint].parameters for joint in joints]
    values = np.array([[each[name].value for name in NAMES] for each in found])
    true = np.array([[truth[joint][name] for name in NAMES] for joint in joints])
    law, coulomb = get_law(LAW), true[:, NAMES.index("coulomb")]
    differences = [
        law.torque(speeds[joint], a) - law.torque(speeds[joint], b)
        for joint, a, b in zip(joints, values, true, strict=True)
    ]
    error = values - true
    robot, case, method, seed = key
    return Run(
        robot=robot,
        case=case,
        method=method,
        seed=seed,
        seconds=_rounded(seconds),
        chi_square=_rounded(result.corrections.chi_square) if result.corrections else None,
        joints=joints,
        relative=[_rounded(each) for each in np.abs(error[:, NAMES.index("coulomb")]) / coulomb],
        shape=[_rounded(np.std(each) / level) for each, level in zip(differences, coulomb, strict=True)],
        error={name: [_rounded(each) for each in error[:, k]] for k, name in enumerate(NAMES)},
        standard_error={name: [_rounded(each[name].standard_error) for each in found] for name in NAMES},
        held={
            name: [
                int(each[name].interval_95[0] <= known <= each[name].interval_95[1])
                for each, known in zip(found, true[:, k], strict=True)
            ]
            for k, name in enumerate(NAMES)
        },
        weak={name: [int(each[name].verdict == "weak") for each in found] for name in NAMES},
    )


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def summary(runs: list[Run]) -> dict[str, float]:
    """Return means over seeds of the mean and of the worst joint, shares of intervals and verdicts, and the time.

    `<parameter>_z` is the root mean square of errors over standard errors, one if the intervals are right.
    """
    row = {"joints": _mean(runs, lambda one: len(one["joints"])), "seconds": _mean(runs, lambda one: one["seconds"])}
    measures: dict[str, Callable[[Run], Array]] = {
        "coulomb": lambda one: np.array(one["relative"]),
        "shape": lambda one: np.array(one["shape"]),
        "viscous": lambda one: np.abs(one["error"]["viscous"]),
        "offset": lambda one: np.abs(one["error"]["offset"]),
    }
    for name, measure in measures.items():
        row[name] = float(np.mean([measure(one).mean() for one in runs]))
        row[f"{name}_worst"] = float(np.mean([measure(one).max() for one in runs]))
    row |= {f"{name}_held": float(np.mean([each for one in runs for each in one["held"][name]])) for name in NAMES}
    row |= {f"{name}_z": _rms_over_error(runs, name) for name in NAMES}
    row["weak"] = float(np.mean([each for one in runs for name in NAMES for each in one["weak"][name]]))
    return row


def _mean(runs: list[Run], measure: Callable[[Run], float]) -> float:
    return float(np.mean([measure(one) for one in runs]))


def _rms_over_error(runs: list[Run], name: str) -> float:
    ratios = [np.divide(one["error"][name], one["standard_error"][name]) for one in runs]
    return float(np.sqrt(np.mean(np.concatenate(ratios) ** 2)))


HEAD = (
    "| robot | case | method | Coulomb % | shape % | viscous | offset | Coulomb held | viscous held | offset held "
    "| weak | joints | s per s |\n|---|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|"
)


def table(runs: Iterable[Run]) -> list[str]:
    """Return the rows of the table in docs/whole-log.md."""
    together: dict[tuple[str, str, str], list[Run]] = {}
    for one in runs:
        together.setdefault((one["robot"], one["case"], one["method"]), []).append(one)
    return [f"| {' | '.join(label)} | {_numbers(summary(found))} |" for label, found in together.items()]


def _numbers(row: dict[str, float]) -> str:
    errors = [f"{100 * row[name]:.2f} / {100 * row[f'{name}_worst']:.1f}" for name in ("coulomb", "shape")]
    held = [f"{100 * row[f'{name}_held']:.0f} %" for name in INTERVALS]
    rest = [f"{100 * row['weak']:.0f} %", f"{row['joints']:.1f}", f"{row['seconds']:.3f}"]
    return " | ".join([*errors, f"{row['viscous']:.3f}", f"{row['offset']:.3f}", *held, *rest])


def keys(robots: Iterable[str], cases: Iterable[str], seeds: int) -> list[Key]:
    """Return which runs there are to make."""
    return [
        (robot, case, method, seed)
        for robot in ROBOTS
        if robot in robots
        for case in CASES
        if case in cases
        for method in methods(CASES[case])
        for seed in range(seeds if CASES[case] != Case() else 1)  # where nothing is drawn, one says all
    ]


def key_of(one: Run) -> Key:
    """Return which run it is."""
    return one["robot"], one["case"], one["method"], one["seed"]


def read_runs(path: Path) -> dict[Key, Run]:
    """Return the runs that a file holds."""
    runs: list[Run] = json.loads(path.read_text(encoding="utf-8"))["runs"] if path.exists() else []
    return {key_of(one): one for one in runs}


def in_order(runs: dict[Key, Run]) -> list[Run]:
    """Return runs as the table has them."""
    orders = list(ROBOTS), list(CASES), METHODS
    places = {key: (*(each.index(name) for each, name in zip(orders, key[:3], strict=True)), key[3]) for key in runs}
    return [runs[key] for key in sorted(runs, key=places.__getitem__)]


def write_runs(path: Path, runs: dict[Key, Run]) -> None:
    """Write runs, one a line, whole or not at all."""
    with whole_or_not_at_all(path) as temporary:
        lines = ",\n".join(json.dumps(each) for each in in_order(runs))
        temporary.write_text(f'{{"runs": [\n{lines}\n]}}\n', encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=SEEDS)
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
    print(HEAD, *table(in_order(runs)), sep="\n")


if __name__ == "__main__":
    main()

"""What each component of the joint estimator is good for: it is switched off, and errors and intervals are compared.

    STRIBECK_REAL_LOGS=DATA_FOLDER python -m studies.ablation --save studies/ablation.json

Components are switched off one at a time, from outside: a function of the estimator is replaced by one that does
without (`studies.ablation_components`). What is left runs on cases of the accuracy study and on harder conditions
(`studies.harder_cases`), each of one seed, with all settings as a user would have them, and on logs of real robots,
where the error of torques is compared that no fit has seen (`studies.held_out`). Beside the components stand the
curve fit and `studies.bar`, the least that a joint estimator can be.

The table says, component by component: how much larger errors of Coulomb friction, of the curve's shape and of the
offset are without it, mean over joints, in the median and the worst of the cases; by how many points fewer of the 95 %
intervals of parameters that are not called weak hold the truth, of all and in the worst case; how much larger the
held-out torque error of real robots is; and how much time it takes.

Runs that the file holds already are not repeated: move it away when the estimator has changed. Rows of components that
are gone from the code stay as they were measured.
"""

import argparse
import json
import os
import runpy
import tempfile
from collections.abc import Callable, Iterable, Sequence
from functools import cache, partial
from itertools import product
from pathlib import Path

import numpy as np

from stribeck import Robot, Settings, identify, read_log
from stribeck.log import RobotLog
from stribeck.outputs import whole_or_not_at_all
from stribeck.result import Result
from stribeck_simulation.run import Simulated
from studies.ablation_components import COMPONENTS, without
from studies.accuracy import timed
from studies.accuracy_cases import CASES, LAW, NAMES, exact_walks
from studies.accuracy_table import CURVE_FIT, Key, Run, key_of
from studies.bar import bar
from studies.harder_cases import CONDITIONS, as_seen, other_walks
from studies.held_out import BANDS, ROOT, parts_of, slowest_speeds, torque_errors

FULL = "full"
SETTINGS = Settings(law=LAW, method="whole-log", corrections="calibration")
"""Of all rows but the curve fit's: what a user has on a robot that walks."""
METHODS: dict[str, Callable[[Sequence[RobotLog], Robot], Result]] = {
    CURVE_FIT: partial(identify, settings=Settings(law=LAW, method="curve-fit")),
    "default": identify,
    "bar": lambda logs, robot: bar(logs, robot)[0],
}
"""Of rows that are not of the joint estimator."""
FEWEST = 20
"""Intervals [1] of a case whose share that holds the truth is compared."""
POINT_FEET = ("go2", "bar")
"""The bar knows no contact forces."""
PLACES: tuple[tuple[str, str], ...] = (
    *((robot, case) for case in CONDITIONS for robot in ("TORO-like", "G1")),
    *(
        (robot, case)
        for case in (
            *("A, wrong model", "B, wrong model", "A", "B", "A, wrong model and calibration"),
            *(name for name, case in CASES.items() if case.differing),
        )
        for robot in ("TORO-like", "G1")
    ),
)
"""Robots and cases that are run."""

Held = dict[str, dict[str, float]]
"""Held-out torque error [N m] by component and joint."""


def walks_of(robot: str, case: str) -> list[Simulated]:
    """Return the walks of a case; those of the robot before are forgotten."""
    return _walks(robot, case in CONDITIONS)


@cache
def _walks(robot: str, harder: bool) -> list[Simulated]:
    return other_walks(robot) if harder else exact_walks(robot)


def run(key: Key) -> Run:
    """Return how the estimator does without a component."""
    robot, name, component, seed = key
    case = CONDITIONS[name] if name in CONDITIONS else CASES[name]
    walks, believed, logs = as_seen(walks_of(robot, name), case, seed)
    with without(component):
        return timed(key, walks, believed, logs, METHODS.get(component, partial(identify, settings=SETTINGS)))


def held_out(folder: Path, component: str) -> dict[str, float]:
    """Return the held-out torque errors of a real robot's joints, root mean square [N m]; see `studies.held_out`."""
    robot = Robot.from_file(folder / ("curve-fit.toml" if component == CURVE_FIT else "robot.toml"))
    parts = parts_of([read_log(path, robot) for path in sorted(folder.glob("log*.npz"))])
    slowest = slowest_speeds(parts)
    errors = []
    for part in parts:
        result, believed = _fitted([other for other in parts if other is not part], robot, component)
        errors.append(torque_errors(part, believed, result, BANDS[folder.name], slowest))
    squares = np.concatenate(errors) ** 2
    return {
        joint: float(f"{np.sqrt(np.nanmean(column)):.4g}")
        for joint, column in zip(robot.joint_names, squares.T, strict=True)
        if not np.isnan(column).all()
    }


def _fitted(logs: list[RobotLog], robot: Robot, component: str) -> tuple[Result, Robot]:
    """Return what is found without a component, and the robot that it is found with."""
    if component == "bar":
        return bar(logs, robot)
    with without(component):
        return identify(logs, robot), robot


def read(path: Path) -> tuple[dict[Key, Run], dict[str, Held]]:
    """Return the runs that a file holds, and the held-out errors of real robots by robot."""
    found = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {"runs": [], "held_out": {}}
    return {key_of(one): one for one in found["runs"]}, found["held_out"]


def write(path: Path, runs: dict[Key, Run], held: dict[str, Held]) -> None:
    """Write both, a run a line, whole or not at all."""
    lines = ",\n".join(json.dumps(each) for each in runs.values())
    with whole_or_not_at_all(path) as temporary:
        temporary.write_text(f'{{"held_out": {json.dumps(held)},\n"runs": [\n{lines}\n]}}\n', encoding="utf-8")


MEASURES: dict[str, Callable[[Run], float]] = {
    "Coulomb": lambda one: float(np.mean(one["relative"])),
    "worst joint": lambda one: max(one["relative"]),
    "shape": lambda one: float(np.mean(one["shape"])),
    "offset": lambda one: float(np.mean(np.abs(one["error"]["offset"]))),
}


def coverage(runs: Iterable[Run]) -> float:
    """Return how many of the 95 % intervals hold the truth, of parameters that are not called weak [1]."""
    held = [
        there
        for one in runs
        for name in NAMES
        for there, weak in zip(one["held"][name], one["weak"][name], strict=True)
        if not weak
    ]
    return float(np.mean(held)) if held else np.nan


HEAD = (
    f"| without | cases | {' | '.join(MEASURES)} | coverage | worst case | {' | '.join(BANDS)} | time |\n"
    f"|---|---:|{'---:|' * (len(MEASURES) + len(BANDS) + 3)}"
)


def table(runs: dict[Key, Run], held: dict[str, Held]) -> list[str]:
    """Return a row for each component that there are runs of."""
    there = list(dict.fromkeys([*COMPONENTS, *(key[2] for key in runs)]))
    return [_row(name, runs, held) for name in there if any(key[2] == name for key in runs)]


def _row(component: str, runs: dict[Key, Run], held: dict[str, Held]) -> str:
    pairs = [(one, runs[full]) for key, one in runs.items() if key[2] == component and (full := _full(key)) in runs]
    cells = [component, str(len(pairs))]
    for measure in MEASURES.values():
        ratios = [measure(one) / measure(full) for one, full in pairs]
        cells.append(f"{np.median(ratios):.2f} / {max(ratios):.2f} ({_name(pairs[int(np.argmax(ratios))][0])})")
    alone = [100 * (coverage([one]) - coverage([full])) if _many(one, full) else np.nan for one, full in pairs]
    both = [coverage(each) for each in zip(*pairs, strict=True)]
    cells.append(f"{100 * both[0]:.1f} % ({100 * (both[0] - both[1]):+.1f})")
    worst = int(np.nanargmin(alone)) if np.isfinite(alone).any() else 0
    cells.append(f"{alone[worst]:+.0f} ({_name(pairs[worst][0])})")
    cells += [_held_ratio(held.get(robot, {}), component) for robot in BANDS]
    cells.append(f"{np.median([one['seconds'] / full['seconds'] for one, full in pairs]):.2f}")
    return f"| {' | '.join(cells)} |"


def _many(*runs: Run) -> bool:
    """Return whether enough parameters of each run are not weak for a share of them to mean anything."""
    return all(sum(1 - weak for each in one["weak"].values() for weak in each) >= FEWEST for one in runs)


def _full(key: Key) -> Key:
    return key[0], key[1], FULL, key[3]


def _name(one: Run) -> str:
    return f"{one['robot']}, {one['case']}"


def _held_ratio(of_robot: Held, component: str) -> str:
    """Return how much larger held-out errors are, geometric mean over the joints."""
    if not {component, FULL} <= set(of_robot):
        return ""
    found, full = of_robot[component], of_robot[FULL]
    joints = found.keys() & full.keys()
    return f"{np.exp(np.mean([np.log(found[joint] / full[joint]) for joint in joints])):.3f}" if joints else "none left"


CASE_HEAD = (
    "| case | seed | method | Coulomb % | worst joint % | shape % | offset [N m] | coverage | s per s |\n"
    "|---|---:|---|---:|---:|---:|---:|---:|---:|"
)


def by_case(runs: Iterable[Run]) -> list[str]:
    """Return a row for each run, without ratios."""
    return [_case_row(one) for one in runs]


def _case_row(one: Run) -> str:
    percent = [f"{100 * measure(one):.2f}" for name, measure in MEASURES.items() if name != "offset"]
    share = coverage([one])
    held = "all weak" if np.isnan(share) else f"{100 * share:.0f} %"
    cells = [_name(one), str(one["seed"]), one["method"], *percent, f"{MEASURES['offset'](one):.4f}", held]
    return f"| {' | '.join(cells)} | {one['seconds']:.3f} |"


def estimators(runs: Iterable[Run]) -> list[Run]:
    """Return the runs of whole estimators, case by case: no component of these is switched off."""
    return sorted((one for one in runs if one["method"] in (FULL, *METHODS)), key=lambda one: (_name(one), one["seed"]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--components", nargs="+", default=list(COMPONENTS), choices=COMPONENTS, help="only these")
    parser.add_argument("--robots", nargs="+", help="only these, real ones or simulated")
    parser.add_argument("--cases", nargs="+", choices=[*CONDITIONS, *CASES], help="only these, and no real robots")
    parser.add_argument("--seeds", nargs="+", type=int, default=[0], help="of the simulated cases' errors")
    parser.add_argument("--save", type=Path, help="JSON that is read at first, and written after every run")
    arguments = parser.parse_args()
    runs, held = read(arguments.save) if arguments.save else ({}, {})
    wanted = arguments.robots or [*BANDS, *(robot for robot, _ in PLACES)]
    cases = arguments.cases or [case for _, case in PLACES]
    for (robot, case), seed in product(PLACES, arguments.seeds):
        for component in arguments.components:
            key = (robot, case, component, seed)
            if robot in wanted and case in cases and key not in runs:
                runs[key] = run(key)
                print(*by_case([runs[key]]), flush=True)
                if arguments.save:
                    write(arguments.save, runs, held)
    if not arguments.cases and (folder := os.environ.get("STRIBECK_REAL_LOGS")):
        convert = runpy.run_path(str(ROOT / "examples/real_robots/convert.py"))["convert"]
        with tempfile.TemporaryDirectory() as scratch:
            for robot in (name for name in BANDS if name in wanted):
                converted = convert(robot, Path(folder), Path(scratch))
                for component in arguments.components:
                    if component in held.setdefault(robot, {}) or (robot, component) == POINT_FEET:
                        continue
                    held[robot][component] = held_out(converted, component)
                    print(robot, component, held[robot][component], flush=True)
                    if arguments.save:
                        write(arguments.save, runs, held)
    print(HEAD, *table(runs, held), "", CASE_HEAD, *by_case(estimators(runs.values())), sep="\n")


if __name__ == "__main__":
    main()

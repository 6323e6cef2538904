"""Compare the accuracy of the curve fit and of the whole log on simulated walks.

    python -m studies.accuracy --save studies/accuracy.json

Three humanoids walk about 45 s straight on, 45 s to the left and 45 s to the right, simulated in MuJoCo with the
friction of Table 6.2 of the paper in their legs and with perfect sensors. Then white noise is added (A: encoders
2e-5 rad, torque sensors 0.1 N m; B: 1e-4 rad, 0.3 N m). The estimators get a model whose principal moments are off by
up to 20 %, centres of mass by 5 to 10 mm and masses by up to 5 %, or torque gains off by 1 % and encoder zeros by
2 mrad. In some cases every seed draws all parameters of all joints with a spread of 30 % around the table, or uses only
the first third of every walk, 45 s in total. Two of the robots also take walks of 15 s that no constant was tuned on,
with the errors of `studies.harder_cases`. In all other cases the IMU's orientation and the contacts are exact. The
wrenches of the feet are not logged.

The figures cover the leg joints that get numbers: relative error of Coulomb friction; root mean square distance of the
friction curves without offset over the middle 98 % of a joint's velocities, relative to the Coulomb friction; errors of
viscous friction and offset; coverage of the 95 % intervals; and the share of weak parameters.
"""

import time
from collections.abc import Callable, Iterable, Iterator
from functools import lru_cache
from itertools import product

import numpy as np

from stribeck import Robot, Settings, identify
from stribeck.core.base.typing import Array
from stribeck.core.friction import get_law
from stribeck.core.log import RobotLog
from stribeck.core.result import ParameterEstimate, Result
from stribeck.simulation.run import Simulated
from studies.accuracy_cases import CASES, LAW, NAMES, WALKS, Case, exact_walks
from studies.command import Row, command, rounded
from studies.harder_cases import CONDITIONS, as_seen, other_walks
from studies.markdown import markdown_table, percent

SEEDS, FEWER = 5, 3
"""Number of seeds per case, and of harder cases; cases without random numbers have one."""
SPEEDS = 401
"""Number of velocities at which curves are compared."""
METHODS = CURVE_FIT, DEFAULT, WHOLE_LOG, TRUSTED = (
    "curve-fit",
    "default",
    "whole-log, law known",
    "whole-log, law and model known",
)
SETTINGS = {
    CURVE_FIT: Settings(law=LAW, method="curve-fit"),
    DEFAULT: Settings(),
    WHOLE_LOG: Settings(law=LAW),
    TRUSTED: Settings(law=LAW, corrections="none"),
}
"""Settings per method. All cases share them, because users do not know whether their model or sensors are wrong."""
HARDER_ROBOTS = ("TORO-like", "G1")
ALL_CASES: dict[str, Case] = {**CASES, **CONDITIONS}


def runs() -> Iterator[Row]:
    """Yield the keys of all runs."""
    for (robot, (case, made)), method in product(product(WALKS, CASES.items()), METHODS):
        if method == TRUSTED and (made.wrong_model or made.harder):
            continue
        seeds = 1 if made == Case() else FEWER if made.harder else SEEDS
        for seed in range(seeds):
            yield {"robot": robot, "case": case, "method": method, "seed": seed}
    for robot, case, method in product(HARDER_ROBOTS, CONDITIONS, (CURVE_FIT, WHOLE_LOG, DEFAULT)):
        yield {"robot": robot, "case": case, "method": method, "seed": 0}


@lru_cache(maxsize=1)
def walks_of(robot: str, harder: bool) -> list[Simulated]:
    """Simulate one robot's walks for the accuracy cases or for the harder conditions."""
    return other_walks(robot) if harder else exact_walks(robot)


def run(robot: str, case: str, method: str, seed: int) -> Row:
    """Identify the friction of one case with one method, and compare it with the ground truth."""
    walks, believed, logs = as_seen(walks_of(robot, case in CONDITIONS), ALL_CASES[case], seed)
    begin = time.perf_counter()
    result = identify(logs, believed, SETTINGS[method])
    seconds = (time.perf_counter() - begin) / result.log.duration
    speeds = usual_speeds(believed, [walk.log for walk in walks])
    return {"seconds": rounded(seconds, 4), **compared(result, walks[0].truth.parameters, speeds)}


def usual_speeds(robot: Robot, walks: list[RobotLog]) -> dict[str, Array]:
    """Compute evenly spaced velocities over the middle 98 % of each joint's velocity range [rad/s]."""
    velocity = np.concatenate([np.gradient(log.position, log.time, axis=0) for log in walks])
    low, high = np.percentile(velocity, [1, 99], axis=0)
    return {joint: np.linspace(low[k], high[k], SPEEDS) for k, joint in enumerate(robot.joint_names)}


def compared(result: Result, truth: dict[str, dict[str, float]], speeds: dict[str, Array]) -> Row:
    """Compare a result with the ground truth; lists have one element per leg joint that got numbers.

    `relative` and `shape` are the relative errors of Coulomb friction and of the curve [1]. `error` and
    `standard_error` refer to each parameter in its unit. `held` is true if the 95 % interval covers the true value.
    """
    law, joints = get_law(LAW), [joint for joint in truth if result.joints[joint].parameters]
    pairs: dict[str, list[tuple[ParameterEstimate, float]]] = {name: [] for name in NAMES}
    shape = []
    for joint in joints:
        found, known = result.joints[joint], truth[joint]
        for name in found.parameters.keys() & pairs.keys():
            pairs[name].append((found.parameters[name], known[name]))
        true_curve = law.torque(speeds[joint], np.array([known[name] for name in NAMES]))
        off = float(np.std(found.friction(speeds[joint], offset=True) - true_curve))
        shape.append(rounded(off, 4) / known["coulomb"])

    def of_all(value: Callable[[ParameterEstimate, float], float]) -> dict[str, list[float]]:
        return {name: [value(found, known) for found, known in each] for name, each in pairs.items()}

    return {
        "chi_square": rounded(result.corrections.chi_square, 4) if result.corrections else None,
        "joints": joints,
        "relative": [rounded(abs(found.value / known - 1), 4) for found, known in pairs["coulomb"]],
        "shape": shape,
        "error": of_all(lambda found, known: rounded(found.value - known, 4)),
        "standard_error": of_all(lambda found, _: rounded(found.standard_error, 4)),
        "held": of_all(lambda found, known: int(found.interval_95[0] <= known <= found.interval_95[1])),
        "weak": of_all(lambda found, _: int(found.verdict == "weak")),
    }


MEASURES: dict[str, Callable[[Row], Array]] = {
    "coulomb": lambda row: np.array(row["relative"]),
    "shape": lambda row: np.array(row["shape"]),
    "viscous": lambda row: np.abs(row["error"]["viscous"]),
    "offset": lambda row: np.abs(row["error"]["offset"]),
}


def coverage(rows: Iterable[Row]) -> float:
    """Compute the share of 95 % intervals that cover the true value [1], among parameters that are not weak."""
    pairs = [pair for row in rows for name in NAMES for pair in zip(row["held"][name], row["weak"][name], strict=True)]
    held = [each for each, weak in pairs if not weak]
    return float(np.mean(held)) if held else np.nan


def summary(rows: list[Row]) -> dict[str, float]:
    """Average over joints and seeds.

    "worst_joint" is the mean over the seeds for the worst joint. "worst" is the mean of each seed's largest error.
    """
    found = {"joints": float(np.mean([len(row["joints"]) for row in rows]))}
    for name, measure in MEASURES.items():
        found[name] = float(np.mean([measure(row).mean() for row in rows]))
    for name in ("coulomb", "shape"):
        by_joint: dict[str, list[float]] = {}
        for row in rows:
            for joint, value in zip(row["joints"], MEASURES[name](row).tolist(), strict=True):
                by_joint.setdefault(joint, []).append(value)
        found[f"{name}_worst_joint"] = max(float(np.mean(values)) for values in by_joint.values())
        found[f"{name}_worst"] = float(np.mean([MEASURES[name](row).max() for row in rows]))
    found |= {f"{name}_covered": float(np.mean([x for row in rows for x in row["held"][name]])) for name in NAMES}
    found["weak"] = float(np.mean([x for row in rows for name in NAMES for x in row["weak"][name]]))
    return found


HEAD = ("robot", "case", "method", "seeds", "Coulomb %", "shape %", "viscous", "offset", "coverage %", "weak %")
HARDER_HEAD = ("condition", "robot", "curve-fit", "law known", "default")


def tables(rows: list[Row]) -> list[str]:
    """Format the tables of walks, of walks with different joints or short logs, and of disturbed walks."""
    together: dict[tuple[str, str, str], list[Row]] = {}
    for row in rows:
        together.setdefault((row["robot"], row["case"], row["method"]), []).append(row)
    usual: dict[bool, list[list[object]]] = {False: [], True: []}
    for key in product(WALKS, CASES, METHODS):
        if found := together.get(key):
            usual[CASES[key[1]].harder].append([*key, len(found), *_numbers(summary(found))])
    harder = []
    for case, robot in product(CONDITIONS, HARDER_ROBOTS):
        own = [together.get((robot, case, method)) for method in (CURVE_FIT, WHOLE_LOG, DEFAULT)]
        if all(own):
            harder.append([case, robot, *(_cell(each[0]) for each in own if each)])
    return [*(markdown_table(HEAD, each, 3) for each in usual.values()), markdown_table(HARDER_HEAD, harder, 2)]


def _numbers(row: dict[str, float]) -> list[str]:
    errors = [
        f"{100 * row[name]:.2f}/{100 * row[f'{name}_worst_joint']:.1f}/{100 * row[f'{name}_worst']:.1f}"
        for name in ("coulomb", "shape")
    ]
    held = "/".join(f"{100 * row[f'{name}_covered']:.0f}" for name in ("coulomb", "viscous", "offset"))
    return [*errors, f"{row['viscous']:.3f}", f"{row['offset']:.3f}", held, f"{100 * row['weak']:.0f}"]


def _cell(row: Row) -> str:
    coulomb, shape, share = np.array(row["relative"]), np.array(row["shape"]), coverage([row])
    held = "–" if np.isnan(share) else percent(share)
    return f"{100 * coulomb.mean():.1f} / {100 * coulomb.max():.1f}, {100 * shape.mean():.1f}, {held}"


if __name__ == "__main__":
    command(__doc__, runs(), run, tables)

"""Compare the accuracy of the curve fit and of the whole log on simulated walks.

    python -m studies.accuracy --save studies/accuracy.json

Three humanoids walk about 45 s straight on, 45 s to the left and 45 s to the right, simulated in MuJoCo with the
friction of Table 6.2 of the paper in their legs and with perfect sensors. Then white noise is added (A: encoders
2e-5 rad, torque sensors 0.1 N m; B: 1e-4 rad, 0.3 N m). The estimators get a model whose principal moments are off by
up to 20 %, centres of mass by 5 to 10 mm and masses by up to 5 %, or torque gains off by 1 % and encoder zeros by
2 mrad. In some cases a seed draws all parameters of all joints with a spread of 30 % around the table, or uses only
the first third of every walk, 45 s in total. Two of the robots also take walks of 15 s that no constant was tuned on,
with the errors of `studies.harder_cases`. In all other cases the IMU's orientation and the contacts are exact. The
wrenches of the feet are not logged.

The figures cover the leg joints that get numbers: relative error of Coulomb friction, and coverage of 95 % intervals
of parameters that are not weak.
"""

from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from itertools import product

import numpy as np

from stribeck import Settings, identify
from stribeck.core.result import Result
from stribeck.simulation.run import Simulated
from studies.accuracy_cases import CASES, LAW, NAMES, WALKS, Case, exact_walks
from studies.command import Row, command
from studies.harder_cases import CONDITIONS, as_seen, other_walks
from studies.markdown import markdown_table, percent

CURVE_FIT, DEFAULT = "curve-fit", "default"
SETTINGS = {CURVE_FIT: Settings(law=LAW, method="curve-fit"), DEFAULT: Settings()}
"""Settings per method. All cases share them, because users do not know whether their model or sensors are wrong."""
HARDER_ROBOTS = ("TORO-like", "G1")
ALL_CASES: dict[str, Case] = {**CASES, **CONDITIONS}


def runs() -> Iterator[Row]:
    """Yield the keys of all runs."""
    for robot, case, method in product(WALKS, ALL_CASES, SETTINGS):
        if robot in HARDER_ROBOTS or case in CASES:
            yield {"robot": robot, "case": case, "method": method, "seed": 0}


@lru_cache(maxsize=1)
def walks_of(robot: str, harder: bool) -> list[Simulated]:
    """Simulate one robot's walks for the accuracy cases or for the harder conditions."""
    return other_walks(robot) if harder else exact_walks(robot)


def run(robot: str, case: str, method: str, seed: int) -> Row:
    """Identify the friction of one case with one method, and compare it with the ground truth."""
    walks, believed, logs = as_seen(walks_of(robot, case in CONDITIONS), ALL_CASES[case], seed)
    return compared(identify(logs, believed, SETTINGS[method]), walks[0].truth.parameters)


def compared(result: Result, truth: Mapping[str, Mapping[str, float]]) -> Row:
    """Compare a result with the ground truth.

    `coulomb` is the relative error [1] of each joint with numbers. `covered` counts the true values within the 95 %
    interval, and all parameters that are not weak.
    """
    joints = [joint for joint in truth if result.joints[joint].parameters]
    pairs = [(result.joints[joint].parameters, truth[joint]) for joint in joints]
    coulomb = [abs(found["coulomb"].value / known["coulomb"] - 1) for found, known in pairs if "coulomb" in found]
    sure = [(own, known[name]) for found, known in pairs for name, own in found.items() if name in NAMES]
    covered = [own.interval_95[0] <= true <= own.interval_95[1] for own, true in sure if own.verdict != "weak"]
    return {"joints": joints, "coulomb": coulomb, "covered": [sum(covered), len(covered)]}


def coverage(rows: Iterable[Row]) -> float:
    """Compute the share of 95 % intervals that cover the true value [1], among parameters that are not weak."""
    inside, count = np.sum([row["covered"] for row in rows], axis=0)
    return float(inside / count) if count else np.nan


HEAD = ("robot", "case", "method", "Coulomb, mean / worst [%]", "coverage")


def tables(rows: list[Row]) -> list[str]:
    """Format the table of all walks."""
    together: dict[tuple[str, str, str], list[Row]] = {}
    for row in rows:
        together.setdefault((row["robot"], row["case"], row["method"]), []).append(row)
    cells = []
    for key, own in together.items():
        coulomb, share = 100 * np.concatenate([row["coulomb"] for row in own]), coverage(own)
        errors = f"{coulomb.mean():.2f} / {coulomb.max():.1f}"
        cells.append([*key, errors, "–" if np.isnan(share) else percent(share)])
    return [markdown_table(HEAD, cells, 3)]


if __name__ == "__main__":
    command(__doc__, runs(), run, tables)

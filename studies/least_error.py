"""How small errors can be at all: the bound of Cramer and Rao for the walks of `studies.accuracy`.

    python -m studies.least_error --save studies/least_error.json

Nothing is known but the model, exactly, and how large the noise of encoders and torque sensors is; the feet do stand
still. Each joint has its own six parameters. What information about them is in the windows of the three walks then
bounds the standard error of every estimate that is right on average. Printed are the expected mean and worst error of
the Coulomb friction over the leg joints; the same if gain, Stribeck velocity and slope were known beforehand; and the
expected mean error of the offsets, first with the model known, then with inertias as uncertain as the estimator
believes them to be.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Literal, TypedDict

import numpy as np

from stribeck import Settings
from stribeck.friction import get_law
from stribeck.identification.whole_log.solve import derivatives, inverse_of
from stribeck.identification.whole_log.summing import sum_up
from stribeck.log import Array
from stribeck.simulation.run import Simulated
from stribeck.survey import prepare
from stribeck.weak_form.lazily import all_equations
from stribeck.whole_log import PLAIN, identify_whole_log, weak_forms
from studies.accuracy_cases import CASES, ROBOTS, exact_walks, measured
from studies.accuracy_table import LAW, NAMES

NOISY = ("A", "B")
BENDS = ("stribeck_gain", "stribeck_velocity", "slope")
EXPECTED = float(np.sqrt(2 / np.pi))
"""Mean of |x| over the standard deviation of x [1]."""
NEXT_TO_NOTHING = 1e-4
"""Error of the model [N m] that keeps the covariance of standing limbs regular."""
DRAWS = 10_000
HEAD = "| robot | case | Coulomb % | bends known | offset | inertias free |\n|---|---|---:|---:|---:|---:|"


class Least(TypedDict):
    """Of one robot and case, expected errors: mean and worst Coulomb friction's [1], and the mean offset's [N m]."""

    robot: str
    case: str
    coulomb: tuple[float, float]
    coulomb_bends_known: tuple[float, float]
    offset: float
    offset_inertias_free: float


def information(case: str, walks: list[Simulated], free: Literal["none", "inertia"]) -> tuple[Array, list[str]]:
    """Return the curvature of chi^2 / 2 at the truth, leg joints' parameters first, and their names.

    What is believed of these parameters beforehand is not in it; what is believed of all else is.
    """
    robot, law, settings = walks[0].robot, get_law(LAW), Settings(law=LAW, method="whole-log", corrections=free)
    logs = [measured(walk.log, CASES[case], 0, number) for number, walk in enumerate(walks)]
    prepared = [prepare(log, robot, settings.model_copy(update={"filter": PLAIN})) for log in logs]
    found = identify_whole_log(prepared, robot, law, settings)
    fit, truth = found.fit, walks[0].truth.parameters
    equations = all_equations(weak_forms(prepared, robot, found.columns, settings))
    levels = replace(
        fit.levels,
        model=np.full_like(fit.levels.model, NEXT_TO_NOTHING),
        root=np.zeros_like(fit.levels.root),
        unrest=np.ones_like(fit.levels.unrest),
        shake=np.ones_like(fit.levels.shake),
    )
    statistic = sum_up(equations, levels, fit.curves, fit.model)
    legs = [k for k, name in enumerate(found.joints) if name in truth]
    values = fit.values.copy()
    values[legs] = [[truth[found.joints[k]][name] for name in NAMES] for k in legs]
    at = replace(fit.solution, internal=fit.curves.inside(values))
    matrix = derivatives(statistic, fit.curves, fit.model, at)[1]
    count = len(NAMES)
    own = (np.array(legs)[:, None] * count + np.arange(count)).ravel()
    matrix[own, own] -= (fit.curves.prior()[1][legs] ** -2).ravel()
    order = np.concatenate([own, np.setdiff1d(np.arange(len(matrix)), own)])
    return matrix[np.ix_(order, order)], [found.joints[k] for k in legs]


def least(robot: str, case: str, walks: list[Simulated]) -> Least:
    """Return the expected errors of one robot and case."""
    trusted, joints = information(case, walks, "none")
    corrected, _ = information(case, walks, "inertia")
    true = np.array([walks[0].truth.parameters[joint]["coulomb"] for joint in joints])
    return Least(
        robot=robot,
        case=case,
        coulomb=_mean_and_worst(_errors(trusted, len(joints), "coulomb") / true),
        coulomb_bends_known=_mean_and_worst(_errors(trusted, len(joints), "coulomb", BENDS) / true),
        offset=_rounded(EXPECTED * _errors(trusted, len(joints), "offset").mean()),
        offset_inertias_free=_rounded(EXPECTED * _errors(corrected, len(joints), "offset").mean()),
    )


def _errors(matrix: Array, joints: int, name: str, known: tuple[str, ...] = ()) -> Array:
    """Return the least standard errors of one parameter of all joints, shape (n,), the `known` ones being given."""
    parameter = np.full(len(matrix), -1)
    parameter[: joints * len(NAMES)] = np.tile(np.arange(len(NAMES)), joints)
    free = np.flatnonzero(~np.isin(parameter, [NAMES.index(each) for each in known]))
    covariance = inverse_of(matrix[np.ix_(free, free)])
    return np.asarray(np.sqrt(np.diag(covariance)[parameter[free] == NAMES.index(name)]))


def _mean_and_worst(errors: Array) -> tuple[float, float]:
    drawn = np.abs(np.random.default_rng(0).standard_normal((DRAWS, len(errors))) * errors)
    return _rounded(EXPECTED * errors.mean()), _rounded(drawn.max(axis=1).mean())


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")


def table(found: list[Least]) -> list[str]:
    """Return a line for each robot and case."""
    return [
        f"| {each['robot']} | {each['case']} "
        f"| {100 * each['coulomb'][0]:.2f} / {100 * each['coulomb'][1]:.1f} "
        f"| {100 * each['coulomb_bends_known'][0]:.2f} / {100 * each['coulomb_bends_known'][1]:.1f} "
        f"| {each['offset']:.3f} | {each['offset_inertias_free']:.3f} |"
        for each in found
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", nargs="+", default=list(ROBOTS), choices=ROBOTS, help="only these")
    parser.add_argument("--save", type=Path, help="JSON that is written")
    arguments = parser.parse_args()
    found = []
    for robot in arguments.robots:
        walks = exact_walks(robot)
        found += [least(robot, case, walks) for case in NOISY]
    if arguments.save:
        lines = ",\n".join(json.dumps(each) for each in found)
        arguments.save.write_text(f'{{"bounds": [\n{lines}\n]}}\n', encoding="utf-8")
    print(HEAD, *table(found), sep="\n")


if __name__ == "__main__":
    main()

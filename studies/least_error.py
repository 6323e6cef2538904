"""How small errors can be at all: the bound of Cramer and Rao for the walks of `studies.accuracy`.

    python -m studies.least_error --save studies/least_error.json

Nothing is known but the model, exactly, and how large the noise of encoders and torque sensors is; the feet do stand
still. Each joint has its own six parameters. What information about them is in the windows of the three walks then
bounds the standard error of every estimate that is right on average. Printed are the expected mean and worst error of
the Coulomb friction over the leg joints; the same if gain, Stribeck velocity and slope were known beforehand; both for
the shape of the curves as in `studies.accuracy`, and the first once more with inertias as uncertain as those of a wrong
model; and the expected mean error of the offsets, first with the model known, then with inertias as uncertain as the
estimator believes them to be.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Literal, TypedDict

import numpy as np

from stribeck import Settings
from stribeck.equations.equation_sequence import equation_sequence
from stribeck.friction import get_law
from stribeck.identification.whole_log.solver.accumulation import accumulate
from stribeck.identification.whole_log.solver.solve import derivatives, inverse_of
from stribeck.methods.whole_log import identify_whole_log, weak_forms
from stribeck.preparation import prepare
from stribeck.typing import Array
from stribeck_simulation.run import Simulated
from studies.accuracy import usual_speeds
from studies.accuracy_cases import CASES, LAW, NAMES, ROBOTS, exact_walks, measured

NOISY = ("A", "B")
BENDS = ("stribeck_gain", "stribeck_velocity", "slope")
NEXT_TO_NOTHING = 1e-4
"""Error of the model [N m] that keeps the covariance of standing limbs regular."""
DRAWS = 10_000
HEAD = (
    "| robot | case | Coulomb % | shape known | shape % | shape known | model wrong | offset | inertias free |\n"
    "|---|---|---:|---:|---:|---:|---:|---:|---:|"
)


class Least(TypedDict):
    """Of one robot and case, expected errors: Coulomb friction and shape [1], mean and worst, and offset [N m]."""

    robot: str
    case: str
    coulomb: tuple[float, float]
    coulomb_bends_known: tuple[float, float]
    shape: tuple[float, float]
    shape_bends_known: tuple[float, float]
    shape_model_wrong: tuple[float, float]
    offset: float
    offset_inertias_free: float


def information(case: str, walks: list[Simulated], free: Literal["none", "inertia"]) -> tuple[Array, Array, list[str]]:
    """Return curvatures of chi^2 / 2 at the truth, leg joints' parameters first, and the names of these joints.

    What is believed of these parameters beforehand is not in them; what is believed of all else is: in the first, the
    model is as wrong as the estimator finds it to be, in the second, as models usually are.
    """
    robot, law, settings = walks[0].robot, get_law(LAW), Settings(law=LAW, method="whole-log", corrections=free)
    logs = [measured(walk.log, CASES[case], 0, number) for number, walk in enumerate(walks)]
    prepared = [prepare(log, robot, settings) for log in logs]
    found = identify_whole_log(prepared, robot, law, settings)
    fit, truth = found.fit, walks[0].truth.parameters
    forms = weak_forms(prepared, robot, found.columns, found.couplings, settings, found.torque_delay)
    equations = equation_sequence(forms)
    components = replace(
        fit.components,
        model=np.full_like(fit.components.model, NEXT_TO_NOTHING),
        root=np.zeros_like(fit.components.root),
        contact_scale=np.ones_like(fit.components.contact_scale),
        encoder_scale=np.ones_like(fit.components.encoder_scale),
    )
    normal_equations = accumulate(equations, components, fit.curves, fit.model)
    legs = [k for k, name in enumerate(found.joints) if name in truth]
    values = fit.values.copy()
    values[legs] = [[truth[found.joints[k]][name] for name in NAMES] for k in legs]
    internal = fit.curves.inside(values).ravel()
    at = replace(fit.solution, x=np.concatenate([internal, fit.solution.corrections]))
    count = len(NAMES)
    own = (np.array(legs)[:, None] * count + np.arange(count)).ravel()
    order = np.concatenate([own, np.setdiff1d(np.arange(len(fit.solution.covariance)), own)])
    curvatures = []
    for model in (fit.model, replace(fit.model, prior_std=np.ones_like(fit.model.prior_std))):
        matrix = derivatives(normal_equations, fit.curves, model, at)[1]
        matrix[own, own] -= (fit.curves.prior[1][legs] ** -2).ravel()
        curvatures.append(matrix[np.ix_(order, order)])
    return curvatures[0], curvatures[1], [found.joints[k] for k in legs]


def least(robot: str, case: str, walks: list[Simulated]) -> Least:
    """Return the expected errors of one robot and case."""
    trusted, _, joints = information(case, walks, "none")
    corrected, wrong, _ = information(case, walks, "inertia")
    truth = np.array([[walks[0].truth.parameters[joint][name] for name in NAMES] for joint in joints])
    speeds = usual_speeds(walks[0].robot, [walk.log for walk in walks])
    curves = [_curve(values, speeds[joint]) for joint, values in zip(joints, truth, strict=True)]
    coulomb, offset = NAMES.index("coulomb"), NAMES.index("offset")

    def size(errors: Array) -> tuple[float, float]:
        return _mean_and_worst(np.abs(errors[:, :, coulomb]) / truth[:, coulomb])

    def shape(errors: Array) -> tuple[float, float]:
        apart = [np.std(errors[:, k] @ curve.T, axis=1) for k, curve in enumerate(curves)]
        return _mean_and_worst(np.column_stack(apart) / truth[:, coulomb])

    known, bends_known = _drawn(trusted, len(joints)), _drawn(trusted, len(joints), BENDS)
    return Least(
        robot=robot,
        case=case,
        coulomb=size(known),
        coulomb_bends_known=size(bends_known),
        shape=shape(known),
        shape_bends_known=shape(bends_known),
        shape_model_wrong=shape(_drawn(wrong, len(joints))),
        offset=_mean_and_worst(np.abs(known[:, :, offset]))[0],
        offset_inertias_free=_mean_and_worst(np.abs(_drawn(corrected, len(joints))[:, :, offset]))[0],
    )


def _drawn(matrix: Array, joints: int, known: tuple[str, ...] = ()) -> Array:
    """Return errors of all joints' internal coordinates, shape (DRAWS, n, p), none of the `known` ones."""
    parameter = np.full(len(matrix), -1)
    parameter[: joints * len(NAMES)] = np.tile(np.arange(len(NAMES)), joints)
    free = np.flatnonzero(~np.isin(parameter, [NAMES.index(each) for each in known]))
    own = np.flatnonzero(parameter[free] >= 0)
    factor = np.linalg.cholesky(inverse_of(matrix[np.ix_(free, free)])[np.ix_(own, own)])
    errors = np.zeros((DRAWS, joints * len(NAMES)))
    errors[:, free[own]] = np.random.default_rng(0).standard_normal((DRAWS, len(own))) @ factor.T
    return errors.reshape(DRAWS, joints, len(NAMES))


def _curve(values: Array, speeds: Array) -> Array:
    """Return a friction curve's derivatives by internal coordinates [N m], shape (speeds, p)."""
    law = get_law(LAW)
    units = np.where([parameter.logarithmic for parameter in law.parameters], values, 1.0)
    return np.asarray(law.jacobian(speeds, values) * units)


def _mean_and_worst(errors: Array) -> tuple[float, float]:
    """Return the mean over joints and draws, shape (draws, n), and the mean of the worst joint of each draw."""
    return _rounded(errors.mean()), _rounded(errors.max(axis=1).mean())


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")


def table(found: list[Least]) -> list[str]:
    """Return a line for each robot and case."""
    return [
        f"| {each['robot']} | {each['case']} "
        f"| {_percent(each['coulomb'])} | {_percent(each['coulomb_bends_known'])} "
        f"| {_percent(each['shape'])} | {_percent(each['shape_bends_known'])} | {_percent(each['shape_model_wrong'])} "
        f"| {each['offset']:.3f} | {each['offset_inertias_free']:.3f} |"
        for each in found
    ]


def _percent(mean_and_worst: tuple[float, float]) -> str:
    mean, worst = mean_and_worst
    return f"{100 * mean:.2f} / {100 * worst:.1f}"


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

"""Switch off the mechanisms of the whole-log estimator in turn, and compare with the full estimator.

    python -m studies.ablation --save studies/ablation.json

Logs of real robots (STRIBECK_REAL_LOGS) are judged by the torque error on the robot's next log, over joints that get
friction both ways; logs with known friction by the median error of the points of curves: first seconds of the walks of
`studies.accuracy`, quadrupeds and everyday logs of `studies.legs` (STRIBECK_EVERYDAY), errors of `studies.coverage`.

The table contains the geometric means of these errors relative to the full estimator: mean over the logs of a robot,
then over robots, and the range of this mean if one robot is left out. Identified joints, covered and confidently wrong
points (`studies.legs`) and processor time are sums over the logs with known friction.
"""

import time
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace
from functools import lru_cache
from typing import Any
from unittest.mock import patch

import numpy as np

from stribeck import Robot, identify
from stribeck.core.errors import StribeckError
from stribeck.core.estimator.noise.variance_components import _between_groups
from stribeck.core.estimator.solver.fit import Fit
from stribeck.core.estimator.uncertainty.covariance_budget import covariance_budget
from stribeck.core.estimator.uncertainty.heterogeneity import Heterogeneity
from stribeck.core.judgement.curve import SPEEDS
from stribeck.core.log import RobotLog
from studies import baselines, coverage, legs
from studies.accuracy_cases import CASES as WALKED
from studies.accuracy_cases import exact_walks
from studies.command import Row, command, of_estimates, rounded
from studies.coverage import Curve, counts, points_of
from studies.harder_cases import as_seen
from studies.markdown import markdown_table

FULL = "nothing"


def _without_group_prior(fit: Fit) -> Any:
    return replace(fit.laws, group_prior=np.full((2, fit.internal.shape[1]), np.nan))


def _without_effects(_: object, __: int, fit: Fit, root_turns: Any, *___: object) -> tuple[Any, Any]:
    return np.zeros(len(fit.internal) + len(root_turns)), np.zeros_like(fit.covariance)


def _equal_folds(fit: Fit, effects: Any, group_mean: Any, differing: Heterogeneity, share: float) -> Any:
    return covariance_budget(fit, effects, group_mean, Heterogeneity(1.0, np.ones_like(differing.joints)), share)


PILOT, NOISE, TERMS = (f"estimator.{name}" for name in ("solver.pilot", "noise", "terms.term_selection"))
MODEL = "estimator.model.corrections.ModelCorrections"
MECHANISMS: dict[str, dict[str, object]] = {
    FULL: {},
    "least trimmed squares": {f"{PILOT}.consistent": lambda fit, *_: fit},
    "reweighting": {f"{PILOT}.undisturbed": lambda fit: fit},
    "median deviations": {f"{PILOT}.without_outliers": lambda groups, *_: groups},
    "window test": {f"{NOISE}.outliers.Prediction.set_aside": lambda _, part, __: part},
    "segment test": {f"{NOISE}.outliers.Prediction.contradicts": lambda *_: False},
    "spikes": {"identify.whole_log.without_spikes": lambda signal, *_, **__: (signal, 0)},
    "torque delay": {f"{PILOT}._delay_pays": lambda *_: False},
    "variance components": {f"{PILOT}.more_likely": lambda components, *_: components},
    "correlation between windows": {
        f"{NOISE}.variance_components._between_groups": lambda correlation, rows: _between_groups(
            correlation * (np.arange(len(correlation)) == 0), rows
        )
    },
    "standstill": {f"{PILOT}._near_standstill": lambda _, basis: np.zeros(len(basis.velocity))},
    "longer filters": {"equations.whole_log.filters.lengthened": lambda kernels, *_: kernels},
    "time to settle": {"equations.whole_log.segments.trims": lambda *_: (0.0, 0.0)},
    "wider bodies": {f"{MODEL}.widest": property(lambda self: self)},
    "learned widths": {f"{MODEL}.learned": lambda self, *_: self},
    "rotors above zero": {f"{MODEL}.with_possible_rotors": lambda self, _: self},
    "group prior": dict.fromkeys(
        ("estimator.solver.empirical_bayes.learn_group_prior", f"{TERMS}.learn_group_prior"), _without_group_prior
    ),
    "terms shared by most": {f"{TERMS}._shared_by_most": lambda *_: frozenset()},
    "proof of terms": {f"{TERMS}.unproven": lambda choice, *_: [{} for _ in choice.verdicts]},
    "support of terms": {"estimator.estimate.unsupported": lambda _, __, load, ___: [{} for _ in load]},
    "overdispersion": {"estimator.uncertainty.heterogeneity.overdispersion_of": lambda *_: 1.0},
    "differences of folds": {"estimator.estimate.covariance_budget": _equal_folds},
    "effects of gait phases": {"estimator.estimate.random_effect_covariance": _without_effects},
    "law's misfit": {"estimator.estimate.law_misfits": lambda fit, *_: np.zeros((len(fit.internal), len(SPEEDS)))},
}
"""What replaces functions of stribeck.core to switch a mechanism off."""
SHARE = 1 / 8
"""Part of the walks of 44 s that is used [1]."""
WALKS = (("G1", "clean"), ("TORO-like", "A"))
LAST = ", last log"
REAL = {
    f"{robot}{log}": robot
    for robot in ("airbot-play", "tx40", "kuka-lwr4", "kinova-gen3", "double-pendulum", "dfki-pendulum")
    for log in ("", LAST)
}
"""Real robot of each case: the fit to its first log predicts the second, the fit to its last log the first."""
LEGS = ("solo12-walk-7",)
EVERYDAY = ("trot/trot.npz", "payload/log.npz")
DIRTY = ("10-bit encoders", "LuGre", "friction grows with the load", "pushed every 2.1 s", "torques 8 ms late")
ROBOTS = (
    {f"{robot}, {case}": robot for robot, case in WALKS}
    | {name: name.split("-")[0] for name in LEGS}
    | {name: name.split("/")[0] for name in EVERYDAY}
    | dict.fromkeys(DIRTY, "arm")
    | REAL
)
"""Robot of each case."""


@lru_cache(maxsize=1)
def known(case: str) -> tuple[list[RobotLog] | str, Robot, list[str], Curve]:
    """Make or find the logs of a case, the robot, its joints with known friction, and their true curves."""
    if case in DIRTY:
        logs, robot, curve = coverage.made(case, 0)
        return logs, robot, [name for name in robot.joint_names if name not in robot.position_controlled], curve
    if case in (*LEGS, *EVERYDAY):
        path, robot, truth = legs.made(case)
        return str(path), robot, list(truth), lambda joint, speed: legs.friction(truth[joint], speed)
    name, errors = case.split(", ", 1)
    walks, robot, logs = as_seen(exact_walks(name), replace(WALKED[errors], share=SHARE), 0)
    values = {
        joint: {"gain": own["stribeck_gain"], "vs": own["stribeck_velocity"], "v0": 1 / own["slope"], **own}
        for joint, own in walks[0].truth.parameters.items()
    }
    return logs, robot, list(values), lambda joint, speed: legs.friction(values[joint], speed)


@lru_cache(maxsize=1)
def measured(robot: str) -> tuple[Robot, list[RobotLog]]:
    """Read a real robot and its logs."""
    return baselines.logs_of(robot)


def run(case: str, without: str) -> Row:
    """Identify a case without a mechanism."""
    measured(REAL[case]) if case in REAL else known(case)  # takes no part of the processor time below
    with ExitStack() as changed:
        for place, replacement in MECHANISMS[without].items():
            changed.enter_context(patch(f"stribeck.core.{place}", replacement))
        begin = time.process_time()
        try:
            row = on_the_next_log(case) if case in REAL else against_the_truth(case)
        except StribeckError as error:
            row = {"identified": 0, "refused": str(error)}
        return row | {"seconds": rounded(time.process_time() - begin)}


def on_the_next_log(case: str) -> Row:
    """Compute each joint's torque error on the next log; NaN without friction."""
    machine, logs = measured(REAL[case])
    first = -1 if case.endswith(LAST) else 0
    pair, results = baselines.run_pair(machine, logs[first], logs[first + 1], {"default": {}})
    joints = result.joints.values() if (result := results["default"]) else ()
    return {"identified": sum(joint.verdict == "identified" for joint in joints), "errors": pair["errors"]["default"]}


def against_the_truth(case: str) -> Row:
    """Count the points of curves, and compute their median error."""
    logs, robot, joints, curve = known(case)
    result = identify(logs, robot)
    points = points_of(result, joints, curve)
    identified = sum(result.joints[name].verdict == "identified" for name in joints)
    error = rounded(float(np.median([point[2] for point in points])), 4) if points else None
    return {"identified": identified, "points": counts(points), "error": error}


HEAD = (
    *("without", "best case", "worst case", "next log", "leaving one out", "known friction", "leaving one out"),
    *("identified", "covered", "wrong", "time"),
)


def tables(rows: list[Row]) -> list[str]:
    """Format the table of mechanisms, over the cases that the full estimator answers."""
    full = {row["case"]: row for row in rows if row["without"] == FULL and "refused" not in row}
    cells = []
    for name in MECHANISMS:
        if own := [row for row in rows if row["without"] == name and row["case"] in full]:
            judged = [row for row in own if row["case"] not in REAL]
            points = np.array([row.get("points", [0, 0, 0]) for row in judged]).reshape(-1, 3)
            count, covered, wrong = points.sum(axis=0).tolist()
            spent, before = (
                sum(row["seconds"] for row in some) for some in (judged, [full[r["case"]] for r in judged])
            )
            identified = sum(row["identified"] for row in judged)
            shares = identified, f"{covered} of {count}", wrong, f"{spent / before:.2f}" if before else ""
            cells.append([name, *_errors(own, full), *shares])
    return [markdown_table(HEAD, cells, 3)]


def _errors(rows: list[Row], full: Mapping[str, Row]) -> list[str]:
    """Format the best and the worst case, and mean and range of real robots and of known friction."""
    logs = {row["case"]: _log_ratio(row, full[row["case"]]) for row in rows}
    ordered = sorted((case for case in logs if np.isfinite(logs[case])), key=lambda case: logs[case])
    cells = [f"{case} {np.exp(logs[case]):.2f}" for case in (*ordered[:1], *ordered[-1:])] or ["", ""]
    for real in (True, False):
        robots = dict.fromkeys(ROBOTS[case] for case in ordered if (case in REAL) == real)
        of_each = [
            [logs[case] for case in ordered if ROBOTS[case] == robot and (case in REAL) == real] for robot in robots
        ]
        means = np.array([float(np.mean(each)) for each in of_each] or [np.nan])
        others = np.exp((means.sum() - means) / max(len(means) - 1, 1))
        cells += [f"{np.exp(means.mean()):.3f}", f"{others.min():.3f} to {others.max():.3f}"]
    return cells


def _log_ratio(row: Row, full: Row) -> float:
    """Compute the mean logarithm of a row's errors relative to those of the full estimator; NaN without any."""
    own, other = (np.atleast_1d(np.array(each.get("errors", each.get("error")), dtype=float)) for each in (row, full))
    logs = np.log(own / other)
    return float(logs[np.isfinite(logs)].mean()) if np.isfinite(logs).any() else np.nan


if __name__ == "__main__":
    keys = [{"case": case, "without": mechanism} for case in ROBOTS for mechanism in MECHANISMS]
    command(__doc__, keys, run, tables, of_estimates)

"""Put faults into logs, follow every remedy that `stribeck identify` prints, and compare with known friction.

    python -m studies.first_hour --save studies/first_hour.json

`fault`: a UR5 and a quadruped, with a wrong model and sensor noise, and one fault each. A remedy is applied exactly
as printed, until the next run prints no new one. `walk`: a humanoid's walk on which no threshold was chosen, with one
fault each, and no remedy.
"""

import re
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from shutil import rmtree

import numpy as np

import stribeck
from stribeck import LogError, NothingIdentifiedError, Robot
from stribeck.core.friction import get_law
from stribeck.core.log import RobotLog
from stribeck.core.result import JointResult
from stribeck.io.writers import write_log
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.sensors.measure import with_noise
from studies.accuracy_cases import CASES, LAW, NAMES, measured, wrong_model
from studies.changes import UR5, packaged, robot_from
from studies.command import ROOT, Row, command, rounded
from studies.fault_cases import FAULTS
from studies.harder_cases import other_walks
from studies.markdown import markdown_table
from studies.remedies import Run, Truth, follow

VAGUE = {"bodies-implausible", "chi-square", "friction-unclear", "heterogeneity", "passivity", "robot-model"}
VAGUE |= {"set-aside", "samples-lost", "not-excited", "weak", "position-stop", "position-limits", "several-causes"}
VAGUE |= {"torque-delay.ambiguous", "torque-unexplained"}
"""Checks whose findings name no cause."""
SURE = ("identified", "no friction")
"""Verdicts of joints whose curves should be right."""
WORSE = 0.05
"""Increase of a joint's largest relative error [1] from which a remedy counts as harmful."""
SHAPE = {"stribeck_gain": 0.25, "stribeck_velocity": 0.1, "offset": 0.0, "slope": 80.0}
"""Other parameters of friction in logs with faults."""


def run(kind: str, log: str, fault: str) -> Row:
    """Follow the remedies of a fault, or put a fault into a walk."""
    return run_fault(log, fault) if kind == "fault" else run_walk(log, fault)


@cache
def made(log: str, fault: str) -> tuple[RobotLog, Robot, str, Truth]:
    """Make a log with a fault, its robot and robot file, and its true friction by joint."""
    change = FAULTS[fault]
    text = UR5 if log == "arm" else packaged("quadruped.toml", "quadruped.urdf")
    text = text.replace("[robot]", '[robot]\ntorque_source = "motor_current"')
    robot = robot_from(text)
    real = change.of_robot(wrong_model(robot, 7))
    limits = np.minimum(robot.effort_limits, 150.0)
    friction = {
        joint: SHAPE | {"viscous": 0.02 * limit, "coulomb": 0.04 * limit}
        for joint, limit in zip(robot.joint_names, limits.tolist(), strict=True)
    }
    law = get_law("stribeck")
    clean, _ = exact_log(real, law, friction, duration=12.0, rate=200.0, seed=11, gait="walk")
    noisy = replace(with_noise(clean, position=2e-5, torque=0.05, seed=5), velocity=clean.velocity)
    truth = {
        joint: lambda v, own=own: float(law.torque(np.array([v]), np.array([own[p.name] for p in law.parameters]))[0])
        for joint, own in friction.items()
    }
    return change.apply(noisy, robot)[0], robot, text, truth


def run_fault(log: str, fault: str) -> Row:
    """Follow the remedies of a log with a fault."""
    given, robot, text, truth = made(log, fault)
    folder = ROOT / "build" / "first-hour" / re.sub("[ /]", "-", f"{log}-{fault}")
    rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (folder / "robot.toml").write_text(text)
    write_log(given, folder / "log.npz")
    first, last = follow(folder / "log.npz", folder / "robot.toml", truth)
    return {"cause": _cause(first, log, fault, robot), **_judged(first, last)}


@cache
def _without_fault(log: str) -> frozenset[str]:
    """List the findings of a log without a fault; they concern the wrong model."""
    given, robot, _, _ = made(log, "none")
    return frozenset(finding.check for finding in stribeck.identify(given, robot).findings)


def _cause(found: Run, log: str, fault: str, robot: Robot) -> str:
    """Judge what the findings of a log with a fault name."""
    made, expected = FAULTS[fault], set(FAULTS[fault].joints(robot))
    named = [
        not joints or not expected or bool(expected & set(joints))
        for check, (joints, words) in found.findings.items()
        if check in made.checks and "before you" not in words
    ]
    if any(named) or any(word in found.refused and "before you" not in found.refused for word in made.words):
        return "named"
    if any(word in words for _, words in found.findings.values() for word in made.words):
        return "listed"
    others = found.findings.keys() - VAGUE - {"torque-scale"} - _without_fault(log)
    return "wrong" if others else "not named"


@cache
def turning_walk(name: str) -> tuple[RobotLog, Robot, Mapping[str, Mapping[str, float]]]:
    """Make the log of a turning walk, the exact model, and the true parameters of friction by joint."""
    found = other_walks(name)[2]
    none = dict.fromkeys(found.log.joint_names, dict.fromkeys(NAMES, 0.0))  # the controller keeps the arms still
    return measured(found.log, CASES["A"], 5, 0), found.robot, none | found.truth.parameters


def run_walk(name: str, fault: str) -> Row:
    """Identify a walk with a fault by default settings, and judge whether the findings lead to the cause."""
    given, robot, truth = turning_walk(name)
    made_fault = FAULTS[fault]
    joints: dict[str, JointResult] = {}
    try:
        result = stribeck.identify(*made_fault.apply(given, robot))
        joints, checks = result.joints, dict.fromkeys(finding.check for finding in result.findings)
    except (LogError, NothingIdentifiedError) as error:
        explained = re.search(r"stribeck explain ([\w-]+)", str(error))
        words = [word for word in made_fault.words if word in str(error)]
        checks = dict.fromkeys([explained[1]] if explained else words)
    wrong = [joint for joint, own in joints.items() if _is_wrong(own, truth[joint])]
    if checks.keys() & {*made_fault.checks, *made_fault.words}:
        cause = "named"
    elif checks.keys() - VAGUE:
        cause = "wrong"
    else:
        cause = "warned" if checks else "silent" if wrong else "harmless"
    sure = [joint for joint, own in joints.items() if own.verdict in SURE]
    return {"found": list(checks), "identified": len(sure), "wrong": wrong, "cause": cause}


def _is_wrong(joint: JointResult, truth: Mapping[str, float]) -> bool:
    """Whether a point of a curve with a sure verdict is off by 10 %, 0.05 N m and two half-widths of its interval."""
    law, values = get_law(LAW), np.array([truth[name] for name in NAMES])
    for point in joint.curve if joint.verdict in SURE else ():
        true = float(law.torque(np.array([point.velocity]), values)[0]) - truth["offset"]
        if abs(point.value - true) > max(0.1 * true, 0.05, 2 * point.half_width):
            return True
    return False


def _judged(first: Run, last: Run) -> Row:
    both = first.error.keys() & last.error.keys()
    return {
        "before": rounded(max(first.error.values(), default=0.0), 2),
        "after": rounded(max(last.error.values(), default=0.0), 2),
        "wrong_before": first.wrong,
        "wrong": last.wrong,
        "worse": sorted(joint for joint in both if last.error[joint] > first.error[joint] + WORSE),
        "found": list(first.findings),
        "left": list(last.findings),
        "refused": re.sub(r"(^|\s)/\S*/", r"\1", last.refused),  # without folders
    }


def tables(rows: list[Row]) -> list[str]:
    """Format the tables of faults and of a walk with faults."""
    faults, walks = ([row for row in rows if row["kind"] == kind] for kind in ("fault", "walk"))
    head = ("error before [%]", "after [%]", "wrong", "findings at first")
    counts = []
    for log in ("arm", "walk"):
        own = [row for row in faults if row["log"] == log and row["fault"] != "none"]
        causes = [sum(row["cause"] == cause for row in own) for cause in CAUSES]
        counts.append((log, len(own), *causes, *(sum(bool(row[key]) for row in own) for key in ("worse", "wrong"))))
    walked = [
        (row["fault"], row["log"], row["identified"], len(row["wrong"]), _list(row["found"]), row["cause"])
        for row in walks
    ]
    judged = [(row["fault"], row["log"], row["cause"], *_cells(row)) for row in faults]
    return [
        markdown_table(("fault", "log", "cause", *head), judged, 3),
        markdown_table(("log", "faults", *CAUSES, "made worse by a remedy", "wrong in the end"), counts),
        markdown_table(("fault", "robot", "identified", "wrong", "findings", "cause"), walked, 2),
    ]


CAUSES = ("named", "listed", "not named", "wrong")


def _cells(row: Row) -> tuple[object, ...]:
    after = "refused" if row["refused"] else f"{100 * row['after']:.0f}"
    return f"{100 * row['before']:.0f}", after, len(row["wrong"]), _list(row["found"])


def _list(checks: list[str]) -> str:
    return ", ".join(f"`{check}`" for check in checks) or "-"


if __name__ == "__main__":
    keys: list[Row] = []
    for fault, own in FAULTS.items():
        kinds = (("fault", "arm"), ("fault", "walk"), ("walk", "G1"))
        keys += [{"kind": kind, "log": log, "fault": fault} for kind, log in kinds if log in own.of.split()]
    command(__doc__, keys, run, tables)

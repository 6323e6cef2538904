"""Take logs from `stribeck init` to `stribeck identify`, follow every printed remedy, and compare with known friction.

    python -m studies.first_hour --save studies/first_hour.json

`case`: logs as users bring them, in the folder $STRIBECK_CASES; each question of `init` is answered as the README of
the case says. `fault`: a UR5 and a quadruped, with a wrong model and sensor noise, and one fault each. A remedy is
applied as it is printed, until the next run prints no new one. `walk`: a humanoid's walk on which no threshold was
chosen, with one fault each, and no remedy.
"""

import json
import os
import re
import sys
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from shutil import rmtree
from typing import Any

import numpy as np

import stribeck
from stribeck import Robot
from stribeck.friction import get_law
from stribeck.log import RobotLog
from stribeck.log.writers import write_log
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.robots import MODELS
from stribeck_simulation.sensors.measure import with_noise
from studies.accuracy_cases import wrong_model
from studies.command import ROOT, Row, command, rounded
from studies.fault_cases import FAULTS
from studies.markdown import markdown_table
from studies.remedies import Run, Truth, answer, follow, typed
from studies.turning_walk import VAGUE, run_walk
from studies.walking_cases import EXAMPLES

WORSE = 0.05
"""Increase of a joint's largest relative error [1] from which a remedy counts as harmful."""
CASES = (
    *(f"bags/{name}" for name in ("custom_msg", "float_arrays", "phantom_full")),
    *(f"joint-number-before-channel/{name}.csv" for name in ("axis0.pos_estimate", "currents_I1", "m1.position")),
    "joint-number-before-channel/rostopic_echo_p.csv",
    "nested-mat-with-units-in-names/log.mat",
    "payload-read-as-gain/log_2kg.npz",
    *(f"repeated-stamps/{name}.csv" for name in ("clock_of_50_ms", "stamps_in_threes", "whole_seconds")),
    *(f"{name}/log.npz" for name in ("effort-in-amperes", "init-scales-slipping-quadruped", "one-joint-of-seven-real")),
    *(f"{name}/log.npz" for name in ("payload-read-as-gain", "pick-and-place-slow", "prismatic-in-mm", "slow-arm")),
    *(f"{name}/log.npz" for name in ("tight-zone", "tilted-mount-10deg", "trot-wide-intervals")),
    *(f"{name}/log.csv" for name in ("servo-ticks", "sparse-table-of-two-topics", "turns-read-as-radians")),
    "uint16-current/log.csv",
    *(f"airbot-play/{name}" for name in ("trapezoids", "chirp", "chirp_with_payload")),
)
"""Logs of users."""
ANSWERS: dict[str, dict[str, Any]] = {
    "": {"robot.torque_source": "motor_current"},
    "effort-in-amperes": {"log.torque.unit": "A"},
    "repeated-stamps": {"log.rate": 100.0},
    "airbot-play": {"log.rate": 100.0},
}
"""Answers to the questions of `init`, for all cases and by case."""
ARM3 = {"shoulder": (1.2, 0.8), "elbow": (0.7, 0.4), "wrist": (0.25, 0.10)}
"""Coulomb [N m] and viscous friction [N m s/rad] of the cases with arm3.urdf."""


def run(kind: str, log: str, fault: str) -> Row:
    """Follow a case or a fault, or put a fault into a walk."""
    return run_case(log) if kind == "case" else run_fault(log, fault) if kind == "fault" else run_walk(log, fault)


def run_case(name: str) -> Row:
    """Take a case from `init` to `identify`."""
    airbot = name.startswith("airbot")
    data = os.environ.get("STRIBECK_REAL_LOGS" if airbot else "STRIBECK_CASES")
    if not data:
        sys.exit("the logs of users are not part of this repository: set STRIBECK_CASES and STRIBECK_REAL_LOGS to them")
    log, folder = Path(data) / name, ROOT / "build" / "first-hour" / name.replace("/", "-")
    rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (model,) = (Path(data) / name.partition("/")[0]).glob("*.urdf")
    code, words = typed("init", model, log, "-o", folder / "robot.toml")
    if not (folder / "robot.toml").exists():
        return {"init": words, "code": code}
    text = (folder / "robot.toml").read_text()
    asked = text.count("TODO: ")
    (folder / "robot.toml").write_text(re.sub(r"^ *#.*\n", "", text, flags=re.MULTILINE))
    answer(folder / "robot.toml", ANSWERS[""] | ANSWERS.get(name.partition("/")[0], {}))
    given = log.parent / "truth.json"
    truth: dict[str, Any] = {}
    if given.exists():
        truth = {joint: _curve(own) for joint, own in json.loads(given.read_text())["joints"].items()}
    elif model.name == "arm3.urdf":
        truth = {joint: _curve({"coulomb": c, "viscous": v}) for joint, (c, v) in ARM3.items()}
    return {"asked": asked, **_judged(*follow(log, folder / "robot.toml", truth))}


def _curve(own: Mapping[str, float]) -> Any:
    """Make the function of friction against velocity from a case's parameters."""

    def torque(velocity: float) -> float:
        height = 1 + own.get("gain", 0.0) * np.exp(-((velocity / own.get("vs", 1.0)) ** 2))
        sliding = own["coulomb"] * height * np.tanh(velocity / own.get("v0", 1e-6)) + own["viscous"] * velocity
        return float(own.get("scale", 1.0) * sliding + own.get("extra_coulomb", 0.0))

    return torque


@cache
def made(log: str, fault: str) -> tuple[RobotLog, Robot, str, Truth]:
    """Make a log with a fault, its robot and robot file, and its true friction by joint."""
    change = FAULTS[fault]
    if log == "arm":
        text = f'[robot]\nmodel = "{EXAMPLES}/ur_description/urdf/ur5_robot.urdf"\nbase = "fixed"\n'
    else:
        text = (MODELS / "quadruped.toml").read_text().replace("quadruped.urdf", str(MODELS / "quadruped.urdf"))
    text = text.replace("[robot]", '[robot]\ntorque_source = "motor_current"')
    path = ROOT / "build" / "first-hour" / f"{log}.toml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    robot = Robot.from_file(path)
    real = change.of_robot(wrong_model(robot, 7))
    limits = np.minimum(robot.effort_limits, 150.0)
    friction = {
        joint: {
            "viscous": 0.02 * limit,
            "coulomb": 0.04 * limit,
            "stribeck_gain": 0.25,
            "stribeck_velocity": 0.1,
            "offset": 0.0,
            "slope": 80.0,
        }
        for joint, limit in zip(robot.joint_names, limits.tolist(), strict=True)
    }
    law = get_law("stribeck")
    clean, _ = exact_log(real, law, friction, duration=12.0, rate=200.0, seed=11, gait="walk")
    noisy = with_noise(clean, position=2e-5, torque=0.05, seed=5)
    noisy = replace(noisy, velocity=clean.velocity, acceleration=None)
    truth = {
        joint: lambda v, own=own: float(law.torque(np.array([v]), np.array([own[p.name] for p in law.parameters]))[0])
        for joint, own in friction.items()
    }
    return change.apply(noisy, robot)[0], robot, text, truth


def run_fault(log: str, fault: str) -> Row:
    """Follow the remedies of a log with a fault."""
    given, robot, text, truth = made(log, fault)
    folder = ROOT / "build" / "first-hour" / f"{log}-{fault.replace(' ', '-').replace('/', '-')}"
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
    made = FAULTS[fault]
    named = [
        not (joints and made.joints(robot)) or bool(set(joints) & set(made.joints(robot)))
        for check, (joints, words) in found.findings.items()
        if check in made.checks and "before you" not in words
    ]
    if any(named) or any(word in found.refused and "before you" not in found.refused for word in made.words):
        return "named"
    if any(word in words for _, words in found.findings.values() for word in made.words):
        return "listed"
    others = found.findings.keys() - VAGUE - {"torque-scale"} - _without_fault(log)
    return "wrong" if others else "not named"


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
        "refused": last.refused,
    }


def tables(rows: list[Row]) -> list[str]:
    """Format the tables of cases, of faults and of a walk with faults."""
    cases, faults, walks = ([row for row in rows if row["kind"] == kind] for kind in ("case", "fault", "walk"))
    head = ("log", "questions", "error before [%]", "after [%]", "wrong", "findings at first")
    lines = [(row["log"], row.get("asked", "no draft"), *_cells(row)) for row in cases]
    of_faults = [(row["fault"], row["log"], row["cause"], *_cells(row)) for row in faults]
    counts = []
    for log in ("arm", "walk"):
        own = [row for row in faults if row["log"] == log and row["fault"] != "none"]
        causes = [sum(row["cause"] == cause for row in own) for cause in CAUSES]
        counts.append((log, len(own), *causes, *(sum(bool(row[key]) for row in own) for key in ("worse", "wrong"))))
    walked = [
        (row["fault"], row["log"], row["identified"], len(row["wrong"]), _list(row["found"]), row["cause"])
        for row in walks
    ]
    bad = ("made worse by a remedy", "wrong in the end")
    return [
        markdown_table(head, lines),
        markdown_table(("fault", "log", "cause", *head[2:]), of_faults, 3),
        markdown_table(("log", "faults", *CAUSES, *bad), counts),
        markdown_table(("fault", "robot", "identified", "wrong", "findings", "cause"), walked, 2),
    ]


CAUSES = ("named", "listed", "not named", "wrong")


def _cells(row: Row) -> tuple[object, ...]:
    if "before" not in row:
        return ("-", "-", "-", row["init"])
    after = "refused" if row["refused"] else f"{100 * row['after']:.0f}"
    return f"{100 * row['before']:.0f}", after, len(row["wrong"]), _list(row["found"])


def _list(checks: list[str]) -> str:
    return ", ".join(f"`{check}`" for check in checks) or "-"


if __name__ == "__main__":
    keys = [{"kind": "case", "log": name, "fault": ""} for name in CASES]
    of = (("fault", "arm"), ("fault", "walk"), ("walk", "G1"))
    keys += [
        {"kind": kind, "log": log, "fault": fault}
        for fault, own in FAULTS.items()
        for kind, log in of
        if log in own.of.split()
    ]
    command(__doc__, keys, run, tables)

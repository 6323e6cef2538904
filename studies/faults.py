"""Measure which semantic faults of a log the audit reports, one at a time, and its false alarms on clean logs.

    python -m studies.faults --save studies/faults.json

Every fault is put into the log of an arm and into a humanoid's walk, if it applies there, with sensor noise and a wrong
model. The arm is a Panda in random motion; the humanoid is a G1 that turns. Thresholds were chosen on other logs: other
arms, straight, sideways and diagonal walks, and real robots. Wrong units are also put into two logs in which no torque
gain can be identified: a turntable with high friction and no load, and a quadruped that stands on all feet. The table
contains the audit's reports, and whether an unreported fault led to a wrong friction that a method called identified
without any warning. Clean logs, whole and in windows of 1, 2 and 10 s, should have no finding.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from stribeck import LogError, NothingIdentifiedError, Robot, Settings, identify
from stribeck.audit import audit
from stribeck.friction import get_law
from stribeck.friction_torque.preparation import prepare
from stribeck.log import RobotLog
from stribeck.result import JointResult
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.prescribed.gait import Gait
from stribeck_simulation.robots import MODELS
from stribeck_simulation.sensors.measure import with_noise
from studies.accuracy_cases import CASES, LAW, NAMES, measured, wrong_model
from studies.command import ROOT, Row, command
from studies.fault_cases import FAULTS, WALK_FAULTS, Fault
from studies.harder_cases import other_walks
from studies.markdown import markdown_table
from studies.walking_cases import EXAMPLES

VAGUE = (
    "bodies-implausible",
    "chi-square",
    "friction-unclear",
    "heterogeneity",
    "passivity",
    "position-stop",
    "set-aside",
    "torque-delay.ambiguous",
    "torque-unexplained",
)
"""Checks whose findings name no cause."""
SECONDS = 20.0
"""Duration of a log that faults are put into [s]."""
WINDOWS = {10.0: 3, 2.0: 8, 1.0: 12}
"""Number of windows, spread evenly over a clean log, by window length [s]."""
WRONG, SMALL = 0.25, 0.1
"""Errors above which Coulomb friction counts as wrong: relative [1] and absolute [N m]."""
CLEAN = "none"
WALK_HEAD = ("fault", "robot", "identified", "wrong", "findings", "cause")
HEAD = ("fault", "log", "found", "named")
CLEAN_HEAD = ("clean log", "whole", *(f"{seconds:g} s" for seconds in WINDOWS))


@dataclass(frozen=True, eq=False)
class CleanLog:
    """Robot as described by its (wrong) model, its log without faults, and true parameters of friction by joint."""

    robot: Robot
    log: RobotLog
    truth: dict[str, dict[str, float]]


ARM = '[robot]\nname = "arm"\nmodel = "{}/panda_description/urdf/panda.urdf"\nbase = "fixed"\n'
TURNTABLE = """<robot name="turntable"><link name="base"/><link name="table"><inertial><mass value="4"/>
<inertia ixx="0.05" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.05"/></inertial></link>
<joint name="axis" type="revolute"><parent link="base"/><child link="table"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="30" velocity="4"/></joint></robot>"""


def _written(name: str, text: str) -> str:
    path = ROOT / "build" / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return str(path)


def arm() -> CleanLog:
    """Make the log of an arm in random motion."""
    return _moved(Robot.from_file(_written("faults.toml", ARM.format(EXAMPLES))), 21, 0.8, 0.4, "walk")


def turntable() -> CleanLog:
    """Make the log of a single vertical axis, whose friction is far larger than its inertial torque."""
    return _moved(Robot.from_model(_written("turntable.urdf", TURNTABLE), base="fixed"), 31, 3.0, 1.0, "stand")


def standing() -> CleanLog:
    """Make the log of a quadruped that moves about and stands on all feet throughout."""
    return _moved(Robot.from_file(MODELS / "quadruped.toml"), 32, 3.0, 1.0, "stand")


def _moved(robot: Robot, seed: int, coulomb: float, viscous: float, gait: Gait) -> CleanLog:
    friction = {"viscous": viscous, "coulomb": coulomb, "stribeck_gain": 0.2, "stribeck_velocity": 0.2}
    parameters = {joint: {**friction, "offset": 0.0, "slope": 40.0} for joint in robot.joint_names}
    log, _ = exact_log(robot, get_law(LAW), parameters, duration=SECONDS, rate=500.0, seed=seed, gait=gait)
    log = replace(with_noise(log, position=2e-5, torque=0.1, seed=seed), velocity=None, acceleration=None)
    return CleanLog(wrong_model(robot, seed), log, parameters)


def humanoid() -> CleanLog:
    """Make the log of a walk that no constant was tuned on."""
    walk = other_walks("G1")[2]
    rows = slice(min(len(walk.log.time), round(SECONDS * len(walk.log.time) / np.ptp(walk.log.time))))
    log = measured(walk.log.take(rows), CASES["A"], 5, 0)
    return CleanLog(wrong_model(walk.robot, 5), log, dict(walk.truth.parameters))


@cache
def walk(name: str) -> CleanLog:
    """Make the log of a turning walk; the model is exact."""
    found = other_walks(name)[2]
    none = dict.fromkeys(found.log.joint_names, dict.fromkeys(NAMES, 0.0))  # the controller keeps the arms still
    return CleanLog(found.robot, measured(found.log, CASES["A"], 5, 0), none | found.truth.parameters)


WALKS = {"walk of TALOS": "TALOS", "walk of G1": "G1"}
"""Walks that are identified; thresholds were chosen on the first."""
LOGS = {"arm": cache(arm), "humanoid": cache(humanoid), "turntable": cache(turntable), "standing": cache(standing)}


def checks_of(log: RobotLog, robot: Robot) -> tuple[list[str], str]:
    """List the checks with findings, and the error if the log was refused."""
    try:
        return [f.check for f in audit(prepare(log, robot, robot.settings), robot, robot.settings)], ""
    except LogError as error:
        return ["refused"], str(error)


def run(log: str, fault: str) -> Row:
    """Audit a log with a fault, or a clean one in windows."""
    if log in WALKS:
        return run_walk(WALKS[log], fault)
    given = LOGS[log]()
    if fault == CLEAN:
        return {"clean": windows_with_findings(given)}
    made = FAULTS[fault]
    changed, robot = made.apply(given.log, given.robot)
    found, refusal = checks_of(changed, robot)
    named = bool(set(found) & set(made.checks)) or bool(made.words and made.words in refusal)
    wrong = [] if found else wrong_unwarned(changed, robot, given.truth)
    return {"found": list(dict.fromkeys(found)), "named": named, "wrong": wrong}


def wrong_unwarned(log: RobotLog, robot: Robot, truth: dict[str, dict[str, float]]) -> list[str]:
    """List the joints whose verdict is identified but whose Coulomb friction is wrong; empty after any warning."""
    try:
        result = identify(log, robot, Settings(method="curve-fit"), force=True)
    except NothingIdentifiedError:
        return []
    wrong = []
    for name, joint in result.joints.items():
        value, true = joint.parameters.get("coulomb"), truth.get(name, {}).get("coulomb")
        if value is None or true is None or not joint.verdict == value.verdict == "identified":
            continue
        if abs(value.value - true) > max(WRONG * true, SMALL):
            wrong.append(name)
    return [] if result.warnings else wrong


def run_walk(name: str, fault: str) -> Row:
    """Identify a walk with a fault by default settings, and judge whether the findings lead to the cause."""
    given = walk(name)
    made = WALK_FAULTS.get(fault, Fault(lambda log, robot: (log, robot), ()))
    log, robot = made.apply(given.log, given.robot)
    joints: dict[str, JointResult] = {}
    try:
        result = identify(log, robot)
        joints, found = result.joints, [(finding.check, str(finding)) for finding in result.findings]
    except (LogError, NothingIdentifiedError) as error:
        words = str(error)
        found = [
            (made.words if made.words and made.words in words else words.rpartition("explain ")[2].strip(")"), words)
        ]
    wrong = [joint for joint, own in joints.items() if _is_wrong(own, given.truth[joint])]
    sure = [joint for joint, own in joints.items() if own.verdict in ("identified", "no friction")]
    checks = dict.fromkeys(check for check, _ in found)
    listed = any(f"{check}: " in text for given, text in found if given == "several-causes" for check in made.checks)
    others = [check for check in checks if check not in (*made.checks, made.words, *VAGUE)]
    others = [check for check in others if not (listed and check == "several-causes")]
    if set(checks) & {*made.checks, made.words} - {""}:
        cause = "named, with others" if others else "named"
    elif others:
        cause = "wrong"
    elif listed:
        cause = "listed"
    else:
        cause = "warned" if checks else "silent" if wrong else "harmless"
    return {
        "robot": name,
        "found": list(checks),
        "identified": len(sure),
        "wrong": wrong,
        "cause": cause,
    }


def _is_wrong(joint: JointResult, truth: dict[str, float]) -> bool:
    """Whether a point of a curve with a sure verdict is off by 10 %, 0.05 N m and two half-widths of its interval."""
    if joint.verdict not in ("identified", "no friction"):
        return False
    law, values = get_law(LAW), np.array([truth[name] for name in NAMES])
    for point in joint.curve:
        true = float(law.torque(np.array([point.velocity]), values)[0]) - truth["offset"]
        if abs(point.value - true) > max(0.1 * true, 0.05, 2 * point.half_width):
            return True
    return False


def windows(log: RobotLog, seconds: float, count: int) -> Iterator[RobotLog]:
    """Yield `count` windows of a log, evenly spaced."""
    length = round(seconds * (len(log.time) - 1) / (log.time[-1] - log.time[0]))
    for start in np.linspace(0, len(log.time) - length, count).astype(int).tolist():
        yield log.take(slice(start, start + length))


def windows_with_findings(given: CleanLog) -> dict[str, list[int]]:
    """Count windows with a finding, and all windows, by length."""
    found = {"whole": [int(bool(checks_of(given.log, given.robot)[0])), 1]}
    for seconds, count in WINDOWS.items():
        each = [bool(checks_of(part, given.robot)[0]) for part in windows(given.log, seconds, count)]
        found[f"{seconds:g} s"] = [sum(each), count]
    return found


def tables(rows: list[Row]) -> list[str]:
    """Format the tables of faults and of clean logs."""
    walks = [row for row in rows if row["log"] in WALKS]
    rows = [row for row in rows if row not in walks]
    faulty, clean = ([row for row in rows if (row["fault"] == CLEAN) == kind] for kind in (False, True))
    cells = [
        (row["fault"], row["log"], ", ".join(f"`{check}`" for check in row["found"]) or "-", _yes(row["named"]))
        for row in faulty
    ]
    counts = [(row["log"], *("{} of {}".format(*row["clean"][length]) for length in CLEAN_HEAD[1:])) for row in clean]
    walked = [
        (
            row["fault"],
            row["robot"],
            row["identified"],
            len(row["wrong"]),
            ", ".join(f"`{check}`" for check in row["found"]) or "-",
            row["cause"],
        )
        for row in walks
    ]
    return [markdown_table(HEAD, cells, 4), markdown_table(CLEAN_HEAD, counts), markdown_table(WALK_HEAD, walked, 2)]


def _yes(named: bool) -> str:
    return "yes" if named else "no"


if __name__ == "__main__":
    keys = [{"log": log, "fault": name} for name, fault in FAULTS.items() for log in LOGS if log in fault.of]
    keys += [{"log": log, "fault": CLEAN} for log in (*LOGS, *WALKS)]
    keys += [{"log": log, "fault": fault} for log in WALKS for fault in WALK_FAULTS]
    command(__doc__, keys, run, tables)

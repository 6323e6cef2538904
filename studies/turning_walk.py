"""Faults in a humanoid's turning walk, on which no threshold was chosen, and whether the findings lead to the cause."""

import re
from collections.abc import Mapping
from functools import cache

import numpy as np

from stribeck import LogError, NothingIdentifiedError, Robot, identify
from stribeck.friction import get_law
from stribeck.log import RobotLog
from stribeck.result import JointResult
from studies.accuracy_cases import CASES, LAW, NAMES, measured
from studies.command import Row
from studies.fault_cases import FAULTS
from studies.harder_cases import other_walks

VAGUE = {"bodies-implausible", "chi-square", "friction-unclear", "heterogeneity", "passivity", "robot-model"}
VAGUE |= {"set-aside", "samples-lost", "not-excited", "weak", "position-stop", "position-limits", "several-causes"}
VAGUE |= {"torque-delay.ambiguous", "torque-unexplained"}
"""Checks whose findings name no cause."""
SURE = ("identified", "no friction")
"""Verdicts of joints whose curves should be right."""


@cache
def walk(name: str) -> tuple[RobotLog, Robot, Mapping[str, Mapping[str, float]]]:
    """Make the log of a turning walk, the exact model, and the true parameters of friction by joint."""
    found = other_walks(name)[2]
    none = dict.fromkeys(found.log.joint_names, dict.fromkeys(NAMES, 0.0))  # the controller keeps the arms still
    return measured(found.log, CASES["A"], 5, 0), found.robot, none | found.truth.parameters


def run_walk(name: str, fault: str) -> Row:
    """Identify a walk with a fault by default settings, and judge whether the findings lead to the cause."""
    given, robot, truth = walk(name)
    made = FAULTS[fault]
    joints: dict[str, JointResult] = {}
    try:
        result = identify(*made.apply(given, robot))
        joints, checks = result.joints, dict.fromkeys(finding.check for finding in result.findings)
    except (LogError, NothingIdentifiedError) as error:
        explained = re.search(r"stribeck explain ([\w-]+)", str(error))
        checks = dict.fromkeys([explained[1]] if explained else [word for word in made.words if word in str(error)])
    wrong = [joint for joint, own in joints.items() if _is_wrong(own, truth[joint])]
    if checks.keys() & {*made.checks, *made.words}:
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

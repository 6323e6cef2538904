"""Positions with an inverted sign, found by trial: with which sign standing feet rest, or a fixed arm's torques fit."""

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np
from scipy.spatial.transform import Rotation

from stribeck.audit.evidence import Evidence, gather
from stribeck.audit.regression import FEWEST, unexplained
from stribeck.audit.scale import scale_line
from stribeck.base.finding import Finding
from stribeck.base.typing import Array
from stribeck.dynamics.state import root_quaternions
from stribeck.settings import Settings

BETTER = 0.8
"""What the other sign must leave of the cost, also relative to other signs of the next best joint [1]."""
FEW_SAMPLES = 6000
"""Number of samples with which signs are tried [1]."""
POOR = 0.2
"""Share of an arm's torques that the given signs must leave unexplained, and the other signs must not [1]."""


def check_inverted(evidence: Evidence, settings: Settings) -> list[Finding]:
    """Report joints whose position fits the model far better with the other sign."""
    fixed = evidence.robot.base == "fixed"
    cost_of: Callable[[Evidence], float] = _unexplained if fixed else _motion_of_feet
    given = cost = cost_of(evidence)
    if not cost > (POOR if fixed else 0.0) or evidence.prepared.log.external_torque is not None:
        return []  # an external torque with the wrong sign is like all positions and torques with the wrong sign
    names: list[str] = []
    shown = np.flatnonzero(evidence.robot.standing(tuple(evidence.robot.contacts)) | fixed)
    examined = {evidence.robot.joint_names[column] for column in shown} & set(evidence.joints)
    while left := examined - set(names):
        trials = {name: _inverted(evidence, name, settings if fixed else None) for name in left}
        costs = {name: cost_of(trial) for name, trial in trials.items()}
        best, *others = sorted(costs, key=costs.__getitem__)
        if costs[best] > BETTER * min([cost, *(costs[name] for name in others)]):
            break
        names.append(best)
        evidence, cost = trials[best], costs[best]
    if not names or (fixed and cost > POOR):
        return []
    channels = ("position", "velocity")[: 1 + (evidence.prepared.log.velocity is not None)]
    setting = " and ".join(scale_line(evidence.robot, dict.fromkeys(names, -1.0), channel) for channel in channels)
    what = "the unexplained torque" if fixed else "the motion of standing feet"
    return [Finding.of("position-sign", sorted(names), what=what, left=100 * cost / given, setting=setting)]


def _inverted(evidence: Evidence, joint: str, settings: Settings | None) -> Evidence:
    """Invert the position of a joint; with settings, compute the model's torque anew from part of the log."""
    log, column = evidence.prepared.log, evidence.robot.joint_names.index(joint)
    sign = np.where(np.arange(log.position.shape[1]) == column, -1.0, 1.0)
    other = {
        name: sign * values
        for name in ("position", "velocity", "acceleration")
        if (values := getattr(log, name)) is not None
    }
    prepared = replace(evidence.prepared, log=replace(log, **other))
    return gather(prepared, evidence.robot, settings, FEW_SAMPLES) if settings else replace(evidence, prepared=prepared)


def _unexplained(evidence: Evidence) -> float:
    """Compute the mean share of the torques that model and friction leave unexplained, with their better signs [1]."""
    shares = [min(unexplained(evidence, k, sign) for sign in (1.0, -1.0)) for k in range(len(evidence.joints))]
    return float(np.mean(shares))


def _motion_of_feet(evidence: Evidence) -> float:
    """Compute the mean rate of standing feet [rad or 1 per bin]: soles turn, and points move relative to others."""
    robot, log = evidence.robot, evidence.prepared.log.take(evidence.rows)
    if log.base_orientation is None:
        return float("nan")
    turn = Rotation.from_quat(root_quaternions(robot, log.position, log.base_orientation))
    together = evidence.run[1:] == evidence.run[:-1]
    standing = {
        foot: np.array([foot in name.split("+") for name in evidence.support_names])[evidence.support]
        for foot, contact in robot.contacts.items()
        if contact.kind != "wheel"
    }
    rates: list[Array] = []
    points: dict[str, Array] = {}
    for foot, stands in standing.items():
        rotation, place = robot.foot_pose(foot, log.position)
        if robot.contacts[foot].kind == "surface":
            sole = turn * Rotation.from_matrix(rotation)
            turned = np.atleast_1d((sole[:-1].inv() * sole[1:]).magnitude())
            rates.append(turned[together & stands[1:] & stands[:-1]])
        else:
            points[foot] = place
    for one, other in combinations(points, 2):
        both = standing[one] & standing[other]
        steps: Array = np.linalg.norm(np.diff(turn.apply(points[one] - points[other]), axis=0), axis=1)
        length: Array = np.linalg.norm(points[one], axis=1)
        rates.append((steps / length[1:])[together & both[1:] & both[:-1]])
    found = np.concatenate([np.empty(0), *rates])
    return float(np.mean(found)) if len(found) >= FEWEST else float("nan")

"""Inverted positions and exchanged legs, by trial: with which standing feet rest, or the torques of an arm fit."""

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np
from scipy.spatial.transform import Rotation

from stribeck.audit.evidence import AuditData, gather
from stribeck.audit.regression import FEWEST, unexplained
from stribeck.audit.scale import scale_line
from stribeck.base.finding import Finding
from stribeck.base.typing import Array
from stribeck.dynamics.state import root_quaternions
from stribeck.settings import Settings

BETTER = 0.8
"""Largest cost with the other sign, relative to the given sign and to the other sign of the next best joint [1]."""
CONTACTS = "contacts of "
POOR = 0.2
"""Unexplained share of an arm's torques, exceeded with the given signs and not with the other signs [1]."""


def check_inverted(evidence: AuditData, settings: Settings) -> list[Finding]:
    """Report joints that fit the model far better with the other sign, or legs that do so if they are exchanged."""
    fixed = evidence.robot.base == "fixed"
    cost_of: Callable[[AuditData], float] = _unexplained if fixed else _motion_of_feet
    given = cost = cost_of(evidence)
    if not cost > (POOR if fixed else 0.0) or evidence.prepared.log.external_torque is not None:
        return []  # an external torque with the wrong sign is like all positions and torques with the wrong sign
    names: list[str] = []
    shown = np.flatnonzero(evidence.robot.standing(tuple(evidence.robot.contacts)) | fixed)
    examined = {evidence.robot.joint_names[column] for column in shown} & set(evidence.joints)
    exchanges = {} if fixed else _exchanges(evidence)
    while len(names) < len(examined):
        trials = {name: _inverted(evidence, name, settings if fixed else None) for name in examined - set(names)}
        costs = {name: cost_of(trial) for name, trial in trials.items()}
        if not names:
            costs |= {legs: min(map(cost_of, own)) for legs, own in exchanges.items()}
        best, *others = sorted(costs, key=costs.__getitem__)
        if costs[best] > BETTER * min([cost, *(costs[name] for name in others)]):
            break
        if best.startswith(CONTACTS):
            flags = evidence.prepared.support.source == "flags"
            setting = "foot_names" if flags else "foot_names or foot_order"
            return [Finding.of("contacts-swapped", pairs=best.removeprefix(CONTACTS), setting=setting)]
        if best in exchanges:
            return [Finding.of("legs-exchanged", legs=best, left=100 * costs[best] / given)]
        names.append(best)
        evidence, cost = trials[best], costs[best]
    if not names or (fixed and cost > POOR):
        return []
    channels = ("position", "velocity")[: 1 + (evidence.prepared.log.velocity is not None)]
    setting = " and ".join(scale_line(evidence.robot, dict.fromkeys(names, -1.0), channel) for channel in channels)
    what = "the unexplained torque" if fixed else "the motion of standing feet"
    return [Finding.of("position-sign", sorted(names), what=what, left=100 * cost / given, setting=setting)]


def _inverted(evidence: AuditData, joint: str, settings: Settings | None) -> AuditData:
    """Invert the position of a joint; with settings, compute the model's torque anew from part of the log."""
    log, column = evidence.prepared.log, evidence.robot.joint_names.index(joint)
    sign = np.where(np.arange(log.position.shape[1]) == column, -1.0, 1.0)
    other = {
        name: sign * values
        for name in ("position", "velocity", "acceleration")
        if (values := getattr(log, name)) is not None
    }
    prepared = replace(evidence.prepared, log=replace(log, **other))
    return gather(prepared, evidence.robot, settings, most=6000) if settings else replace(evidence, prepared=prepared)


def _exchanges(evidence: AuditData) -> dict[str, tuple[AuditData, ...]]:
    """Exchange the positions of two legs or of two pairs of legs, also with their contacts, or only contacts."""
    robot, log = evidence.robot, evidence.prepared.log
    legs = {foot: np.flatnonzero(robot.standing((foot,))) for foot in robot.contacts}
    pairs = [(a, b) for a, b in combinations(legs, 2) if len(legs[a]) == len(legs[b]) and not {*legs[a]} & {*legs[b]}]
    found = dict[str, tuple[AuditData, ...]]()
    for some in (*((pair,) for pair in pairs), *combinations(pairs, 2)):
        order, other = np.arange(log.position.shape[1]), dict[str, str]()
        for a, b in some:
            order[legs[a]], order[legs[b]] = legs[b], legs[a]
            other |= {a: b, b: a}
        if len(other) < 2 * len(some):
            continue
        names = tuple("+".join(other.get(foot, foot) for foot in name.split("+")) for name in evidence.support_names)
        position = log.position[:, order]
        trial = replace(evidence, prepared=replace(evidence.prepared, log=replace(log, position=position)))
        words = ", ".join(f"{a} and {b}" for a, b in some)
        found[words] = (trial, replace(trial, support_names=names))
        found[CONTACTS + ", ".join(f"{a} as {b}" for a, b in other.items())] = (replace(evidence, support_names=names),)
    return found


def _unexplained(evidence: AuditData) -> float:
    """Compute the mean share of the torques that model and friction leave unexplained, with their better signs [1]."""
    shares = [min(unexplained(evidence, k, sign) for sign in (1.0, -1.0)) for k in range(len(evidence.joints))]
    return float(np.mean(shares))


def _motion_of_feet(evidence: AuditData) -> float:
    """Compute the mean rate of standing feet [rad or 1 per bin]: soles turn, and points move relative to others."""
    robot, log = evidence.robot, evidence.prepared.log.take(evidence.rows)
    if log.base_orientation is None or len(evidence.rows) < FEWEST:
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

"""Trials of other signs and orders: inverted positions, exchanged legs and exchanged contacts.

A trial is better if standing feet move less, or if the model explains more of the torques of a robot on a fixed base.
"""

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np
from scipy.spatial.transform import Rotation

from stribeck.check.audit.base import contact_setting
from stribeck.check.audit.change import ColumnChange
from stribeck.check.audit.evidence import LEAST_BINS, AuditData, gather
from stribeck.check.audit.regression import POOR, all_unexplained, fit, winner
from stribeck.core.base.finding import Finding
from stribeck.core.base.typing import Array
from stribeck.core.dynamics.state import root_quaternions
from stribeck.core.robot.scale_setting import scale_setting
from stribeck.core.settings import Settings

Trials = dict[str, tuple[AuditData, ...]]
"""Evidence with a change, in one or two variants, by joint or by description."""


def check_by_trial(evidence: AuditData, settings: Settings) -> list[Finding]:
    """Report inverted positions, exchanged legs or exchanged contacts."""
    fixed = evidence.robot.base == "fixed"
    cost_of: Callable[[AuditData], float] = _unexplained if fixed else _motion_of_feet
    given = cost = cost_of(evidence)
    if not cost > (POOR if fixed else 0.0) or evidence.prepared.log.external_torque is not None:
        return []  # an external torque with the wrong sign is like all positions and torques with the wrong sign
    shown = np.flatnonzero(evidence.robot.standing(tuple(evidence.robot.contacts)) | fixed)
    examined = {evidence.robot.joint_names[column] for column in shown} & set(evidence.joints)
    legs, contacts = ({}, {}) if fixed else _exchanges(evidence)
    names: list[str] = []
    far_better = 0.6  # relative cost [1] up to which feet show an inverted axis although its friction resists
    while len(names) < len(examined):
        signs = {name: (_inverted(evidence, name, settings if fixed else None),) for name in examined - set(names)}
        trials = signs if names else {**signs, **legs, **contacts}
        costs = {key: min(map(cost_of, variants)) for key, variants in trials.items()}
        logarithms = {key: float(np.log(max(share, 1e-300))) for key, share in ({"": cost} | costs).items()}
        best = winner(logarithms, float(np.log(1.25)))  # the others cost at least 1.25 times as much
        if not best:
            break
        unsure = best in signs and (fixed or costs[best] > far_better * cost)
        if unsure and (as_given := fit(evidence, evidence.joints.index(best))) and as_given.dissipation > 0.5 * fixed:
            break  # with the wrong sign, friction drives
        if best in contacts:
            setting = contact_setting(evidence.prepared.support.source)
            return [Finding.of("contacts-swapped", pairs=best, setting=setting)]
        if best in legs:
            return [Finding.of("legs-exchanged", legs=best, left=100 * costs[best] / given)]
        names.append(best)
        (evidence,), cost = signs[best], costs[best]
    if not names or (fixed and cost > POOR):
        return []
    channels = ("position", "velocity")[: 1 + (evidence.prepared.log.velocity is not None)]
    scales = [scale_setting(evidence.robot, dict.fromkeys(names, -1.0), channel) for channel in channels]
    what = "the unexplained torque" if fixed else "the motion of standing feet"
    return [Finding.of("position-sign", sorted(names), what=what, left=100 * cost / given, settings=scales)]


def _inverted(evidence: AuditData, joint: str, settings: Settings | None) -> AuditData:
    """Invert the position of a joint; with settings, compute the model's torque anew from part of the log."""
    names = np.array(evidence.robot.joint_names)
    change = ColumnChange.none(len(names)).times(position=np.where(names == joint, -1.0, 1.0))
    prepared = replace(evidence.prepared, log=change.apply(evidence.prepared.log))
    return gather(prepared, evidence.robot, settings, most=6000) if settings else replace(evidence, prepared=prepared)


def _exchanges(evidence: AuditData) -> tuple[Trials, Trials]:
    """Exchange two legs or two pairs of legs, without and with their contacts; and only the contacts."""
    robot, log = evidence.robot, evidence.prepared.log
    legs = {foot: np.flatnonzero(robot.standing((foot,))) for foot in robot.contacts}
    pairs = [(a, b) for a, b in combinations(legs, 2) if len(legs[a]) == len(legs[b]) and not {*legs[a]} & {*legs[b]}]
    exchanged, contacts = Trials(), Trials()
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
        exchanged[", ".join(f"{a} and {b}" for a, b in some)] = (trial, replace(trial, support_names=names))
        contacts[", ".join(f"{a} as {b}" for a, b in other.items())] = (replace(evidence, support_names=names),)
    return exchanged, contacts


def _unexplained(evidence: AuditData) -> float:
    """Compute the mean share of the torques that model and friction leave unexplained, with their better signs [1]."""
    return float(np.mean(np.minimum(all_unexplained(evidence), all_unexplained(evidence, -1.0))))


def _motion_of_feet(evidence: AuditData) -> float:
    """Compute how much standing feet move from bin to bin, mean; NaN if too few of them stand.

    It is the rotation of soles [rad], and the motion of points relative to each other, divided by the leg's length [1].
    """
    robot, log = evidence.robot, evidence.prepared.log.take(evidence.rows)
    if log.base_orientation is None or len(evidence.rows) < LEAST_BINS:
        return float("nan")
    turn = Rotation.from_quat(root_quaternions(robot, log.position, log.base_orientation))
    together = evidence.run[1:] == evidence.run[:-1]
    standing = {
        foot: np.array([foot in feet for feet in evidence.support_feet], dtype=bool)[evidence.support]
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
    for foot, other in combinations(points, 2):
        both = standing[foot] & standing[other]
        steps: Array = np.linalg.norm(np.diff(turn.apply(points[foot] - points[other]), axis=0), axis=1)
        length: Array = np.linalg.norm(points[foot], axis=1)
        rates.append((steps / length[1:])[together & both[1:] & both[:-1]])
    motion = np.concatenate([np.empty(0), *rates])
    return float(np.mean(motion)) if len(motion) >= LEAST_BINS else float("nan")

"""Checks of the base: orientation against standing feet, axes of the IMU, and contacts against heights of the feet."""

from dataclasses import dataclass
from itertools import permutations

import numpy as np
from scipy.spatial.transform import Rotation

from stribeck.check.audit.evidence import LEAST_BINS, AuditData
from stribeck.core.base.finding import Finding, Setting
from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.dynamics.contact.phases import switch, up_in_base
from stribeck.core.dynamics.state import root_quaternions
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot

SLOPE = 0.5
"""Share of the differences in height of standing feet that a slope may leave [1]."""
LIFT = 0.01
"""Height of a standing foot above the lowest one that contradicts its contact [m]."""


def check_base(evidence: AuditData) -> list[Finding]:
    """Report contradictions between orientation, gyroscope, accelerometer and contacts."""
    if evidence.robot.base == "fixed" or len(evidence.rows) < LEAST_BINS:
        return []
    contacts = check_contacts(evidence)
    swapped = any(finding.check == "contacts-swapped" for finding in contacts)
    if swapped or evidence.prepared.log.base_orientation is None:
        return contacts
    return _orientation(evidence) or contacts or _inertial(evidence)


def check_contacts(evidence: AuditData) -> list[Finding]:
    """Report feet that are logged as standing although they are in the air."""
    robot, support = evidence.robot, evidence.prepared.support
    feet = tuple(robot.contacts)
    if len(feet) < 2 or robot.carried(feet) or support.source not in ("flags", "forces"):
        return []
    standing = np.zeros((len(evidence.prepared.log.time), len(feet)), dtype=bool)
    known = np.zeros(len(standing), dtype=bool)
    for phase in support.phases:
        known[phase.start : phase.stop] = phase.kind != "touching"
        standing[phase.start : phase.stop] = [foot in phase.feet for foot in feet]
    if not standing.any():  # a hung robot
        return []
    rows = np.flatnonzero(known)
    rows = rows[:: max(1, len(rows) // 4000)]  # about 4000 samples are sufficient
    standing = standing[rows]
    log = evidence.prepared.log.take(rows)
    height = _heights(log, robot, standing)
    lift = height - height.min(axis=1, keepdims=True)
    order = _best_order(standing, lift)
    if order is not None:
        pairs = ", ".join(f"{feet[k]} as {feet[j]}" for k, j in enumerate(order) if j != k)
        return [Finding.of("contacts-swapped", pairs=pairs, setting=contact_setting(support.source))]
    others = np.column_stack([np.delete(lift, k, axis=1).min(axis=1) for k in range(len(feet))])
    ground = np.where(standing, height, np.inf).min(axis=1, keepdims=True)  # a swinging foot may be below it
    above = np.where(standing, height - ground, 0.0)
    wrong = {
        "logged as standing, but is above another standing foot": (standing, above),
        "not logged as standing, but all other feet are above it": (~standing, others),
    }
    parts = [
        f"{foot} is {what}"
        for what, (flags, lifts) in wrong.items()
        for foot, flag, high in zip(feet, flags.T, lifts.T, strict=True)
        if _repeats(flag, high)
    ]
    return [Finding.of("contact-stuck", evidence="; ".join(parts))] if parts else []


def contact_setting(source: str) -> str:
    """Name the settings with the order of the contacts that come from a source."""
    return "foot_names" if source == "flags" else "foot_names or foot_order"


def _heights(log: RobotLog, robot: Robot, standing: BoolArray) -> Array:
    """Compute the heights of the feet above the ground, shape (T, feet), up to a constant per row.

    The ground is level, or a slope if one explains most of the differences between standing feet.
    """
    place = np.stack([robot.foot_pose(foot, log.position)[1] for foot in robot.contacts], axis=1)
    height: Array = np.einsum("ti,tfi->tf", up_in_base(log, robot), place)
    if log.base_orientation is None:
        return height
    turned = Rotation.from_quat(root_quaternions(robot, log.position, log.base_orientation)).as_matrix()
    along = np.einsum("tij,tfj->tfi", turned, place) @ (np.eye(3) - np.outer(robot.up, robot.up))
    count = np.maximum(standing.sum(axis=1), 1)[:, None]
    run, rise = (
        (coordinates - (coordinates * standing[..., None]).sum(axis=1, keepdims=True) / count[..., None])[standing]
        for coordinates in (along, height[..., None])
    )
    slope, weight = np.zeros((3, 1)), np.ones((len(run), 1))
    for _ in range(10):  # least absolute deviations: feet with wrong flags are far off the ground
        slope = np.linalg.lstsq(run * weight, rise * weight, rcond=1e-6)[0]
        weight = 1 / np.sqrt(np.maximum(np.abs(rise - run @ slope), LIFT / 10))
    if np.abs(rise - run @ slope).mean() > SLOPE * np.abs(rise).mean():
        return height
    return np.asarray(height - (along @ slope)[..., 0])


def _repeats(flag: BoolArray, lift: Array) -> bool:
    """Whether a foot rises and comes down at least twice while its flag stays set.

    On stairs a standing foot is above a swinging one once per step.
    """
    high = switch(lift[:, None], LIFT, LIFT / 2)[:, 0]
    parts = np.cumsum(np.diff(flag.astype(np.int8), prepend=0) != 0)
    rises = np.flatnonzero(high[1:] & ~high[:-1] & flag[1:] & flag[:-1])
    falls = np.flatnonzero(~high[1:] & high[:-1] & flag[1:] & flag[:-1])
    both = np.minimum(*(np.bincount(parts[rows], minlength=parts[-1] + 1) for rows in (rises, falls)))
    return bool(both.max() >= 2)


def _best_order(standing: BoolArray, lift: Array) -> tuple[int, ...] | None:
    """Find for each foot the one whose flag fits its height; None if the given order fits about as well.

    The best order must reduce the mean height of standing feet to 40 %, and feet be too high in 25 % of the time.
    """
    some = standing.any(axis=1) & ~standing.all(axis=1)
    if some.sum() < LEAST_BINS or lift.shape[1] > 4:
        return None
    standing, lift = standing[some], lift[some]
    identity = tuple(range(lift.shape[1]))

    def cost(order: tuple[int, ...]) -> float:
        return float(np.mean(lift[standing[:, order]]))

    best = min(permutations(identity), key=cost)
    wrong = np.mean(lift[standing] > LIFT / 2)
    return best if cost(identity) > 0.004 and cost(best) < 0.4 * cost(identity) and wrong > 0.25 else None


@dataclass(frozen=True, eq=False)
class _Turns:
    """Rotation between two bins [rad/s], in the frame of the base, shape (S, 3) each."""

    measured: Array
    expected: Array

    def explained(self, axes: Array) -> float:
        """Compute the share of the measured rotation that the expected one explains with other axes."""
        residual = self.measured - self.expected @ axes.T
        return 1 - float(np.sum(residual**2) / np.sum((self.measured - self.measured.mean(axis=0)) ** 2))


def _axes_off(turns: _Turns) -> Array | None:
    """Find the axes that explain a rotation far better than the given ones; None if the given ones are fine.

    They must explain half of the rotation, and leave less than 35 % of the residual of the given axes, which explain
    less than 90 %: tilts of up to 18 degrees are corrected.
    """
    slowest = min(_rms(turns.measured), _rms(turns.expected)) if len(turns.measured) >= LEAST_BINS else 0.0
    if slowest < 0.02:  # rad/s
        return None
    left, _, right = np.linalg.svd(turns.measured.T @ turns.expected)  # Kabsch 1976
    proper = left * [1, 1, np.sign(np.linalg.det(left @ right))] @ right  # of two axes, the third one has no sign
    best = proper if turns.explained(proper) > turns.explained(left @ right) - 0.05 else left @ right
    explained, given = turns.explained(best), turns.explained(np.eye(3))
    return best if explained > 0.5 and given < 0.9 and 1 - explained < 0.35 * (1 - given) else None


def _rms(vectors: Array) -> float:
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=1))))


def _orientation(evidence: AuditData) -> list[Finding]:
    """Compare the base orientation with the kinematics while a sole stands still."""
    log, robot = evidence.prepared.log, evidence.robot
    quaternions = root_quaternions(robot, log.position[evidence.rows], log.base_orientation[evidence.rows])  # type: ignore[index]
    base = Rotation.from_quat(quaternions)
    foot = _standing_sole(evidence)
    known = np.flatnonzero(foot >= 0)
    if not len(known):
        return []
    poses = np.tile(np.eye(3), (len(evidence.rows), 1, 1))
    for k in np.unique(foot[known]).tolist():
        bins = np.flatnonzero(foot == k)
        poses[bins] = robot.foot_pose(list(robot.contacts)[k], log.position[evidence.rows[bins]])[0]
    in_foot = Rotation.from_matrix(poses).inv()
    first, last, step = _pairs(evidence, foot)
    expected = (in_foot[first].inv() * in_foot[last]).as_rotvec() / step
    turns = _Turns(measured=(base[first].inv() * base[last]).as_rotvec() / step, expected=expected)
    backwards = _Turns(measured=(base[first] * base[last].inv()).as_rotvec() / step, expected=expected)
    if (axes := _axes_off(turns)) is not None:
        inverse = backwards.explained(np.eye(3))
        explained = max(inverse, turns.explained(axes))
        if np.trace(axes) < -2.5 or inverse > explained - 0.05:
            return [Finding.of("quaternion-inverse", explained=100 * explained)]
        return [_axes_finding(evidence, axes, "base_orientation", turns, stops=True)]
    normal = np.einsum("ti,ti->t", base.inv().apply(robot.up)[known], poses[known, :, 2])
    tilt = float(np.rad2deg(np.median(np.arccos(np.clip(normal, -1, 1)))))
    return [Finding.of("base-orientation", tilt=tilt)] if tilt > 25.0 else []


def _pairs(evidence: AuditData, foot: IntArray) -> tuple[IntArray, IntArray, Array]:
    """Pair bins 0.2 s apart in one run, on one foot; the third value is the time between them [s], shape (P, 1).

    Over shorter times soles roll a little where they stand.
    """
    period = evidence.prepared.sampling.period
    apart = max(1, round(0.2 / (period * float(np.median(np.diff(evidence.rows))))))
    first = np.arange(max(0, len(evidence.rows) - apart))
    last = first + apart
    together = (evidence.run[first] == evidence.run[last]) & (foot[first] == foot[last]) & (foot[first] >= 0)
    first, last = first[together], last[together]
    return first, last, (evidence.rows[last] - evidence.rows[first])[:, None] * period


def _standing_sole(evidence: AuditData) -> IntArray:
    """Find the number of a standing sole in each bin, -1 without one, shape (B,)."""
    soles = {name: k for k, (name, foot) in enumerate(evidence.robot.contacts.items()) if foot.kind == "surface"}
    of_support = [min((soles[foot] for foot in feet if foot in soles), default=-1) for feet in evidence.support_feet]
    return np.array(of_support, dtype=np.int64)[evidence.support]


def _axes_finding(evidence: AuditData, axes: Array, channel: str, turns: _Turns, *, stops: bool) -> Finding:
    names = [" ".join(_part(*pair) for pair in zip(row, "xyz", strict=True) if abs(pair[0]) > 0.1) for row in axes]
    mount = Rotation.from_euler("xyz", getattr(evidence.robot.log_table, channel).mount or (0.0, 0.0, 0.0))
    angles = (Rotation.from_matrix(axes.T) * mount).as_euler("xyz") if np.linalg.det(axes) > 0 else np.zeros(0)
    return Finding.of(
        "imu-axes" if angles.size else "imu-axes.mirrored",
        channel=channel,
        stops=stops,
        settings=[Setting(f"log.{channel}", "mount", np.round(angles, 3).tolist())] if angles.size else [],
        axes=", ".join(names),
        explained=100 * turns.explained(axes),
        given=100 * turns.explained(np.eye(3)),
    )


def _part(value: float, axis: str) -> str:
    """Format a part of a combination of axes, e.g. "x", "-y", "+0.5 z"."""
    return f"{'-' if value < 0 else ''}{axis}" if abs(value) > 0.97 else f"{value:+.2g} {axis}"


def _inertial(evidence: AuditData) -> list[Finding]:
    """Compare gyroscope and accelerometer with the base orientation, assuming the same frame."""
    log, rows = evidence.prepared.log, evidence.rows
    first, last, step = _pairs(evidence, np.zeros(len(rows), dtype=np.int64))
    base = Rotation.from_quat(log.base_orientation[rows])  # type: ignore[index]
    findings: list[Finding] = []
    if log.angular_velocity is not None:
        sums = np.concatenate([np.zeros((1, 3)), np.cumsum(log.angular_velocity, axis=0)])
        mean = (sums[rows[last]] - sums[rows[first]]) / (rows[last] - rows[first])[:, None]
        turns = _Turns(measured=mean, expected=(base[first].inv() * base[last]).as_rotvec() / step)
        if (axes := _axes_off(turns)) is not None:
            findings.append(_axes_finding(evidence, axes, "angular_velocity", turns, stops=False))
    if log.linear_acceleration is not None and not findings:
        mean, up = log.linear_acceleration[rows].mean(axis=0), base.inv().apply(evidence.robot.up).mean(axis=0)
        size = float(np.linalg.norm(mean))
        agreement = float(mean @ up) / max(size, 1e-9)
        if 0.5 < size / 9.81 < 2 and agreement < 0.7:
            shown = np.round(mean, 1).tolist()
            findings.append(Finding.of("imu-axes.accelerometer", stops=False, mean=shown))
    return findings

"""The base: its orientation against the standing feet's kinematics, the IMU's axes, and contacts against heights."""

from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from stribeck.audit.evidence import Evidence
from stribeck.contact.phases import switch, up_in_base
from stribeck.dynamics.state import root_quaternions
from stribeck.finding import Finding
from stribeck.typing import Array

FEWEST = 24
"""Pairs of bins [1] between which turning is compared."""
LAG = 0.2
"""[s] between the two: soles roll a little, and quickly, where they stand."""
AGREES = 0.5
"""Share of a turning that some axes must explain before they are named."""
BETTER = 0.35
"""And what they leave of it, over what the axes as given leave."""
TURNING = 0.02
"""[rad/s] of turning that is enough to compare."""
TILTED = np.deg2rad(25.0)
"""[rad] between the normal of a standing sole and the vertical."""
LIFT = 0.01
"""[m] by which a foot that is said to stand may be higher than the lowest one."""
FITS = 0.4
"""Height of the standing feet if they are exchanged, over that as given [1]."""
WRONG = 0.25
"""Share of the time in which feet are higher by half of that if they are said to stand in place of others."""
MOST_ROWS = 4000


def check_base(evidence: Evidence) -> list[Finding]:
    """Return what orientation, gyroscope, accelerometer and contacts say against one another."""
    if evidence.robot.base == "fixed" or len(evidence.rows) < FEWEST:
        return []
    if evidence.prepared.log.base_orientation is None:
        return check_contacts(evidence)
    contacts = check_contacts(evidence)
    if any(finding.check == "contacts-swapped" for finding in contacts):
        return contacts
    return _orientation(evidence) or contacts or _inertial(evidence)


def check_contacts(evidence: Evidence) -> list[Finding]:
    """Return a finding if feet are said to stand that are in the air."""
    robot, support = evidence.robot, evidence.prepared.support
    feet = tuple(robot.contacts)
    if len(feet) < 2 or support.source not in ("flags", "forces"):
        return []
    standing = np.zeros((len(evidence.prepared.log.time), len(feet)), dtype=bool)
    known = np.zeros(len(standing), dtype=bool)
    for phase in support.phases:
        known[phase.start : phase.stop] = phase.kind != "touching"
        standing[phase.start : phase.stop] = [foot in phase.feet for foot in feet]
    rows = np.flatnonzero(known)
    rows = rows[:: max(1, len(rows) // MOST_ROWS)]
    standing = standing[rows]
    log = evidence.prepared.log.take(rows)
    up = up_in_base(log, robot)
    height = np.column_stack([np.einsum("ti,ti->t", up, robot.foot_pose(foot, log.position)[1]) for foot in feet])
    lift = height - height.min(axis=1, keepdims=True)
    order = _best_order(standing, lift)
    if order is not None:
        pairs = [f"{feet[k]} as {feet[j]}" for k, j in enumerate(order) if j != k]
        where = "foot_names" if support.source == "flags" else "foot_names or foot_order"
        return [
            Finding(
                check="contacts-swapped",
                text="feet that are said to stand are higher than others that are not; heights fit if they are "
                f"exchanged: {', '.join(pairs)}",
                cure=f"exchange them in [log] {where}; if left and right joints are exchanged, in [log] joint_names",
                stops=True,
            )
        ]
    others = np.column_stack([np.delete(lift, k, axis=1).min(axis=1) for k in range(len(feet))])
    ground = np.where(standing, height, np.inf).min(axis=1, keepdims=True)  # a foot that swings may reach below it
    above = np.where(standing, height - ground, 0.0)
    stuck = [foot for k, foot in enumerate(feet) if _repeats(standing[:, k], above[:, k])]
    never = [foot for k, foot in enumerate(feet) if _repeats(~standing[:, k], others[:, k])]
    if not stuck and not never:
        return []
    parts = [f"{name} is said to stand while it is above another that stands" for name in stuck]
    parts += [f"{name} is not said to stand for long, though all others are above it" for name in never]
    return [
        Finding(
            check="contact-stuck",
            text=f"contacts do not fit the heights of the feet: {'; '.join(parts)}",
            cure='set [identify.support] source = "kinematics" or "forces", or mend the channel',
            stops=True,
        )
    ]


def _repeats(said: NDArray[np.bool_], lift: Array) -> bool:
    """Return whether something rises and comes down again, twice or more, while contacts say the same throughout.

    On stairs a foot that stands is above one that swings once a step.
    """
    high = switch(lift[:, None], LIFT, LIFT / 2)[:, 0]
    parts = np.cumsum(np.diff(said.astype(np.int8), prepend=0) != 0)
    rises = np.flatnonzero(high[1:] & ~high[:-1] & said[1:] & said[:-1])
    falls = np.flatnonzero(~high[1:] & high[:-1] & said[1:] & said[:-1])
    both = np.minimum(*(np.bincount(parts[rows], minlength=parts[-1] + 1) for rows in (rises, falls)))
    return bool(both.max() >= 2)


def _best_order(standing: NDArray[np.bool_], lift: Array) -> tuple[int, ...] | None:
    """Return for each foot the one whose flag fits its height, None if its own does as well as any."""
    some = standing.any(axis=1) & ~standing.all(axis=1)
    if some.sum() < FEWEST:
        return None
    standing, lift = standing[some], lift[some]
    identity = tuple(range(lift.shape[1]))

    def cost(order: tuple[int, ...]) -> float:
        return float(np.mean(lift[standing[:, order]]))

    if lift.shape[1] > 4:
        return None
    best = min(permutations(identity), key=cost)
    wrong = np.mean(lift[standing] > LIFT / 2)
    return best if cost(identity) > 0.004 and cost(best) < FITS * cost(identity) and wrong > WRONG else None


@dataclass(frozen=True, eq=False)
class _Turns:
    """Turning between two bins [rad/s], in the frame of the base, shape (S, 3) each."""

    measured: Array
    expected: Array

    def explained(self, turn: Array) -> float:
        """Return the share of the measured turning that the expected one, turned, explains."""
        left = self.measured - self.expected @ turn.T
        return 1 - float(np.sum(left**2) / np.sum((self.measured - self.measured.mean(axis=0)) ** 2))


AXES = [
    np.array([[sign * (column == place) for column in range(3)] for place, sign in zip(order, signs, strict=True)])
    for order in permutations(range(3))
    for signs in product((1.0, -1.0), repeat=3)
]
"""All ways to exchange and turn round three axes."""


def _axes_off(turns: _Turns) -> Array | None:
    """Return the axes that explain a turning which those as given do not, None if there are none."""
    if len(turns.measured) < FEWEST or min(_rms(turns.measured), _rms(turns.expected)) < TURNING:
        return None
    given = turns.explained(np.eye(3))
    best = max(AXES, key=turns.explained)
    explained = turns.explained(best)
    return best if explained > AGREES and 1 - explained < BETTER * (1 - given) else None


def _rms(vectors: Array) -> float:
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=1))))


def _orientation(evidence: Evidence) -> list[Finding]:
    """Compare the base orientation with what the joints say while a sole stands still."""
    log, robot = evidence.prepared.log, evidence.robot
    quaternions = root_quaternions(robot, log.position[evidence.rows], log.base_orientation[evidence.rows])  # type: ignore[index]
    base = Rotation.from_quat(quaternions)
    foot = _standing_sole(evidence)
    if foot is None:
        return []
    known = np.flatnonzero(foot >= 0)
    poses = np.tile(np.eye(3), (len(evidence.rows), 1, 1))
    for k, name in enumerate(robot.contacts):
        here = np.flatnonzero(foot == k)
        if len(here):
            poses[here] = robot.foot_pose(name, log.position[evidence.rows[here]])[0]
    in_foot = Rotation.from_matrix(poses).inv()
    first, last, step = _pairs(evidence, foot)
    turns = _Turns(
        measured=(base[first].inv() * base[last]).as_rotvec() / step,
        expected=(in_foot[first].inv() * in_foot[last]).as_rotvec() / step,
    )
    backwards = _Turns(measured=(base[first] * base[last].inv()).as_rotvec() / step, expected=turns.expected)
    axes = _axes_off(turns)
    inverse = backwards.explained(np.eye(3)) if axes is not None else 0.0
    explained = max(inverse, turns.explained(axes)) if axes is not None else 0.0
    if axes is not None and (np.allclose(axes, -np.eye(3)) or inverse > explained - 0.05):
        return [
            Finding(
                check="quaternion-inverse",
                channel="base_orientation",
                text="the base turns the other way than the joints above a standing foot say: "
                f"{100 * explained:.0f} % of its turning is explained by the inverse quaternion",
                cure="log the orientation of the base in the world, not of the world in the base "
                "([log.base_orientation] has no setting for it)",
                stops=True,
            )
        ]
    if axes is not None:
        return [_axes_finding(axes, "base_orientation", turns, stops=True)]
    normal = np.einsum("ti,ti->t", base.inv().apply([0.0, 0.0, 1.0])[known], poses[known, :, 2])
    tilt = float(np.median(np.arccos(np.clip(normal, -1, 1))))
    if tilt > TILTED:
        return [
            Finding(
                check="base-orientation",
                channel="base_orientation",
                text=f"by the base orientation the soles stand tilted by {np.rad2deg(tilt):.0f} deg",
                cure="see [log.base_orientation] order, [robot] base_frame, and the zeros of the legs' encoders",
                stops=True,
            )
        ]
    return []


def _pairs(evidence: Evidence, foot: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """Return pairs of bins that are `LAG` apart in one run, on one foot, and the time between them [s], (P, 1)."""
    if len(evidence.rows) < 2:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64), np.empty((0, 1))
    period = evidence.prepared.sampling.period
    apart = max(1, round(LAG / (period * float(np.median(np.diff(evidence.rows))))))
    first = np.arange(max(0, len(evidence.rows) - apart))
    last = first + apart
    together = (evidence.run[first] == evidence.run[last]) & (foot[first] == foot[last]) & (foot[first] >= 0)
    first, last = first[together], last[together]
    return first, last, (evidence.rows[last] - evidence.rows[first])[:, None] * period


def _standing_sole(evidence: Evidence) -> NDArray[np.int64] | None:
    """Return the number of a sole that stands in each bin, -1 where none does, shape (B,); None if there are none."""
    contacts = evidence.robot.contacts
    soles = [k for k, contact in enumerate(contacts.values()) if contact.kind == "surface"]
    names = list(contacts)
    of_support = [next((k for k in soles if names[k] in name.split("+")), -1) for name in evidence.support_names]
    if not soles or not of_support:
        return None
    return np.array(of_support, dtype=np.int64)[evidence.support]


def _axes_finding(axes: Array, channel: str, turns: _Turns, *, stops: bool) -> Finding:
    letters = [("-" if axes[row].sum() < 0 else "") + "xyz"[int(np.argmax(np.abs(axes[row])))] for row in range(3)]
    explained, as_given = 100 * turns.explained(axes), 100 * turns.explained(np.eye(3))
    return Finding(
        check="imu-axes",
        channel=channel,
        text=f"{channel} turns about other axes than the base: its x, y, z are {', '.join(letters)} of the base, which "
        f"explains {explained:.0f} % of its turning ({as_given:.0f} % as given)",
        cure=f"set [robot] base_frame to the IMU's frame in the model, or turn {channel} before it is logged",
        stops=stops,
    )


def _inertial(evidence: Evidence) -> list[Finding]:
    """Compare gyroscope and accelerometer with the base orientation, which is in the same frame."""
    log, rows = evidence.prepared.log, evidence.rows
    first, last, step = _pairs(evidence, np.zeros(len(rows), dtype=np.int64))
    if len(first) < FEWEST:
        return []
    base = Rotation.from_quat(log.base_orientation[rows])  # type: ignore[index]
    found: list[Finding] = []
    if log.angular_velocity is not None:
        sums = np.concatenate([np.zeros((1, 3)), np.cumsum(log.angular_velocity, axis=0)])
        mean = (sums[rows[last]] - sums[rows[first]]) / (rows[last] - rows[first])[:, None]
        turns = _Turns(measured=mean, expected=(base[first].inv() * base[last]).as_rotvec() / step)
        axes = _axes_off(turns)
        if axes is not None:
            found.append(_axes_finding(axes, "angular_velocity", turns, stops=False))
    if log.linear_acceleration is not None and not found:
        felt = log.linear_acceleration[rows]
        up = base.inv().apply([0.0, 0.0, 1.0])
        mean = felt.mean(axis=0)
        size = float(np.linalg.norm(mean))
        agreement = float(mean @ up.mean(axis=0)) / max(size, 1e-9)
        if 0.5 < size / 9.81 < 2 and agreement < 0.7:
            found.append(
                Finding(
                    check="imu-axes",
                    channel="linear_acceleration",
                    text="linear_acceleration does not feel gravity where the base orientation has it: its mean is "
                    f"{np.round(mean, 1).tolist()} m/s^2",
                    cure="turn it into the axes of the base before it is logged; an IMU at rest feels +g upwards",
                )
            )
    return found

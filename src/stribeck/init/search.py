"""Order and signs of a log's columns, by what explains its torques: inverse dynamics and friction."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from stribeck.audit import gather
from stribeck.audit.positions import OUTSIDE
from stribeck.audit.regression import unexplained
from stribeck.base.typing import Array
from stribeck.errors import LogError, SettingsError
from stribeck.friction_torque.preparation import prepare
from stribeck.init.names import words
from stribeck.log import RobotLog
from stribeck.robot import Robot
from stribeck.settings import Settings

BETTER = 30.0
"""Product of the factors by which a change leaves less of the torques' variances, from which it is made."""


@dataclass(frozen=True, eq=False)
class Columns:
    """Which of a log's columns each joint has, and the signs of its position and its torque, shape (n,) each."""

    order: tuple[int, ...]
    position: Array
    torque: Array

    def of(self, log: RobotLog) -> RobotLog:
        """Return the log with these columns and signs."""
        signs = dict.fromkeys(("position", "velocity", "acceleration"), self.position)
        signs |= {"torque": self.torque, "external_torque": np.ones(len(self.order))}
        given = {name: array for name in signs if (array := getattr(log, name)) is not None}
        return replace(log, **{name: array[:, list(self.order)] * signs[name] for name, array in given.items()})

    def changed_since(self, before: Columns) -> NDArray[np.bool_]:
        """Return which joints have another column or sign than before, shape (n,)."""
        order = np.array(self.order) != np.array(before.order)
        return np.asarray(order | (self.position != before.position) | (self.torque != before.torque))


def as_given(joints: int) -> Columns:
    """Return columns in their order, with their signs."""
    return Columns(tuple(range(joints)), np.ones(joints), np.ones(joints))


def find_columns_by_dynamics(log: RobotLog, robot: Robot, unsure: Sequence[int]) -> Columns:
    """Find the order and signs that agree best with the model.

    Steps are made from the given ones while each makes the log far more likely: a joint that counts the other way, or
    two of them, or its torque or position alone, all torques at once, and, of joints whose names say nothing, two that
    are exchanged or all of them in another order that logs are known to have; any order, if they are few. Steps after
    which the model still does not explain the torques of the joints that they change are not taken: something else is
    wrong there, such as the contacts.

    Parameters
    ----------
    log
        With the robot's joints.
    unsure
        Columns whose joint is not known by its name.
    """
    log = _excerpt(log)
    given = as_given(len(robot.joint_names))
    best = _descend(given, log, robot, unsure)
    left = _agreement(best.of(log), robot).left[best.changed_since(given)[robot.torque_controlled]]
    return given if np.any(left > 0.5) else best  # share of the torque's variance


def _descend(best: Columns, log: RobotLog, robot: Robot, unsure: Sequence[int]) -> Columns:
    """Return the columns after all steps that make the log far more likely."""
    now = _agreement(best.of(log), robot)
    tried = 0
    while tried < 1500 and (bad := now.poor(robot)):
        for changes in (_changes(best, robot, bad, unsure), _turned(best, bad)):
            scored = [(_agreement(change.of(log), robot), change) for change in changes]
            tried += len(scored)
            after, change = min(scored, key=lambda one: one[0].cost, default=(now, best))
            if now.cost - after.cost > np.log(BETTER):
                best, now = change, after
                break
        else:
            break
    return best


@dataclass(frozen=True, eq=False)
class Agreement:
    """How well a log agrees with a model.

    Attributes
    ----------
    left
        Share of each torque's variance that model and friction leave, shape (k,); NaN where the log says too little.
    outside
        Whether each joint leaves its range, shape (n,).
    """

    left: Array
    outside: NDArray[np.bool_]

    @property
    def cost(self) -> float:
        """Logarithm of the product of the shares, larger where joints leave their range."""
        shares = np.nan_to_num(self.left, nan=1.0)
        return float(np.log(np.clip(shares, 1e-3, 1.0)).sum() + 1.1 * np.log(BETTER) * self.outside.sum())

    def poor(self, robot: Robot) -> list[int]:
        """Find the joints whose columns may be wrong: those that agree poorly, and all below and above them."""
        poor = {int(robot.torque_controlled[k]) for k in np.flatnonzero(np.nan_to_num(self.left) > 0.2)}
        poor |= set(np.flatnonzero(self.outside).tolist())
        paths = _paths(robot)
        beyond = {column for column, path in paths.items() if poor & set(path)}
        return sorted(beyond.union(*(paths[column] for column in poor)))


def _agreement(log: RobotLog, robot: Robot) -> Agreement:
    """Compare the torques and ranges of a log with the model."""
    settings = Settings(support=robot.settings.support)
    low, high = robot.position_limits
    outside = (log.position.min(axis=0) < low - OUTSIDE) | (log.position.max(axis=0) > high + OUTSIDE)
    try:
        evidence = gather(prepare(log, robot, settings), robot, settings)
    except (LogError, SettingsError):
        return Agreement(np.ones(len(robot.torque_controlled)), outside)
    return Agreement(np.array([unexplained(evidence, k, 1.0) for k in range(len(evidence.joints))]), outside)


def _excerpt(log: RobotLog) -> RobotLog:
    """Take at most 2,000 samples at about 200 Hz from the middle of a log."""
    step = max(1, int(1 / float(np.median(np.diff(log.time))) / 200.0))
    rows = len(log.time) // step
    first = max(0, rows - 2000) // 2 * step
    return log.take(slice(first, first + min(rows, 2000) * step, step))


def _paths(robot: Robot) -> dict[int, list[int]]:
    """List the columns from each joint to the base, by the joint's column."""
    tree = robot.tree
    paths = map(tree.path_to_root, range(1 + tree.floating, tree.model.njoints))
    return {path[0]: path for path in ([tree.column(joint) for joint in joints] for joints in paths)}


def _changes(now: Columns, robot: Robot, bad: Sequence[int], unsure: Sequence[int]) -> Iterator[Columns]:
    yield replace(now, torque=-now.torque)
    for column in bad:
        sign = np.where(np.arange(len(now.order)) == column, -1.0, 1.0)
        yield replace(now, position=now.position * sign, torque=now.torque * sign)
        yield replace(now, torque=now.torque * sign)
        yield replace(now, position=now.position * sign)
    if len(unsure) <= 5:  # every order
        for columns in permutations([now.order[column] for column in unsure]):
            placed = dict(zip(unsure, columns, strict=True))
            yield replace(now, order=tuple(placed.get(joint, column) for joint, column in enumerate(now.order)))
    else:
        if now.order == tuple(range(len(now.order))) and len(unsure) == len(now.order):
            yield from (replace(now, order=tuple(order)) for order in other_orders(robot))
        for one, other in combinations([column for column in unsure if column in bad], 2):
            order = list(now.order)
            order[one], order[other] = order[other], order[one]
            yield replace(now, order=tuple(order))


def _turned(now: Columns, bad: Sequence[int]) -> Iterator[Columns]:
    """Yield the columns with several joints that count the other way: about parallel axes one alone may seem worse."""
    for count in range(2, 1 + (len(bad) if len(bad) <= 7 else 2)):
        for some in combinations(bad, count):
            sign = np.where(np.isin(np.arange(len(now.order)), some), -1.0, 1.0)
            yield replace(now, position=now.position * sign, torque=now.torque * sign)


def other_orders(robot: Robot) -> list[list[int]]:
    """Return for each joint its column in orders that logs have beside the model's: sides and ends exchanged, by depth.

    By depth are those of simulators that number joints breadth first: all hips, then all knees. ROS drivers have them
    by the alphabet.
    """
    names, paths = robot.joint_names, _paths(robot)
    by_depth = sorted(range(len(names)), key=lambda column: (len(paths[column]), column))
    meant = [tuple(words(name)) for name in names]
    sides, ends = ("left", "right"), ("front", "rear")

    def exchanged(*pairs: tuple[str, str]) -> list[int]:
        other = {a: b for pair in pairs for a, b in (pair, pair[::-1])}
        places = {each: k for k, each in enumerate(meant)}
        return [places.get(tuple(other.get(word, word) for word in each), k) for k, each in enumerate(meant)]

    plain = [exchanged(), exchanged(sides), exchanged(ends), exchanged(sides, ends)]
    plain.append([sorted(names).index(name) for name in names])
    under = [[by_depth.index(column) for column in order] for order in plain]
    return [list(order) for order in sorted({*map(tuple, plain), *map(tuple, under)})]

"""Order and signs of a log's columns, by what explains its torques: inverse dynamics and friction."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from stribeck.audit import gather
from stribeck.audit.positions import OUTSIDE
from stribeck.audit.regression import unexplained
from stribeck.errors import LogError, SettingsError
from stribeck.log import RobotLog
from stribeck.preparation import prepare
from stribeck.robot import Robot
from stribeck.settings import Settings
from stribeck.typing import Array

ENOUGH_RATE = 200.0
"""[Hz] that motions are compared at."""
ENOUGH_ROWS = 2000
"""Samples [1] that are compared."""
POOR = 0.2
"""Share of a torque's variance that model and friction may leave before signs and order are looked at."""
BETTER = 30.0
"""Product of the factors by which a change leaves less of the torques' variances, from which it is made."""
EXPLAINED = 0.5
"""Share of its torque's variance that may be left of each joint whose column or sign is changed."""
EXACT = 1e-3
"""A smaller share that is left says nothing more."""
MOST_TOGETHER = 7
"""Joints [1] of which any number is turned round together; of more, two."""
MOST_ORDERED = 5
"""Columns [1] without telling names that every order is tried of; of more, exchanges of two and known orders."""
MOST_TRIED = 1500
"""Changes that are tried at most."""


@dataclass(frozen=True, eq=False)
class Columns:
    """Which of a log's columns each joint has, and the signs of its position and its torque, shape (n,) each."""

    order: tuple[int, ...]
    position: Array
    torque: Array

    def of(self, log: RobotLog) -> RobotLog:
        """Return the log with these columns and signs."""
        order = list(self.order)
        moved = {
            name: getattr(log, name)[:, order] * self.position
            for name in ("position", "velocity", "acceleration")
            if getattr(log, name) is not None
        }
        if log.external_torque is not None:
            moved["external_torque"] = log.external_torque[:, order]
        return replace(log, torque=log.torque[:, order] * self.torque, **moved)

    def changed_since(self, before: Columns) -> NDArray[np.bool_]:
        """Return which joints have another column or sign than before, shape (n,)."""
        order = np.array(self.order) != np.array(before.order)
        return np.asarray(order | (self.position != before.position) | (self.torque != before.torque))


def as_given(joints: int) -> Columns:
    """Return columns in their order, with their signs."""
    return Columns(tuple(range(joints)), np.ones(joints), np.ones(joints))


def find_columns_by_dynamics(log: RobotLog, robot: Robot, unsure: Sequence[int]) -> tuple[Columns, Agreement]:
    """Return the order and signs that agree best with the model, and how well they do.

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
    log = excerpt(log)
    best = as_given(len(robot.joint_names))
    changed = _descend(best, log, robot, unsure)
    after = agreement(changed.of(log), robot)
    left = after.left[changed.changed_since(best)[robot.torque_controlled]]
    if np.any(left > EXPLAINED):
        return best, agreement(best.of(log), robot)
    return changed, after


def _descend(best: Columns, log: RobotLog, robot: Robot, unsure: Sequence[int]) -> Columns:
    """Return the columns after all steps that make the log far more likely."""
    now = agreement(best.of(log), robot)
    tried = 0
    while tried < MOST_TRIED and (bad := now.poor(robot)):
        for changes in (_changes(best, robot, bad, unsure), _turned(best, bad)):
            scored = [(agreement(change.of(log), robot), change) for change in changes]
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
        return float(np.log(np.clip(shares, EXACT, 1.0)).sum() + 1.1 * np.log(BETTER) * self.outside.sum())

    def poor(self, robot: Robot) -> list[int]:
        """Return columns of joints that may be wrong: those that agree poorly, and all of their limbs."""
        columns = {int(robot.torque_controlled[k]) for k in np.flatnonzero(np.nan_to_num(self.left) > POOR)}
        columns |= set(np.flatnonzero(self.outside).tolist())
        return _with_their_limbs(robot, columns)


def agreement(log: RobotLog, robot: Robot) -> Agreement:
    """Return how well a log agrees with the model: torques and ranges."""
    settings = Settings(support=robot.settings.support)
    try:
        prepared = prepare(log, robot, settings)
        evidence = gather(prepared, robot, settings)
    except (LogError, SettingsError):
        return Agreement(np.ones(len(robot.torque_controlled)), _outside(log, robot))
    shares = [unexplained(evidence, k, 1.0) for k in range(len(evidence.joints))]
    return Agreement(np.array(shares), _outside(log, robot))


def _outside(log: RobotLog, robot: Robot) -> NDArray[np.bool_]:
    low, high = robot.position_limits
    return np.asarray((log.position.min(axis=0) < low - OUTSIDE) | (log.position.max(axis=0) > high + OUTSIDE))


def excerpt(log: RobotLog) -> RobotLog:
    """Return as much of a log as is compared, from its middle."""
    step = max(1, int(1 / float(np.median(np.diff(log.time))) / ENOUGH_RATE))
    rows = len(log.time) // step
    first = max(0, rows - ENOUGH_ROWS) // 2 * step
    return log.take(slice(first, first + min(rows, ENOUGH_ROWS) * step, step))


def _with_their_limbs(robot: Robot, columns: Iterable[int]) -> list[int]:
    """Return columns of joints and of all between them and the base, or beyond them."""
    paths = {robot.tree.column(path[0]): {robot.tree.column(j) for j in path} for path in _paths(robot)}
    found = set(columns)
    found |= {above for column in found for above in paths[column]}
    found |= {column for column, path in paths.items() if path & set(columns)}
    return sorted(found)


def _paths(robot: Robot) -> Iterator[list[int]]:
    first = 2 if robot.tree.floating else 1
    for joint in range(first, robot.tree.model.njoints):
        yield robot.tree.path_to_root(joint)


def _changes(now: Columns, robot: Robot, bad: Sequence[int], unsure: Sequence[int]) -> Iterator[Columns]:
    yield replace(now, torque=-now.torque)
    for column in bad:
        sign = np.where(np.arange(len(now.order)) == column, -1.0, 1.0)
        yield replace(now, position=now.position * sign, torque=now.torque * sign)
        yield replace(now, torque=now.torque * sign)
        yield replace(now, position=now.position * sign)
    if len(unsure) <= MOST_ORDERED:
        for columns in permutations([now.order[column] for column in unsure]):
            placed = dict(zip(unsure, columns, strict=True))
            yield replace(now, order=tuple(placed.get(joint, column) for joint, column in enumerate(now.order)))
    else:
        if now.order == tuple(range(len(now.order))) and len(unsure) == len(now.order):
            yield from (replace(now, order=tuple(order)) for order in other_orders(robot))
        some = [column for column in unsure if column in bad]
        for k, one in enumerate(some):
            for other in some[k + 1 :]:
                order = list(now.order)
                order[one], order[other] = order[other], order[one]
                yield replace(now, order=tuple(order))


def _turned(now: Columns, bad: Sequence[int]) -> Iterator[Columns]:
    """Yield the columns with several joints that count the other way: about parallel axes one alone may seem worse."""
    most = len(bad) if len(bad) <= MOST_TOGETHER else 2
    for count in range(2, most + 1):
        for some in combinations(bad, count):
            sign = np.where(np.isin(np.arange(len(now.order)), some), -1.0, 1.0)
            yield replace(now, position=now.position * sign, torque=now.torque * sign)


def other_orders(robot: Robot) -> list[list[int]]:
    """Return for each joint its column in orders that logs have beside the model's: sides and ends exchanged, by depth.

    By depth are those of simulators that number joints breadth first: all hips, then all knees. ROS drivers have them
    by the alphabet.
    """
    from stribeck.draft.names import words

    names = robot.joint_names
    depth = {robot.tree.column(path[0]): len(path) for path in _paths(robot)}
    by_depth = sorted(range(len(names)), key=lambda column: (depth[column], column))
    meant = [tuple(words(name)) for name in names]

    def exchanged(*pairs: tuple[str, str]) -> list[int]:
        other = {a: b for pair in pairs for a, b in (pair, pair[::-1])}
        places = {each: k for k, each in enumerate(meant)}
        return [places.get(tuple(other.get(word, word) for word in each), k) for k, each in enumerate(meant)]

    def under(order: Sequence[int]) -> list[int]:
        place = {column: k for k, column in enumerate(by_depth)}
        return [place[column] for column in order]

    plain = [exchanged(), exchanged(("left", "right")), exchanged(("front", "rear"))]
    plain.append(exchanged(("left", "right"), ("front", "rear")))
    by_name = sorted(range(len(names)), key=lambda column: names[column])
    plain.append([by_name.index(column) for column in range(len(names))])
    return [list(order) for order in sorted({tuple(order) for each in plain for order in (each, under(each))})]

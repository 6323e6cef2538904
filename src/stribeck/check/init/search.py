"""Search for the order and signs of a log's columns that agree best with inverse dynamics and friction."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations, product

import numpy as np

from stribeck.check.audit.evidence import gather, with_motion
from stribeck.check.audit.positions import OUTSIDE
from stribeck.check.audit.regression import BETTER, POOR, all_unexplained, misfit
from stribeck.check.init.names import words
from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.errors import LogError, SettingsError
from stribeck.core.log import RobotLog
from stribeck.core.log.channels import ANGLE
from stribeck.core.log.clock import typical_step
from stribeck.core.robot import Robot
from stribeck.core.settings import Settings


@dataclass(frozen=True, eq=False)
class ColumnMatch:
    """Column of the log for each joint, and the signs of its position and torque, shape (n,) each."""

    order: tuple[int, ...]
    position: Array
    torque: Array

    def of(self, log: RobotLog) -> RobotLog:
        """Apply these columns and signs to a log."""
        signs = dict.fromkeys(("position", "velocity", "acceleration"), self.position)
        signs |= {"torque": self.torque, "external_torque": np.ones(len(self.order))}
        given = {name: array for name in signs if (array := getattr(log, name)) is not None}
        return replace(log, **{name: array[:, list(self.order)] * signs[name] for name, array in given.items()})

    def inverted(self, columns: Sequence[int]) -> ColumnMatch:
        """Invert position and torque of columns."""
        sign = np.where(np.isin(np.arange(len(self.order)), columns), -1.0, 1.0)
        return replace(self, position=self.position * sign, torque=self.torque * sign)

    def changed_since(self, before: ColumnMatch) -> BoolArray:
        """Find joints whose column or sign differs from before, shape (n,)."""
        order = np.array(self.order) != np.array(before.order)
        return np.asarray(order | (self.position != before.position) | (self.torque != before.torque))


def as_given(joints: int) -> ColumnMatch:
    """Make columns in their original order, with their original signs."""
    return ColumnMatch(tuple(range(joints)), np.ones(joints), np.ones(joints))


def find_columns_by_dynamics(log: RobotLog, robot: Robot, unsure: Sequence[int]) -> ColumnMatch:
    """Find the order and signs that agree best with the model.

    The search starts from the given columns, and makes steps as long as each makes the log far more likely. A step
    inverts one or two joints, only their torque or position, or all torques; or it exchanges two joints without known
    names, or puts all of them in another order known from logs (in any order, if they are few). Steps are undone if the
    model does not explain the torques of the changed joints, because then another problem is likely, such as wrong
    contacts.

    Parameters
    ----------
    log
        Log with the robot's joints.
    unsure
        Columns whose joint could not be matched by name.
    """
    log = _take_excerpt(log)
    given = as_given(len(robot.joint_names))
    best = _descend(given, log, robot, unsure)
    shares = _compare(best.of(log), robot).left[best.changed_since(given)[robot.torque_controlled]]
    return given if np.any(shares > 0.5) else best  # share of the torque's variance


def unit_by_dynamics(log: RobotLog, robot: Robot) -> str:
    """Find the unit of positions in which the torques agree far better with the model than in radians; "" if none."""
    log = _take_excerpt(log)
    given, turning = _compare(log, robot), ~np.array(robot.prismatic)
    best = ""
    for unit in ("deg", "turn"):
        agreement = _compare(with_motion(log, np.where(turning, ANGLE[unit], 1.0)), robot)
        if given.cost - agreement.cost > np.log(BETTER) and np.nanmedian(agreement.left) < POOR:
            given, best = agreement, unit
    return best


def gear_ratios_by_dynamics(log: RobotLog, robot: Robot) -> tuple[Array, Array] | None:
    """Find gear ratios with which angles, and maybe torques, of the motors' shafts agree far better with the model.

    The search starts from the best common ratio, and then changes one ratio at a time.

    Returns
    -------
    ratios, torques
        Ratios of positions, and factors of torques [1], shape (n,) each; None if the log agrees as it is, or with none.
    """
    log = _take_excerpt(log)
    given, turning = _compare(log, robot), ~np.array(robot.prismatic)
    if not np.median(np.nan_to_num(given.left)) > POOR or log.command is not None:
        return None
    radians = ANGLE[robot.log_table.position.unit or "rad"]

    def geared(ratios: Array, before: bool) -> Agreement:
        scaled = with_motion(log, np.where(turning, 1 / (radians * ratios), 1.0))
        return _compare(replace(scaled, torque=log.torque * (ratios if before else 1.0)), robot)

    grid = np.geomspace(1.0, 200.0, 40)
    trials = product(np.outer(grid, turning) + ~turning, (True, False))  # common ratios, with and without torques
    ratios, before = min(trials, key=lambda trial: geared(*trial).cost)
    if (best := geared(ratios, before)).cost > given.cost - 1:
        return None
    fine = [step ** np.arange(-3.0, 4.0) for step in (1.04, 1.015, 1.005)]
    for factors in (None, *fine):
        for column in robot.torque_controlled[turning[robot.torque_controlled]]:
            for value in grid if factors is None else ratios[column] * factors:
                trial = np.where(np.arange(len(ratios)) == column, value, ratios)
                if (agreement := geared(trial, before)).cost < best.cost:
                    best, ratios = agreement, trial
    shares = ratios * np.subtract(*robot.position_limits[::-1]) / 200  # one if positions are -100 to 100 of the range
    if given.cost - best.cost < np.log(BETTER) or np.nanmedian(best.left) > POOR or np.allclose(shares, 1, atol=0.05):
        return None
    ratios = np.round(ratios, 0 if geared(np.round(ratios), before).cost < best.cost + 1 else 2)
    return ratios, ratios if before else np.ones(len(ratios))


def _descend(best: ColumnMatch, log: RobotLog, robot: Robot, unsure: Sequence[int]) -> ColumnMatch:
    """Make all steps that make the log far more likely."""
    now = _compare(best.of(log), robot)
    tried = 0
    while tried < 1500 and (bad := now.poor(robot)):
        for changes in (_list_changes(best, robot, bad, unsure), _invert_several(best, bad)):
            scored = [(_compare(change.of(log), robot), change) for change in changes]
            tried += len(scored)
            after, change = min(scored, key=lambda pair: pair[0].cost, default=(now, best))
            if now.cost - after.cost > np.log(BETTER):
                best, now = change, after
                break
        else:
            break
    return best


@dataclass(frozen=True, eq=False)
class Agreement:
    """Agreement of a log with a model.

    Attributes
    ----------
    left
        Unexplained share of each torque's variance, shape (k,); NaN without enough data.
    outside
        Whether each joint leaves its range, shape (n,).
    """

    left: Array
    outside: BoolArray

    @property
    def cost(self) -> float:
        """Logarithm of the product of the shares, larger if joints leave their range."""
        return misfit(self.left) + 1.1 * float(np.log(BETTER)) * int(self.outside.sum())

    def poor(self, robot: Robot) -> list[int]:
        """Find the joints whose columns may be wrong: joints that agree poorly, and all joints below and above them."""
        poor = {int(robot.torque_controlled[k]) for k in np.flatnonzero(np.nan_to_num(self.left) > POOR)}
        poor |= set(np.flatnonzero(self.outside).tolist())
        paths = _find_paths(robot)
        beyond = {column for column, path in paths.items() if poor & set(path)}
        return sorted(beyond.union(*(paths[column] for column in poor)))


def _compare(log: RobotLog, robot: Robot) -> Agreement:
    """Compare the torques and ranges of a log with the model."""
    settings = Settings(support=robot.settings.support)
    low, high = robot.position_limits
    outside = (log.position.min(axis=0) < low - OUTSIDE) | (log.position.max(axis=0) > high + OUTSIDE)
    try:
        evidence = gather(prepare(log, robot, settings), robot, settings)
    except (LogError, SettingsError):
        return Agreement(np.ones(len(robot.torque_controlled)), outside)
    return Agreement(all_unexplained(evidence), outside)


def _take_excerpt(log: RobotLog) -> RobotLog:
    """Take at most 2,000 samples at about 200 Hz from the middle of a log."""
    step = max(1, int(1 / typical_step(log.time[np.isfinite(log.time)], log.path) / 200.0))
    rows = max(1, len(log.time) // step)
    first = max(0, rows - 2000) // 2 * step
    return log.take(slice(first, first + min(rows, 2000) * step, step))


def _find_paths(robot: Robot) -> dict[int, list[int]]:
    """List the columns from each joint to the base, by the joint's column."""
    tree = robot.tree
    paths = map(tree.path_to_root, range(1 + tree.floating, tree.model.njoints))
    return {path[0]: path for path in ([tree.column(joint) for joint in joints] for joints in paths)}


def _list_changes(now: ColumnMatch, robot: Robot, bad: Sequence[int], unsure: Sequence[int]) -> Iterator[ColumnMatch]:
    yield replace(now, torque=-now.torque)
    for column in bad:
        both = now.inverted([column])
        yield from (both, replace(both, position=now.position), replace(both, torque=now.torque))
    if len(unsure) <= 5:  # every order
        for columns in permutations([now.order[column] for column in unsure]):
            placed = dict(zip(unsure, columns, strict=True))
            yield replace(now, order=tuple(placed.get(joint, column) for joint, column in enumerate(now.order)))
    else:
        if now.order == tuple(range(len(now.order))) and len(unsure) == len(now.order):
            yield from (replace(now, order=tuple(order)) for order in other_orders(robot))
        for joint, other in combinations([column for column in unsure if column in bad], 2):
            order = list(now.order)
            order[joint], order[other] = order[other], order[joint]
            yield replace(now, order=tuple(order))


def _invert_several(now: ColumnMatch, bad: Sequence[int]) -> Iterator[ColumnMatch]:
    """Yield columns with several inverted joints; with parallel axes, inverting only one may be worse."""
    for count in range(2, 1 + (len(bad) if len(bad) <= 7 else 2)):
        for some in combinations(bad, count):
            yield now.inverted(some)


def other_orders(robot: Robot) -> list[list[int]]:
    """List the column of each joint in other usual orders: sides and ends exchanged, by depth, or alphabetical.

    Simulators number joints by depth (breadth first): all hips, then all knees. ROS drivers sort them alphabetically.
    """
    names, paths = robot.joint_names, _find_paths(robot)
    by_depth = sorted(range(len(names)), key=lambda column: (len(paths[column]), column))
    meant = [tuple(words(name)) for name in names]
    sides, ends = ("left", "right"), ("front", "rear")

    def exchange(*pairs: tuple[str, str]) -> list[int]:
        other = {a: b for pair in pairs for a, b in (pair, pair[::-1])}
        places = {terms: k for k, terms in enumerate(meant)}
        return [places.get(tuple(other.get(word, word) for word in terms), k) for k, terms in enumerate(meant)]

    plain = [exchange(), exchange(sides), exchange(ends), exchange(sides, ends)]
    plain.append([sorted(names).index(name) for name in names])
    under = [[by_depth.index(column) for column in order] for order in plain]
    return [list(order) for order in sorted({*map(tuple, plain), *map(tuple, under)})]

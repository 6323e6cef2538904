"""Search for the order, signs, unit and gear ratios of a log that agree best with inverse dynamics and friction."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations

import numpy as np

from stribeck.check.audit.change import ColumnChange
from stribeck.check.audit.evidence import gather
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
class Trial:
    """A change, and the agreement of the changed log with the model.

    Attributes
    ----------
    left
        Unexplained share of each torque's variance, shape (k,); NaN without enough data.
    outside
        Whether each joint leaves its range, shape (n,).
    """

    change: ColumnChange
    left: Array
    outside: BoolArray

    @property
    def cost(self) -> float:
        """Logarithm of the product of the shares, larger if joints leave their range."""
        return misfit(self.left) + 1.1 * BETTER * int(self.outside.sum())

    @property
    def fits(self) -> bool:
        """Whether the model explains most torques."""
        return bool(np.nanmedian(self.left) < POOR)


def _take_excerpt(log: RobotLog) -> RobotLog:
    """Take at most 2,000 samples at about 200 Hz from the middle of a log."""
    step = max(1, int(1 / typical_step(log.time[np.isfinite(log.time)], log.path) / 200.0))
    rows = max(1, len(log.time) // step)
    first = max(0, rows - 2000) // 2 * step
    return log.take(slice(first, first + min(rows, 2000) * step, step))


def _try(log: RobotLog, robot: Robot, change: ColumnChange) -> Trial:
    """Compare the torques and ranges of a changed log with the model."""
    log, settings = change.apply(log), Settings(support=robot.settings.support)
    low, high = robot.position_limits
    outside = (log.position.min(axis=0) < low - OUTSIDE) | (log.position.max(axis=0) > high + OUTSIDE)
    try:
        left = all_unexplained(gather(prepare(log, robot, settings), robot, settings))
    except (LogError, SettingsError):
        left = np.ones(len(robot.torque_controlled))
    return Trial(change, left, outside)


def unexplained(log: RobotLog, robot: Robot) -> float:
    """Compute the median share of each torque's variance that the model leaves unexplained in an excerpt of a log."""
    return float(np.nanmedian(_try(_take_excerpt(log), robot, ColumnChange.none(len(robot.joint_names))).left))


def _best(log: RobotLog, robot: Robot, now: Trial, changes: Iterable[ColumnChange], least: float = BETTER) -> Trial:
    """Choose the best change if it decreases the cost by more than the least amount [1], and the present one if not."""
    best = min((_try(log, robot, change) for change in changes), key=lambda trial: trial.cost, default=now)
    return best if now.cost - best.cost > least else now


def find_columns_by_dynamics(log: RobotLog, robot: Robot, unsure: Sequence[int]) -> ColumnChange:
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
    given = now = _try(log, robot, ColumnChange.none(len(robot.joint_names)))
    tried, most = 0, 1500  # trials [1]
    while tried < most and (bad := _poor(now, robot)):
        for steps in (_list_changes(now.change, robot, bad, unsure), _invert_several(now.change, bad)):
            changes = list(steps)
            tried += len(changes)
            if (after := _best(log, robot, now, changes)) is not now:
                now = after
                break
        else:
            break
    shares = now.left[now.change.since(given.change)[robot.torque_controlled]]
    return given.change if np.any(shares > 0.5) else now.change  # share of the torque's variance


def unit_by_dynamics(log: RobotLog, robot: Robot) -> str:
    """Find the unit of positions in which the torques agree far better with the model than in radians; "" if none."""
    log, none, turning = _take_excerpt(log), ColumnChange.none(len(robot.joint_names)), ~np.array(robot.prismatic)
    changes = {unit: none.times(position=np.where(turning, ANGLE[unit], 1.0)) for unit in ("deg", "turn")}
    best = _best(log, robot, _try(log, robot, none), changes.values())
    return next((unit for unit, change in changes.items() if best.change is change and best.fits), "")


def gear_ratios_by_dynamics(log: RobotLog, robot: Robot) -> tuple[Array, Array] | None:
    """Find gear ratios with which angles, and maybe torques, of the motors' shafts agree far better with the model.

    The search starts from the best common ratio, and then changes one ratio at a time.

    Returns
    -------
    ratios, torques
        Ratios of positions, and factors of torques [1], shape (n,) each; None if the log agrees as it is, or with none.
    """
    log, turning = _take_excerpt(log), ~np.array(robot.prismatic)
    given = _try(log, robot, ColumnChange.none(len(turning)))
    if not np.median(np.nan_to_num(given.left)) > POOR or log.command is not None or log.unscaled:
        return None
    radians = ANGLE[robot.log_table.position.unit or "rad"]

    grid, in_radians = np.geomspace(1.0, 200.0, 40), given.change.times(position=np.where(turning, 1 / radians, 1.0))
    common = np.outer(grid, turning) + ~turning  # ratios of all joints, with and without torques
    changes = (in_radians.times(1 / ratios, factors) for ratios in common for factors in (ratios, 1.0))
    best = _best(log, robot, given, changes, 1.0)
    before, columns = bool(np.any(best.change.torque != 1)), robot.torque_controlled[turning[robot.torque_controlled]]
    for step, count in ((grid[1], 20), (1.04, 3), (1.015, 3), (1.005, 3)) if best is not given else ():
        for column in columns.tolist():
            powers = np.outer(np.arange(-count, count + 1), np.arange(len(turning)) == column)
            changes = (best.change.times(1 / each, each if before else 1.0) for each in step**powers)
            best = _best(log, robot, best, changes, 0.0)
    ratios: Array = np.where(turning, 1 / (radians * best.change.position), 1.0)
    shares = ratios * np.subtract(*robot.position_limits[::-1]) / 200  # one if positions are -100 to 100 of the range
    if given.cost - best.cost < BETTER or not best.fits or np.allclose(shares, 1, atol=0.05):
        return None
    whole = in_radians.times(1 / np.round(ratios), np.round(ratios) if before else 1.0)
    ratios = np.round(ratios, 0 if _try(log, robot, whole).cost < best.cost + 1 else 2)
    return ratios, ratios if before else np.ones(len(ratios))


def _poor(trial: Trial, robot: Robot) -> list[int]:
    """Find the joints whose columns may be wrong: joints that agree poorly, and all joints below and above them."""
    poor = {int(robot.torque_controlled[k]) for k in np.flatnonzero(np.nan_to_num(trial.left) > POOR)}
    poor |= set(np.flatnonzero(trial.outside).tolist())
    paths = _find_paths(robot)
    beyond = {column for column, path in paths.items() if poor & set(path)}
    return sorted(beyond.union(*(paths[column] for column in poor)))


def _find_paths(robot: Robot) -> dict[int, list[int]]:
    """List the columns from each joint to the base, by the joint's column."""
    tree = robot.tree
    paths = map(tree.path_to_root, range(1 + tree.floating, tree.model.njoints))
    return {path[0]: path for path in ([tree.column(joint) for joint in joints] for joints in paths)}


def _list_changes(now: ColumnChange, robot: Robot, bad: Sequence[int], unsure: Sequence[int]) -> Iterator[ColumnChange]:
    yield now.times(torque=-1.0)
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


def _invert_several(now: ColumnChange, bad: Sequence[int]) -> Iterator[ColumnChange]:
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

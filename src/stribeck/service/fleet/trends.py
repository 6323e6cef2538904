"""Friction of a robot type over logs: spreads, robots that stand out, and changes of joints (docs/fleet.md).

The logarithm y of a joint's friction at one speed, in log j of robot i, is mu + b_i + e_ij. The robot's part b_i has
the variance tau^2, and e_ij has omega^2 + phi s_ij^2, with s_ij the log's relative standard error. The share phi of it
differs from log to log; the rest, such as errors of the model, is the same in all logs.
"""

import json
from dataclasses import asdict, dataclass, field
from datetime import datetime
from itertools import groupby
from pathlib import Path

import numpy as np

from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.errors import SettingsError
from stribeck.core.result.log_spread import change_text, smallest_text
from stribeck.service.fleet.changes import Change, find_changes, visible_change
from stribeck.service.fleet.friction import Fleet, JointSpeed, TypeParameter, read_fleet, read_parameters
from stribeck.service.fleet.spreads import log_variance, outliers, reml


@dataclass(frozen=True, kw_only=True)
class TypeFriction(JointSpeed):
    """Friction of a joint of this robot type at one speed.

    `friction` has the standard error `standard_error`; `robot_spread` and `log_spread` are standard deviations from
    robot to robot and from log to log of one robot [N m], [N]; `smallest` is the smallest change that three logs show,
    once many logs are known [%].
    """

    friction: float
    standard_error: float
    robot_spread: float
    log_spread: float
    smallest: float
    robots: int
    logs: int


@dataclass(frozen=True, kw_only=True)
class OddRobot(JointSpeed):
    """Robot whose joint differs from the type: its friction at `velocity`, that of the others, and their spread."""

    robot: str
    friction: float
    usual: float
    spread: float

    @property
    def line(self) -> str:
        """One line, e.g. "R7 elbow: 2.41 N m at 0.5 rad/s, where the others have 1.20 ± 0.06 N m"."""
        friction = f"{self.friction:.3g} {self.unit} at {self.speed}"
        others = f"where the others have {self.usual:.3g} ± {self.spread:.2g} {self.unit}"
        return f"{self.robot} {self.joint}: {friction}, {others}"


@dataclass(frozen=True, kw_only=True)
class FrictionChange(JointSpeed):
    """Change of a joint's friction: first log with it and its start, and the log in which it was seen.

    `before` and `after` are the friction at `velocity`; `standard_error` is that of their difference.
    """

    robot: str
    start: datetime
    log: str
    seen: str
    before: float
    after: float
    standard_error: float

    @property
    def line(self) -> str:
        """One line, e.g. "R3 elbow: 1.20 -> 1.61 ± 0.04 N m at 0.5 rad/s since 2026-03-01 (log_17.npz)"."""
        change = f"{self.before:.3g} -> {self.after:.3g} ± {1.96 * self.standard_error:.2g} {self.unit}"
        log = Path(self.log).name  # its stamps may count from zero
        when = f"{self.start:%Y-%m-%d} ({log})" if self.start.year > 1970 else log
        return f"{self.robot} {self.joint}: {change} at {self.speed} since {when}"


@dataclass(frozen=True, kw_only=True)
class Trends:
    """Friction of a robot type at some speeds and its parameters, robots that stand out, and alarms sorted by severity.

    `fleet` has the numbers behind them.
    """

    friction: list[TypeFriction]
    parameters: list[TypeParameter]
    odd: list[OddRobot]
    alarms: list[FrictionChange]
    logs_per_false_alarm: float
    fleet: Fleet = field(repr=False)

    @property
    def title(self) -> str:
        """Numbers of logs and robots, and the first and the last day if known."""
        fleet, robots = self.fleet, len(np.unique(self.fleet.robots))
        days = f", {fleet.start.min().astype('M8[D]')} to {fleet.start.max().astype('M8[D]')}"
        return f"{len(fleet.log)} logs of {robots} robot" + "s" * (robots != 1) + days * (days[2:6] != "1970")

    @property
    def conclusion(self) -> str:
        """State how many joints changed and how many robots stand out, with the clearest of each."""
        joints, robots = ({(alarm.robot, alarm.joint) for alarm in self.alarms}, {robot.robot for robot in self.odd})
        changed = f"{len(joints)} joint{'s' * (len(joints) != 1)} changed" if joints else "No joint changed"
        odd = f"{len(robots)} robot{'s' * (len(robots) != 1)} stand{'s' * (len(robots) == 1)} out" if robots else ""
        clearest = [f" ({group[0].line})" if group else "" for group in (self.alarms, self.odd)]
        least: dict[str, float] = {}
        for fit in self.friction:
            least[fit.joint] = min(fit.smallest, least.get(fit.joint, fit.smallest))
        seen = f" The smallest change that three logs show is {smallest_text(least)}."
        return f"{changed}{clearest[0]}, and {odd or 'no robot stands out'}{clearest[1]}.{seen}"

    def to_json(self) -> str:
        """Format all but the numbers behind as JSON."""
        names = "friction", "parameters", "odd", "alarms"
        rows = {name: [asdict(row) for row in getattr(self, name)] for name in names}
        return json.dumps({"conclusion": self.conclusion, **rows}, indent=2, default=str) + "\n"

    def summary(self) -> str:
        """Format the conclusion, and tables of the type's friction, robots that stand out, and alarms."""
        lines = [self.conclusion, self.title]
        for fit in self.friction:
            text = f"  {fit.joint}  {fit.friction:.3g} {fit.unit} at {fit.speed}; standard deviations: "
            text += f"robots {fit.robot_spread:.2g}, " * (fit.robot_spread >= 0)  # NaN of a single robot
            lines.append(f"{text}logs {fit.log_spread:.2g} {fit.unit}; changes from {change_text(fit.smallest)}")
        for joint, group in groupby(self.parameters, key=lambda parameter: parameter.joint):
            lines.append(f"  {joint}  {', '.join(map(str, group))} in 90 % of the logs")
        lines += [f"stands out: {robot.line}" for robot in self.odd]
        lines += [f"changed: {alarm.line}" for alarm in self.alarms]
        return "\n".join(lines)


def find_trends(store: str | Path, *, logs_per_false_alarm: float = 1000.0) -> Trends:
    """Find the friction of a robot type, robots that stand out, and changes.

    Parameters
    ----------
    store
        Folder that `stribeck fleet` wrote.
    logs_per_false_alarm
        Mean number of logs between false alarms, over all joints.

    Raises
    ------
    SettingsError
        If the folder is not a store, a file of it is damaged, or `logs_per_false_alarm` is not within 10 to 1e9.
    NothingIdentifiedError
        If no joint has friction in the store.
    """
    if not 10 <= logs_per_false_alarm <= 1e9:
        raise SettingsError(f"logs_per_false_alarm: found {logs_per_false_alarm:g}, expected 10 to 1e9 logs")
    fleet = read_fleet(store)
    variance, freedom = log_variance(fleet)
    visible = visible_change(logs_per_false_alarm, len(freedom), freedom)
    changes = find_changes(fleet.robots, fleet.logarithm, variance, logs_per_false_alarm, freedom)
    first = np.isfinite(fleet.logarithm)  # logs before the first change of their robot
    for change in changes:
        first[change.first : change.stop, change.channel] = False
    friction, odd = [], list[OddRobot]()
    for channel in range(len(fleet.channels)):
        fit, robots = _type_friction(fleet, channel, variance[:, channel], first[:, channel], float(visible[channel]))
        friction.append(fit)
        odd += robots
    return Trends(
        friction=friction,
        parameters=read_parameters(store),
        odd=_clearest(odd),
        alarms=_alarms(fleet, changes),
        logs_per_false_alarm=logs_per_false_alarm,
        fleet=fleet,
    )


def _type_friction(
    fleet: Fleet, channel: int, variance: Array, used: BoolArray, visible: float
) -> tuple[TypeFriction, list[OddRobot]]:
    """Fit the mixed model of one channel by REML, without robots that stand out."""
    place = asdict(fleet.channels[channel])
    robots, which = np.unique(fleet.robots[used], return_inverse=True)
    weight = 1 / variance[used]
    total = np.bincount(which, weight)
    mean = np.bincount(which, weight * fleet.logarithm[used, channel]) / total
    odd = outliers(mean, 0.05 / len(fleet.channels))  # 5 % of fleets without such a robot seem to have one
    kept = np.setdiff1d(np.arange(len(robots)), odd)
    usual, error, spread = reml(mean[kept], 1 / total[kept])
    friction, between_logs = float(np.exp(usual)), float(np.sqrt(np.median(variance[used])))
    fit = TypeFriction(
        **place,
        friction=friction,
        standard_error=friction * error,
        robot_spread=friction * spread,
        log_spread=friction * between_logs,
        smallest=100 * float(np.expm1(min(visible * between_logs, 10.0))),
        robots=len(robots),
        logs=int(used.sum()),
    )
    place |= {"usual": friction, "spread": friction * spread}
    return fit, [OddRobot(**place, robot=str(robots[k]), friction=float(np.exp(mean[k]))) for k in odd]


def _clearest(odd: list[OddRobot]) -> list[OddRobot]:
    """Keep the speed of each robot's joint at which it stands out most, the largest first."""
    robots: dict[tuple[str, str], OddRobot] = {}
    for robot in sorted(odd, key=lambda robot: -abs(np.log(robot.friction / robot.usual))):
        robots.setdefault((robot.robot, robot.joint), robot)
    return list(robots.values())


def _alarms(fleet: Fleet, changes: list[Change]) -> list[FrictionChange]:
    """Make one alarm of the changes of a joint at its speeds; the most significant speed is shown."""
    groups: dict[tuple[str, str], list[list[Change]]] = {}
    for change in sorted(changes, key=lambda change: change.first):
        clusters = groups.setdefault((str(fleet.robots[change.first]), fleet.channels[change.channel].joint), [])
        if clusters and change.first <= max(member.seen for member in clusters[-1]):
            clusters[-1].append(change)
        else:
            clusters.append([change])
    alarms = []
    for (robot, _), joined in groups.items():
        for group in joined:
            change = max(group, key=lambda member: abs(member.after - member.before) / member.error)
            seen = min(member.seen for member in group)
            alarms.append(
                FrictionChange(
                    **asdict(fleet.channels[change.channel]),
                    robot=robot,
                    start=fleet.start[change.first].astype(datetime),
                    log=str(fleet.log[change.first]),
                    seen=str(fleet.log[seen]),
                    before=float(np.exp(change.before)),
                    after=float(np.exp(change.after)),
                    standard_error=float(np.exp(change.after)) * change.error,
                )
            )
    return sorted(alarms, key=lambda alarm: -abs(np.log(alarm.after / alarm.before)))

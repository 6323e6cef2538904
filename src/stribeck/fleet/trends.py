"""Friction of a robot type over logs: spreads, robots that stand out, and changes of joints (docs/fleet.md).

The logarithm y of a joint's friction at one speed, in log j of robot i, is mu + b_i + e_ij. The robot's part b_i has
the variance tau^2, and e_ij has omega^2 + phi s_ij^2, with s_ij the log's relative standard error. The share phi of it
differs from log to log; the rest, such as errors of the model, is the same in all logs.
"""

import json
from dataclasses import asdict, dataclass, field
from datetime import datetime
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize, minimize_scalar
from scipy.stats import t as student_t

from stribeck.base.typing import Array
from stribeck.errors import NothingIdentifiedError
from stribeck.fleet.changes import Change, find_changes
from stribeck.fleet.store import connect

CHANNELS = 3
"""Speeds of each joint that are followed [1], at most."""
COMMON = 0.8
"""Share of a joint's logs that reach a followed speed [1], at least."""
ALPHA = 0.05
"""Probability that a fleet in which no robot stands out has one that seems to [1]."""
PAIRS = 4000
"""Pairs of successive logs that the spreads are estimated from [1], at most."""


@dataclass(frozen=True, kw_only=True)
class TypeFriction:
    """Friction of a joint of this robot type at one speed.

    `friction` has the standard error `standard_error`; `robot_spread` and `log_spread` are standard deviations from
    robot to robot and from log to log of one robot [N m], [N].
    """

    joint: str
    velocity: float
    unit: str
    friction: float
    standard_error: float
    robot_spread: float
    log_spread: float
    robots: int
    logs: int


@dataclass(frozen=True, kw_only=True)
class OddRobot:
    """Robot whose joint differs from the type: its friction at `velocity`, that of the others, and their spread."""

    robot: str
    joint: str
    velocity: float
    unit: str
    friction: float
    usual: float
    spread: float

    @property
    def line(self) -> str:
        """One line, e.g. "R7 elbow: 2.41 N m at 0.5 rad/s, where the others have 1.20 ± 0.06 N m"."""
        others = f"where the others have {self.usual:.3g} ± {self.spread:.2g} {self.unit}"
        return f"{self.robot} {self.joint}: {self.friction:.3g} {self.unit} at {_speed(self)}, {others}"


@dataclass(frozen=True, kw_only=True)
class Alarm:
    """Change of a joint's friction: first log with it and its start, and the log in which it was seen.

    `before` and `after` are the friction at `velocity`; `standard_error` is that of their difference.
    """

    robot: str
    joint: str
    velocity: float
    unit: str
    start: datetime
    log: str
    seen: str
    before: float
    after: float
    standard_error: float

    @property
    def line(self) -> str:
        """One line, e.g. "R3 elbow: 1.20 -> 1.61 ± 0.04 N m at 0.5 rad/s since 2026-03-01 (log_17.npz)"."""
        change = (
            f"{self.before:.3g} -> {self.after:.3g} ± {1.96 * self.standard_error:.2g} {self.unit} at {_speed(self)}"
        )
        return f"{self.robot} {self.joint}: {change} since {self.start:%Y-%m-%d} ({Path(self.log).name})"


@dataclass(frozen=True, kw_only=True)
class Trends:
    """Friction of a robot type, robots that stand out, and alarms sorted by severity.

    `fleet` has the numbers behind them.
    """

    friction: list[TypeFriction]
    odd: list[OddRobot]
    alarms: list[Alarm]
    logs_per_false_alarm: float
    fleet: "Fleet" = field(repr=False)

    @property
    def title(self) -> str:
        """Numbers of logs and robots, and the first and the last day."""
        fleet = self.fleet
        days = f"{fleet.start.min().astype('M8[D]')} to {fleet.start.max().astype('M8[D]')}"
        return f"{len(fleet.log)} logs of {len(np.unique(fleet.robots))} robots, {days}"

    def to_json(self) -> str:
        """Format all but the numbers behind as JSON."""
        plain = {name: [asdict(each) for each in getattr(self, name)] for name in ("friction", "odd", "alarms")}
        return json.dumps(plain, indent=2, default=str) + "\n"

    def summary(self) -> str:
        """Format tables of the type's friction, robots that stand out, and alarms."""
        lines = [self.title]
        for each in self.friction:
            spreads = f"robots {each.robot_spread:.2g}, logs {each.log_spread:.2g}"
            lines.append(
                f"  {each.joint}  {each.friction:.3g} {each.unit} at {_speed(each)}; standard deviations: {spreads}"
            )
        lines += [f"stands out: {each.line}" for each in self.odd]
        lines += [f"changed: {each.line}" for each in self.alarms] or ["no joint changed"]
        return "\n".join(lines)


@dataclass(frozen=True, eq=False, kw_only=True)
class Fleet:
    """Friction of N logs, sorted by robot and start, in C channels: joints, each at some speeds.

    Attributes
    ----------
    robots, start, log
        Robot id, start and path of each log, shape (N,).
    channels
        Joint, speed and unit of each channel.
    friction, error
        Friction and its standard error [N m], shape (N, C); NaN where a log has none.
    """

    robots: NDArray[np.str_]
    start: NDArray[np.datetime64]
    log: NDArray[np.object_]
    channels: list[tuple[str, float, str]]
    friction: Array
    error: Array

    @cached_property
    def logarithm(self) -> Array:
        """Logarithm of the friction, shape (N, C); NaN where it is not positive."""
        return np.log(np.where(self.friction > 0, self.friction, np.nan))


def _speed(of: TypeFriction | OddRobot | Alarm) -> str:
    return f"{of.velocity:g} {'rad/s' if of.unit == 'N m' else 'm/s'}"


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
        If the folder is not a store.
    NothingIdentifiedError
        If no joint has friction in the store.
    """
    fleet = read_fleet(store)
    variance = np.column_stack([log_variance(fleet, channel) for channel in range(len(fleet.channels))])
    changes = find_changes(fleet.robots, fleet.logarithm, variance, logs_per_false_alarm)
    first = _before_changes(fleet, changes)
    friction, odd = [], list[OddRobot]()
    for channel in range(len(fleet.channels)):
        found, own = _type_friction(fleet, channel, variance[:, channel], first[:, channel])
        friction.append(found)
        odd += own
    return Trends(
        friction=friction,
        odd=_clearest(odd),
        alarms=_alarms(fleet, changes),
        logs_per_false_alarm=logs_per_false_alarm,
        fleet=fleet,
    )


def read_fleet(store: str | Path) -> Fleet:
    """Read the friction of all logs at the speeds that most of them reach."""
    speeds = f"""
        WITH counts AS (SELECT joint, velocity, any_value(unit) AS unit, count(*) AS n FROM curves GROUP BY ALL),
        usual AS (SELECT *, row_number() OVER (PARTITION BY joint ORDER BY velocity) AS k,
                         count(*) OVER (PARTITION BY joint) AS m
                  FROM counts QUALIFY n >= {COMMON} * max(n) OVER (PARTITION BY joint))
        SELECT joint, velocity, unit FROM usual
        WHERE m <= {CHANNELS} OR k IN (1, (m + 1) // 2, m) ORDER BY joint, velocity"""
    with connect(store) as connection:
        connection.execute("SET memory_limit = '1GB'; SET preserve_insertion_order = false")
        channels = connection.execute(speeds.replace("GROUP BY ALL", "GROUP BY joint, velocity")).fetchall()
        if not channels:
            raise NothingIdentifiedError(
                f"{store}: has no log with the friction of a joint; run `stribeck fleet` first"
            )
        connection.execute(
            "CREATE TEMP TABLE place AS SELECT key, robot, start, log, "
            "row_number() OVER (ORDER BY robot, start, log) - 1 AS n FROM logs WHERE status = 'identified'"
        )
        connection.execute("CREATE TEMP TABLE channel (joint VARCHAR, velocity DOUBLE, unit VARCHAR, c INTEGER)")
        connection.executemany(
            "INSERT INTO channel VALUES (?, ?, ?, ?)", [(*each, c) for c, each in enumerate(channels)]
        )
        logs = connection.execute("SELECT robot, start, log FROM place ORDER BY n").fetchnumpy()
        connection.execute(
            "CREATE TEMP TABLE point AS SELECT n, c, friction, standard_error FROM curves "
            "JOIN channel USING (joint, velocity) JOIN place USING (key, robot)"
        )
        found = np.full((2, len(logs["robot"]), len(channels)), np.nan)
        for channel in range(len(channels)):  # all at once would take several gigabytes
            rows = connection.execute(
                "SELECT n, friction, standard_error FROM point WHERE c = ?", [channel]
            ).fetchnumpy()
            found[:, rows["n"], channel] = rows["friction"], rows["standard_error"]
    return Fleet(
        robots=np.array(logs["robot"], dtype=str),
        start=np.array(logs["start"], dtype="datetime64[us]"),
        log=np.array(logs["log"], dtype=object),
        channels=channels,
        friction=found[0],
        error=found[1],
    )


def log_variance(fleet: Fleet, channel: int) -> Array:
    """Compute the relative variance of each log about its robot's friction, omega^2 + phi s^2, shape (N,).

    omega and phi are the most likely ones of the differences of successive logs, which a change touches once; those
    beyond four robust standard deviations are left out.
    """
    squares = (fleet.error[:, channel] / fleet.friction[:, channel]) ** 2
    difference = np.diff(fleet.logarithm[:, channel])
    own = squares[1:] + squares[:-1]
    valid = (fleet.robots[1:] == fleet.robots[:-1]) & np.isfinite(difference)
    difference, own = difference[valid], own[valid]
    kept = np.abs(difference) <= 4 * 1.4826 * np.median(np.abs(difference)) if len(difference) else []
    difference, own = difference[kept], own[kept]
    if len(difference) < 5:  # too few logs to tell
        return squares
    some = np.linspace(0, len(difference) - 1, min(len(difference), PAIRS)).astype(int)
    difference, own = difference[some], own[some]
    scale = np.mean(difference**2) + 1e-12 * np.mean(own) + 1e-300

    def cost(logarithms: Array) -> float:
        omega, phi = np.exp(logarithms)
        variance = 2 * omega * scale + phi * own
        return float(np.mean(np.log(variance) + difference**2 / variance))

    bounds = [(-14.0, 3.0), (-9.0, 0.0)]
    starts = [np.array([-0.7, -3.0]), np.array([-5.0, -0.1])]
    best = min((minimize(cost, start, bounds=bounds) for start in starts), key=lambda each: each.fun)
    omega, phi = np.exp(best.x)
    return np.asarray(omega * scale + phi * squares)


def _before_changes(fleet: Fleet, changes: list[Change]) -> NDArray[np.bool_]:
    """Mask the logs of each channel before the first change of their robot, shape (N, C)."""
    first = np.isfinite(fleet.logarithm)
    for change in changes:
        own = slice(change.first, change.stop)
        first[own, change.channel] = False
    return first


def _type_friction(
    fleet: Fleet, channel: int, variance: Array, used: NDArray[np.bool_]
) -> tuple[TypeFriction, list[OddRobot]]:
    """Fit the mixed model of one channel by REML, without robots that stand out."""
    joint, velocity, unit = fleet.channels[channel]
    robots, which = np.unique(fleet.robots[used], return_inverse=True)
    weight = 1 / variance[used]
    total = np.bincount(which, weight)
    mean = np.bincount(which, weight * fleet.logarithm[used, channel]) / total
    odd = outliers(mean, ALPHA / len(fleet.channels))
    kept = np.setdiff1d(np.arange(len(robots)), odd)
    usual, error, spread = reml(mean[kept], 1 / total[kept])
    friction = float(np.exp(usual))
    found = TypeFriction(
        joint=joint,
        velocity=velocity,
        unit=unit,
        friction=friction,
        standard_error=friction * error,
        robot_spread=friction * spread,
        log_spread=friction * float(np.sqrt(np.median(variance[used]))),
        robots=len(robots),
        logs=int(used.sum()),
    )
    return found, [
        OddRobot(
            robot=str(robots[k]),
            joint=joint,
            velocity=velocity,
            unit=unit,
            friction=float(np.exp(mean[k])),
            usual=friction,
            spread=friction * spread,
        )
        for k in odd
    ]


def reml(mean: Array, variance: Array) -> tuple[float, float, float]:
    """Fit mean_i = mu + b_i + error_i, with known variances of the errors, by restricted maximum likelihood.

    Returns
    -------
    mu, standard_error, spread
        The standard deviation of b_i is `spread`; NaN for a single robot.
    """
    if len(mean) < 2:
        return float(mean[0]), float(np.sqrt(variance[0])), float("nan")

    def average(between: float) -> tuple[float, Array]:
        weight = 1 / (variance + between)
        return float(np.sum(weight * mean) / weight.sum()), weight

    def cost(logarithm: float) -> float:
        mu, weight = average(np.exp(logarithm))
        return float(np.sum(weight * (mean - mu) ** 2 - np.log(weight)) + np.log(weight.sum()))

    top = np.log(np.var(mean, ddof=1) + variance.max() + 1e-300) + 2
    between = float(np.exp(minimize_scalar(cost, bounds=(top - 30, top), method="bounded").x))
    mu, weight = average(between)
    return mu, float(weight.sum() ** -0.5), float(np.sqrt(between))


def outliers(values: Array, alpha: float) -> list[int]:
    """Find values that stand out, by the generalized extreme Studentized deviate test (Rosner 1983).

    At most a quarter of the values stand out; fewer than five are not tested.
    """
    left, order, count = np.arange(len(values)), list[int](), 0
    for k in range(1, len(values) // 4 + 1) if len(values) > 4 else ():
        n = len(left)
        spread = values[left].std(ddof=1)
        distance = np.abs(values[left] - values[left].mean())
        worst = int(left[distance.argmax()])
        quantile = float(student_t.ppf(1 - alpha / (2 * n), n - 2))
        limit = (n - 1) * quantile / np.sqrt((n - 2 + quantile**2) * n)
        order.append(worst)
        left = left[left != worst]
        if distance.max() > limit * spread:
            count = k
    return order[:count]


def _clearest(odd: list[OddRobot]) -> list[OddRobot]:
    """Keep the speed of each robot's joint at which it stands out most, the largest first."""
    found: dict[tuple[str, str], OddRobot] = {}
    ordered = sorted(odd, key=lambda each: -abs(np.log(each.friction / each.usual)))
    for each in ordered:
        found.setdefault((each.robot, each.joint), each)
    return list(found.values())


def _alarms(fleet: Fleet, changes: list[Change]) -> list[Alarm]:
    """Make one alarm of the changes of a joint at its speeds; the most significant speed is shown."""
    groups: dict[tuple[str, str], list[list[Change]]] = {}
    for change in sorted(changes, key=lambda each: each.first):
        own = groups.setdefault((str(fleet.robots[change.first]), fleet.channels[change.channel][0]), [])
        if own and change.first <= max(each.seen for each in own[-1]):
            own[-1].append(change)
        else:
            own.append([change])
    found = []
    for (robot, joint), joined in groups.items():
        for group in joined:
            change = max(group, key=lambda each: abs(each.after - each.before) / each.error)
            seen = min(each.seen for each in group)
            _, velocity, unit = fleet.channels[change.channel]
            found.append(
                Alarm(
                    robot=robot,
                    joint=joint,
                    velocity=velocity,
                    unit=unit,
                    start=fleet.start[change.first].astype(datetime),
                    log=str(fleet.log[change.first]),
                    seen=str(fleet.log[seen]),
                    before=float(np.exp(change.before)),
                    after=float(np.exp(change.after)),
                    standard_error=float(np.exp(change.after)) * change.error,
                )
            )
    return sorted(found, key=lambda each: -abs(np.log(each.after / each.before)))

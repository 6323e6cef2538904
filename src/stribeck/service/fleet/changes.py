"""Changes of friction from log to log: self-starting CUSUM charts of all robots and joints at once.

Each log is compared with the mean of the robot's logs before it. With known variances, the differences divided by
their standard deviations, z, are independent and normal as long as nothing changes (recursive residuals; Brown, Durbin
and Evans 1975). The chart sums z - k in each direction, and alarms above h (Page 1954). h follows from the mean number
of logs between false alarms, by Siegmund's approximation (1985). If the variances are estimated, z has Student's
distribution; Wallace's approximation (1959) makes it normal, so that short stores raise no false alarms.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from stribeck.core.base.typing import Array, IntArray

SLACK, CLIP = 1.0, 4.0
"""Slack k of the charts, and largest z that counts [standard deviations].

Changes of twice the slack are found soonest. A single odd log is no change.
"""


@dataclass(frozen=True, kw_only=True)
class Change:
    """Change of a channel: `first` log with it, log in which it was `seen`, `stop` of the robot's logs (indices).

    `before` and `after` are means of the logs since the change before, and until the next one; `error` is the standard
    error of their difference.
    """

    channel: int
    first: int
    seen: int
    stop: int
    before: float
    after: float
    error: float


def threshold(logs_per_false_alarm: float, charts: int) -> float:
    """Compute h for a mean number of logs between false alarms in so many two-sided charts.

    One side alarms after (exp(2 k b) - 2 k b - 1) / (2 k^2) logs on average, with b = h + 1.166.
    """
    wanted = 2 * charts * logs_per_false_alarm
    k = SLACK
    return float(brentq(lambda b: (np.exp(2 * k * b) - 2 * k * b - 1) / (2 * k**2) - wanted, 0.0, 50.0)) - 1.166


def visible_change(logs_per_false_alarm: float, charts: int, freedom: Array) -> Array:
    """Compute the smallest change that is seen within three logs [standard deviations], given their freedom."""
    z = SLACK + threshold(logs_per_false_alarm, charts) / 3
    return np.asarray(np.sqrt(freedom * np.expm1((z * (8 * freedom + 3) / (8 * freedom + 1)) ** 2 / freedom)))


def find_changes(
    robots: NDArray[np.str_],
    values: Array,
    variance: Array,
    logs_per_false_alarm: float,
    freedom: Array | float = 1e9,
) -> list[Change]:
    """Find changes in N logs, sorted by robot and time, in C channels.

    Parameters
    ----------
    robots
        Robot of each log, shape (N,).
    values, variance
        Friction, and its variance from log to log, shape (N, C); NaN where a log has none.
    logs_per_false_alarm
        Mean number of logs between false alarms, over all channels.
    freedom
        Degrees of freedom of the variance, shape (C,); large if it is known.
    """
    starts = np.flatnonzero(np.r_[True, robots[1:] != robots[:-1]])
    stops = np.r_[starts[1:], len(robots)]
    limit = threshold(logs_per_false_alarm, values.shape[1])
    alarms = list[tuple[int, int, int, int]]()  # robot, channel, first, seen
    longest = np.argsort(starts - stops, kind="stable")  # robots with a log at a step are the first of these
    starts, stops = starts[longest], stops[longest]
    shape = (len(starts), values.shape[1])
    weight, mean = np.zeros(shape), np.zeros(shape)
    signs = np.array([1.0, -1.0])[:, None, None]  # the two directions of each chart
    sums, first = np.zeros((2, *shape)), np.zeros((2, *shape), dtype=np.int64)  # first log since the sum was zero
    for step in range(int((stops - starts).max())):
        count = int(np.sum(stops - starts > step))
        rows = slice(0, count)
        place = starts[rows] + step
        value, precision = values[place], 1 / variance[place]
        known = np.isfinite(value) & np.isfinite(precision)
        value, precision = np.where(known, value, 0.0), np.where(known, precision, 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            deviation = np.sqrt(1 / precision + 1 / weight[rows])
            z = (value - mean[rows]) / deviation
        compared = known & (weight[rows] > 0)
        z = np.sign(z) * (8 * freedom + 1) / (8 * freedom + 3) * np.sqrt(freedom * np.log1p(z**2 / freedom))
        z = np.where(compared, np.clip(z, -CLIP, CLIP), 0.0)
        clipped = np.where(compared, mean[rows] + z * np.where(compared, deviation, 0.0), value)
        mean[rows] = (weight[rows] * mean[rows] + precision * clipped) / np.maximum(weight[rows] + precision, 1e-300)
        weight[rows] += precision
        first[:, rows][(sums[:, rows] == 0) & known] = step
        sums[:, rows] = np.where(known, np.maximum(sums[:, rows] + signs * z - SLACK, 0.0), sums[:, rows])
        side, robot, channel = np.nonzero(sums[:, rows] > limit)
        alarms += zip(robot, channel, starts[robot] + first[side, robot, channel], place[robot], strict=True)
        weight[robot, channel] = sums[:, robot, channel] = 0.0  # these charts start anew
    return _measured(alarms, starts, stops, values, variance)


def _measured(
    alarms: list[tuple[int, int, int, int]], starts: IntArray, stops: IntArray, values: Array, variance: Array
) -> list[Change]:
    """Compute the means before and after each change."""
    changes = list[Change]()
    charts: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for robot, channel, first, seen in alarms:
        charts.setdefault((int(robot), int(channel)), []).append((int(first), int(seen)))
    for (robot, channel), chart in charts.items():
        mean = partial(_mean, values[:, channel], variance[:, channel])
        begin, stop = int(starts[robot]), int(stops[robot])
        for k, (first, seen) in enumerate(chart):
            end = chart[k + 1][0] if k + 1 < len(chart) else stop
            pairs = {split: (mean(begin, split), mean(split, end)) for split in range(first, seen + 1)}
            split = max(pairs, key=lambda split: _distance(*pairs[split]))
            (before, _), (after, _) = pairs[split]
            error = float(np.hypot(pairs[split][0][1], pairs[split][1][1]))
            change = Change(channel=channel, first=split, seen=seen, stop=stop, before=before, after=after, error=error)
            changes.append(change)
            begin = split
    return changes


def _distance(before: tuple[float, float], after: tuple[float, float]) -> float:
    """Compare two means, given with their standard errors [standard errors]; 0 if one is unknown."""
    return float(np.nan_to_num(abs(before[0] - after[0]) / np.hypot(before[1], after[1])))


def _mean(values: Array, variance: Array, begin: int, end: int) -> tuple[float, float]:
    """Compute the weighted mean of some logs and its standard error; NaN without a log."""
    known = np.isfinite(values[begin:end])
    weight = 1 / variance[begin:end][known]
    if not len(weight):
        return float("nan"), float("nan")
    return float(np.sum(weight * values[begin:end][known]) / weight.sum()), float(weight.sum() ** -0.5)

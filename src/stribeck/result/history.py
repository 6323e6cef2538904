"""How friction changed over any number of results of a robot, in the order in which they are given."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path, PurePath
from typing import Any

import numpy as np
from scipy.stats import norm, t

from stribeck.errors import SettingsError
from stribeck.result import JointResult, ParameterEstimate, Result, read_result
from stribeck.result.compare import DIRECTED, Difference, difference_of, holm, p_value, require_one_law
from stribeck.result.mirror import mirrored_pairs
from stribeck.typing import Array

FEWEST = 3
"""Values that a trend needs."""


@dataclass(frozen=True, kw_only=True)
class Trend:
    """One parameter of one joint in all results.

    `values` and `intervals_95` are None where a result has no such parameter; `changes` are the differences from the
    first value there is, None of itself. `slope` is the change from one result to the next, by weighted least squares;
    its interval is widened where the values scatter more than their standard errors say (Birge 1932). None with fewer
    than three values. Those of `changes`, and the slope (`drifts`), are significant by Holm's method over all tests of
    the history: where nothing has changed, one history in twenty has any that is.
    """

    joint: str
    parameter: str
    unit: str
    values: list[float | None]
    intervals_95: list[tuple[float, float] | None]
    changes: list[Difference | None]
    slope: float | None = None
    slope_interval_95: tuple[float, float] | None = None
    drifts: bool = False

    @property
    def first(self) -> float:
        """The first value."""
        return next(value for value in self.values if value is not None)

    @property
    def last_change(self) -> Difference:
        """From the first to the last value."""
        return next(change for change in reversed(self.changes) if change is not None)


@dataclass(frozen=True, kw_only=True)
class History:
    """All trends, and the joints that some results say nothing about, with the reason.

    `joints` are what they are of: by name, a joint's result in each of the results, or None.
    """

    robot: str
    law: str
    names: list[str]
    rows: list[Trend]
    missing: dict[str, str]
    tests: int
    joints: Mapping[str, Sequence[JointResult | None]] = field(repr=False, compare=False)

    def to_json(self) -> str:
        """Return the history as the text of a JSON document."""
        document = asdict(replace(self, joints={}))
        del document["joints"]
        return json.dumps(document, indent=2, allow_nan=False) + "\n"


def history(results: Sequence[Result | str | Path], names: Sequence[str] | None = None) -> History:
    """Return how every parameter changed over two results or more, the oldest first.

    Parameters
    ----------
    results
        Results, or the paths of their result.json, in the order of time.
    names
        What to call them; by their logs if None.

    Returns
    -------
    history
        A row for each parameter of each joint that two results or more have.

    Raises
    ------
    SettingsError
        If the laws differ, there are fewer than two results, no joint is in two of them, or names are not as many and
        distinct.

    Examples
    --------
    >>> found = history(["out/result.json", result, result], names=["May", "June", "July"])
    >>> found.rows[0].joint, found.rows[0].parameter, found.rows[0].drifts
    ('shoulder', 'viscous', False)
    """
    read = [one if isinstance(one, Result) else read_result(one) for one in results]
    if len(read) < 2:
        raise SettingsError(f"compare: {len(read)} result is given; expected two or more")
    require_one_law(read)
    every = dict.fromkeys(joint for result in read for joint in result.joints)
    joints = {joint: [result.joints.get(joint) for result in read] for joint in every}
    if not any(sum(each is not None for each in own) > 1 for own in joints.values()):
        raise SettingsError("compare: no joint is in two of the results; expected logs of one robot")
    labels = distinct_names(read) if names is None else list(names)
    if len(labels) != len(read) or len(set(labels)) != len(labels):
        raise SettingsError(f"--names: found {', '.join(labels)}; expected {len(read)} names, each once")
    return _history(read[-1], labels, joints)


def history_of_sides(result: Result) -> History:
    """Return a history whose two results are the left and the right joints of one; offsets are left out.

    Raises
    ------
    SettingsError
        If no joint has a partner on the other side.
    """
    pairs = mirrored_pairs(result.joints)
    if not pairs:
        raise SettingsError("compare: no joint has a partner on the other side, expected names with left and right")
    joints = {f"{left} | {right}": [result.joints[left], result.joints[right]] for left, right in pairs}
    return _history(result, ["left", "right"], joints, DIRECTED)


def distinct_names(results: Sequence[Result]) -> list[str]:
    """Return what results are called: the names of their logs, with their folders or numbers where they need them."""
    paths = [[path] if isinstance(path := result.log.path, str) else path for result in results]
    for words in (lambda path: PurePath(path).name, str):
        labels = [", ".join(words(path) for path in own) or "log" for own in paths]
        if len(set(labels)) == len(labels):
            return labels
    return [f"{label} ({k})" for k, label in enumerate(labels, start=1)]


def _history(
    result: Result,
    names: list[str],
    joints: Mapping[str, Sequence[JointResult | None]],
    left_out: frozenset[str] = frozenset(),
) -> History:
    """Return the trends of joints, their changes tested together."""
    rows: list[Trend] = []
    slopes: list[float] = []  # p-values
    for joint, own in joints.items():
        for name in dict.fromkeys(name for each in own if each for name in each.parameters):
            there = {k: each.parameters[name] for k, each in enumerate(own) if each and name in each.parameters}
            if len(there) > 1 and name not in left_out:
                trend, slope = _trend(joint, name, there, len(own))
                rows.append(trend)
                slopes.append(slope)
    tests = [p_value(change) for row in rows for change in row.changes if change]
    tests += [p for row, p in zip(rows, slopes, strict=True) if row.slope is not None]
    significant = iter(holm(tests))
    rows = [
        replace(row, changes=[change and replace(change, significant=next(significant)) for change in row.changes])
        for row in rows
    ]
    rows = [replace(row, drifts=row.slope is not None and next(significant)) for row in rows]
    missing = {joint: reason for joint, own in joints.items() if (reason := _missing(names, own))}
    return History(
        robot=result.robot, law=result.law, names=names, rows=rows, missing=missing, tests=len(tests), joints=joints
    )


def _missing(names: Sequence[str], own: Sequence[JointResult | None]) -> str:
    """Return which results have no friction of a joint, and why."""
    reasons = []
    for name, each in zip(names, own, strict=True):
        if each is None:
            reasons.append(f"not in {name}")
        elif each.verdict in ("no friction", "not excited"):
            reasons.append(f"{each.verdict} in {name} ({each.reason})")
    return "; ".join(reasons)


def _trend(joint: str, parameter: str, there: Mapping[int, ParameterEstimate], results: int) -> tuple[Trend, float]:
    """Return the trend of a parameter by result, nothing of it tested yet, and the p-value of its slope."""
    first = min(there)
    changes = {k: difference_of(joint, parameter, there[first], each) for k, each in there.items() if k > first}
    trend = Trend(
        joint=joint,
        parameter=parameter,
        unit=there[first].unit,
        values=[there[k].value if k in there else None for k in range(results)],
        intervals_95=[there[k].interval_95 if k in there else None for k in range(results)],
        changes=[changes.get(k) for k in range(results)],
    )
    errors = np.array([each.standard_error for each in there.values()])
    if len(there) < FEWEST or not errors.all():
        return trend, 1.0
    values = np.array([each.value for each in there.values()])
    slope, error, distribution = _slope(np.array([*there], dtype=float), values, errors)
    half = float(distribution.ppf(0.975)) * error
    p = 2 * float(distribution.sf(abs(slope) / error))
    return replace(trend, slope=slope, slope_interval_95=(slope - half, slope + half)), p


def _slope(order: Array, values: Array, errors: Array) -> tuple[float, float, Any]:
    """Return the slope of the weighted line, its standard error and the distribution of its error.

    That is Student's where the error is from the scatter about the line, which then is more than the errors say.
    """
    weights = 1 / errors**2
    centre, mean = np.average(order, weights=weights), np.average(values, weights=weights)
    information = float(weights @ (order - centre) ** 2)
    slope = float(weights @ ((order - centre) * (values - mean))) / information
    freedom = len(order) - 2
    scatter = math.sqrt(float(weights @ (values - mean - slope * (order - centre)) ** 2) / freedom)
    return slope, max(scatter, 1.0) / math.sqrt(information), t(freedom) if scatter > 1 else norm

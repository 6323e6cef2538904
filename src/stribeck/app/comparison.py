"""Comparison of two results of a robot, or of the left and right joints of one result."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path, PurePath

import numpy as np

from stribeck.core.base.text_table import TextTable, number, span
from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError
from stribeck.core.friction import AUTO, LAWS, LAWS_WITH_STATE, get_law
from stribeck.core.result import JointResult, ParameterEstimate, Result, read_result
from stribeck.core.result.law_values import law_values
from stribeck.core.result.log_spread import LogSpread, learn_spread, smallest_text
from stribeck.core.result.mirror import mirrored_pairs

Joints = Mapping[str, tuple[JointResult, JointResult]]
"""Results of each joint in a and in b."""

FALSE_ALARMS = 0.05
"""Probability of any false "significant" in a comparison without changes [1]."""


@dataclass(frozen=True, kw_only=True)
class Difference:
    """Friction at one speed, or one parameter, of one joint or of two mirrored joints, in both results.

    `parameter` is "friction_slow", "friction_middle" or "friction_top", at `velocity`, or the name of a parameter.
    `difference` is b - a with its 95 % interval; without a change, it includes the spread between logs. `agrees` tests
    whether the interval contains zero, which fails for 5 % of unchanged values; `significant` accounts for the number
    of joints (`holm`), and excludes weak values. `percent` is the difference relative to |a|, None if a is close to
    zero, and `smallest` the smallest significant change [%]. Joints that only one side identified are listed in
    `Comparison.missing`.
    """

    joint: str
    parameter: str
    unit: str
    a: float
    b: float
    difference: float
    interval_95: tuple[float, float]
    p_value: float
    smallest: float | None
    agrees: bool
    weak: bool
    percent: float | None
    velocity: float | None = None
    significant: bool = False

    @property
    def name(self) -> str:
        """The quantity in words, e.g. "friction at 0.52 rad/s" or "rotor inertia"."""
        if self.velocity is None:
            return "rotor inertia" if self.parameter == "armature" else self.parameter
        return f"friction at {self.velocity:.2g} {'m/s' if self.unit == 'N' else 'rad/s'}"

    @property
    def change(self) -> str:
        """The difference in percent as text; "" if a is close to zero."""
        return "" if self.percent is None else f"{self.percent:+.{0 if abs(self.percent) > 10 else 1}f} %"


@dataclass(frozen=True, kw_only=True, repr=False)
class Comparison:
    """All differences, the labels of a and b, and the joints that cannot be compared, with reasons.

    `joints` contains the results in a and in b of each joint that both have. JSON has `conclusion`, `a`, `b`, `rows`,
    `missing`.
    """

    a: str
    b: str
    rows: list[Difference]
    missing: dict[str, str]
    robot: str = field(default="", compare=False)
    law: str = field(default="", compare=False)
    joints: Joints = field(default_factory=dict, repr=False, compare=False)

    def __repr__(self) -> str:
        significant = sum(row.significant for row in self.rows)
        return f"Comparison({self.a!r} and {self.b!r}: {significant} of {len(self.rows)} differences significant)"

    @property
    def conclusion(self) -> str:
        """State which joints differ significantly, with the clearest parameter of each, or that none does."""
        joints, clearest = {row.joint for row in self.rows}, dict[str, Difference]()
        for row in sorted(self.rows, key=lambda row: (row.velocity is None, row.p_value)):
            if row.significant:
                clearest.setdefault(row.joint, row)
        of = f"{len(joints)} joint{'s' * (len(joints) != 1)}" + " of each side" * (self.a == "left")
        if not clearest:
            return f"No significant difference between {self.a} and {self.b} in {of}.{self.visible}"
        said = [f"{joint} ({row.name} {row.change or 'from near zero'})" for joint, row in clearest.items()]
        more = f" and {len(said) - 5} more" if len(said) > 5 else ""
        changed = f"{len(said)} of {of}: {', '.join(said[:5])}{more}."
        return f"{self.b} differs significantly from {self.a} in {changed}{self.visible}"

    @property
    def visible(self) -> str:
        """Sentence on the smallest change of friction that would be significant; "" if none is known."""
        least: dict[str, float] = {}
        for row in [row for row in self.rows if row.velocity is not None] or self.rows:
            if row.smallest is not None and not row.weak:
                least[row.joint] = min(row.smallest, least.get(row.joint, row.smallest))
        return f" The smallest significant change is {smallest_text(least)}." if least else ""

    def table(self) -> TextTable:
        """Build a table with one row per difference, and a sentence per joint that cannot be compared."""
        rows = [
            [
                row.joint,
                f"{row.name} [{row.unit}]",
                *(number(value) for value in (row.a, row.b, row.difference)),
                span(row.interval_95),
                row.change,
                ("yes" if row.agrees else "no") + ", significant" * row.significant + " (weak)" * row.weak,
            ]
            for row in self.rows
        ]
        return TextTable(
            title=f"{self.a} and {self.b}",
            left=["joint", "parameter"],
            right=["first", "second", "difference", "95 % interval", "change"],
            last=["agrees"],
            rows=rows,
            notes=[f"{joint}: {reason}" for joint, reason in self.missing.items()],
        )

    def _repr_html_(self) -> str:
        """Format the table for notebooks."""
        return self.table().html()

    def to_json(self) -> str:
        """Return the comparison as the text of a JSON document."""
        rows = [asdict(row) for row in self.rows]
        document = {"conclusion": self.conclusion, "a": self.a, "b": self.b, "rows": rows, "missing": self.missing}
        return json.dumps(document, indent=2, allow_nan=False) + "\n"


def compare(a: Result | str | Path, b: Result | str | Path, names: tuple[str, str] | None = None) -> Comparison:
    """Compare two results of a robot, joint by joint.

    Parameters
    ----------
    a, b
        Results, or the paths of their result.json.
    names
        Labels of the results; the names of their logs if None, or the paths if the names are equal.

    Returns
    -------
    comparison
        Rows of friction at three speeds that both results contain, Coulomb and viscous friction and rotor inertia of
        each joint: b - a, in its unit, with the 95 % interval.

    Raises
    ------
    SettingsError
        If the laws differ, no joint is in both, or a file is not a result.

    Examples
    --------
    >>> row = compare("out/result.json", result).rows[0]
    >>> row.joint, row.parameter, row.difference, row.agrees
    ('shoulder', 'friction_slow', 0.0, True)
    """
    a, b = (result if isinstance(result, Result) else read_result(result) for result in (a, b))
    if a.law != b.law:
        raise SettingsError(f"compare: the results have the laws '{a.law}' and '{b.law}', expected one and the same")
    joints = {name: (joint, b.joints[name]) for name, joint in a.joints.items() if name in b.joints}
    if not joints:
        raise SettingsError(
            f"compare: no joint is in both results, the first has {_listed(a)}, the second {_listed(b)}, "
            "expected logs of one robot"
        )
    missing = {joint: "only in the first result" for joint in a.joints if joint not in b.joints}
    missing |= {joint: "only in the second result" for joint in b.joints if joint not in a.joints}
    for which, place in (("second", 1), ("first", 0)):
        missing |= {joint: reason for joint, pair in joints.items() if (reason := _unknown(pair[place], which))}
    first, second = (", ".join(PurePath(path).name for path in result.log.paths) for result in (a, b))
    labels = names or ((first, second) if first != second else (", ".join(a.log.paths), ", ".join(b.log.paths)))
    logs = 0.0 if a.log.paths == b.log.paths else 1 / len(a.log.paths) + 1 / len(b.log.paths)
    return _comparison(a, joints, missing, labels, logs)


def compare_sides(result: Result) -> Comparison:
    """Compare the left (a) with the right (b) joints of one result.

    Direction-dependent parameters are omitted, because mirrored axes can point either way.

    Raises
    ------
    SettingsError
        If no joint has a partner on the other side.
    """
    pairs = mirrored_pairs(result.joints)
    if not pairs:
        raise SettingsError(f"compare: no joint of {_listed(result)} has a partner, expected names with left and right")
    missing = {name: text for pair in pairs for name in pair if (text := _unknown(result.joints[name], "result"))}
    joints = {f"{left} | {right}": (result.joints[left], result.joints[right]) for left, right in pairs}
    return _comparison(result, joints, missing, ("left", "right"), logs=0.0)


def _comparison(
    result: Result, joints: Joints, missing: dict[str, str], names: tuple[str, str], logs: float
) -> Comparison:
    """Compare pairs of joints; all differences are tested together.

    Each difference contains the spread between logs `logs` times (`LogSpread.total`), learned from the other joints.
    """
    for joint, (first, second) in list(joints.items()):
        if first.torque_unit != second.torque_unit:
            units = " and ".join(side.units()[1] for side in (first, second))
            missing[joint] = f"friction in {units}; set the missing torque constant or kp"
    joints = {joint: pair for joint, pair in joints.items() if pair[0].torque_unit == pair[1].torque_unit}
    pairs = [pair for name, fits in joints.items() for pair in _pairs(name, *fits, sides=names == ("left", "right"))]
    tested = {pair.joint for pair in pairs if not pair.is_weak}
    spreads = _spreads(pairs, logs)
    rows = [difference_of(pair, *spreads[k], logs, len(tested)) for k, pair in enumerate(pairs)]
    p_values = {joint: [row.p_value for row in rows if row.joint == joint and not row.weak] for joint in tested}
    levels = holm({joint: simes(values) for joint, values in p_values.items()})
    rows = [replace(row, significant=not row.weak and row.p_value <= levels.get(row.joint, 0.0)) for row in rows]
    a, b = names
    return Comparison(a=a, b=b, rows=rows, missing=missing, robot=result.robot, law=result.law, joints=joints)


@dataclass(frozen=True)
class Pair:
    """A quantity of a joint in both results: friction at a speed, or a parameter."""

    joint: str
    parameter: str
    velocity: float | None
    a: ParameterEstimate
    b: ParameterEstimate

    @property
    def is_weak(self) -> bool:
        """Whether one of the logs does not support the value."""
        return "weak" in (self.a.verdict, self.b.verdict)

    @property
    def level(self) -> float:
        """Mean of both sizes."""
        return (abs(self.a.value) + abs(self.b.value)) / 2


def _pairs(joint: str, a: JointResult, b: JointResult, *, sides: bool) -> list[Pair]:
    """Collect friction at three speeds that both curves contain, Coulomb and viscous friction, and rotor inertia."""
    pairs = list[Pair]()
    if a.curve and b.curve and {a.verdict, b.verdict} <= {"identified", "weak"}:
        middle = (a.curve[len(a.curve) // 2].velocity + b.curve[len(b.curve) // 2].velocity) / 2
        low, high = (choose(a.curve[k].velocity, b.curve[k].velocity) for k, choose in ((0, max), (-1, min)))
        if low <= high:
            speeds = np.clip([low, middle, high], low, high)
            load = ((a.mean_load or 0.0) + (b.mean_load or 0.0)) / 2
            names = ("friction_slow", "friction_middle", "friction_top")
            curves = _curve_at(a, speeds, load), _curve_at(b, speeds, load)
            pairs += [Pair(joint, *fields) for fields in zip(names, speeds.tolist(), *curves, strict=True)]
    ways = ("",) if sides else ("", "_positive", "_negative")
    for name in (name + way for name in ("coulomb", "viscous", "armature") for way in ways):
        if name in a.parameters and name in b.parameters:
            pairs.append(Pair(joint, name, None, a.parameters[name], b.parameters[name]))
    return pairs


def _curve_at(joint: JointResult, speeds: Array, load: float) -> list[ParameterEstimate]:
    """Evaluate a joint's friction curve at speeds within it, under a load [N m]; its relative error is interpolated."""
    known = np.array([(point.velocity, point.value, point.half_width) for point in joint.curve])
    before, error = (np.interp(speeds, known[:, 0], known[:, k]) for k in (1, 2))
    law = get_law(joint.law) if joint.law in (*LAWS, *LAWS_WITH_STATE, AUTO) else None
    values = law_values(law, joint.values, load) if law else None
    friction = before if law is None or values is None else law.resisting(speeds, values)
    halves = error * (np.abs(friction) / np.maximum(np.abs(before), 1e-9 * np.abs(friction) + np.finfo(float).tiny))
    verdict, unit = joint.verdict, joint.curve[0].unit
    ends = np.stack([np.maximum(friction - halves, 0.0), friction + halves], axis=1).tolist()
    return [
        ParameterEstimate(value=r, standard_error=half / 1.96, interval_95=tuple(end), unit=unit, verdict=verdict)
        for r, half, end in zip(friction.tolist(), halves.tolist(), ends, strict=True)
    ]


def _spreads(pairs: Sequence[Pair], logs: float) -> dict[int, tuple[LogSpread, int]]:
    """Learn each pair's spread between logs from the same quantity of the other joints, with its channel, by index."""
    spreads: dict[int, tuple[LogSpread, int]] = {}
    kinds = [pair.parameter.partition("_")[0] for pair in pairs]
    for kind in set(kinds):
        places = [k for k, label in enumerate(kinds) if label == kind]
        group = [pairs[k] for k in places]
        level = np.array([pair.level if pair.a.value * pair.b.value else np.nan for pair in group])
        with np.errstate(over="ignore", invalid="ignore"):
            difference = np.array([pair.b.value - pair.a.value for pair in group]) / level
            error = np.hypot(*np.array([(pair.a.half_width, pair.b.half_width) for pair in group]).T) / 1.96 / level
        joint = np.unique([pair.joint for pair in group], return_inverse=True)[1]
        learned = learn_spread(difference[None], error[None], joint, logs, others=True)
        spreads |= {k: (learned, channel) for channel, k in enumerate(places)}
    return spreads


def holm(p_values: Mapping[str, float]) -> dict[str, float]:
    """Select the joints that changed by Holm's step-down method (Holm 1979), each with its level of significance.

    The i-th smallest of m p-values is compared with `FALSE_ALARMS / (m - i)`, i from 0, up to the first that is larger.
    The probability of any false positive is at most `FALSE_ALARMS`, whatever the dependence between the tests.
    """
    levels: dict[str, float] = {}
    for i, joint in enumerate(sorted(p_values, key=lambda joint: p_values[joint])):
        level = FALSE_ALARMS / (len(p_values) - i)
        if p_values[joint] > level:
            break
        levels[joint] = level
    return levels


def simes(p_values: Sequence[float]) -> float:
    """Combine p-values of tests with positive dependence, such as speeds of one curve (Simes 1986)."""
    return min(len(p_values) * p / (k + 1) for k, p in enumerate(sorted(p_values)))


def difference_of(pair: Pair, spread: LogSpread, channel: int, logs: float, joints: int) -> Difference:
    """Compare two independent estimates, which also differ by the spread between logs; one of so many joints.

    The interval of the difference combines the facing half-widths of both intervals (Zou and Donner 2008), which also
    suits asymmetric intervals.
    """
    a, b = pair.a, pair.b
    difference = b.value - a.value
    below = math.hypot(b.value - b.interval_95[0], a.interval_95[1] - a.value)
    above = math.hypot(b.interval_95[1] - b.value, a.value - a.interval_95[0])
    if not math.isfinite(difference + below + above):
        raise SettingsError(
            f"compare: {pair.parameter} of {pair.joint} is {a.value:g} and {b.value:g}; expected a finite difference"
        )
    level = max(pair.level, 1e-9 * below, 1e-9 * above, float(np.finfo(float).tiny))
    errors = (half / 1.96 / level for half in (below, above))  # [1]
    low, high = (level * spread.quantile(channel, 0.05, error, logs) for error in errors)
    error = (below if difference > 0 else above) / 1.96 / level  # toward zero
    smallest = level * spread.quantile(channel, FALSE_ALARMS / max(joints, 1), error, logs)
    return Difference(
        joint=pair.joint,
        parameter=pair.parameter,
        unit=a.unit,
        a=a.value,
        b=b.value,
        difference=difference,
        interval_95=(difference - low, difference + high),
        p_value=spread.tail(channel, difference / level, error, logs),
        smallest=_percent(smallest, a.value),
        agrees=difference - low <= 0 <= difference + high,
        weak=pair.is_weak,
        percent=_percent(difference, a.value),
        velocity=pair.velocity,
    )


def _percent(difference: float, of: float) -> float | None:
    """Compute a difference relative to a value [%]; None above 1000 %, where the value is close to zero."""
    return 100 * difference / abs(of) if of != 0 and abs(difference) <= 10 * abs(of) else None


def _unknown(joint: JointResult, which: str) -> str:
    """Explain why a joint of a result has no friction; "" if it has."""
    without = joint.verdict in ("no friction", "not excited")
    return f"{joint.verdict} in the {which} ({joint.reason})" if without else ""


def _listed(result: Result) -> str:
    return ", ".join(f"'{joint}'" for joint in list(result.joints)[:5]) or "no joint"

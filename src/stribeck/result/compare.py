"""Comparison of two results of a robot, or of the left and right joints of one result."""

import json
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path, PurePath

from scipy.special import ndtr, ndtri  # of scipy.stats, which is slow to import

from stribeck.base.text_table import TextTable, number, span
from stribeck.errors import SettingsError
from stribeck.result import JointResult, ParameterEstimate, Result, read_result
from stribeck.result.mirror import mirrored_pairs

FALSE_ALARMS = 0.05
"""Probability of any false "significant" in a comparison without changes [1]."""


@dataclass(frozen=True, kw_only=True)
class Difference:
    """One parameter of one joint, or of two mirrored joints, in both results.

    `difference` is b - a with its 95 % interval; `z_score` is the difference in standard errors, None if they are
    close to zero. `agrees` tests whether the interval contains zero, which fails for 5 % of unchanged parameters;
    `significant` accounts for the number of tests (`holm`). `percent` is the difference relative to |a|, None if a is
    close to zero. Joints that only one side identified are listed in `Comparison.missing`.
    """

    joint: str
    parameter: str
    unit: str
    a: float
    b: float
    difference: float
    interval_95: tuple[float, float]
    z_score: float | None
    agrees: bool
    weak: bool
    percent: float | None
    significant: bool = False

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
    joints: Mapping[str, tuple[JointResult, JointResult]] = field(default_factory=dict, repr=False, compare=False)

    def __repr__(self) -> str:
        significant = sum(row.significant for row in self.rows)
        return f"Comparison({self.a!r} and {self.b!r}: {significant} of {len(self.rows)} differences significant)"

    @property
    def conclusion(self) -> str:
        """State which joints differ significantly, with the clearest parameter of each, or that none does."""
        joints, clearest = {row.joint for row in self.rows}, dict[str, Difference]()
        for row in sorted(self.rows, key=lambda row: (row.parameter not in ("coulomb", "viscous"), p_value(row))):
            if row.significant:
                clearest.setdefault(row.joint, row)
        of = f"{len(joints)} joint{'s' * (len(joints) != 1)}" + " of each side" * (self.a == "left")
        if not clearest:
            return f"No significant difference between {self.a} and {self.b} in {of}."
        said = [f"{joint} ({row.parameter} {row.change or 'from near zero'})" for joint, row in clearest.items()]
        more = f" and {len(said) - 5} more" if len(said) > 5 else ""
        return f"{self.b} differs significantly from {self.a} in {len(said)} of {of}: {', '.join(said[:5])}{more}."

    def table(self) -> TextTable:
        """Build a table with one row per parameter, and a sentence per joint that cannot be compared."""
        rows = [
            [
                row.joint,
                f"{row.parameter} [{row.unit}]",
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
        One row per parameter of both results: b - a, in its unit, with the 95 % interval.

    Raises
    ------
    SettingsError
        If the laws differ, no joint is in both, or a file is not a result.

    Examples
    --------
    >>> row = compare("out/result.json", result).rows[0]
    >>> row.joint, row.parameter, row.difference, row.agrees
    ('shoulder', 'viscous', 0.0, True)
    """
    a, b = (one if isinstance(one, Result) else read_result(one) for one in (a, b))
    if a.law != b.law:
        raise SettingsError(f"compare: the results have the laws '{a.law}' and '{b.law}', expected one and the same")
    joints = {joint: (found, b.joints[joint]) for joint, found in a.joints.items() if joint in b.joints}
    if not joints:
        raise SettingsError(
            f"compare: no joint is in both results, the first has {_listed(a)}, the second {_listed(b)}, "
            "expected logs of one robot"
        )
    missing = {joint: "only in the first result" for joint in a.joints if joint not in b.joints}
    missing |= {joint: "only in the second result" for joint in b.joints if joint not in a.joints}
    for which, place in (("second", 1), ("first", 0)):
        missing |= {joint: reason for joint, pair in joints.items() if (reason := _unknown(pair[place], which))}
    first, second = (", ".join(PurePath(path).name for path in one.log.paths) for one in (a, b))
    labels = names or ((first, second) if first != second else (", ".join(a.log.paths), ", ".join(b.log.paths)))
    return _comparison(a, joints, missing, labels, other_log=a.log.paths != b.log.paths)


def compare_sides(result: Result) -> Comparison:
    """Compare the left (a) with the right (b) joints of one result.

    Offsets and other direction-dependent parameters are omitted, because mirrored axes can point either way.

    Raises
    ------
    SettingsError
        If no joint has a partner on the other side.
    """
    pairs = mirrored_pairs(result.joints)
    if not pairs:
        raise SettingsError(f"compare: no joint of {_listed(result)} has a partner, expected names with left and right")
    sides = [name for pair in pairs for name in pair]
    missing = {name: reason for name in sides if (reason := _unknown(result.joints[name], "result"))}
    joints = {f"{left} | {right}": (result.joints[left], result.joints[right]) for left, right in pairs}
    directed = {"offset", "coulomb_positive", "coulomb_negative", "viscous_positive", "viscous_negative"}
    return _comparison(result, joints, missing, ("left", "right"), directed)


def _comparison(
    result: Result,
    joints: Mapping[str, tuple[JointResult, JointResult]],
    missing: dict[str, str],
    names: tuple[str, str],
    left_out: Collection[str] = (),
    other_log: bool = False,
) -> Comparison:
    """Compare pairs of joints; all differences are tested together. Friction varies from one log to another."""
    for joint, (first, second) in list(joints.items()):
        if first.torque_unit != second.torque_unit:
            units = " and ".join(one.units()[1] for one in (first, second))
            missing[joint] = f"friction in {units}; set the missing torque constant or kp"
    joints = {joint: pair for joint, pair in joints.items() if pair[0].torque_unit == pair[1].torque_unit}
    rows = [
        difference_of(joint, name, a.parameters[name], b.parameters[name], other_log * a.between_logs(name))
        for joint, (a, b) in joints.items()
        for name in a.parameters
        if name in b.parameters and name not in left_out
    ]
    significant = holm([p_value(row) for row in rows])
    rows = [replace(row, significant=one) for row, one in zip(rows, significant, strict=True)]
    a, b = names
    return Comparison(a=a, b=b, rows=rows, missing=missing, robot=result.robot, law=result.law, joints=joints)


def holm(p_values: Sequence[float]) -> list[bool]:
    """Select the significant tests by Holm's step-down method (Holm 1979).

    The i-th smallest of m p-values is compared with `FALSE_ALARMS / (m - i)`, i from 0, up to the first that is larger.
    The probability of any false positive is at most `FALSE_ALARMS`, whatever the dependence between the tests.
    """
    order = sorted(range(len(p_values)), key=lambda k: p_values[k])
    significant = [False] * len(p_values)
    for i, k in enumerate(order):
        if p_values[k] > FALSE_ALARMS / (len(order) - i):
            break
        significant[k] = True
    return significant


def p_value(difference: Difference) -> float:
    """Compute the p-value of a difference from the end of its interval that faces zero."""
    low, high = difference.interval_95
    half = difference.difference - low if difference.difference > 0 else high - difference.difference
    if not half:
        return float(difference.difference == 0)
    return 2 * float(ndtr(-ndtri(0.975) * abs(difference.difference) / half))


def difference_of(
    label: str, name: str, a: ParameterEstimate, b: ParameterEstimate, between_logs: float = 0.0
) -> Difference:
    """Compare two independent estimates.

    Without a change, they differ by a share with the standard deviation `between_logs` [1].
    The interval of the difference combines the facing half-widths of both intervals (Zou and Donner 2008), which also
    suits asymmetric intervals.
    """
    difference, spread = b.value - a.value, between_logs * (abs(a.value) + abs(b.value)) / 2
    below = math.hypot(b.value - b.interval_95[0], a.interval_95[1] - a.value, 1.96 * spread)
    above = math.hypot(b.interval_95[1] - b.value, a.value - a.interval_95[0], 1.96 * spread)
    error = math.hypot(a.standard_error, b.standard_error, spread)
    if not math.isfinite(difference + below + above + error):
        raise SettingsError(f"compare: {name} of {label} is {a.value:g} and {b.value:g}; expected a finite difference")
    z_score = difference / error if error > 0 else math.inf
    return Difference(
        joint=label,
        parameter=name,
        unit=a.unit,
        a=a.value,
        b=b.value,
        difference=difference,
        interval_95=(difference - below, difference + above),
        z_score=z_score if math.isfinite(z_score) else None,
        agrees=difference - below <= 0 <= difference + above,
        weak="weak" in (a.verdict, b.verdict),
        percent=_percent(difference, a.value),
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

"""What changed between two results of a robot, or differs between its left and its right."""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from scipy.stats import norm

from stribeck.errors import SettingsError
from stribeck.result import JointResult, ParameterEstimate, Result, read_result
from stribeck.result.mirror import mirrored_pairs

DIRECTED = frozenset({"offset", "coulomb_positive", "coulomb_negative", "viscous_positive", "viscous_negative"})
"""Parameters that belong to one direction of a joint's axis: mirrored axes may point either way."""

FALSE_ALARMS = 0.05
"""Chance [1] that any change is called significant in a comparison where nothing has changed."""

LARGEST_PERCENT = 1000.0
"""More says that the first value is next to nothing [%]."""


@dataclass(frozen=True, kw_only=True)
class Difference:
    """One parameter of one joint, or of two mirrored joints, in both results.

    `difference` is b - a with its 95 % interval; `z_score` is the difference in standard errors, None if they are
    zero, or next to it; `agrees` says whether the interval holds zero, one in twenty of the intervals of joints that
    have not changed does not; `significant` heeds how many there are (`holm`). `percent` is the difference over |a|,
    None where a is next to zero. Nothing is said about a joint that only one side identified: it is in `missing`.
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


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """All differences, what a and b are, and the joints that cannot be compared with the reason."""

    a: str
    b: str
    rows: list[Difference]
    missing: dict[str, str]

    def to_json(self) -> str:
        """Return the comparison as the text of a JSON document."""
        return json.dumps(asdict(self), indent=2, allow_nan=False) + "\n"


def compare(a: Result | str | Path, b: Result | str | Path, names: tuple[str, str] | None = None) -> Comparison:
    """Compare two results of a robot, joint by joint.

    Parameters
    ----------
    a, b
        Results, or the paths of their result.json.
    names
        What to call them; their logs' paths if None.

    Returns
    -------
    comparison
        A row for each parameter that both have: b - a, in its unit, with the 95 % interval.

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
    require_one_law([a, b])
    both = [joint for joint in a.joints if joint in b.joints]
    if not both:
        raise SettingsError(
            f"compare: no joint is in both results, the first has {_listed(a)}, the second {_listed(b)}, "
            "expected logs of one robot"
        )
    missing = {joint: "only in the first result" for joint in a.joints if joint not in b.joints}
    missing |= {joint: "only in the second result" for joint in b.joints if joint not in a.joints}
    rows = []
    for joint in both:
        rows += _rows(joint, a.joints[joint], b.joints[joint], frozenset())
        missing |= _not_identified({joint: a.joints[joint]}, "first") or _not_identified(
            {joint: b.joints[joint]}, "second"
        )
    first, second = names or (_label(a), _label(b))
    return Comparison(a=first, b=second, rows=_tested(rows), missing=missing)


def compare_sides(result: Result) -> Comparison:
    """Compare the left with the right joints of one result; a is left, b is right.

    Offsets and other parameters of one direction are left out: a result does not know which way mirrored axes point.

    Raises
    ------
    SettingsError
        If no joint has a partner on the other side.
    """
    pairs = mirrored_pairs(result.joints)
    if not pairs:
        raise SettingsError(f"compare: no joint of {_listed(result)} has a partner, expected names with left and right")
    rows: list[Difference] = []
    missing: dict[str, str] = {}
    for left, right in pairs:
        rows += _rows(f"{left} | {right}", result.joints[left], result.joints[right], DIRECTED)
        missing |= _not_identified({left: result.joints[left], right: result.joints[right]}, "result")
    return Comparison(a="left", b="right", rows=_tested(rows), missing=missing)


def require_one_law(results: Sequence[Result]) -> None:
    """Refuse results of which the laws differ, with a SettingsError."""
    laws = list(dict.fromkeys(result.law for result in results))
    if len(laws) > 1:
        raise SettingsError(
            f"compare: the results have the laws '{laws[0]}' and '{laws[1]}', expected one and the same"
        )


def holm(p_values: Sequence[float]) -> list[bool]:
    """Return which of many tests are significant, by Holm's step-down method (Holm 1979).

    The i-th smallest of m p-values is compared with `FALSE_ALARMS / (m - i)`, i from 0, up to the first that is larger:
    the chance of any false one is `FALSE_ALARMS` at most, however the tests depend on one another.
    """
    order = sorted(range(len(p_values)), key=lambda k: p_values[k])
    significant = [False] * len(p_values)
    for i, k in enumerate(order):
        if p_values[k] > FALSE_ALARMS / (len(order) - i):
            break
        significant[k] = True
    return significant


def p_value(difference: Difference) -> float:
    """Return the chance [1] of so large a difference without a change, by the end of its interval that faces zero."""
    low, high = difference.interval_95
    half = difference.difference - low if difference.difference > 0 else high - difference.difference
    if not half:
        return float(difference.difference == 0)
    return 2 * float(norm.sf(norm.ppf(0.975) * abs(difference.difference) / half))


def _tested(rows: list[Difference]) -> list[Difference]:
    significant = holm([p_value(row) for row in rows])
    return [replace(row, significant=one) for row, one in zip(rows, significant, strict=True)]


def _rows(label: str, a: JointResult, b: JointResult, left_out: frozenset[str]) -> list[Difference]:
    shared = [name for name in a.parameters if name in b.parameters and name not in left_out]
    return [difference_of(label, name, a.parameters[name], b.parameters[name]) for name in shared]


def difference_of(label: str, name: str, a: ParameterEstimate, b: ParameterEstimate) -> Difference:
    """Compare two independent estimates.

    The interval of the difference adds the squares of the distances from value to interval end that face each other
    (Zou and Donner 2008), so that intervals symmetric in a logarithm are served too.
    """
    difference = b.value - a.value
    below = math.hypot(b.value - b.interval_95[0], a.interval_95[1] - a.value)
    above = math.hypot(b.interval_95[1] - b.value, a.value - a.interval_95[0])
    error = math.hypot(a.standard_error, b.standard_error)
    if not math.isfinite(difference + below + above + error):
        raise SettingsError(
            f"compare: {name} of {label} is {a.value:g} and {b.value:g}; expected numbers whose difference is finite"
        )
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
    small = abs(difference) <= LARGEST_PERCENT / 100 * abs(of) and of != 0
    return 100 * difference / abs(of) if small else None


def _not_identified(joints: dict[str, JointResult], which: str) -> dict[str, str]:
    without = ("no friction", "not excited")
    return {
        joint: f"{found.verdict} in the {which} ({found.reason})"
        for joint, found in joints.items()
        if found.verdict in without
    }


def _label(result: Result) -> str:
    path = result.log.path
    return path if isinstance(path, str) else ", ".join(path)


def _listed(result: Result) -> str:
    return ", ".join(f"'{joint}'" for joint in list(result.joints)[:5]) or "no joint"

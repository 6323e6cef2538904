"""Format saved scores as tables; docs/accuracy.md shows a summary."""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence

import numpy as np
from studies.markdown import markdown_table

from benchmarks.contest.cases import COMMANDED, CONDITIONS, LATENCIES, PRESCRIBED, WALKS
from benchmarks.contest.score import Score

GROUPS = {"walks": tuple(WALKS), **{name: (name,) for name in (*PRESCRIBED, *COMMANDED)}}
"""Robots that share one row of a table."""
HEAD = (
    *("logs", "contestant", "joints answered", "Coulomb error, median (90 %)", "viscous error, median (90 %)"),
    *("offset error [N m], median (90 %)", "curve error, median (90 %)", "coverage", "confident, > 25 % off"),
    *("confident, > 3 errors off", "processor time [s/s]", "memory [MB]", "needs"),
)
BLANK = "–"


def lines(scores: Sequence[Score]) -> list[str]:
    """Format all tables in Markdown, separated by blank lines."""
    tables = [by_condition(scores, CONDITIONS), by_condition(scores, LATENCIES), real_table(scores), blanks(scores)]
    return [main_table(scores), *(line for table in tables for line in ("", *table))]


def main_table(scores: Sequence[Score]) -> str:
    """Format the table of all contestants with answers, over all conditions."""
    rows = [_row(group, name, own) for group, name, own in grouped(scores) if any(each.curve for each in own)]
    return markdown_table(HEAD, rows, 2, right=1)


def grouped(scores: Sequence[Score]) -> Iterator[tuple[str, str, list[Score]]]:
    """Yield the group of robots, the contestant, and the contestant's scores of this group."""
    for group, robots in GROUPS.items():
        for name in names(scores):
            yield group, name, [each for each in scores if each.contestant == name and each.robot in robots]


def summary_table(scores: Sequence[Score]) -> list[str]:
    """Format the errors of the curves, the coverage and the confident errors per contestant, for docs/accuracy.md."""
    rows = []
    for name in names(scores):
        own = [each for each in scores if each.contestant == name and each.curve]
        groups = [[each for each in own if each.robot in robots] for robots in GROUPS.values()]
        if own:
            cells = [spread(group, lambda each: each.curve.values(), _percent) for group in groups]
            rows.append([name, *cells, _coverage(own), _confident(own)])
    return markdown_table(("contestant", *GROUPS, "coverage", "confident, > 25 % off"), rows).split("\n")


def _coverage(own: Sequence[Score]) -> str:
    return _share(*(sum(each.covered[k] for each in own) for k in range(2)))


def _confident(own: Sequence[Score]) -> str:
    return _share(sum(len(each.far) for each in own), sum(each.good for each in own))


def _row(group: str, name: str, own: Sequence[Score]) -> list[str]:
    asked, answered = sum(each.asked for each in own), sum(len(each.curve) for each in own)
    return [
        f"{group} ({len([each for each in own if each.curve])})",
        name,
        _share(answered, asked),
        spread(own, lambda each: each.relative.get("coulomb", {}).values(), _percent),
        spread(own, lambda each: each.relative.get("viscous", {}).values(), _percent),
        spread(own, lambda each: each.offset.values(), _number),
        spread(own, lambda each: each.curve.values(), _percent),
        _coverage(own),
        _confident(own),
        _share(sum(len(each.beyond) for each in own), sum(each.with_errors for each in own)),
        _number(float(np.mean([each.seconds or 0.0 for each in own]))),
        f"{max(each.memory or 0.0 for each in own):.0f}",
        ", ".join(dict.fromkeys(need for each in own for need in each.needs)) or "nothing",
    ]


def by_condition(scores: Sequence[Score], conditions: Collection[str]) -> list[str]:
    """Format the median error of the curve for each of the conditions."""
    rows = []
    for group, name, own in grouped(scores):
        cells = [median_curve(own, condition) for condition in conditions]
        if any(cell is not None for cell in cells):
            rows.append((group, name, *(BLANK if v is None else _percent(v) for v in cells)))
    return markdown_table(("logs", "contestant", *conditions), rows, 2).split("\n")


def median_curve(own: Iterable[Score], condition: str) -> float | None:
    """Compute the median error of the curves in a condition [1]; None without an answer."""
    values = [value for each in own if each.condition == condition for value in each.curve.values()]
    return float(np.median(values)) if values else None


def real_table(scores: Sequence[Score]) -> list[str]:
    """Format the held-out torque error relative to the model without friction, as geometric means over the joints."""
    robots = list(dict.fromkeys(each.robot for each in scores if each.held_out))
    rows = []
    for name in names(scores):
        own = {each.robot: each.held_out for each in scores if each.contestant == name and each.held_out}
        means = {robot: f"{np.exp(np.mean(np.log(list(errors.values())))):.3f}" for robot, errors in own.items()}
        if own:
            rows.append((name, *(means.get(robot, BLANK) for robot in robots)))
    return markdown_table(("contestant", *robots), rows).split("\n") if robots else []


def blanks(scores: Sequence[Score]) -> list[str]:
    """List the reasons for blanks with their cases; a robot's name represents all its cases."""
    found: dict[tuple[str, str], list[Score]] = {}
    for each in scores:
        if each.blank:
            found.setdefault((each.contestant, each.blank), []).append(each)
    return [f"- {name}, {_cases(own, scores)}: {reason}" for (name, reason), own in found.items()]


def _cases(own: Sequence[Score], scores: Sequence[Score]) -> str:
    known, had = _conditions(scores), _conditions(own)
    if known == had:
        return "all logs"
    return ", ".join(
        robot if known[robot] == conditions else f"{robot} ({', '.join(conditions)})"
        for robot, conditions in had.items()
    )


def _conditions(scores: Sequence[Score]) -> dict[str, list[str]]:
    """List the conditions of each robot."""
    found: dict[str, list[str]] = {}
    for each in scores:
        if each.condition not in found.setdefault(each.robot, []):
            found[each.robot].append(each.condition)
    return {robot: sorted(conditions) for robot, conditions in found.items()}


def names(scores: Sequence[Score]) -> list[str]:
    """List the contestants in the order of the file."""
    return list(dict.fromkeys(each.contestant for each in scores))


def spread(own: Sequence[Score], values: Callable[[Score], Iterable[float]], text: Callable[[float], str]) -> str:
    """Format the median and the 90th percentile of values over all joints and cases."""
    found = [float(value) for each in own for value in values(each)]
    if not found:
        return BLANK
    return f"{text(float(np.median(found)))} ({text(float(np.percentile(found, 90)))})"


def _percent(value: float) -> str:
    return f"{100 * value:.2g} %" if value < 0.995 else f"{100 * value:.0f} %"


def _number(value: float) -> str:
    return f"{value:.2g}"


def _share(part: int, whole: int) -> str:
    return f"{100 * part / whole:.0f} %" if whole else BLANK

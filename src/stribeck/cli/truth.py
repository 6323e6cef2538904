"""Console output next to the ground truth: of `demo` and `rehearse`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from stribeck.base.text_table import TextTable, number, span
from stribeck.cli.console import print_table, say

if TYPE_CHECKING:
    from stribeck.result import Result


def print_truth(result: Result, truth: Mapping[str, Mapping[str, float]]) -> None:
    """Print the true and estimated parameters of each joint, then how many intervals contain the truth."""
    rows, identified, covered = [], 0, 0
    for joint, found in result.joints.items():
        true = truth.get(joint, {})
        compared = {name: value for name, value in found.parameters.items() if name in true}
        if not compared:
            verdict = found.verdict if found.parameters else f"{found.verdict}: {found.reason}"
            rows.append([joint, "", "" if true else "none", "", "", verdict])
        for name, value in compared.items():
            low, high = value.interval_95
            identified += value.verdict == "identified"
            covered += low <= true[name] <= high
            numbers = [number(true[name]), number(value.value), span(value.interval_95)]
            rows.append([joint, f"{name} [{value.unit}]", *numbers, value.verdict])
    parameters = sum(bool(row[1]) for row in rows)
    table = TextTable(
        title=f"True and estimated friction of {result.robot} (law {result.law})",
        left=["joint", "parameter"],
        right=["truth", "estimate", "95 % interval"],
        last=["verdict"],
        rows=rows,
        notes=[f"{parameters} parameters: {identified} identified; {covered} of the 95 % intervals contain the truth"],
    )
    print_table(table)


def print_expectation(result: Result, truth: Mapping[str, Mapping[str, float]], notes: Iterable[str]) -> None:
    """Print what an identification can be expected to find: a conclusion, then one line per joint."""
    from stribeck.result.tables import advice, point_text

    rows, covered, widths = [], 0, []
    for name, joint in result.joints.items():
        if name not in truth or not joint.curve:
            rows.append([name, "", "", "", joint.verdict, advice(joint)])
            continue
        point = joint.curve[len(joint.curve) // 2]
        known = truth[name]["coulomb"] + truth[name]["viscous"] * point.velocity
        covered += point.interval_95[0] <= known <= point.interval_95[1]
        widths += [point.half_width / known] * (joint.verdict == "identified")
        error = f"{100 * (point.value / known - 1):+.1f} %"
        found = f"{point_text(point)} {point.unit} at {point.velocity:.2g}"
        rows.append([name, f"{number(known)} {point.unit}", found, error, joint.verdict, advice(joint)])
    ends = [f"{100 * each:.2g}" for each in (min(widths), max(widths))] if widths else []
    within = f" within ± {' to '.join(dict.fromkeys(ends))} %" if ends else ""
    say([f"{len(widths)} of {len(rows)} joints would be identified{within} of their friction at middle speed"])
    print_table(
        TextTable(
            title=f"Rehearsal of {result.robot}",
            left=["joint"],
            right=["assumed friction", "identified", "error"],
            last=["verdict", "next step"],
            rows=rows,
            notes=[
                f"{covered} of {sum(bool(row[1]) for row in rows)} intervals contain the assumed friction",
                *notes,
                "best case: the model is exact, and the sensors have only white noise",
            ],
        )
    )

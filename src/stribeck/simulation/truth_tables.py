"""Tables that compare a result with the simulated truth."""

from collections.abc import Iterable, Mapping

from stribeck.core.base.text_table import TextTable, number, span
from stribeck.core.result import Result
from stribeck.core.result.tables import advice, point_text


def truth_table(result: Result, truth: Mapping[str, Mapping[str, float]]) -> TextTable:
    """List the true and estimated parameters of each joint, and how many intervals contain the truth."""
    rows, identified, covered = [], 0, 0
    for joint, friction in result.joints.items():
        true = truth.get(joint, {})
        compared = {name: value for name, value in friction.parameters.items() if name in true}
        if not compared:
            verdict = friction.verdict if friction.parameters else f"{friction.verdict}: {friction.reason}"
            rows.append([joint, "", "" if true else "none", "", "", verdict])
        for name, value in compared.items():
            low, high = value.interval_95
            identified += value.verdict == "identified"
            covered += low <= true[name] <= high
            numbers = [number(true[name]), number(value.value), span(value.interval_95)]
            rows.append([joint, f"{name} [{value.unit}]", *numbers, value.verdict])
    parameters = sum(bool(row[1]) for row in rows)
    return TextTable(
        title=f"True and estimated friction of {result.robot} (law {result.law})",
        left=["joint", "parameter"],
        right=["truth", "estimate", "95 % interval"],
        last=["verdict"],
        rows=rows,
        notes=[f"{parameters} parameters: {identified} identified; {covered} of the 95 % intervals contain the truth"],
    )


def expectation_table(
    result: Result, truth: Mapping[str, Mapping[str, float]], notes: Iterable[str]
) -> tuple[str, TextTable]:
    """State what an identification can be expected to find: a conclusion, and one line per joint."""
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
        estimate = f"{point_text(point)} {point.unit} at {point.velocity:.2g}"
        rows.append([name, f"{number(known)} {point.unit}", estimate, error, joint.verdict, advice(joint)])
    ends = [f"{100 * width:.2g}" for width in (min(widths), max(widths))] if widths else []
    within = f" within ± {' to '.join(dict.fromkeys(ends))} %" if ends else ""
    conclusion = f"{len(widths)} of {len(rows)} joints would be identified{within} of their friction at middle speed"
    return conclusion, TextTable(
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

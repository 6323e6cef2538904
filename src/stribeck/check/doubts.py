"""Weak verdicts on joints with a fault that a finding names, until the fault is fixed."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from stribeck.core.base.finding import Finding
from stribeck.core.judgement.reason import Reason
from stribeck.core.result import JointResult


def doubted(joints: Mapping[str, JointResult], findings: Sequence[Finding]) -> dict[str, JointResult]:
    """Make identified joints weak if a finding names such a fault; its remedy is the next step.

    A wrong gain of the torque scales friction by the same factor. The intervals then contain friction with and without
    the remedy.
    """
    judged = dict(joints)
    for finding in (finding for finding in findings if finding.doubt):
        for name in finding.joints or joints:
            if name in judged and judged[name].verdict == "identified":
                why = Reason(finding.doubt, remedy=finding.cure)
                joint = replace(judged[name], verdict="weak", **why.fields)
                judged[name] = _scaled(joint, 1 / finding.gains[name]) if name in finding.gains else joint
    return judged


def _scaled(joint: JointResult, factor: float) -> JointResult:
    """Extend the intervals of friction, so that they also contain it multiplied by a factor."""

    def both(interval: tuple[float, float] | None) -> Any:
        ends = [scale * end for scale in (1, factor) for end in interval or ()]
        return (min(ends), max(ends)) if ends else None

    parameters = {
        name: replace(each, interval_95=both(each.interval_95), verdict="weak") if each.unit.startswith("N") else each
        for name, each in joint.parameters.items()
    }
    curve = tuple(
        replace(point, interval_95=both(point.interval_95), interval_next_log=both(point.interval_next_log))
        for point in joint.curve
    )
    return replace(joint, parameters=parameters, curve=curve)

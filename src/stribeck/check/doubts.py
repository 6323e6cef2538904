"""Weak verdicts on joints with a fault that a finding names, until the fault is fixed."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from stribeck.core.base.finding import Finding
from stribeck.core.friction.terms.motion import drift
from stribeck.core.judgement.curve import WIDEST, relative_width
from stribeck.core.judgement.reason import Reason
from stribeck.core.result import JointResult
from stribeck.core.result.tables import least_known


def doubted(joints: Mapping[str, JointResult], findings: Sequence[Finding]) -> dict[str, JointResult]:
    """Make identified joints weak if a finding names such a fault; its remedy is the next step.

    A joint whose curve is wide because of a finding gets its remedy, because longer motion would not help.
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
    for finding in findings:
        for name in finding.joints if finding.check in ("friction-drift", "command-delay") else ():
            if name in judged and judged[name].verdict == "weak" and _wide(judged[name], finding.check):
                judged[name] = replace(judged[name], remedy=finding.cure)
    return judged


def _wide(joint: JointResult, check: str) -> bool:
    """Whether the curve is wide, and not only because of few samples: a drift is most of the interval's square."""
    if joint.remedy or relative_width(joint.curve) <= WIDEST:
        return False
    point, values = least_known(joint.curve), {name: each.value for name, each in joint.parameters.items()}
    change = float(drift(values, np.array([point.velocity]))[0])
    return check != "friction-drift" or 2 * change**2 > point.half_width**2


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

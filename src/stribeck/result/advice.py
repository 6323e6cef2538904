"""What a user should do about a joint: one clause, from its verdict and its numbers."""

import re

from stribeck.result.joint import CurvePoint, JointResult

_REMEDY = re.compile(r"\b(?:move|let) it? ?.*$|\blet it .*$")
"""What the reason of a joint that does not move enough ends with."""


def advice(joint: JointResult) -> str:
    """Return what to do about a joint, e.g. "log more motion near 5.7 rad/s"."""
    if joint.verdict == "not excited":
        remedy = _REMEDY.search(joint.reason)
        return remedy[0] if remedy else "move it faster and longer, in both directions"
    if joint.verdict == "no friction":
        return "nothing: its friction is below what the log resolves"
    if joint.verdict == "identified":
        loose = [name for name, found in joint.parameters.items() if found.verdict != "identified"]
        return "use its curve" if loose else "use it"
    return _of_weak(joint)


def _of_weak(joint: JointResult) -> str:
    validation = joint.validation
    if not joint.curve:
        return "move it faster and longer"
    if not any(point.interval_95[0] > 0 for point in joint.curve):
        return "check its torque; log it longer"
    if validation is not None and validation.rms >= validation.rms_zero_friction:
        return "check the model, signs and delays"
    point = max(joint.curve, key=_relative_width)
    unit = "rad/s" if point.unit == "N m" else "m/s"
    return f"log more motion near {point.velocity:.2g} {unit}"


def _relative_width(point: CurvePoint) -> float:
    return point.half_width / point.value if point.value > 0 else float("inf")

"""Small results, made by hand."""

from dataclasses import replace
from typing import Any

from stribeck.core.result import CurvePoint, JointResult, LogSummary, ParameterEstimate, Result, Verdict


def estimate(value: float, error: float = 0.1, verdict: Verdict = "identified") -> ParameterEstimate:
    interval = (value - 2 * error, value + 2 * error)
    return ParameterEstimate(value=value, standard_error=error, interval_95=interval, unit="N m", verdict=verdict)


def point(velocity: float, value: float, half: float) -> CurvePoint:
    interval = (max(value - half, 0.0), value + half)
    return CurvePoint(velocity=velocity, value=value, standard_error=half / 2, interval_95=interval, unit="N m")


def joint(values: dict[str, float | ParameterEstimate] | None = None, **changed: Any) -> JointResult:
    """Make a joint with these parameters; without any, one that moves too little."""
    parameters = {name: estimate(v) if isinstance(v, float | int) else v for name, v in (values or {}).items()}
    fields = {
        "verdict": "identified" if parameters else "not excited",
        "reason": "" if parameters else "it <moves> too little",
        "samples": 100,
        "velocity_range": (-1.0, 1.0),
        "reversals": 5,
    }
    return JointResult(parameters=parameters, **(fields | changed))


def result(law: str = "stribeck", path: str = "a.npz", **joints: JointResult) -> Result:
    log = LogSummary(path=path, sha256="0", duration=1.0, rate=1000.0, samples_used=100)
    return Result(robot="r & d", log=log, law=law, method="curve-fit", joints=joints, stribeck="0")


def of_one_log(found: Result) -> Result:
    """The same result without the spread of friction between logs."""
    curves = {name: [replace(p, interval_next_log=None) for p in own.curve] for name, own in found.joints.items()}
    return replace(found, joints={name: replace(own, curve=tuple(curves[name])) for name, own in found.joints.items()})

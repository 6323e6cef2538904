"""Measured and predicted torque over the whole log, without and with the identified friction."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from stribeck.base.typing import Array
from stribeck.friction_torque.samples import FrictionSamples
from stribeck.report.charts import Chart, axis, line, robust_limits
from stribeck.report.page import Section, render
from stribeck.report.text import number
from stribeck.result import JointResult, Result

POINTS = 24_000
"""Largest number of points of a line, summed over the joints."""
LEGEND = (("data", "measured"), ("muted", "without friction"), ("law", "with friction"))
"""Colors and labels of the lines."""
ABOUT = "Inverse dynamics plus the offset of the torque, without and with friction, at the bandwidth of the filter."
"""Explanation of the charts."""


def replayed_torques(result: Result, samples: FrictionSamples) -> Section | None:
    """Render one chart per joint with friction; None if the measured torque is unknown."""
    charts: dict[str, Chart] = {}
    figures = []
    fitted = [name for name, joint in result.joints.items() if joint.parameters and name in samples.joint_names]
    points = POINTS // max(len(fitted), 1)
    for name in fitted if samples.torque is not None else []:
        column = samples.joint_names.index(name)
        if column < samples.torque.shape[1] and len(samples.time) > 1:  # type: ignore[union-attr]  # not a coupling
            charts[f"o{column}"], caption = _chart(name, result.joints[name], samples, column, points)
            figures.append((f"o{column}", caption))
    if not figures:
        return None
    body = render("torques.html.j2", legend=LEGEND, about=ABOUT, figures=figures)
    return Section(anchor="torques", title="Torque over the log, without and with friction", body=body, charts=charts)


def over_time(time: Array, curves: Sequence[tuple[Array, str, str]], points: int) -> list[dict[str, Any]]:
    """Describe lines of values over time on an even grid; lines break at gaps and where a value is not finite.

    Parameters
    ----------
    time
        Times from zero [s], shape (T,).
    curves
        Values, shape (T,), color and label of each line; the first line is the thickest.
    points
        Largest number of points of a line.
    """
    step = max(float(np.median(np.diff(time))), float(time[-1]) / points)
    even = np.arange(0.0, float(time[-1]), step)
    rows = np.searchsorted(time, even).clip(max=len(time) - 1)
    near = np.abs(time[rows] - even) < 3 * step
    widths = [1.6, *[1.1] * (len(curves) - 1)]
    return [
        line([0.0], np.where(near, values[rows], np.nan), colour, label, width=width, step=step)
        for (values, colour, label), width in zip(curves, widths, strict=True)
    ]


def _chart(name: str, joint: JointResult, samples: FrictionSamples, column: int, points: int) -> tuple[Chart, str]:
    """Draw the torques of a joint, with the RMS errors in the caption; lines break where the friction is unknown."""
    values, time = predictions(joint, samples, column), elapsed(samples)
    measured, *predicted = (own[np.isfinite(own)] for own in values)
    errors = [_rms(measured - own) for own in predicted]
    curves = [(own, colour, label) for own, (colour, label) in zip(values, LEGEND, strict=True)]
    unit = joint.units(bool(samples.prismatic) and samples.prismatic[column])[1]
    limits = robust_limits(measured, share=0.0)
    x, y = axis("time [s]", (0.0, float(time[-1]))), axis(f"torque [{unit}]", limits)
    chart = {"x": x, "y": y, "lines": over_time(time, curves, points), "sync": "torques"}
    return chart, f"{name}: error {number(errors[0], 2)} → {number(errors[1], 2)} {unit} (RMS)"


def predictions(joint: JointResult, samples: FrictionSamples, column: int) -> tuple[Array, Array, Array]:
    """Compute measured torque and predictions without and with friction, shape (N,); NaN where friction is unknown."""
    assert samples.torque is not None
    measured, velocity = samples.torque[:, column], samples.velocity[:, column]
    expected = measured - samples.friction_torque[:, column]
    friction = joint.friction(velocity, load=expected, offset=True)
    known = np.where(samples.usable[:, column] & np.isfinite(expected + friction), 0.0, np.nan)
    return known + measured, known + expected + joint.values.get("offset", 0.0), known + expected + friction


def elapsed(samples: FrictionSamples) -> Array:
    """Compute the time since the first sample [s], shape (N,); the logs follow each other."""
    step = samples.period * samples.stride
    return np.concatenate([[0.0], np.cumsum(np.where(np.diff(samples.time) > 0, np.diff(samples.time), step))])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")

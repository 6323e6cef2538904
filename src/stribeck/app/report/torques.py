"""Measured and predicted torque over the whole log, without and with the identified friction."""

from collections.abc import Sequence

import numpy as np

from stribeck.app.report.charts import Chart, axis, line, robust_limits
from stribeck.app.report.page import Section, section
from stribeck.app.report.text import number
from stribeck.core.base.typing import Array
from stribeck.core.result import JointResult, Result
from stribeck.core.result.samples import FrictionSamples

POINTS = 24_000
"""Largest number of points of a line, summed over the joints."""
LEGEND = (("data", "measured"), ("muted", "without friction"), ("law", "with friction"))
"""Colors and labels of the lines."""


def replayed_torques(result: Result, samples: FrictionSamples) -> Section | None:
    """Render one chart per joint with friction; None if the measured torque is unknown."""
    figures: dict[str, tuple[Chart, str]] = {}
    fitted = [name for name, joint in result.joints.items() if joint.parameters and name in samples.joint_names]
    points = POINTS // max(len(fitted), 1)
    for name in fitted if samples.torque is not None else []:
        column = samples.joint_names.index(name)
        if column < samples.torque.shape[1] and len(samples.time) > 1:  # type: ignore[union-attr]  # not a coupling
            figures[f"o{column}"] = _chart(name, result.joints[name], samples, column, points)
    title = "Torque over the log, without and with friction"
    about = "Inverse dynamics plus the offset of the torque, without and with friction, at the bandwidth of the filter."
    return section("torques", title, "torques", figures, legend=LEGEND, about=about) if figures else None


def over_time(
    time: Array, label: str, values: Sequence[Array], legend: Sequence[tuple[str, str]], points: int, sync: str
) -> Chart:
    """Draw values over time on an even grid; lines break at gaps and where a value is not finite.

    Parameters
    ----------
    time
        Times from zero [s], shape (T,).
    label
        Label of the vertical axis, which is scaled to the first values.
    values, legend
        Values, shape (T,), and color and label of each line; the first line is the thickest.
    points
        Largest number of points of a line.
    sync
        Name of the charts that zoom together.
    """
    step = max(float(np.median(np.diff(time))), float(time[-1]) / points)
    even = np.arange(0.0, float(time[-1]), step)
    rows = np.searchsorted(time, even).clip(max=len(time) - 1)
    near = np.abs(time[rows] - even) < 3 * step
    return {
        "x": axis("time [s]", (0.0, float(time[-1]))),
        "y": axis(label, robust_limits(values[0][np.isfinite(values[0])], share=0.0)),
        "lines": [
            line([0.0], np.where(near, series[rows], np.nan), *key, width=1.1 if k else 1.6, step=step)
            for k, (series, key) in enumerate(zip(values, legend, strict=True))
        ],
        "sync": sync,
    }


def _chart(name: str, joint: JointResult, samples: FrictionSamples, column: int, points: int) -> tuple[Chart, str]:
    """Draw the torques of a joint, with the RMS errors in the caption; lines break where the friction is unknown."""
    values = predictions(joint, samples, column)
    measured, *predicted = (torque[np.isfinite(torque)] for torque in values)
    errors = " → ".join(number(_rms(measured - torque), 2) for torque in predicted)
    unit = joint.units(bool(samples.prismatic) and samples.prismatic[column])[1]
    chart = over_time(elapsed(samples), f"torque [{unit}]", values, LEGEND, points, "torques")
    return chart, f"{name}: error {errors} {unit} (RMS)"


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

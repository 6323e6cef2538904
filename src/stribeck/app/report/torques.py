"""Measured and predicted torque over the whole log, without and with the identified friction."""

import numpy as np

from stribeck.app.report.charts import Figures, over_time, with_residual
from stribeck.app.report.joints import noisy_modes
from stribeck.app.report.page import Section, section
from stribeck.app.report.text import number
from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.result import JointResult, Result
from stribeck.core.result.samples import FrictionSamples

POINTS = 24_000
"""Largest number of points of a line, summed over the joints."""
LEGEND = (("data", "measured"), ("muted", "without friction"), ("law", "with friction"))
"""Colors and labels of the lines."""


def replayed_torques(result: Result, samples: FrictionSamples) -> Section | None:
    """Render two charts per joint with friction, torque and residual; None if the measured torque is unknown."""
    figures: Figures = {}
    fitted = [name for name, joint in result.joints.items() if joint.parameters and name in samples.joint_names]
    points = POINTS // max(len(fitted), 1)
    for name in fitted if samples.torque is not None else []:
        column = samples.joint_names.index(name)
        if column < samples.torque.shape[1] and len(samples.time) > 1:  # type: ignore[union-attr]  # not a coupling
            figures |= _charts(name, result.joints[name], samples, column, points)
    title = "Torque over the log, without and with friction"
    about = (
        "Two charts per joint: inverse dynamics plus the offset of the torque, without and with friction, at the "
        "bandwidth of the filter; and measured torque minus each of them."
    )
    if any(chart["spans"] for chart, _ in figures.values()):
        about += " Shaded: the model explains these contacts less well; they hardly count for the friction."
    return section("torques", title, "torques", figures, legend=LEGEND, about=about) if figures else None


def _charts(name: str, joint: JointResult, samples: FrictionSamples, column: int, points: int) -> Figures:
    """Draw torque and residual of a joint, with RMS errors in the caption; noisy contact modes are shaded."""
    values, time = predictions(joint, samples, column), elapsed(samples)
    noisy = noisy_modes(samples, np.flatnonzero(np.isfinite(values[2])), column, joint)
    shaded = np.isin(samples.support, noisy)
    known = np.isfinite(values[2]) & ~shaded
    errors = " → ".join(number(_rms((values[0] - torque)[known]), 2) for torque in values[1:])
    unit = joint.units(samples.slides(column))[1]
    chart = over_time(time, f"torque [{unit}]", values, LEGEND, points, "torques")
    chart["spans"] = _spans(time, shaded & np.isfinite(values[2]))
    caption = f"{name}: error {errors} {unit} (RMS)"
    if noisy:
        rest = np.isfinite(values[2]) & shaded
        caption += f"; shaded: {number(_rms((values[0] - values[2])[rest]), 2)} {unit}"
    return with_residual(f"o{column}", caption, chart, values, known)


def _spans(time: Array, shaded: BoolArray) -> list[list[float]]:
    """List start and end of shaded parts [s]; pauses of less than 0.2 % of the time are included."""
    at = time[shaded]
    breaks = np.flatnonzero(np.diff(at) > 2e-3 * time[-1])
    starts, ends = at[np.insert(breaks + 1, 0, 0)[: len(at)]], at[np.append(breaks, len(at) - 1)[: len(at)]]
    return [[float(start), float(end)] for start, end in zip(starts, ends, strict=True)]


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

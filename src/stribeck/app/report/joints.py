"""Panels per joint: parameters, and charts of friction, residual and coverage; torques over the log."""

from dataclasses import dataclass

import numpy as np

from stribeck.app.report import charts
from stribeck.app.report.charts import Chart, Figures, Points
from stribeck.app.report.page import Section, number, section, symbols
from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.friction.law import FrictionLaw
from stribeck.core.result import Evidence, JointResult, Result, velocity_grid
from stribeck.core.result.reference import Reference
from stribeck.core.result.samples import FrictionSamples

LEGEND = (("data", "measured"), ("muted", "without friction"), ("law", "with friction"))
"""Colors and labels of torques over the log."""


@dataclass(frozen=True, eq=False, kw_only=True)
class JointSamples:
    """Evenly thinned samples of a joint that the fit may use, without its offset.

    `time` [s], `velocity` [rad/s], friction `torque` [N m] (for prismatic joints m/s and N) and whether the velocity
    `rises` have the shape (N,). Samples of the contact modes `omitted` are left out, because they are much noisier
    than the fit.
    """

    time: Array
    velocity: Array
    torque: Array
    rises: BoolArray
    omitted: tuple[str, ...] = ()


def joint_samples(samples: FrictionSamples, name: str, joint: JointResult | None = None) -> JointSamples:
    """Select the samples of a joint; empty without a torque.

    With a result, the offset is subtracted, and noisy contact modes are omitted.
    """
    every = max(1, -(-len(samples.time) // 30_000))  # more samples are not visible
    rows, column = np.empty(0, dtype=np.int64), 0
    if name in samples.joint_names:
        column = samples.joint_names.index(name)
        values = samples.velocity[::every, column] + samples.friction_torque[::every, column]
        rows = every * np.flatnonzero(samples.usable[::every, column] & np.isfinite(values))
    noisy = [] if joint is None else noisy_modes(samples, rows, column, joint)
    offset = 0.0 if joint is None else joint.values.get("offset", 0.0)
    rows = rows[~np.isin(samples.support[rows], noisy)]
    return JointSamples(
        time=samples.time[rows],
        velocity=samples.velocity[rows, column],
        torque=samples.friction_torque[rows, column] - offset,
        rises=samples.acceleration[rows, column] > 0,
        omitted=tuple(samples.support_names[mode] for mode in noisy),
    )


def noisy_modes(samples: FrictionSamples, rows: IntArray, column: int, joint: JointResult) -> list[int]:
    """Find the contact modes with large residuals of a fitted joint, as indices; never the quietest one.

    Their samples, for example of a standing leg, hardly contribute to the fit.
    """
    if not joint.residual_rms or (joint.verdict != "no friction" and joint.band(np.zeros(1)) is None):
        return []
    law = joint.friction(samples.velocity[rows, column], offset=True)
    residual = np.abs(samples.friction_torque[rows, column] - law)
    modes = np.unique(samples.support[rows]).tolist()
    medians = {mode: float(np.median(residual[samples.support[rows] == mode])) for mode in modes}
    usual = max(joint.residual_rms, min(medians.values(), default=0.0))
    return [mode for mode, median in medians.items() if median > 3.0 * usual]


def joint_panels(result: Result, evidence: Evidence, law: FrictionLaw, reference: Reference) -> Section:
    """Render every joint's panel, in the order of the result."""
    figures, panels = Figures(), {}
    for index, (name, joint) in enumerate(result.joints.items()):
        panel = enumerate(joint_charts(name, joint, evidence, reference))
        drawn = {f"j{index}{k}": (chart | {"sync": f"j{index}"}, caption) for k, (chart, caption) in panel}
        figures |= drawn
        panels[name] = [(key, caption) for key, (_, caption) in drawn.items()]
    shown = {"joints": result.joints, "prismatic": evidence.prismatic, "panels": panels}
    return section("joints", "Joints", "joint_panels", figures, symbols=symbols(law), known=reference, **shown)


def joint_charts(name: str, joint: JointResult, evidence: Evidence, reference: Reference) -> list[tuple[Chart, str]]:
    """Draw the charts of a joint with captions; without a fitted law, only the samples."""
    shown, units = joint_samples(evidence.samples, name, joint), joint.units(name in evidence.prismatic)
    if not len(shown.velocity):
        return []
    over_velocity = friction_over_velocity(shown, joint, reference.without_offset(name), units)
    caption = "Friction torque versus velocity"
    if shown.omitted:
        caption += f"; without the much noisier samples of {', '.join(shown.omitted)}"
    if joint.band(shown.velocity[:1]) is None:
        why = "no friction is detected" if joint.verdict == "no friction" else "no law is fitted"
        return [(over_velocity, f"{caption}: only samples, because {why}.")]
    figures = [(over_velocity, caption)]
    near = None if evidence.close_up is None else joint_samples(evidence.close_up, name, joint)
    if near is not None and len(near.time) > 1:
        span = f"{near.time[0]:.2f} to {near.time[-1]:.2f} s of the log"
        lines, legend = (near.torque, joint.friction(near.velocity)), (("data", "measured"), ("law", "law"))
        chart = charts.over_time(near.time - near.time[0], f"friction [{units[1]}]", lines, legend, 700, "")
        chart["lines"][0]["width"] = 0.8  # noise does not hide the law
        figures.append((chart, f"Over time, {span}"))
    law = joint.friction(shown.velocity)
    return [*figures, (residual_over_velocity(shown, law, over_velocity), "Residual of the law, and its mean")]


def friction_over_velocity(
    shown: JointSamples, joint: JointResult, reference: Points | None, units: tuple[str, str]
) -> Chart:
    """Draw the samples' density, the fitted law with its 95 % band, and the reference if given."""
    limits = charts.robust_limits(shown.velocity, share=0.0, margin=0.03)
    grid = velocity_grid(*limits)
    fitted = joint.band(grid)
    lines = [] if fitted is None else [charts.line(grid, fitted[0], "law", "law", band=fitted[1])]
    lines += [charts.line(*reference, "ink", "reference", width=1.2, dash=[4, 3])] if reference else []
    low, high = charts.robust_limits(shown.torque, share=0.02)
    for curve in (fitted[0] if fitted else None, reference[1] if reference else None):
        if curve is not None and np.isfinite(curve).all():
            low, high = min(low, 1.08 * float(curve.min())), max(high, 1.08 * float(curve.max()))
    samples = charts.density(shown.velocity, shown.torque, limits, (low, high))
    return {**charts.velocity_axes(units, limits, (low, high)), "lines": lines, "images": [samples]}


def residual_over_velocity(shown: JointSamples, law: Array, over_velocity: Chart) -> Chart:
    """Draw the residual as a density with its mean; structure indicates friction beyond the law."""
    finite = np.isfinite(law)  # a law at a bound, such as a Stribeck velocity of zero, can be undefined
    velocity, residual = shown.velocity[finite], (shown.torque - law)[finite]
    limits = charts.robust_limits(shown.velocity, share=0.0, margin=0.03)
    reach = max(map(abs, charts.robust_limits(residual, share=0.01)))
    centre, mean = running_mean(velocity, residual, limits)
    label = over_velocity["y"]["label"].replace("friction", "measured − law")
    return {
        "x": over_velocity["x"],
        "y": charts.axis(label, (-reach, reach)),
        "lines": [charts.line(centre, mean, "law", "mean residual", width=1.5)],
        "images": [charts.density(velocity, residual, limits, (-reach, reach))],
    }


def running_mean(x: Array, y: Array, limits: tuple[float, float], bins: int = 40) -> tuple[Array, Array]:
    """Compute centers and means of y over bins of x; NaN for bins with less than 0.05 % of the samples."""
    counts, edges = np.histogram(x, bins=bins, range=limits)
    sums, _ = np.histogram(x, bins=bins, range=limits, weights=y)
    enough = counts >= max(3, 5e-4 * len(x))
    mean = np.divide(sums, counts, out=np.full(bins, np.nan), where=enough)
    return (edges[:-1] + edges[1:]) / 2, mean


def replayed_torques(result: Result, samples: FrictionSamples) -> Section | None:
    """Render two charts per joint with friction, torque and residual; None if the measured torque is unknown."""
    figures: Figures = {}
    fitted = [name for name, joint in result.joints.items() if joint.parameters and name in samples.joint_names]
    points = charts.POINTS // max(len(fitted), 1)
    for name in fitted if samples.torque is not None else []:
        column = samples.joint_names.index(name)
        if column < samples.torque.shape[1] and len(samples.time) > 1:  # type: ignore[union-attr]  # not a coupling
            figures |= _charts(name, result.joints[name], samples, column, points)
    title = "Torque over the log, without and with friction"
    about = {"what": "friction", "shaded": any(chart["spans"] for chart, _ in figures.values())}
    return section("torques", title, "torques", figures, legend=LEGEND, **about) if figures else None


def _charts(name: str, joint: JointResult, samples: FrictionSamples, column: int, points: int) -> Figures:
    """Draw torque and residual of a joint, with RMS errors in the caption; noisy contact modes are shaded."""
    values, time = predictions(joint, samples, column), elapsed(samples)
    noisy = noisy_modes(samples, np.flatnonzero(np.isfinite(values[2])), column, joint)
    shaded = np.isin(samples.support, noisy)
    known = np.isfinite(values[2]) & ~shaded
    errors = " → ".join(number(_rms((values[0] - torque)[known]), 2) for torque in values[1:])
    unit = joint.units(samples.slides(column))[1]
    chart = charts.over_time(time, f"torque [{unit}]", values, LEGEND, points, "torques")
    chart["spans"] = _spans(time, shaded & np.isfinite(values[2]))
    caption = f"{name}: error {errors} {unit} (RMS)"
    if noisy:
        rest = np.isfinite(values[2]) & shaded
        caption += f"; shaded: {number(_rms((values[0] - values[2])[rest]), 2)} {unit}"
    return charts.with_residual(f"o{column}", caption, chart, values, known)


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

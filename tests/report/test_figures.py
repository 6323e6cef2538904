from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest

from stribeck.friction import get_law
from stribeck.report.density import BINS, FAINTEST, HUE, draw_density, robust_limits
from stribeck.report.figure import COLOURS, house_style, inline_svg, new_axes
from stribeck.report.joint_data import MOST_DRAWN, joint_data
from stribeck.report.timeline import _share_held, one_clock
from stribeck.result import ParameterEstimate, Result


def test_the_figure_takes_its_colours_and_font_from_the_page() -> None:
    with house_style():
        axes = new_axes("x", "y")
        axes.plot([0, 1], [0, 1], color=COLOURS["data"])
        drawing = inline_svg(axes, 'a "label"', "f0")
    assert "var(--data)" in drawing
    assert "var(--grid)" in drawing
    assert "font-family" not in drawing
    assert not any(stand_in in drawing for stand_in in COLOURS.values())
    assert 'aria-label="a &#34;label&#34;"' in drawing


def test_the_users_matplotlib_settings_come_back() -> None:
    with mpl.rc_context({"font.size": 23.0, "svg.fonttype": "path"}):
        with house_style():
            assert mpl.rcParams["svg.fonttype"] == "none"
        assert mpl.rcParams["font.size"] == 23.0
        assert mpl.rcParams["svg.fonttype"] == "path"


def test_numbers_in_texts_are_not_shortened() -> None:
    with house_style():
        axes = new_axes("0.123456 [m]", "y")
        drawing = inline_svg(axes, "numbers", "f0")
    assert "0.123456 [m]" in drawing


def test_the_raster_holds_each_sample_once_and_is_stronger_where_there_are_more() -> None:
    x, y = np.array([0.1, 0.1, 0.1, 0.9, 5.0]), np.array([0.5, 0.5, 0.5, 0.2, 0.5])  # the last one lies outside
    with house_style():
        axes = new_axes("x", "y")
        draw_density(axes, x, y, (0.0, 1.0), (0.0, 1.0))
        image = np.asarray(axes.images[0].get_array())
    opacity = image[..., 3]
    columns, rows = BINS
    assert np.count_nonzero(opacity) == 2
    assert opacity[int(0.5 * rows), int(0.1 * columns)] == 255
    assert 255 * FAINTEST < opacity[int(0.2 * rows), int(0.9 * columns)] < 255
    assert image[0, 0, :3] == pytest.approx(255 * np.array(HUE), abs=0.5)


def test_limits_leave_outliers_aside() -> None:
    values = np.concatenate([np.linspace(-1, 1, 10_000), [1e6]])
    low, high = robust_limits(values)
    assert -1.3 < low < -0.9
    assert 0.9 < high < 1.3


def test_the_band_is_the_parameters_standard_error_where_the_law_is_one_parameter(result: Result) -> None:
    name = "left_hip_yaw"
    assert result.evidence is not None
    law = get_law("stribeck")
    only_offset = np.zeros((6, 6))
    index = [parameter.name for parameter in law.parameters].index("offset")
    only_offset[index, index] = 0.2**2
    evidence = replace(result.evidence, covariance={name: only_offset})
    data = joint_data(name, result.joints[name], evidence, law, evidence.samples)
    band = data.band(np.linspace(-1, 1, 11))
    assert band == pytest.approx(np.full(11, 1.96 * 0.2))


def test_what_is_fitted_beside_the_law_does_not_widen_its_band(result: Result) -> None:
    name = "left_hip_yaw"
    assert result.evidence is not None
    law, samples = get_law("stribeck"), result.evidence.samples
    joint = result.joints[name]
    inertia = ParameterEstimate(
        value=0.3, standard_error=0.01, interval_95=(0.28, 0.32), unit="kg m^2", verdict="identified"
    )
    with_inertia = replace(joint, parameters={**joint.parameters, "armature": inertia})
    wider = np.full((7, 7), 50.0)
    wider[:6, :6] = result.evidence.covariance[name]
    evidence = replace(result.evidence, covariance={name: wider})
    grid = np.linspace(-1, 1, 11)
    plain = joint_data(name, joint, result.evidence, law, samples).band(grid)
    beside = joint_data(name, with_inertia, evidence, law, samples).band(grid)
    assert plain is not None
    assert beside == pytest.approx(plain)
    assert joint_data(name, joint, evidence, law, samples).band(grid) is None  # seven variances, six parameters


def test_many_samples_are_thinned_and_stand_for_the_same_time(result: Result) -> None:
    assert result.evidence is not None
    samples = result.evidence.samples
    rows = np.tile(np.arange(len(samples.time)), 12)
    arrays = ("time", "velocity", "acceleration", "friction_torque", "usable", "block", "support")
    many = replace(samples, **{name: getattr(samples, name)[rows] for name in arrays})
    name, law = "torso_pitch", get_law("stribeck")
    few = joint_data(name, result.joints[name], result.evidence, law, samples)
    thinned = joint_data(name, result.joints[name], result.evidence, law, many)
    assert len(thinned.time) <= MOST_DRAWN < len(rows)
    assert len(thinned.time) * thinned.seconds_per_sample == pytest.approx(
        12 * len(few.time) * few.seconds_per_sample, rel=1e-3
    )


def test_the_strips_hold_the_phases_time() -> None:
    rng = np.random.default_rng(5)
    borders = np.sort(rng.uniform(0, 10, 40))
    phases = [(float(a), float(b), "left", True) for a, b in zip(borders[::2], borders[1::2], strict=True)]
    edges = np.linspace(-1, 11, 60)
    share = _share_held(phases, edges)
    assert np.sum(share * np.diff(edges)) == pytest.approx(sum(b - a for a, b, _, _ in phases))
    assert share.min() >= 0
    assert share.max() <= 1 + 1e-12


def test_logs_follow_each_other_on_one_clock() -> None:
    phases = [(0.0, 1.0, "left", True), (1.0, 2.5, "right", True), (0.5, 1.5, "left", True)]
    assert one_clock(phases) == [(0.0, 1.0, "left", True), (1.0, 2.5, "right", True), (2.5, 3.5, "left", True)]

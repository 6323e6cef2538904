"""The pictures of a simulated walk, and its truth beside what was found."""

import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from tests.report.conftest import make_walk, truth_of

from stribeck.friction import get_law
from stribeck.report import write_report
from stribeck.report.figure import COLOURS, house_style, inline_svg
from stribeck.report.joint_data import joint_data
from stribeck.report.joint_figures import friction_over_velocity
from stribeck.result import Result
from stribeck_simulation.pictures.section import side_colours, walk_section
from stribeck_simulation.pictures.walk import SEEN_FROM, Footprint, Picture, Pose
from stribeck_simulation.pictures.walk_figures import _sole, from_above, seen_from_the_side, strip

SIDES = {"left_foot": "data", "right_foot": "right"}


def test_sections_appear_with_what_they_show(result: Result, tmp_path: Path) -> None:
    write_report(result, tmp_path / "without.html")
    section = walk_section(make_walk())
    write_report(result, tmp_path / "with.html", reference=truth_of(result), further=[section])
    without, shown = ((tmp_path / f"{name}.html").read_text(encoding="utf-8") for name in ("without", "with"))
    body = without[without.index("<body>") :].lower()
    assert "truth" not in body
    assert 'id="walk"' not in body
    assert shown.index('id="warnings"') < shown.index('id="joints"') < shown.index('id="walk"')
    assert shown.count("<small>truth ") == 5 * 6  # a panel each
    assert shown.count("<br>truth ") == 5 * 6  # a row each
    assert "the simulated truth" in shown


def test_the_truth_is_a_curve_of_its_own(result: Result) -> None:
    name = "left_hip_yaw"
    evidence, reference = result.evidence, truth_of(result)
    assert evidence is not None
    with house_style():
        data = joint_data(name, result.joints[name], evidence, get_law("stribeck"), evidence.samples, reference)
        axes = friction_over_velocity(data)
        lines = {str(line.get_color()): line for line in axes.get_lines()}
        truth, law = lines[COLOURS["ink"]], lines[COLOURS["law"]]
    velocity, torque = reference.curves[name]
    np.testing.assert_array_equal(truth.get_xydata(), np.column_stack([velocity, torque]))
    assert truth.get_linestyle() != law.get_linestyle()
    low, high = axes.get_ylim()
    assert low < torque.min() < torque.max() < high


@pytest.mark.parametrize("steps", [2, 6, 100])
def test_seen_from_above_a_metre_is_a_metre_both_ways(steps: int) -> None:
    picture = make_walk(steps)
    with house_style():
        axes = from_above(picture, SIDES, (0.0, 0.3 * steps, -0.3, 0.4), (0.0, 1.0))
        (x0, y0), (x1, y1) = axes.transData.transform([(0, 0), (1, 1)])
    assert x1 - x0 == pytest.approx(y1 - y0)
    (low_x, high_x), (low_y, high_y) = axes.get_xlim(), axes.get_ylim()
    assert low_x < 0.0 < 0.3 * steps < high_x
    assert low_y < -0.3 < 0.4 < high_y


def test_later_prints_are_stronger_and_coloured_by_side() -> None:
    picture = make_walk(10)
    with house_style():
        axes = from_above(picture, SIDES, (0.0, 3.5, -0.5, 0.8), (0.0, 1.0))
        outlines = [patch for patch in axes.patches if not patch.get_fill()]
    assert len(outlines) == 10
    assert np.all(np.diff([float(patch.get_alpha() or 0) for patch in outlines]) > 0)
    assert outlines[0].get_edgecolor() != outlines[1].get_edgecolor()
    assert outlines[0].get_edgecolor()[:3] == outlines[2].get_edgecolor()[:3]


def test_a_foot_that_comes_back_leaves_one_print() -> None:
    picture = make_walk(4, turn=0.0)
    twice = replace(picture, footprints=(*picture.footprints, *picture.footprints))
    with house_style():
        axes = from_above(twice, SIDES, (0.0, 1.5, -0.5, 0.5), (0.0, 1.0))
    assert sum(not patch.get_fill() for patch in axes.patches) == 4


def test_an_outline_has_the_sole_s_place_size_and_heading() -> None:
    one = Footprint(foot="left_foot", place=(3.0, -2.0), yaw=0.7, size=(0.24, 0.1), time=0.0)
    points = np.asarray(_sole(one).vertices) - one.place
    ahead, left = points @ [np.cos(0.7), np.sin(0.7)], points @ [-np.sin(0.7), np.cos(0.7)]
    assert (ahead.min(), ahead.max()) == pytest.approx((-0.12, 0.12))
    assert (left.min(), left.max()) == pytest.approx((-0.05, 0.05))


def test_the_view_turns_with_the_robot_and_keeps_lengths() -> None:
    pose = make_walk().poses[2]
    view = seen_from_the_side(pose)
    np.testing.assert_allclose(
        np.linalg.norm(view[:, 1] - view[:, 0], axis=-1),
        np.linalg.norm(pose.segments[:, 1] - pose.segments[:, 0], axis=-1),
    )
    turn = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])  # a quarter to the left
    moved = Pose(
        time=pose.time,
        segments=(pose.segments - [*pose.place, 0]) @ turn + [5.0, 6.0, 0],
        place=(5.0, 6.0),
        yaw=pose.yaw + np.pi / 2,
    )
    np.testing.assert_allclose(seen_from_the_side(moved), view, atol=1e-12)


def test_the_robot_faces_to_the_right_and_its_right_side_is_near() -> None:
    ahead_and_right = np.array([[[0.0, 0, 0], [1, 0, 0]], [[0, 0, 0], [0, -1, 0]]])
    view = seen_from_the_side(Pose(time=0.0, segments=ahead_and_right, place=(0.0, 0.0), yaw=0.0))
    np.testing.assert_allclose(view[0, 1], [np.cos(SEEN_FROM), 0, -np.sin(SEEN_FROM)])
    assert view[1, 1, 2] < -0.9  # nearer than the root


def test_poses_stand_apart_on_one_ground() -> None:
    picture = make_walk()
    with house_style():
        axes = strip(picture, side_colours(list(picture.segment_names)))
        reaches = [np.array(group.get_segments()) for group in axes.collections]  # type: ignore[attr-defined]
    assert len(reaches) == len(picture.poses)
    for one, next_one in pairwise(reaches):
        assert one[..., 0].max() < next_one[..., 0].min()
        assert one[..., 1].min() == pytest.approx(next_one[..., 1].min())
    assert [label.get_text() for label in axes.get_xticklabels()] == [f"{pose.time:.2f}" for pose in picture.poses]


def test_pictures_stand_where_the_sticks_would() -> None:
    picture = make_walk()
    pixels = np.full((40, 20, 4), 200, dtype=np.uint8)
    seen = Picture(pixels=pixels, left=-0.3, right=0.4, bottom=-0.02, top=1.7)
    shown = replace(picture, poses=tuple(replace(pose, picture=seen) for pose in picture.poses))
    with house_style():
        axes = strip(shown, side_colours(list(picture.segment_names)))
        drawing = inline_svg(axes, "poses", "w")
    assert not axes.collections
    extents = np.array([image.get_extent() for image in axes.images])
    np.testing.assert_allclose(extents[:, 1] - extents[:, 0], 0.7)
    assert (extents[1:, 0] > extents[:-1, 1]).all()
    np.testing.assert_allclose(extents[:, 2:], [[-0.02, 1.7]] * len(picture.poses))
    placed = re.findall(r'<image .*?width="(\d+)" height="(\d+)" transform="matrix\(([^)]*)\)"', drawing)
    assert len(placed) == len(picture.poses)
    (x0, y0), (x1, y1) = axes.transData.transform([(0, 0), (0.7, 1.72)])
    for width, height, matrix in placed:
        a, _, _, d, _, _ = map(float, matrix.split())
        assert int(width) * a == pytest.approx(x1 - x0, abs=0.01)  # in the SVG, a unit is a pixel of the figure
        assert int(height) * abs(d) == pytest.approx(y1 - y0, abs=0.01)


def test_a_long_walk_has_a_close_up() -> None:
    near, far = walk_section(make_walk(6)), walk_section(make_walk(40))
    assert near.body.count("<figure>") == 2
    assert far.body.count("<figure>") == 3


def test_names_without_sides_are_ink() -> None:
    assert side_colours(["FL_foot", "FR_foot", "waist"]) == {"FL_foot": "data", "FR_foot": "right", "waist": "ink"}

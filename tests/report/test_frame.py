"""The frame of a figure is where matplotlib would draw it, and no figure shows what was drawn before it."""

import io
import itertools
import re
from collections.abc import Callable

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, NullLocator
from tests.report.conftest import make_walk

from stribeck.friction import get_law
from stribeck.report.figure import house_style, inline_svg, new_axes
from stribeck.report.joint_data import joint_data
from stribeck.report.joint_figures import friction_over_time, friction_over_velocity, velocity_coverage
from stribeck.report.timeline import _strips
from stribeck.result import Result
from stribeck_simulation.pictures.section import side_colours
from stribeck_simulation.pictures.walk_figures import from_above, strip

TEXT = re.compile(r"<text ([^>]*)>([^<]*)</text>")
PLACE = re.compile(r'\b([xy])="([-\d.]+)"')
GRID_LINES = re.compile(r'<path d="([^"]*)"[^>]*var\(--grid\)')
MOVE = re.compile(r"M ?([-\d.]+) ([-\d.]+)")

Draw = Callable[[], Axes]


def line(x: tuple[float, float], y: tuple[float, float], scale: str = "linear") -> Draw:
    def draw() -> Axes:
        axes = new_axes("velocity [rad/s]", "friction [N m]")
        axes.plot(np.linspace(*x, 7), np.linspace(*y, 7))
        if scale == "log":
            axes.set_yscale("log")
            axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axes.yaxis.set_minor_locator(NullLocator())
        return axes

    return draw


LINES = {
    "usual": line((-0.6, 0.7), (-1.2, 2.5)),
    "tall": line((0.0, 12.0), (-12_000.0, 31_000.0)),
    "logarithmic": line((-3.0, 5.0), (2e-3, 70.0), "log"),
    "tiny": line((-3e-7, 4e-7), (1e-8, 8e-8)),
    "far away": line((1.7e9, 1.7e9 + 120.0), (1000.001, 1000.009)),
}


def texts(svg: str) -> dict[str, list[tuple[float, float]]]:
    """Return where each text stands."""
    found: dict[str, list[tuple[float, float]]] = {}
    for attributes, text in TEXT.findall(svg):
        place = dict(PLACE.findall(attributes))
        found.setdefault(text, []).append((float(place["x"]), float(place["y"])))
    return found


def drawn_by_matplotlib(axes: Axes) -> str:
    """Return the same figure with ticks and labels by matplotlib, without marks at its ticks."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_visible(True)
        axis.set_tick_params(length=3.5, color="none", pad=4.0, grid_color="#abcdef")
        axis.labelpad = 2.0
    axes.set_axisbelow(True)
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg")
    return buffer.getvalue()


@pytest.mark.parametrize("name", LINES)
def test_numbers_labels_and_grid_are_where_matplotlib_draws_them(name: str) -> None:
    with house_style():
        axes = LINES[name]()
        ours = str(inline_svg(axes, "figure", "f"))
        theirs = drawn_by_matplotlib(axes)
    assert texts(ours).keys() == texts(theirs).keys()
    for text, places in texts(theirs).items():
        np.testing.assert_allclose(sorted(texts(ours)[text]), sorted(places), atol=0.02, err_msg=text)
    found = GRID_LINES.search(ours)
    assert found is not None
    their_lines = re.findall(r'<path d="(M[^"]*)"[^>]*#abcdef', theirs)
    starts = [[float(value) for value in MOVE.findall(path)[0]] for path in their_lines]
    np.testing.assert_allclose(np.array(MOVE.findall(found[1]), dtype=float), starts, atol=0.01)


def test_a_figure_shows_nothing_of_those_before_it(result: Result) -> None:
    name, walk = "left_hip_yaw", make_walk(6)
    evidence = result.evidence
    assert evidence is not None
    assert evidence.close_up is not None
    joint, law = result.joints[name], get_law("stribeck")
    data, close_up = (joint_data(name, joint, evidence, law, part) for part in (evidence.samples, evidence.close_up))
    kinds: dict[str, Draw] = {
        **LINES,
        "velocity": lambda: friction_over_velocity(data),
        "time": lambda: friction_over_time(close_up),
        "coverage": lambda: velocity_coverage(data, 0.1),
        "phases": lambda: _strips(evidence.phases, ["left_foot", "right_foot"], 0.0, 12.0),
        "above": lambda: from_above(walk, side_colours(["left_foot", "right_foot"]), (0.0, 2.0, -0.4, 0.4), (0.0, 2.0)),
        "strip": lambda: strip(walk, side_colours(list(walk.segment_names))),
    }

    def drawn(kind: str) -> str:
        return inline_svg(kinds[kind](), kind, "f")

    alone = {}
    for kind in kinds:
        with house_style():
            alone[kind] = drawn(kind)
    for before, after in itertools.permutations(kinds, 2):
        with house_style():
            assert drawn(before) == alone[before]
            assert drawn(after) == alone[after], f"{after} after {before}"


def test_two_figures_may_be_drawn_side_by_side() -> None:
    with house_style():
        inline_svg(LINES["usual"](), "an earlier one", "f")
        first, second = LINES["usual"](), LINES["tall"]()
        assert first is not second
        drawings = [inline_svg(axes, "figure", "f") for axes in (first, second, second)]
        third, fourth = LINES["usual"](), LINES["tall"]()
    assert third is not fourth
    assert drawings[0] != drawings[1] == drawings[2]

"""The demonstration leaves what a user would have, and finds the friction that was put in."""

import re
from contextlib import redirect_stdout
from functools import partial
from io import StringIO
from pathlib import Path
from typing import NamedTuple

import pytest
from tests.cli.test_cli import run

from stribeck import Robot, identify
from stribeck.core.result import read_result
from stribeck.paper.figures.of_log import paper_sections
from stribeck.simulation import demo
from stribeck.simulation.files import read_truth

SHORT = (Path(__file__).parent / "short.toml").read_text()


class Made(NamedTuple):
    """Where the demonstration wrote to, and what it printed."""

    folder: Path
    printed: str


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    """The demonstration with a shorter walk."""
    place = tmp_path_factory.mktemp("demo")
    (place / "short.toml").write_text(SHORT)
    printed = StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(printed):
        patch.setattr(demo, "make_demo", partial(demo.make_demo, scenario=place / "short.toml"))
        assert run("demo", "-o", place / "out") == 0
    return Made(place / "out", printed.getvalue())


def test_its_folder_has_all_that_identify_needs(made: Made) -> None:
    names = sorted(path.name for path in made.folder.iterdir())
    assert names == sorted([*demo.FILES, "result.json", "report.html", "friction_torque.parquet"])
    assert (made.folder / "scenario.toml").read_text() == SHORT
    shown = read_result(made.folder / "result.json")
    assert shown.log.path == str(made.folder / "log.npz")
    page = (made.folder / "report.html").read_text()
    assert "truth" in page
    assert page.count("<circle") == len(shown.joints)


@pytest.mark.long
def test_its_result_is_what_identify_finds(made: Made) -> None:
    again = identify(made.folder / "log.npz", Robot.from_file(made.folder / "robot.toml"))
    assert again.to_json() == (made.folder / "result.json").read_text()


def test_the_friction_is_found_and_printed_beside_the_truth(made: Made) -> None:
    result, truth = read_result(made.folder / "result.json"), read_truth(made.folder / "log.npz").parameters
    for joint, true in truth.items():
        found = result.joints[joint].parameters
        assert found["offset"].value == pytest.approx(true["offset"], rel=0.05)
        low, high = found["coulomb"].interval_95
        assert abs(found["coulomb"].value - true["coulomb"]) < high - low  # twice as far as 19 in 20 go
    for knee in ("left_knee", "right_knee"):  # the fastest of the quick, low steps
        assert result.joints[knee].parameters["coulomb"].value == pytest.approx(truth[knee]["coulomb"], rel=0.1)
    rows = made.printed.partition("left_knee")[2]
    for name, value in truth["left_knee"].items():
        estimate = result.joints["left_knee"].parameters[name]
        assert re.search(rf"│ {name}\b.*│ *{value:.4g} *│ *{estimate.value:.4g} *│.*│ *{estimate.verdict} *│", rows)
    assert re.search(r"\n24 parameters: \d+ identified; \d+ of the 95 % intervals contain the truth", made.printed)
    assert made.printed.endswith(f"{made.folder / 'report.html'}\n")


def test_the_figures_of_the_paper_have_its_shapes(made: Made) -> None:
    """Fig. 6.1, 7.1 and 7.3 to 7.6, for the knees, which take most of the power as in the paper."""
    log, robot, printed = made.folder / "log.npz", made.folder / "robot.toml", StringIO()
    with redirect_stdout(printed):
        assert run("paper", log, "-r", robot, "-o", made.folder / "paper.html") == 0
    machine = Robot.from_file(robot)
    charts = {part.key: part.charts[0] for part in paper_sections(log, machine, machine.settings)}
    assert all(chart.samples.joint_names[chart.column].endswith("knee") for chart in charts.values())
    assert printed.getvalue().count("_knee: ") == len(charts) == 5
    numbers = {key: chart.numbers for key, chart in charts.items()}
    taken, measured = numbers["acceleration"]
    assert taken > 0.5 * measured
    equal, favored = numbers["double-support"]
    assert favored > 1.1 * equal  # the weights decide
    assert numbers["spectrum"][0] > 3  # the estimate is less noisy than the measured acceleration
    power, negative = numbers["power"]
    assert power > 0
    assert negative < 20
    by_masses, by_moments, *splits = numbers["inertias"]
    assert by_masses > 3 * by_moments
    assert min(splits) > 0.02

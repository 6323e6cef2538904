"""The studies of the paper run, and the pages say what they found."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from studies import kept_walks
from studies.paper import figures, pages, walks
from studies.paper.statements import read_statements
from studies.paper.study import NUMBERS, find_studies, plain

from stribeck_simulation.run import run_scenario

STUDIES = find_studies()


@pytest.fixture(scope="module", params=STUDIES)
def quick(request: pytest.FixtureRequest):
    """A study by name, and what its quick variant gives."""
    return request.param, STUDIES[request.param].run(True)


def test_a_quick_study_has_the_numbers_of_the_whole_one(quick) -> None:
    name, study = quick
    kept = json.loads((NUMBERS / f"{name}.json").read_text())
    assert _keys(plain(study.numbers)) == _keys(kept)
    assert STUDIES[name].texts(plain(study.numbers)).keys() == STUDIES[name].texts(kept).keys()


def _keys(value):
    """Return the shape of numbers: the keys of mappings, all the way down."""
    return {key: _keys(each) for key, each in value.items()} if isinstance(value, dict) else None


def test_figures_are_drawn_in_both_themes(quick, tmp_path: Path) -> None:
    _, study = quick
    for name, draw in study.figures.items():
        figures.save(name, draw, tmp_path)
        for theme in ("light", "dark"):
            file = f"{name}-{theme}.svg"
            assert (tmp_path / file).exists()
            assert (figures.FOLDER / file).exists()


def test_a_figure_is_the_same_every_time(tmp_path: Path) -> None:
    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        figures.plot_runs(axes, np.arange(9.0), np.arange(9.0), np.arange(9.0) ** 2, "C0", label="a")
        figures.shade(axes, np.arange(9.0), np.arange(9) > 4)
        axes.legend()

    for folder in ("once", "again"):
        figures.save("figure", draw, tmp_path / folder)
    for theme in ("light", "dark"):
        once, again = ((tmp_path / folder / f"figure-{theme}.svg").read_bytes() for folder in ("once", "again"))
        assert once == again


@pytest.mark.parametrize("page", pages.pages(), ids=lambda path: path.stem)
def test_pages_quote_the_numbers(page: Path) -> None:
    text = page.read_text()
    assert text == pages.filled(text, pages.all_texts())


def test_every_figure_and_every_text_is_on_a_page() -> None:
    text = "\n".join(page.read_text() for page in pages.pages()) + (NUMBERS.parent / "statements.toml").read_text()
    shown = set(re.findall(r"assets/paper/([\w-]+)-light\.svg", text))
    assert shown == {path.stem.removesuffix("-light") for path in figures.FOLDER.glob("*-light.svg")}
    quoted = set(re.findall(r"<!-- (\w+\.[\w-]+) -->|\{(\w+\.[\w-]+)\}", text))
    assert {one or other for one, other in quoted} == set(pages.all_texts())


def test_statements_have_an_outcome_where_their_study_is_there() -> None:
    for statement in read_statements():
        assert bool(statement.finding) == (statement.outcome != "open"), statement.claim
        if statement.outcome != "open":
            assert statement.study in STUDIES


def test_a_kept_walk_is_the_walk_that_was_simulated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = walks.SCENARIOS["right-knee-ideal"]
    still = scenario.model_copy(update={"walk": []})
    monkeypatch.setattr(kept_walks, "FOLDER", tmp_path)
    monkeypatch.setitem(walks.SCENARIOS, "right-knee-ideal", still)
    first = walks.get_walk("right-knee-ideal")
    (kept,) = (path for path in tmp_path.iterdir() if "truth" not in path.name)
    changed = kept.stat().st_mtime_ns
    again = walks.get_walk("right-knee-ideal")
    assert kept.stat().st_mtime_ns == changed
    expected = run_scenario(still)
    for walk in (first, again):
        np.testing.assert_array_equal(walk.log.torque, expected.log.torque)
        np.testing.assert_array_equal(walk.truth.friction_torque, expected.truth.friction_torque)
        assert walk.truth.parameters == expected.truth.parameters
    monkeypatch.setitem(walks.SCENARIOS, "right-knee-ideal", still.model_copy(update={"seed": 1}))
    walks.get_walk("right-knee-ideal")
    assert not kept.exists()

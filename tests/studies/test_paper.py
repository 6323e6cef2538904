"""The studies of the paper run (`make paper`), their page contains their numbers, and their tools are correct."""

import json
import pkgutil
import re
from pathlib import Path

import numpy as np
import pytest
from studies import kept_walks
from studies.paper import figures, pages, walks
from studies.paper.explicit_steps import STEP, chatter, coast, least_inertia
from studies.paper.identified import JOINTS, PARAMETERS, mean_and_worst, read_paper
from studies.paper.laws import SLOPE, curve
from studies.paper.study import NUMBERS, ROOT, find_studies, plain

from stribeck.app.cli.app import app
from stribeck.simulation.run import run_scenario
from stribeck.simulation.scenario import by_joint

STUDIES = find_studies()
DURATION = 0.6
PAPER = read_paper()
KEPT = json.loads((NUMBERS / "tables.json").read_text())["found"]


@pytest.mark.long
@pytest.mark.parametrize("name", STUDIES)
def test_a_quick_study_has_the_numbers_of_the_whole_one(name: str, tmp_path: Path) -> None:
    study = STUDIES[name]
    numbers, kept = plain(study.run(True)), json.loads((NUMBERS / f"{name}.json").read_text())
    assert keys(numbers) == keys(kept)
    assert study.texts(numbers).keys() == study.texts(kept).keys()
    for figure, draw in getattr(study, "drawings", lambda _: {})(numbers).items():
        figures.save(figure, draw, tmp_path)
        for theme in ("light", "dark"):
            assert (figures.FOLDER / f"{figure}-{theme}.svg").exists()


def keys(value):
    """The shape of numbers: the keys of mappings, all the way down."""
    return {key: keys(each) for key, each in value.items()} if isinstance(value, dict) else None


def test_the_page_has_the_statements_and_docs_show_all_figures() -> None:
    page, texts = pages.PAGE.read_text(), pages.all_texts()
    assert page == pages.filled(page, texts)
    assert set(re.findall(r"\{(\w+\.[\w-]+)\}", pages.STATEMENTS.read_text())) <= set(texts)
    everything = "".join(path.read_text() for path in (ROOT / "docs").rglob("*.md"))
    shown = set(re.findall(r"assets/paper/([\w-]+)-light\.svg", everything))
    assert shown == {path.stem.removesuffix("-light") for path in figures.FOLDER.glob("*-light.svg")}
    for statement in pages.read_statements():
        assert bool(statement.get("finding")) == (statement["outcome"] != "open"), statement["claim"]
        assert statement["outcome"] in {"confirmed", "sharpened", "contradicted", "open"}
        assert statement["outcome"] == "open" or statement["study"] in STUDIES


def test_the_map_has_every_equation_figure_and_table_and_its_names_exist() -> None:
    table = pages.PAGE.read_text().partition("## Where to find each")[2].partition("\n## ")[0]
    rows = [line.split(" | ") for line in table.splitlines() if line.startswith("| ")][1:]
    items = {item.strip("| ") for place, *_ in rows for item in place.split(",")}
    equations = {3: 5, 4: 5, 5: 13, 6: 4, 7: 9}
    expected = {f"({chapter}.{k})" for chapter, last in equations.items() for k in range(1, last + 1)}
    expected |= {
        f"Fig. {place}" for place in ("4.1", *(f"6.{k}" for k in range(1, 6)), *(f"7.{k}" for k in range(1, 9)))
    }
    assert items == expected | {"Table 4.1", "Table 6.1", "Table 6.2"}
    for name in re.findall(r"`([^`]+)`", "".join(here for *_, here in rows)):
        if name.startswith("stribeck "):
            assert name.split()[1] in {command.name or command.callback.__name__ for command in app.registered_commands}
        else:
            assert pkgutil.resolve_name(name) is not None


def test_a_kept_walk_is_the_walk_that_was_simulated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    still = walks.SCENARIOS["right-knee-ideal"].model_copy(update={"walk": []})
    monkeypatch.setattr(kept_walks, "FOLDER", tmp_path)
    monkeypatch.setitem(walks.SCENARIOS, "right-knee-ideal", still)
    first = walks.get_walk("right-knee-ideal")
    (kept,) = (path for path in tmp_path.iterdir() if "truth" not in path.name)
    changed = kept.stat().st_mtime_ns
    again, expected = walks.get_walk("right-knee-ideal"), run_scenario(still)
    assert kept.stat().st_mtime_ns == changed
    for walk in (first, again):
        np.testing.assert_array_equal(walk.log.torque, expected.log.torque)
        np.testing.assert_array_equal(walk.truth.friction_torque, expected.truth.friction_torque)
        assert walk.truth.parameters == expected.truth.parameters
    monkeypatch.setitem(walks.SCENARIOS, "right-knee-ideal", still.model_copy(update={"seed": 1}))
    walks.get_walk("right-knee-ideal")
    assert not kept.exists()


@pytest.mark.parametrize("walk", PAPER)
def test_the_papers_errors_follow_from_what_it_found(walk: str) -> None:
    friction = walks.SCENARIOS[walk].friction
    targets = by_joint(friction.joints, friction.common, JOINTS, "")
    assert tuple(PAPER[walk]) == JOINTS
    for joint, row in PAPER[walk].items():
        target = np.array([targets[joint][name] for name in PARAMETERS])
        np.testing.assert_allclose(100 * np.abs(np.array(row["found"]) / target - 1), row["error"], atol=0.03)


def test_errors_are_at_most_half_of_the_papers_and_what_it_cannot_find_is_weak() -> None:
    paper, found = (mean_and_worst(each["straight-and-sideways"]) for each in (PAPER, KEPT))
    for key in ("mean", "worst"):
        assert np.all(found[key] <= paper[key] / 2), key
    assert {row["verdict"] for row in KEPT["straight-and-sideways"].values()} == {"identified"}
    for joint, row in PAPER["straight"].items():
        assert np.all(np.array(KEPT["straight"][joint]["weak"])[np.array(row["error"]) >= 100] != 0)


def test_explicit_steps_chatter_below_the_least_inertia_and_implicit_ones_only_lose_speed() -> None:
    for slope in (20.0, 40.0, 1000.0):
        least = least_inertia(slope)
        assert chatter(coast(1.05 * least, slope, implicit=False, duration=DURATION)) == 0
        assert chatter(coast(0.95 * least, slope, implicit=False, duration=DURATION)) > 0
    for slope in (10.0, 1000.0, np.inf):
        assert np.all(np.diff(np.abs(coast(0.01, slope, implicit=True, duration=DURATION))) <= 0)
    inertia = 0.9 * least_inertia(SLOPE)
    found = chatter(coast(inertia, SLOPE, implicit=False, duration=DURATION))
    assert 2 * found == pytest.approx(STEP / inertia * curve("stribeck", np.array([found]))[0], rel=1e-6)

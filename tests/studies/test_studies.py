"""The studies: tables in the docs are those of their saved runs, and what these runs show."""

import importlib
import sys
from contextlib import suppress
from dataclasses import replace
from datetime import date
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from studies import robots, summary
from studies.__main__ import PAGES, dated, path_of, state
from studies.__main__ import STUDIES as COSTS
from studies.accuracy_cases import NAMES
from studies.command import ROOT, SOURCE, command, read, saved
from studies.harder_cases import Harder, as_seen
from studies.mutations import MUTATIONS, TESTS, Mutation

from stribeck import Robot, read_result
from stribeck.core.friction import get_law
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.robots import MODELS
from stribeck.simulation.run import Simulated

STUDIES = [name for name in COSTS if path_of(name).exists()]
VALUES = [0.3, 1.2, 0.3, 0.15, 0.2, 50.0]


def test_the_page_of_real_robots_shows_the_committed_results() -> None:
    assert robots.page() == robots.PAGE.read_text(encoding="utf-8")
    for path in robots.RESULTS.glob("*.json"):
        result = read_result(path)
        assert path.stem in robots.SOURCES
        for joint in result.joints.values():
            for point in joint.curve if "coulomb" in joint.parameters else ():
                ways = joint.friction([point.velocity, -point.velocity])
                assert (ways[0] - ways[1]) / 2 == pytest.approx(point.value, rel=1e-3, abs=1e-4)


@pytest.mark.parametrize("name", STUDIES)
def test_every_study_prints_its_tables_and_pages_show_these(name: str) -> None:
    texts = [page.read_text(encoding="utf-8") for page in PAGES]
    path, study = path_of(name), read(path_of(name))
    assert {"version", "digest", "runs"} < study.keys()
    assert path.stat().st_size < 500_000
    assert all(dated(text, name, date.fromisoformat(study["date"]).isoformat()) == text for text in texts)
    tables = importlib.import_module(f"studies.{name}").tables(study["rows"])
    assert tables
    for table in tables:
        head, _, rows = table.split("\n", 2)
        assert rows
        assert all(table in text for text in texts if f"\n{head}\n" in text), head
    assert any(f"studies.{name}" in text for text in texts)


@pytest.mark.long
def test_no_study_is_stale() -> None:
    assert not [f"{name}: {state(name)}" for name in COSTS if state(name) != "current"]


def test_a_study_continues_after_an_interruption_and_starts_anew_if_numbers_change(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, done = tmp_path / "study.json", list[int]()
    monkeypatch.setattr(sys, "argv", ["study", "--save", str(file)])
    for digest, last in (("a", 1), ("a", 3), ("b", 3)):

        def run(k: int, last: int = last) -> dict[str, float]:
            done.append(k)
            return {"third": 1 / 3} if k < last else sys.exit()

        with suppress(SystemExit):
            command("", [{"k": k} for k in range(3)], run, lambda _: [], partial(str, digest))
    assert done == [0, 1, 1, 2, 0, 1, 2]
    assert read(file)["rows"][2] == {"k": 2, "third": 0.3333}


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: f"{mutation.file}: {mutation.old}")
def test_every_wrong_line_still_replaces_one_place(mutation: Mutation) -> None:
    assert (SOURCE / mutation.file).read_text().count(mutation.old) == 1
    assert mutation.old != mutation.new
    assert mutation.tests
    assert "test_golden.py" not in mutation.tests
    assert all((TESTS / name).exists() for name in mutation.tests)


def test_the_page_on_accuracy_summarizes_the_saved_studies() -> None:
    page = "".join(path.read_text(encoding="utf-8") for path in (summary.PAGE, ROOT / "studies/accuracy.md"))
    for table in summary.tables():
        assert table in page, table
    for name, (data, label) in summary.dots().items():
        assert all(values for row in data.values() for values in row.values())
        summary.draw(Figure(), data, label)
        assert f"assets/{name}-light.svg" in page


def test_intervals_cover_the_truth_under_errors_that_no_setting_describes() -> None:
    count, inside, wrong = np.sum([row["points"] for row in saved("coverage")], axis=0)
    assert inside > 0.93 * count
    assert not wrong


@pytest.fixture(scope="module")
def walk() -> Simulated:
    """An arm that moves, with feet that stand now and then and a level base."""
    robot, law = Robot.from_file(MODELS / "arm.toml"), get_law("stribeck")
    truth = {joint: dict(zip(NAMES, VALUES, strict=True)) for joint in robot.joint_names}
    log, known = exact_log(robot, law, truth, duration=16.0, seed=1)
    level = np.tile([0.0, 0.0, 0.0, 1.0], (len(log.time), 1))
    contact = (np.arange(len(log.time)) // 500 % 2 == 0)[:, None]
    return Simulated(robot, replace(log, base_orientation=level, foot_names=("foot",), contact=contact), known)


def seen(walk: Simulated, **wrong: float) -> tuple[Simulated, Robot, Simulated]:
    """The walk with its friction, the robot that is believed, and the walk as it is logged."""
    (truth, _), robot, (log, _) = as_seen([walk, walk], replace(Harder(), pushed=True, **wrong), 0)  # type: ignore[arg-type]
    return truth, robot, replace(walk, log=log)

"""The study of constants: values are changed where they are used, and come back; the page shows what was measured."""

import json
from pathlib import Path

import numpy as np
from studies.sensitivity import cell, changed, compared, constants, observed, scaled, table

from stribeck import Robot, Settings, identify
from stribeck.equations import window
from stribeck.friction import get_law
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.robots.biped import MODELS

ROOT = Path(__file__).parents[2]


def test_values_are_scaled_by_their_kind() -> None:
    assert scaled(5, 0.5) == 2
    assert scaled(1, 0.5) == 1
    assert scaled((0.1, 3.0), 2.0) == (0.2, 6.0)
    np.testing.assert_array_equal(scaled(np.array([1.0, 2.0]), 2.0), [2.0, 4.0])


def test_every_constant_has_a_unit() -> None:
    found = constants()
    assert found["WINDOW_SPACING"] == (vars(window)["WINDOW_SPACING"], "s")
    assert found["FIRST_WRENCH_STD"][1] == "N, N m"
    assert not [name for name, (_, unit) in found.items() if not unit]


def test_a_constant_is_changed_for_a_while() -> None:
    arm, law = Robot.from_file(MODELS / "arm.toml"), get_law("coulomb-viscous")
    truth = {joint: {"viscous": 0.3, "coulomb": 1.2, "offset": 0.1} for joint in arm.joint_names}
    log, _ = exact_log(arm, law, truth, duration=12.0)
    settings = Settings(method="whole-log", law=law.name, corrections="none")
    spacing = vars(window)["WINDOW_SPACING"]
    before, names = observed(lambda: identify(log, arm, settings))
    assert compared(before, before)["shift"] == 0
    with changed("WINDOW_SPACING", 2 * spacing):
        assert vars(window)["WINDOW_SPACING"] == 2 * spacing
        found = compared(before, identify(log, arm, settings))
    assert vars(window)["WINDOW_SPACING"] == spacing
    assert found["shift"] > 0
    assert found["of"].split()[0] in arm.joint_names
    assert "WINDOW_SPACING" in names
    assert "LEAST_GAIN" not in names  # of the law auto


def test_a_cell_says_the_largest_change_of_all_logs() -> None:
    still = {"shift": 0.001, "of": "knee coulomb", "width": 1.0, "chi^2": 1.0, "verdicts": 0, "terms": 0}
    moved = still | {"shift": 1.23, "width": 0.7, "chi^2": 0.5, "verdicts": 2}
    assert cell({"constant": ["1", "s"]}) == "not reached"
    assert cell({"constant": ["1", "s"], "a": still}) == "nothing"
    assert cell({"a": still, "b": moved}) == "1.2 s.e. (b), s.e. x0.70, chi^2 x0.50, verdicts of 2"
    assert cell({"a": still, "b": {"error": "LinAlgError"}}) == "LinAlgError (b)"


def test_the_page_shows_what_was_measured() -> None:
    page = (ROOT / "docs/constants.md").read_text(encoding="utf-8").splitlines()
    rows = table(json.loads((ROOT / "studies/sensitivity.json").read_text(encoding="utf-8")))
    assert [row for row in rows if row not in page] == []

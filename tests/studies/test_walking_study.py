"""The walking study: no walk of the saved one fell, the docs have its figures, and short runs agree with it."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from studies.walking import run, table
from studies.walking_cases import CASES

from stribeck_simulation.walking.footsteps import Steps
from stribeck_simulation.walking.simulate import Push

ROOT = Path(__file__).parents[2]
SAVED = json.loads((ROOT / "studies" / "walking.json").read_text(encoding="utf-8"))["cases"]
COARSE = 0.0005  # [s], twice the study's physics step


def test_every_case_was_run_with_every_seed_and_none_fell() -> None:
    assert list(SAVED) == list(CASES)
    for label, case in CASES.items():
        runs = SAVED[label]
        assert sorted(runs) == sorted(str(seed) for seed in case.seeds)
        for found in runs.values():
            assert found["fell"] == ""
            assert found["steps"] == sum(steps.count for steps in case.walk)
            assert found["slip"] < 3.0


def test_the_docs_have_the_table() -> None:
    page = (ROOT / "docs" / "simulation.md").read_text(encoding="utf-8")
    for row in table(SAVED):
        assert row in page


@pytest.mark.parametrize("label", ["`harsh` sensors and masses 5 % off", "G1: straight 0.2 m, sideways 0.1 m, turning"])
def test_short_runs_agree(label: str) -> None:
    case = CASES[label]
    found, saved = run(replace(case, walk=[replace(case.walk[0], count=3)]), 0, COARSE), SAVED[label]["0"]
    assert (found["fell"], found["steps"]) == ("", 3)
    assert 0.0 < found["tilt"] < 1.5 * saved["tilt"]
    assert 0.0 < found["error"] < 1.5 * saved["error"]
    assert found["slip"] < 3.0


def test_a_fall_is_told() -> None:
    case = replace(CASES["the same, 0.8 s"], walk=[Steps(count=0)], pushes=[Push(0.1, 0.1, (0.0, 3000.0, 0.0))])
    assert "fell" in run(case, 0, COARSE)["fell"]

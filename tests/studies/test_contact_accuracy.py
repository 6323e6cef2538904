"""A clean walk on real contacts gives friction back: the study's full walk, and a short one that is simulated here."""

import json
from pathlib import Path

import pytest
from studies.contact_accuracy import CASES, SCENARIO, Row, accuracy, leg_joints, summary

from stribeck_simulation.scenario import read_scenario

ROOT = Path(__file__).parents[2]
DOCUMENT = json.loads((ROOT / "studies" / "contact_accuracy.json").read_text())
STUDY = {case: {joint: Row(**row) for joint, row in rows.items()} for case, rows in DOCUMENT.items()}


@pytest.mark.parametrize("case", CASES)
def test_forty_steps_give_the_friction_of_the_legs_back(case: str) -> None:
    legs = [STUDY[case][joint] for joint in leg_joints(STUDY[case])]
    assert len(legs) == 12
    assert all(row.verdict == "identified" for row in legs)
    coulomb = [abs(row.coulomb) for row in legs]
    assert sum(coulomb) / 12 <= 0.003
    assert max(coulomb) <= 0.008
    assert max(abs(row.viscous) for row in legs) <= 0.01
    assert max(abs(row.offset) for row in legs) <= 0.005


def upper_body() -> dict[str, Row]:
    rows = STUDY[CASES[1]]
    return {joint: row for joint, row in rows.items() if joint not in leg_joints(rows)}


def test_arms_and_waist_get_the_verdict_that_their_numbers_deserve() -> None:
    upper = upper_body()
    assert len(upper) == 13
    assert all(abs(row.coulomb) < 0.01 for row in upper.values() if row.verdict == "identified")
    still = [joint for joint, row in upper.items() if row.verdict == "not excited"]
    assert {joint.split("_", 1)[1] for joint in still} >= {"wrist_1", "wrist_2", "shoulder_3"}


def test_the_page_shows_the_study() -> None:
    page = (ROOT / "docs" / "simulation.md").read_text()
    for case in CASES:
        assert f"| {case} | {' | '.join(summary(STUDY[case]))} |" in page
    for joint, row in upper_body().items():
        error = "–" if row.coulomb is None else f"{100 * row.coulomb:+.1f} %"
        assert f"| `{joint}` | {row.verdict} | {error} |" in page


def test_a_short_walk_gives_the_friction_of_the_legs_back() -> None:
    scenario = read_scenario(SCENARIO)
    walk = [steps.model_copy(update={"count": count}) for steps, count in zip(scenario.walk, (8, 4, 4), strict=True)]
    rows = accuracy(scenario.model_copy(update={"walk": walk, "physics_step": 0.0005}))
    assert list(rows) == leg_joints(rows)
    mean, coulomb, viscous, offset = (float(figure.split()[0]) for figure in summary(rows))
    assert mean <= 0.3  # %
    assert coulomb <= 0.8
    assert viscous <= 0.02
    assert offset <= 0.003

"""Tables 6.1 and 6.2: the paper's are copied rightly, and ours are at least twice as good."""

import json

import numpy as np
import pytest
from studies.paper.identified import JOINTS, PARAMETERS, mean_and_worst, read_paper
from studies.paper.study import NUMBERS
from studies.paper.walks import SCENARIOS

from stribeck_simulation.scenario import by_joint

KEPT = json.loads((NUMBERS / "tables.json").read_text())
PAPER = read_paper()


@pytest.mark.parametrize("walk", PAPER)
def test_the_papers_errors_follow_from_what_it_found(walk: str) -> None:
    friction = SCENARIOS[walk].friction
    targets = by_joint(friction.joints, friction.common, JOINTS, "")
    assert tuple(PAPER[walk]) == JOINTS
    for joint, row in PAPER[walk].items():
        target = np.array([targets[joint][name] for name in PARAMETERS])
        np.testing.assert_allclose(100 * np.abs(np.array(row["found"]) / target - 1), row["error"], atol=0.03)


def test_mean_and_worst_errors_are_at_most_half_of_the_papers() -> None:
    paper = mean_and_worst(PAPER["straight-and-sideways"])
    found = mean_and_worst(KEPT["found"]["straight-and-sideways"])
    for key in ("mean", "worst"):
        assert np.all(found[key] <= paper[key] / 2), key
    assert {row["verdict"] for row in KEPT["found"]["straight-and-sideways"].values()} == {"identified"}


def test_what_the_paper_cannot_find_walking_straight_is_weak() -> None:
    for joint, row in PAPER["straight"].items():
        found = KEPT["found"]["straight"][joint]
        wrong = np.array(row["error"]) >= 100
        if wrong.any():
            assert np.all(np.array(found["weak"])[wrong] != 0)

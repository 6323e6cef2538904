"""The 95 % intervals cover 95 % of the true values: the saved study says so, and a short run of it agrees."""

import json
from pathlib import Path

import pytest
from studies import log_coverage
from studies.coverage import CASES, TRUTH, coverage

SAVED = Path(__file__).parents[2] / "studies" / "coverage.json"


def test_saved_study_covers_the_truth_in_90_to_99_percent() -> None:
    document = json.loads(SAVED.read_text(encoding="utf-8"))
    assert document["repetitions"] >= 200
    assert set(document["cases"]) == set(CASES)
    for rows in document["cases"].values():
        assert set(rows) == set(TRUTH)
        for row in rows.values():
            assert 0.90 <= row["coverage"] <= 0.99


@pytest.mark.parametrize("label", ["20 steps, good sensors"])
def test_short_study_agrees(label: str) -> None:
    rows = coverage(CASES[label], repetitions=40, seed=11)
    shares = [row["coverage"] for row in rows.values()]
    assert min(shares) >= 0.83  # 95 % less 3.5 standard deviations of 40 draws
    assert 0.90 <= sum(shares) / len(shares) <= 0.995
    for row in rows.values():
        assert abs(row["bias"]) < 0.3 * row["half_width"]


def test_saved_study_of_whole_logs_covers_the_truth_in_90_to_99_percent() -> None:
    document = json.loads((SAVED.parent / "log_coverage.json").read_text(encoding="utf-8"))
    assert document["repetitions"] >= 200
    assert set(document["cases"]) == set(log_coverage.CASES)
    for rows in document["cases"].values():
        for row in rows.values():
            assert 0.90 <= row["coverage"] <= 0.99
            assert row["intervals"] >= 1200


def test_a_short_study_of_whole_logs_agrees() -> None:
    rows = log_coverage.coverage(log_coverage.CASES["arm (UR5)"], repetitions=3)
    shares = [row["coverage"] for row in rows.values()]
    assert 0.86 <= sum(shares) / len(shares) <= 1  # 108 intervals: 95 % less four standard deviations

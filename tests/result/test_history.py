"""Friction over many results: changes, trends, and which of them are significant."""

import json
from dataclasses import replace

import numpy as np
import pytest
from tests.result.test_compare import estimate, joint, result

from stribeck.errors import SettingsError
from stribeck.report.comparison import write_comparison
from stribeck.result import Result
from stribeck.result.compare import holm
from stribeck.result.history import history, history_of_sides


def results(values: list[float], error: float = 0.1, **others: float) -> list[Result]:
    """Return results with a knee whose Coulomb friction has these values, and joints that stay as they are."""
    same = {name: joint(coulomb=estimate(value, error)) for name, value in others.items()}
    return [
        result(f"{k}.npz", law="coulomb-viscous", knee=joint(coulomb=estimate(value, error)), **same)
        for k, value in enumerate(values)
    ]


def test_a_slope_is_that_of_the_line_through_the_values() -> None:
    (row,) = history(results([1.0, 1.5, 2.0, 2.5])).rows
    assert row.slope == pytest.approx(0.5)
    low, high = row.slope_interval_95
    assert high - low == pytest.approx(2 * 1.96 * 0.1 / np.sqrt(5), rel=1e-3)  # sum of (k - mean)^2 is 5
    assert row.drifts
    assert [change and change.percent for change in row.changes] == [None, *map(pytest.approx, (50, 100, 150))]
    assert [bool(change and change.significant) for change in row.changes] == [False, True, True, True]


def test_scatter_beyond_the_errors_widens_the_slope() -> None:
    values = [1.0, 3.0, 1.0, 3.0, 2.0]
    (row,) = history(results(values, error=0.01)).rows
    slope, (low, high) = np.polyfit(range(5), values, 1)[0], row.slope_interval_95
    assert row.slope == pytest.approx(slope)
    assert low < 0 < high
    assert not row.drifts
    assert row.changes[1].significant


def test_a_change_that_comes_and_goes_is_no_drift() -> None:
    (row,) = history(results([1.0, 2.0, 1.0])).rows
    assert [bool(change and change.significant) for change in row.changes] == [False, True, False]
    assert not row.drifts


def test_holm_is_stricter_the_more_tests_there_are() -> None:
    assert holm([0.04]) == [True]
    assert holm([0.04, 0.5]) == [False, False]
    assert holm([0.04, 0.02]) == [True, True]  # 0.02 < 0.05 / 2, then 0.04 < 0.05 / 1
    assert holm([0.5, 0.001, 0.03, 0.012]) == [False, True, False, True]
    many = history(results([1.0, 1.25], hip=1.0, neck=1.0, toe=1.0)).rows
    alone = history(results([1.0, 1.29])).rows
    assert [row.last_change.significant for row in many] == [False] * 4
    assert alone[0].last_change.significant


def test_where_nothing_changes_one_history_in_twenty_has_anything_significant() -> None:
    generator = np.random.default_rng(7)
    alarms = 0
    for _ in range(400):
        found = history(results(list(1 + 0.1 * generator.normal(size=4))))
        alarms += any(row.drifts or any(c and c.significant for c in row.changes) for row in found.rows)
    assert 2 <= alarms <= 30  # Holm's bound is 20; the tests of one parameter depend on each other


def test_what_some_results_lack_is_named_and_left_out() -> None:
    first, second, third = results([1.0, 1.0, 1.0], neck=1.0)
    second = replace(second, joints={"knee": joint(), "hip": joint(coulomb=estimate(1.0))})
    found = history([first, second, third], names=["May", "June", "July"])
    assert [row.joint for row in found.rows] == ["knee", "neck"]
    assert [row.values for row in found.rows] == [[1.0, None, 1.0]] * 2
    assert found.missing == {
        "knee": "not excited in June (it moves too little)",
        "neck": "not in June",
        "hip": "not in May; not in July",
    }
    assert found.rows[0].slope is None
    document = json.loads(found.to_json())
    assert list(document) == ["robot", "law", "names", "rows", "missing", "tests"]
    assert document["names"] == ["May", "June", "July"]


def test_results_of_logs_of_one_name_are_told_apart() -> None:
    a, b, c = (
        replace(one, log=replace(one.log, path=path))
        for one, path in zip(results([1.0, 1.0, 1.0]), ["may/log.npz", "june/log.npz", "june/log.npz"], strict=True)
    )
    assert history([a, b]).names == ["may/log.npz", "june/log.npz"]
    assert history([b, c]).names == ["june/log.npz (1)", "june/log.npz (2)"]
    assert history(results([1.0, 1.0])).names == ["0.npz", "1.npz"]


def test_what_cannot_be_compared_is_refused() -> None:
    one, two = results([1.0, 1.0])
    with pytest.raises(SettingsError, match="1 result is given; expected two or more"):
        history([one])
    with pytest.raises(SettingsError, match="found a, a; expected 2 names, each once"):
        history([one, two], names=["a", "a"])
    with pytest.raises(SettingsError, match="laws 'coulomb-viscous' and 'stribeck', expected one and the same"):
        history([one, replace(two, law="stribeck")])
    with pytest.raises(SettingsError, match="no joint is in two of the results"):
        history([one, replace(two, joints={"hip": joint()})])
    with pytest.raises(SettingsError, match="has a partner on the other side"):
        history_of_sides(one)


def test_the_page_has_every_curve_and_says_what_changed(tmp_path) -> None:
    def leg(coulomb: float) -> Result:
        found = joint(viscous=estimate(0.5), coulomb=estimate(coulomb), offset=estimate(0.0))
        found = replace(found, correlation=tuple(map(tuple, np.eye(3))))
        return result(f"{coulomb}.npz", law="coulomb-viscous", left_knee=found, right_knee=found)

    for found in (history([leg(1.0), leg(1.1), leg(5.0)], names=["<May>", "June", "July"]), history_of_sides(leg(2.0))):
        write_comparison(found, tmp_path / "page.html")
        page = (tmp_path / "page.html").read_text()
        assert page.count('class="strip"') == len(found.rows)
        assert page.count("Friction over velocity of") == len(found.joints)
        assert "http" not in page.replace("http://www.w3.org/", "")
        if len(found.names) == 3:
            assert "left_knee coulomb +400" in page
            assert "&lt;May&gt;" in page
            assert "<May>" not in page
            assert '<g class="changed"><title>July: 5.000 [4.800, 5.200] N m</title>' in page

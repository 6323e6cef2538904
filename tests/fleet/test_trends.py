"""Trends of a fleet: spreads, robots that stand out, changes; with a store made of known numbers."""

import html
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.fleet.synthetic import write_store

from stribeck.app.report.trends import write_trends
from stribeck.core.base.typing import Array
from stribeck.service.fleet import connect, find_trends
from stribeck.service.fleet.changes import find_changes
from stribeck.service.fleet.friction import Fleet, JointSpeed
from stribeck.service.fleet.spreads import log_variance, outliers, reml

PAGE = Path(__file__).parents[2] / "docs/fleet.md"


def test_false_alarms_are_as_rare_as_asked() -> None:
    values = np.random.default_rng(1).standard_normal((100_000, 30))
    robots = np.repeat([f"{k:04d}" for k in range(1000)], 100)
    found = find_changes(robots, values, np.ones_like(values), 1000.0)
    assert 60 < len(found) < 150  # a hundred are expected; fewer at the beginning of each robot's logs


@pytest.mark.parametrize("size", [3.0, 5.0, -5.0])
def test_a_change_is_dated_and_measured(size: float) -> None:
    generator = np.random.default_rng(2)
    values = generator.standard_normal((60, 4))
    values[43:, 2] += size
    robots = np.repeat(["a", "b", "c"], 20)
    found = find_changes(robots, values, np.ones_like(values), 1000.0)
    assert [each.channel for each in found] == [2]
    assert abs(found[0].first - 43) <= 1
    assert 43 < found[0].seen <= 46
    assert found[0].after - found[0].before == pytest.approx(size, abs=4 * found[0].error)


def test_one_odd_log_and_missing_values_are_no_change() -> None:
    values = np.random.default_rng(3).standard_normal((40, 2))
    values[11, 0] += 30
    values[20:, 1] = np.nan
    assert find_changes(np.repeat(["a", "b"], 20), values, np.ones_like(values), 1000.0) == []


def test_reml_finds_the_spread_of_robots() -> None:
    generator, spreads = np.random.default_rng(4), list[float]()
    for _ in range(40):
        errors = generator.uniform(0.01, 0.2, 30)
        mean = 2 + 0.1 * generator.standard_normal(30) + errors * generator.standard_normal(30)
        mu, error, spread = reml(mean, errors**2)
        assert abs(mu - 2) < 5 * error
        spreads.append(spread)
    assert np.sqrt(np.mean(np.square(spreads))) == pytest.approx(0.1, rel=0.1)


def test_outliers_do_not_hide_each_other() -> None:
    values: Array = np.random.default_rng(5).normal(1, 0.05, 20)
    values[[3, 11]] = 2.0, 2.1
    assert sorted(outliers(values, 0.01)) == [3, 11]
    assert outliers(np.random.default_rng(6).normal(1, 0.05, 20), 0.01) == []


def test_trends_name_changed_joints_and_outlying_robots(tmp_path: Path) -> None:
    false = 0  # 0.7 are expected in the 720 logs
    for seed in range(3):
        store = tmp_path / str(seed)
        write_store(store, robots=12, logs=20, joints=3, seed=seed, wear={(3, 1): (12, 1.3)}, odd={7: 2.0})
        found = find_trends(store)
        own = [each for each in found.alarms if (each.robot, each.joint) == ("r0003", "joint_01")]
        assert own[0].after / own[0].before == pytest.approx(1.3, rel=0.05)
        assert own[0].log == "log_00012.npz"
        assert own[0].seen <= "log_00014.npz"
        assert {each.robot for each in found.odd} == {"r0007"}
        false += len(found.alarms) - 1
        for each in found.friction:
            assert each.robot_spread == pytest.approx(0.05 * each.friction, rel=0.6)
            assert each.log_spread == pytest.approx(0.02 * each.friction, rel=0.3)
            assert 4 < each.smallest < 9
    assert false <= 3
    assert [(row.parameter, row.logs) for row in found.parameters] == [("coulomb", 240)] * 3
    assert all(0.7 < row.low / (k + 1.1) < row.high / (k + 1.1) < 2.5 for k, row in enumerate(found.parameters))
    write_trends(found, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    assert found.summary().startswith(found.conclusion)
    assert html.escape(found.conclusion, quote=False) in page
    assert re.fullmatch(r"1 joint changed \(r0003 .*\), and 1 robot stands out \(r0007 .*\)\.", found.conclusion)
    assert "joint_01 at" in page
    undated = np.arange(240).astype("M8[us]")  # stamps of all logs count from zero
    write_trends(replace(found, fleet=replace(found.fleet, start=undated)), tmp_path / "undated.html")
    assert '"log number","range":[-3.' in (tmp_path / "undated.html").read_text()


def changed_in(friction: Array, error: float, robots: int = 1) -> set[str]:
    """Find the joints that change in N logs of C joints."""
    count, channels = friction.shape
    fleet = Fleet(
        robots=np.repeat([f"r{k}" for k in range(robots)], count // robots),
        start=np.zeros(count, "M8[us]"),
        log=np.full(count, "log.npz", dtype=object),
        channels=[JointSpeed(joint=f"j{k}", velocity=1.0, unit="N m", speed_unit="rad/s") for k in range(channels)],
        friction=friction,
        error=error * friction,
    )
    variance, freedom = log_variance(fleet)
    changes = find_changes(fleet.robots, fleet.logarithm, variance, 1000.0, freedom)
    return {f"j{each.channel}" for each in changes}


@pytest.mark.parametrize(("robots", "logs"), [(1, 3), (1, 5), (1, 8), (2, 3), (3, 4)])
def test_short_stores_raise_no_false_alarms(robots: int, logs: int) -> None:
    frictions = (np.random.default_rng(seed).normal(1, 0.02, (robots * logs, 21)) for seed in range(10))
    assert sum(len(changed_in(friction, 0.005, robots)) for friction in frictions) <= 2  # 0.12 are expected


@pytest.mark.parametrize("joints", [3, 6])
def test_a_change_in_two_of_four_logs_is_seen(joints: int) -> None:
    """The other joints show that logs of this robot differ by only 0.3 %."""
    for seed in range(20):
        friction = np.random.default_rng(seed).normal(1, 0.003, (4, joints))
        assert changed_in(friction, 0.003) == set()
        friction[2:, 1] *= 1.2
        assert changed_in(friction, 0.003) == {"j1"}


def test_the_queries_of_the_page_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_store(tmp_path / "store", robots=3, logs=4, joints=2)
    blocks = re.findall(r"```sql\n(.*?)```", PAGE.read_text(), re.DOTALL)
    with connect("store") as connection:
        for query in "".join(blocks).split(";\n"):
            if query.strip():
                connection.execute(query)
        assert connection.execute("SELECT count(*) FROM logs").fetchall() == [(12,)]

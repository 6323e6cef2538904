"""The ablation study: harder conditions are what they say, components are switched off and on, ratios are of pairs."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from studies import harder
from studies.ablation import CASE_HEAD, FULL, HEAD, PLACES, by_case, coverage, estimators, read, table, write
from studies.ablation_components import COMPONENTS, without
from studies.accuracy_cases import CASES, NAMES, measured
from studies.accuracy_table import CURVE_FIT, DEFAULT, Run, key_of
from studies.bar import bar
from studies.harder_cases import CONDITIONS, ROTOR, Harder, as_seen

from stribeck import Robot, Settings, identify
from stribeck.friction import get_law
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.robots.biped import MODELS
from stribeck_simulation.run import Simulated

ROOT = Path(__file__).parents[2]
EXACT = Harder()


@pytest.fixture(scope="module")
def walk() -> Simulated:
    """An arm that moves, with feet that stand now and then and a level base."""
    robot, law = Robot.from_file(MODELS / "arm.toml"), get_law("stribeck")
    values = [0.3, 1.2, 0.3, 0.15, 0.2, 50.0]
    truth = {joint: dict(zip(NAMES, values, strict=True)) for joint in robot.joint_names}
    log, known = exact_log(robot, law, truth, duration=16.0, seed=1)
    level = np.tile([0.0, 0.0, 0.0, 1.0], (len(log.time), 1))
    contact = (np.arange(len(log.time)) // 500 % 2 == 0)[:, None]
    return Simulated(robot, replace(log, base_orientation=level, foot_names=("foot",), contact=contact), known)


def seen(walk: Simulated, **wrong: float) -> tuple[Simulated, Robot, Simulated]:
    """The walk with its friction, the robot that is believed, and the walk as it is logged."""
    (truth, _), robot, (log, _) = as_seen([walk, walk], replace(EXACT, pushed=True, **wrong), 0)  # type: ignore[arg-type]
    return truth, robot, replace(walk, log=log)


def test_without_anything_wrong_the_log_is_as_it_was(walk: Simulated) -> None:
    _, robot, logged = seen(walk)
    np.testing.assert_array_equal(logged.log.torque, walk.log.torque)
    np.testing.assert_array_equal(logged.log.position, walk.log.position)
    assert logged.log.base_orientation is not None
    np.testing.assert_allclose(logged.log.base_orientation[:, 3], 1.0)
    assert robot is walk.robot


def test_each_condition_is_as_large_as_it_says(walk: Simulated) -> None:
    period, coulomb = 1e-3, 1.2
    assert np.max(np.abs(seen(walk, bits=14)[2].log.position - walk.log.position)) == pytest.approx(
        np.pi / 2**14, rel=0.01
    )
    assert np.std(seen(walk, coloured=0.3)[2].log.torque - walk.log.torque) == pytest.approx(0.3, rel=0.1)
    ripple = seen(walk, ripple=0.1)[2].log.torque - walk.log.torque
    assert np.max(np.abs(ripple)) == pytest.approx(0.1 * coulomb, rel=0.01)
    gains = seen(walk, gains=0.03)[2].log.torque / walk.log.torque
    assert np.ptp(gains, axis=0) == pytest.approx(0.0, abs=1e-9)
    assert 0.005 < np.std(gains[0]) < 0.1
    np.testing.assert_array_equal(seen(walk, torque_delay=2 * period)[2].log.torque[2:], walk.log.torque[:-2])
    late = seen(walk, contact_delay=20 * period)[2].log.contact
    assert late is not None
    assert walk.log.contact is not None
    np.testing.assert_array_equal(late[20:], walk.log.contact[:-20])
    tilted = seen(walk, tilt=1.5)[2].log.base_orientation
    assert tilted is not None
    np.testing.assert_allclose(2 * np.rad2deg(np.arccos(tilted[:, 3])), 1.5)
    assert seen(walk, every=4)[2].log.time[1] == pytest.approx(4 * period)
    stood = seen(walk, standing=1.0)[2].log
    np.testing.assert_array_equal(stood.torque[1000:], walk.log.torque)
    assert np.ptp(stood.position[:1000], axis=0).max() == 0.0
    spikes = seen(walk, spikes=True)[2].log.torque - walk.log.torque
    assert set(np.round(np.abs(spikes).ravel(), 6)) == {0.0, 20.0}


def test_model_and_truth_differ_as_a_condition_says(walk: Simulated) -> None:
    lighter = seen(walk, payload=0.2)[1]
    assert lighter.mass == pytest.approx(walk.robot.mass - 0.2)
    wrong, robot, _ = seen(walk, rotors=0.2)
    assert np.max(np.abs(robot.armature / ROTOR - 1)) <= 0.2
    assert np.ptp(robot.armature) > 0
    assert np.std(wrong.log.torque - walk.log.torque) > 0
    spread = [each["coulomb"] for each in seen(walk, decades=1.0)[0].truth.parameters.values()]
    assert max(spread) / min(spread) == pytest.approx(10.0)


def test_a_component_is_switched_off_and_on_again() -> None:
    for component, substitutes in COMPONENTS.items():
        before = [getattr(place, name) for place, name, _ in substitutes]
        with without(component):
            assert [getattr(place, name) for place, name, _ in substitutes] == [each for *_, each in substitutes]
        assert [getattr(place, name) for place, name, _ in substitutes] == before


@pytest.mark.parametrize("component", [name for name, substitutes in COMPONENTS.items() if substitutes])
def test_the_estimator_runs_without_a_component(walk: Simulated, component: str) -> None:
    short = replace(walk.log, base_orientation=None, contact=None, foot_names=()).take(slice(10_000))
    log = measured(short, CASES["B"], 0, 0)
    with without(component):
        result = identify(log, walk.robot, Settings(law="stribeck"))
    for joint, known in walk.truth.parameters.items():
        assert result.joints[joint].parameters["coulomb"].value == pytest.approx(known["coulomb"], rel=0.3)


def test_places_are_cases_that_there_are() -> None:
    assert all(case in CASES or case in CONDITIONS for _, case in PLACES)
    assert len(set(PLACES)) == len(PLACES)


def test_the_bar_finds_the_friction_and_the_mass_of_an_arm(walk: Simulated) -> None:
    model = pin.Model(walk.robot.tree.model)
    body = model.inertias[2]
    model.inertias[2] = pin.Inertia(1.05 * body.mass, body.lever, body.inertia)
    log = replace(walk.log, base_orientation=None, contact=None, foot_names=())
    noisy = measured(log, CASES["A"], 0, 0)
    result, found = bar([noisy], replace(walk.robot, tree=replace(walk.robot.tree, model=model)))
    for joint, known in walk.truth.parameters.items():
        estimates = result.joints[joint].parameters
        assert estimates["coulomb"].value == pytest.approx(known["coulomb"], rel=0.02)
        offset = estimates["offset"]  # of a joint that gravity loads it is as uncertain as the bodies' masses
        assert abs(offset.value - known["offset"]) < 3 * offset.standard_error < 0.2
    assert result.corrections is not None
    assert result.corrections.chi_square == pytest.approx(1.0, abs=0.2)
    assert abs(found.tree.model.inertias[2].mass - body.mass) < 0.05 * body.mass


def a_run(component: str, error: float, held: int, case: str = "A") -> Run:
    """A run of eight joints whose every parameter is off by the same; half of them are weak."""
    return Run(
        robot="G1",
        case=case,
        method=component,
        seed=0,
        seconds=error,
        chi_square=1.0,
        joints=[f"joint_{k}" for k in range(8)],
        relative=4 * [error, 2 * error],
        shape=8 * [error],
        error={name: 4 * [error, -error] for name in NAMES},
        standard_error={name: 8 * [0.1] for name in NAMES},
        held={name: 4 * [held, 0] for name in NAMES},
        weak={name: 4 * [0, 1] for name in NAMES},
    )


def test_ratios_are_those_of_a_case_to_the_whole_estimator(tmp_path: Path) -> None:
    component = list(COMPONENTS)[-1]
    found = [a_run(FULL, 0.1, 1), a_run(component, 0.3, 0), a_run(FULL, 0.1, 1, "B"), a_run(component, 0.1, 1, "B")]
    assert coverage(found[:2]) == 0.5
    write(
        tmp_path / "runs.json",
        {key_of(one): one for one in found},
        {"go2": {FULL: {"knee": 0.2}, component: {"knee": 0.3}}},
    )
    whole, without_it = table(*read(tmp_path / "runs.json"))
    assert whole.startswith("| full | 2 | 1.00 / 1.00 (")
    assert without_it.startswith(f"| {component} | 2 | 2.00 / 3.00 (G1, A)")
    assert "| 50.0 % (-50.0) | -100 (G1, A) |" in without_it
    assert "| 1.500 |" in without_it
    assert without_it.count(" | ") == HEAD.split("\n")[0].count(" | ")


def test_the_rows_shown_are_the_studys() -> None:
    page = (ROOT / "docs/ablation.md").read_text(encoding="utf-8")
    runs, held = read(ROOT / "studies/ablation.json")
    for row in [HEAD, *table(runs, held), CASE_HEAD, *by_case(estimators(runs.values()))]:
        assert row in page


def test_the_rows_of_harder_conditions_are_the_studys() -> None:
    page = (ROOT / "docs/whole-log.md").read_text(encoding="utf-8")
    runs, _ = read(ROOT / "studies/harder.json")
    rows = harder.table(runs)
    assert len(rows) == len(CONDITIONS) * len(harder.ROBOTS)
    for row in [harder.HEAD, *rows]:
        assert row in page


def test_the_default_is_closer_than_the_curve_fit_in_all_harder_conditions() -> None:
    runs, _ = read(ROOT / "studies/harder.json")
    for (robot, condition, method, seed), one in runs.items():
        if method == CURVE_FIT:
            default = runs[robot, condition, DEFAULT, seed]
            assert np.mean(default["relative"]) < np.mean(one["relative"])

"""The joint distribution of a result's parameters: storage, and the most probable values under conditions."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.exporters.found import found_in, robot_of

from stribeck import Result, Robot, read_result
from stribeck.app.exporters.posterior import inertias_pay, projected
from stribeck.core.errors import SettingsError
from stribeck.core.result import ErrorCorrelation
from stribeck.core.result.parts import BODY_COORDINATES
from stribeck.core.result.posterior import Posterior


@given(seed=st.integers(0, 1000), given=st.integers(1, 3))
def test_the_most_probable_values_under_conditions_minimise_the_distance(seed: int, given: int) -> None:
    generator = np.random.default_rng(seed)
    root = generator.standard_normal((6, 6))
    names = tuple("abcdef")
    posterior = Posterior(names, ("1",) * 6, generator.standard_normal(6), root @ root.T)
    values = dict(zip(names[:given], generator.standard_normal(given).tolist(), strict=True))
    found = np.array([*posterior.shifts(values).values()])
    np.testing.assert_allclose(found[:given] + posterior.mean[:given], [*values.values()], atol=1e-6)
    gradient = np.linalg.solve(posterior.covariance, found)  # zero in all other directions
    np.testing.assert_allclose(gradient[given:], 0, atol=1e-4 * np.abs(gradient).max())


@pytest.fixture
def arm(tmp_path: Path) -> tuple[Result, Robot]:
    """Return a result in which the first joint's offset and the center of its body make up for one another."""
    robot, _ = robot_of("arm", tmp_path)
    result, _ = found_in(robot)
    joint, body = robot.joint_names[0], next(iter(result.corrections.bodies))
    covariance = np.array([[1.0, 0.9], [0.9, 1.0]])
    told = ErrorCorrelation.of([f"{joint}.offset", f"{body}.centre_x"], covariance)
    return replace(result, corrections=replace(result.corrections, correlation=told)), robot


def test_the_logarithm_of_a_mass_has_its_relative_error(arm: tuple[Result, Robot]) -> None:
    (name, body), posterior = next(iter(arm[0].corrections.bodies.items())), arm[0].posterior
    place = posterior.names.index(f"{name}.{BODY_COORDINATES[0]}")
    assert posterior.mean[place] == pytest.approx(np.log(body.mass[1]))
    assert posterior.covariance[place, place] == pytest.approx((body.mass_error / body.mass[1]) ** 2)


def test_correlations_survive_in_a_file_and_damage_is_refused(arm: tuple[Result, Robot], tmp_path: Path) -> None:
    result, _ = arm
    path = tmp_path / "result.json"
    result.save(path)
    again = read_result(path)
    assert again == result
    np.testing.assert_array_equal(again.posterior.covariance, result.posterior.covariance)
    plain = json.loads(path.read_text())
    plain["corrections"]["correlation"]["lower"] = "AAAA"
    path.write_text(json.dumps(plain))
    with pytest.raises(SettingsError, match="lower"):
        read_result(path)
    del plain["corrections"]["correlation"]
    plain["corrections"]["correlations"] = [["a.b", "c.d", 0.5]]  # as earlier versions wrote them
    path.write_text(json.dumps(plain))
    assert read_result(path).corrections.correlation is None


def test_offsets_of_commands_go_to_what_is_confounded_with_them(arm: tuple[Result, Robot]) -> None:
    result, robot = arm
    joint, body = robot.joint_names[0], next(iter(result.corrections.bodies))
    assert projected(result, robot) is result  # a sensor can have an offset
    found = projected(result, replace(robot, torque_source="command"))
    assert found.joints[joint].values["offset"] == 0
    offset, centre = result.joints[joint].parameters["offset"], result.corrections.bodies[body]
    moved = found.corrections.bodies[body].centre_of_mass[1][0] - centre.centre_of_mass[1][0]
    expected = -0.9 * centre.centre_of_mass_error[0] / offset.standard_error * offset.value
    assert moved == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("change", "pays"), [((-0.1, 0.05), True), ((-0.1, 0.09), False), (None, False)])
def test_inertias_are_written_where_the_held_out_torque_says_so(
    change: tuple[float, float] | None, pays: bool, arm: tuple[Result, Robot]
) -> None:
    result, _ = arm
    corrections = replace(result.corrections, held_out_change=change)
    assert inertias_pay(replace(result, corrections=corrections))[0] is pays

"""Robots and ranges that a log supports: drawn from the covariance of what was found, in the target's words."""

import sys
from dataclasses import make_dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest
import yaml
from tests.arm import write_arm
from tests.exporters.found import found_in, joint, module, robot_of
from tests.exporters.test_models import assert_possible, read_again
from tests.result import made

from stribeck import Robot, export
from stribeck.app.exporters import TARGETS, export_ranges, export_samples
from stribeck.app.exporters.joints import joint_terms
from stribeck.app.exporters.posterior import drawn, joint_ranges
from stribeck.core.result import JointResult, Result, read_result

TRUTH = {"viscous": 0.3, "coulomb": 1.2, "stribeck_gain": 0.4, "stribeck_velocity": 0.2, "offset": -0.4}
CORRELATION = np.eye(5)
for _row, _column, _value in ((0, 1, -0.9), (0, 4, 0.1), (1, 2, 0.2), (2, 3, -0.5)):
    CORRELATION[[_row, _column], [_column, _row]] = _value

PLAIN = TARGETS["isaaclab"].forms["plain"]
ROTOR = replace(made.estimate(0.05, 0.005), unit="kg m^2")


def arm_result(folder: Path, **joints: JointResult) -> tuple[Result, Robot]:
    robot = Robot.from_file(write_arm(folder))
    return replace(found_in(robot, "auto")[0], joints=joints, corrections=None), robot


def uncertain() -> JointResult:
    own = joint(**TRUTH)
    errors = dict(zip(TRUTH, (0.02, 0.03, 0.05, 0.01, 0.1), strict=True))
    parameters = {name: replace(found, standard_error=errors[name]) for name, found in own.parameters.items()}
    return replace(own, parameters=parameters, correlation=tuple(map(tuple, CORRELATION.tolist())))


def test_draws_have_the_covariance_that_was_found_and_results_keep_it(tmp_path: Path) -> None:
    result, _ = arm_result(tmp_path, j=uncertain())
    (tmp_path / "result.json").write_text(result.to_json())
    assert read_result(tmp_path / "result.json").joints["j"].correlation == uncertain().correlation
    values = np.array([[p.value for p in each.joints["j"].parameters.values()] for each in drawn(result, 4000)])
    own = result.joints["j"].parameters.values()
    np.testing.assert_allclose(values.mean(axis=0), [p.value for p in own], atol=0.005)
    np.testing.assert_allclose(values.std(axis=0) / [p.standard_error for p in own], 1.0, rtol=0.05)
    np.testing.assert_allclose(np.corrcoef(values.T), CORRELATION, atol=0.05)
    alone = replace(result, joints={"j": replace(uncertain(), correlation=None)})
    spread = [np.std([each.joints["j"].friction(1.5) + 0.4 for each in drawn(own, 500)]) for own in (result, alone)]
    assert spread[0] < spread[1]  # of parameters that trade places


def test_draws_vary_from_log_to_log(tmp_path: Path) -> None:
    """By one factor per joint, for everything that is friction."""
    point = replace(made.point(1.0, 2.0, 0.0), interval_next_log=(1.5, 2.5))
    certain = replace(uncertain(), curve=(point,))
    parameters = {name: replace(own, standard_error=0.0) for name, own in certain.parameters.items()}
    found, _ = arm_result(tmp_path, j=replace(certain, parameters=parameters))
    draws = [each.joints["j"].parameters for each in drawn(found, 2000)]
    factor = np.array([own["coulomb"].value / parameters["coulomb"].value for own in draws])
    assert np.std(factor) == pytest.approx(0.25 / 1.96, rel=0.05)
    for own, expected in zip(draws, factor, strict=True):
        assert own["viscous"].value == pytest.approx(expected * parameters["viscous"].value)
        assert own["offset"].value == parameters["offset"].value


@pytest.mark.parametrize("name", ["arm", "toro"])
def test_every_robot_that_is_drawn_could_exist(name: str, tmp_path: Path) -> None:
    robot, target = robot_of(name, tmp_path)
    result, _ = found_in(robot)
    masses = []
    for path in export_samples(result, robot, tmp_path / "draws", target, 5, inertia=True):
        model = read_again(robot, path).tree.model
        masses.append(sum(inertia.mass for inertia in model.inertias))
        for inertia in list(model.inertias)[1:]:
            assert_possible(inertia)
    assert np.std(masses) > 0


def with_rotor() -> JointResult:
    """Return a joint whose Coulomb and viscous friction trade places."""
    own, errors = joint(coulomb=1.2, viscous=0.3, offset=0.0), {"coulomb": 0.1, "viscous": 0.1, "offset": 0.1}
    parameters = {name: replace(found, standard_error=errors[name]) for name, found in own.parameters.items()}
    correlation = ((1.0, -0.9, 0.0, 0.0), (-0.9, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    return replace(own, parameters=parameters | {"armature": ROTOR}, correlation=correlation)


def without_friction() -> JointResult:
    point = made.point(1.0, 0.0, 0.04)
    return replace(uncertain(), parameters={}, verdict="no friction", correlation=None, curve=(point,))


def test_ranges_cover_95_percent_of_other_draws(tmp_path: Path) -> None:
    result, _ = arm_result(tmp_path, shoulder=with_rotor())
    found = joint_ranges(result, PLAIN, None, include_weak=False)["shoulder"]
    assert set(found.numbers) == {"friction", "dynamic_friction", "viscous_friction", "armature"}
    assert not found.weak
    others = [joint_terms(each, PLAIN)["shoulder"].stated for each in drawn(result, 400, seed=1)]
    for word, (low, high) in found.numbers.items():
        assert np.mean([low <= each[word][0] <= high for each in others]) == pytest.approx(0.95, abs=0.04)
    low, high = found.friction
    assert low < 1 < high
    own = joint_terms(result, PLAIN)["shoulder"].stated

    def whole(stated: dict[str, tuple[float, str]]) -> float:
        return stated["dynamic_friction"][0] + stated["viscous_friction"][0]  # at the top speed of 1 rad/s

    assert np.mean([low <= whole(each) / whole(own) <= high for each in others]) >= 0.93
    assert high - low < 0.5 * np.ptp(found.numbers["viscous_friction"]) / own["viscous_friction"][0]


def test_mujoco_takes_them_by_degree_of_freedom(tmp_path: Path) -> None:
    robot, _ = robot_of("toro", tmp_path)
    name = robot.joint_names[0]
    result = replace(found_in(robot, "auto")[0], joints={name: with_rotor()}, corrections=None)
    lines = export_ranges(result, robot, tmp_path / "ranges", "mjcf")
    assert any(line.startswith(f"Joint {name}: frictionloss ") for line in lines)
    own = module(tmp_path / "ranges")
    export(result, robot, tmp_path / "new.xml", "mjcf", friction="plain")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "new.xml"))
    before = {field: getattr(model, field).copy() for field in own.bounds(model)}
    assert sorted(before) == ["dof_armature", "dof_damping", "dof_frictionloss", "dof_solref"]
    model.dof_solref[:], sharp = (0.02, 1.0), before.pop("dof_solref")
    at, generator = model.joint(name).dofadr[0], np.random.default_rng(0)
    drawn_values: dict[str, list[float]] = {field: [] for field in before}
    invweights = []
    for _ in range(20):
        own.randomize(model, generator)
        invweights.append(model.dof_invweight0[at])
        for field, values in drawn_values.items():
            now = getattr(model, field)
            values.append(now[at])
            assert np.array_equal(np.delete(now, at), np.delete(before[field], at))  # as of the other joint
    np.testing.assert_array_equal(model.dof_solref, sharp)  # friction acts at once, as in the exported model
    np.testing.assert_array_equal(sharp[at], (0.001, 1.0))
    for field, values in drawn_values.items():
        low, high = own.RANGES[name][field]
        assert low <= min(values) < max(values) <= high
        assert low < before[field][at] < high
    assert np.std(invweights) > 0


def test_isaac_lab_gets_terms_of_its_events(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With stand-ins that have the keywords of Isaac Lab 2.3 and 3.0."""

    def randomize_joint_parameters(
        env: object,
        env_ids: object,
        asset_cfg: Any,
        friction_distribution_params: tuple[float, float] | None = None,
        armature_distribution_params: tuple[float, float] | None = None,
        operation: str = "abs",
        distribution: str = "uniform",
    ) -> tuple[str, str, Any]:
        del env, env_ids, distribution
        return asset_cfg.joint_names[0], operation, friction_distribution_params or armature_distribution_params

    mdp = SimpleNamespace(randomize_joint_parameters=randomize_joint_parameters)
    classes = {"EventTermCfg": ("func", "mode", "params"), "SceneEntityCfg": ("name", "joint_names")}
    managers = SimpleNamespace(**{name: make_dataclass(name, fields) for name, fields in classes.items()})
    for name, stub in {"": None, ".envs": SimpleNamespace(mdp=mdp), ".managers": managers}.items():
        monkeypatch.setitem(sys.modules, f"isaaclab{name}", stub or SimpleNamespace())  # type: ignore[arg-type]
    result, robot = arm_result(tmp_path, shoulder=with_rotor(), elbow=without_friction())
    export_ranges(result, robot, tmp_path / "ranges", "isaaclab")
    own = module(tmp_path / "ranges")
    terms = own.events("arm", mode="reset")
    assert {term.mode for term in terms.values()} == {"reset"}
    called = {name: term.func(None, None, **term.params) for name, term in terms.items()}
    assert called == {
        "friction_0": ("shoulder", "scale", own.SCALES["shoulder"]),
        "armature_0": ("shoulder", "abs", own.RANGES["shoulder"]["armature"]),
    }
    assert own.RANGES["elbow"]["friction"] == (0.0, 0.04)  # nothing to scale, and as much as the log may hide


def test_weak_friction_is_omitted_or_reported_as_wide(tmp_path: Path) -> None:
    own = uncertain()
    parameters = {k: replace(p, verdict="weak", standard_error=2 * p.value) for k, p in own.parameters.items()}
    weak = replace(own, verdict="weak", parameters=parameters, correlation=None)
    result, robot = arm_result(tmp_path, shoulder=uncertain(), elbow=weak)
    lines = export_ranges(result, robot, tmp_path / "ranges", "mjcf")
    assert "Not identified or not requested: elbow." in lines
    lines = export_ranges(result, robot, tmp_path / "ranges", "mjcf", include_weak=True)
    (line,) = (line for line in lines if line.startswith("Joint elbow"))
    assert line.endswith("; wide, as its friction is weak.")
    ranges = module(tmp_path / "ranges").RANGES
    assert np.ptp(ranges["elbow"]["dof_frictionloss"]) > 5 * np.ptp(ranges["shoulder"]["dof_frictionloss"])
    export_ranges(replace(result, joints={"shoulder": with_rotor()}), robot, tmp_path / "ranges.yaml", "yaml")
    plain = yaml.safe_load((tmp_path / "ranges.yaml").read_text())["joints"]["shoulder"]
    assert set(plain) == {"static", "coulomb", "viscous", "armature"}
    assert all(0 < low < high for low, high in plain.values())

"""Ranges to draw robots from: they hold what the log supports, in the words of the program that draws."""

import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest
from tests.arm import write_arm
from tests.cli.test_cli import refused, run
from tests.export.found import found_in
from tests.export.test_export import robot_of
from tests.export.test_forms import joint
from tests.export.test_samples import uncertain
from tests.export.test_simulators import module

from stribeck import Robot, export
from stribeck.errors import NothingIdentifiedError, SettingsError
from stribeck.export import TARGETS, export_ranges
from stribeck.export.joints import joint_terms
from stribeck.export.ranges import joint_ranges
from stribeck.export.samples import drawn
from stribeck.result import CurvePoint, JointResult, ParameterEstimate, Result

PLAIN = TARGETS["isaaclab"].forms["plain"]
ROTOR = ParameterEstimate(
    value=0.05, standard_error=0.005, interval_95=(0.04, 0.06), unit="kg m^2", verdict="identified"
)


def arm_result(folder: Path, **joints: JointResult) -> tuple[Result, Robot]:
    robot = Robot.from_file(write_arm(folder))
    return replace(found_in(robot, "auto")[0], joints=joints, corrections=None), robot


def with_rotor() -> JointResult:
    """Return a joint whose Coulomb and viscous friction trade places."""
    own, errors = joint(coulomb=1.2, viscous=0.3, offset=0.0), {"coulomb": 0.1, "viscous": 0.1, "offset": 0.1}
    parameters = {name: replace(found, standard_error=errors[name]) for name, found in own.parameters.items()}
    correlation = ((1.0, -0.9, 0.0, 0.0), (-0.9, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    return replace(own, parameters=parameters | {"armature": ROTOR}, correlation=correlation)


def without_friction() -> JointResult:
    point = CurvePoint(velocity=1.0, value=0.0, standard_error=0.02, interval_95=(0.0, 0.04), unit="N m")
    return replace(uncertain(), parameters={}, verdict="no friction", correlation=None, curve=(point,))


def test_ranges_hold_95_percent_of_other_draws(tmp_path: Path) -> None:
    assert PLAIN is not None
    result, _ = arm_result(tmp_path, shoulder=with_rotor())
    found = joint_ranges(result, PLAIN)["shoulder"]
    assert set(found.numbers) == {"friction", "dynamic_friction", "viscous_friction", "armature"}
    assert not found.weak
    others = [joint_terms(each, PLAIN)["shoulder"].stated for each in drawn(result, 400, seed=1)]
    for word, (low, high) in found.numbers.items():
        assert np.mean([low <= each[word][0] <= high for each in others]) == pytest.approx(0.95, abs=0.04)
    assert found.friction is not None
    low, high = found.friction
    assert low < 1 < high
    own = joint_terms(result, PLAIN)["shoulder"].stated

    def whole(stated: dict[str, tuple[float, str]]) -> float:
        return stated["dynamic_friction"][0] + stated["viscous_friction"][0]  # at the top speed of 1 rad/s

    assert np.mean([low <= whole(each) / whole(own) <= high for each in others]) >= 0.93
    assert high - low < 0.5 * np.ptp(found.numbers["viscous_friction"]) / own["viscous_friction"][0]


def test_mujoco_takes_them_by_degree_of_freedom(tmp_path: Path) -> None:
    robot, _ = robot_of("toro", tmp_path)
    name, other = robot.joint_names[:2]
    result = replace(found_in(robot, "auto")[0], joints={name: with_rotor()}, corrections=None)
    lines = export_ranges(result, robot, tmp_path / "ranges", "mjcf")
    assert any(line.startswith(f"Joint {name}: frictionloss ") for line in lines)
    own = module(tmp_path / "ranges")
    export(result, robot, tmp_path / "new.xml", "mjcf", friction="plain")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "new.xml"))
    before = {field: getattr(model, field).copy() for field in own.bounds(model)}
    assert sorted(before) == ["dof_armature", "dof_damping", "dof_frictionloss"]
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
    assert model.joint(other).dofadr[0] != at
    for field, values in drawn_values.items():
        low, high = own.RANGES[name][field]
        assert low <= min(values) < max(values) <= high
        assert low < before[field][at] < high
    assert np.std(invweights) > 0


def test_isaac_lab_gets_terms_of_its_events(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With stand-ins that have the keywords of Isaac Lab 2.3 and 3.0."""

    @dataclass
    class SceneEntityCfg:
        name: str
        joint_names: list[str]

    @dataclass
    class EventTermCfg:
        func: Any
        mode: str
        params: dict[str, Any]

    def randomize_joint_parameters(
        env: object,
        env_ids: object,
        asset_cfg: SceneEntityCfg,
        friction_distribution_params: tuple[float, float] | None = None,
        armature_distribution_params: tuple[float, float] | None = None,
        operation: str = "abs",
        distribution: str = "uniform",
    ) -> tuple[str, str, Any]:
        del env, env_ids, distribution
        return asset_cfg.joint_names[0], operation, friction_distribution_params or armature_distribution_params

    mdp = SimpleNamespace(randomize_joint_parameters=randomize_joint_parameters)
    managers = SimpleNamespace(EventTermCfg=EventTermCfg, SceneEntityCfg=SceneEntityCfg)
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


@pytest.mark.parametrize("target", ["newton", "genesis", "physx"])
def test_others_get_their_own_words_as_json(target: str, tmp_path: Path) -> None:
    result, robot = arm_result(tmp_path, shoulder=with_rotor())
    export_ranges(result, robot, tmp_path / "ranges.json", target)
    ranges = json.loads((tmp_path / "ranges.json").read_text())["joints"]["shoulder"]
    form = TARGETS[target].forms["plain"]
    assert form is not None
    assert set(ranges) == set(form.words.values())
    for low, high in ranges.values():
        assert 0 < low < high


def test_weak_friction_is_left_out_or_said_to_be_wide(tmp_path: Path) -> None:
    own = uncertain()
    parameters = {k: replace(p, verdict="weak", standard_error=2 * p.value) for k, p in own.parameters.items()}
    weak = replace(own, verdict="weak", parameters=parameters, correlation=None)
    result, robot = arm_result(tmp_path, shoulder=uncertain(), elbow=weak)
    lines = export_ranges(result, robot, tmp_path / "ranges", "mjcf")
    assert "Not identified, or not asked for: elbow." in lines
    lines = export_ranges(result, robot, tmp_path / "ranges", "mjcf", include_weak=True)
    (line,) = (line for line in lines if line.startswith("Joint elbow"))
    assert line.endswith("; wide, as its friction is weak.")
    ranges = module(tmp_path / "ranges").RANGES
    assert np.ptp(ranges["elbow"]["dof_frictionloss"]) > 5 * np.ptp(ranges["shoulder"]["dof_frictionloss"])


def test_what_has_no_ranges_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result, robot = arm_result(tmp_path, shoulder=uncertain())
    (tmp_path / "result.json").write_text(result.to_json())
    command = ("export", tmp_path / "result.json", "-r", robot.path, "-o", tmp_path / "ranges.py", "--ranges", "--to")
    sentence = refused(capsys, *command, "c")
    assert "'c'; expected mjcf, isaaclab, physx, newton or genesis" in sentence
    assert "neither --samples" in refused(capsys, *command, "mjcf", "--samples", "3")
    assert "no joint 'knee'" in refused(capsys, *command, "mjcf", "--joints", "knee")
    with pytest.raises(NothingIdentifiedError, match="no friction"):
        export_ranges(replace(result, joints={}), robot, tmp_path / "ranges.py", "mjcf")
    with pytest.raises(SettingsError, match="own model"):
        export_ranges(result, robot, robot.model_path, "mjcf")
    assert not (tmp_path / "ranges.py").exists()
    assert run(*command, "mjcf") == 0
    assert "95 %" in capsys.readouterr().out

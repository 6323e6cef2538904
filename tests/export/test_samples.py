"""Robots that a log cannot tell apart: drawn from the covariance of what was found, each of them possible."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from tests.cli.test_cli import refused, run
from tests.export.found import found_in
from tests.export.test_export import read_again, robot_of
from tests.export.test_forms import joint

from stribeck.errors import SettingsError
from stribeck.export import export_samples
from stribeck.export.samples import drawn
from stribeck.result import JointResult, read_result

TRUTH = {"viscous": 0.3, "coulomb": 1.2, "stribeck_gain": 0.4, "stribeck_velocity": 0.2, "offset": -0.4}
CORRELATION = np.array(
    [
        [1.0, -0.9, 0.0, 0.0, 0.1],
        [-0.9, 1.0, 0.2, 0.0, 0.0],
        [0.0, 0.2, 1.0, -0.5, 0.0],
        [0.0, 0.0, -0.5, 1.0, 0.0],
        [0.1, 0.0, 0.0, 0.0, 1.0],
    ]
)


def uncertain() -> JointResult:
    own = joint(**TRUTH)
    errors = dict(zip(TRUTH, (0.02, 0.03, 0.05, 0.01, 0.1), strict=True))
    parameters = {name: replace(found, standard_error=errors[name]) for name, found in own.parameters.items()}
    return replace(own, parameters=parameters, correlation=tuple(map(tuple, CORRELATION.tolist())))


def test_draws_have_the_covariance_that_was_found(tmp_path: Path) -> None:
    robot, _ = robot_of("arm", tmp_path)
    result = replace(found_in(robot, "auto")[0], joints={robot.joint_names[0]: uncertain()})
    (name,) = result.joints
    values = np.array([[p.value for p in each.joints[name].parameters.values()] for each in drawn(result, 4000)])
    own = result.joints[name].parameters.values()
    np.testing.assert_allclose(values.mean(axis=0), [p.value for p in own], atol=0.005)
    np.testing.assert_allclose(values.std(axis=0) / [p.standard_error for p in own], 1.0, rtol=0.05)
    np.testing.assert_allclose(np.corrcoef(values.T), CORRELATION, atol=0.05)


def test_friction_by_itself_varies_less_than_parameters_that_trade_places(tmp_path: Path) -> None:
    robot, _ = robot_of("arm", tmp_path)
    known = replace(found_in(robot, "auto")[0], joints={"j": uncertain()})
    alone = replace(known, joints={"j": replace(uncertain(), correlation=None)})
    spread = [np.std([each.joints["j"].friction(1.5) + 0.4 for each in drawn(own, 500)]) for own in (known, alone)]
    assert spread[0] < spread[1]


@pytest.mark.parametrize("name", ["arm", "toro"])
def test_every_robot_that_is_drawn_could_exist(name: str, tmp_path: Path) -> None:
    robot, target = robot_of(name, tmp_path)
    result, _ = found_in(robot)
    masses = []
    for path in export_samples(result, robot, tmp_path / "draws", target, 5):
        model = read_again(robot, path).tree.model
        masses.append(sum(inertia.mass for inertia in model.inertias))
        for inertia in list(model.inertias)[1:]:
            assert pin.Inertia.FromDynamicParameters(inertia.toDynamicParameters()).mass > 0
            moments = np.linalg.eigvalsh(inertia.inertia)
            assert moments[0] > 0
            assert moments[2] <= moments[:2].sum() * (1 + 1e-9)
    assert np.std(masses) > 0


def test_bounds_hold_and_a_scale_that_nothing_shows_stays_possible(tmp_path: Path) -> None:
    robot, _ = robot_of("arm", tmp_path)
    wide = uncertain()
    parameters = {name: replace(found, standard_error=50.0) for name, found in wide.parameters.items()}
    result = replace(found_in(robot, "auto")[0], joints={"j": replace(wide, parameters=parameters)})
    for each in drawn(result, 200):
        own = {name: p.value for name, p in each.joints["j"].parameters.items()}
        assert own["viscous"] >= 0
        assert own["coulomb"] >= 0
        assert 0 < own["stribeck_velocity"] < 10


def test_the_command_line_writes_all_or_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot, _ = robot_of("arm", tmp_path)
    (tmp_path / "result.json").write_text(found_in(robot)[0].to_json())
    arguments = ("export", tmp_path / "result.json", "-r", robot.path, "-o", tmp_path / "draws", "--to")
    assert run(*arguments, "urdf", "--samples", "3") == 0
    assert sorted(path.name for path in (tmp_path / "draws").iterdir()) == ["000.urdf", "001.urdf", "002.urdf"]
    capsys.readouterr()
    assert "draws: is there already" in refused(capsys, *arguments, "urdf", "--samples", "3")
    assert "0 samples are asked for" in refused(capsys, *arguments, "urdf", "--samples", "0", "--overwrite")
    assert "'unity'" in refused(capsys, *arguments, "unity", "--samples", "2", "--overwrite")
    with pytest.raises(SettingsError, match="'unity'"):
        export_samples(found_in(robot)[0], robot, tmp_path / "none", "unity", 2)
    assert not (tmp_path / "none").exists()


def test_a_result_keeps_its_correlation(tmp_path: Path) -> None:
    robot, _ = robot_of("arm", tmp_path)
    result = replace(found_in(robot, "auto")[0], joints={"j": uncertain()})
    path = tmp_path / "result.json"
    path.write_text(result.to_json())
    assert read_result(path).joints["j"].correlation == uncertain().correlation
    assert np.shape(json.loads(path.read_text())["joints"]["j"]["correlation"]) == (5, 5)

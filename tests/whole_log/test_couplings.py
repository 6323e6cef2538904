"""Friction on a sum of joint speeds is told from that of the joints themselves."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.whole_log.logs import PLAIN

from stribeck import Robot, identify, write_report
from stribeck.app.exporters import TARGETS
from stribeck.app.exporters.targets import summary
from stribeck.core.friction import get_law
from stribeck.core.log import RobotLog
from stribeck.core.result import Result, read_result
from stribeck.core.settings import Settings
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.robots import MODELS
from stribeck.simulation.sensors.measure import with_noise

SHARED = {"viscous": 0.5, "coulomb": 2.0}
ROTOR = 0.03
LAW = get_law("coulomb-viscous")
COEFFICIENTS = (1.0, -0.5)


@pytest.fixture(scope="module")
def arm() -> Robot:
    arm = Robot.from_file(MODELS / "arm.toml")
    return replace(arm, couplings={"motor": dict(zip(arm.joint_names[-2:], COEFFICIENTS, strict=True))})


@pytest.fixture(scope="module")
def log(arm: Robot) -> RobotLog:
    """The last two joints share a motor, with a rotor."""
    exact, _ = exact_log(arm, LAW, dict.fromkeys(arm.joint_names, PLAIN), duration=14.0, seed=1)
    coefficients = arm.coefficients(arm.joint_names, ["motor"])[:, 0]
    shared = LAW.torque(exact.velocity @ coefficients, np.array([*SHARED.values(), 0.0]))
    shared += ROTOR * (exact.acceleration @ coefficients)
    loaded = replace(exact, torque=exact.torque + np.outer(shared, coefficients))
    return with_noise(loaded, position=1e-5, torque=0.05, seed=2)


def identified(arm: Robot, log: RobotLog, law: str) -> Result:
    settings = Settings(method="whole-log", corrections="none", law=law, fit_armature=["motor"])
    return identify(log, arm, settings)


@pytest.fixture(scope="module")
def simple(arm: Robot, log: RobotLog) -> Result:
    return identified(arm, log, "coulomb-viscous")


@pytest.mark.parametrize("law", ["coulomb-viscous", pytest.param("auto", marks=pytest.mark.long)])
def test_friction_of_a_coupling_is_distinguished_from_its_joints(arm, log, simple, law):
    result = identified(arm, log, law) if law == "auto" else simple
    for name in arm.joint_names:
        for parameter, truth in PLAIN.items():
            assert result.joints[name].parameters[parameter].value == pytest.approx(truth, abs=0.03)
    motor = result.couplings["motor"]
    assert motor.verdict == "identified"
    assert "offset" not in motor.parameters
    for parameter, truth in (SHARED | {"armature": ROTOR}).items():
        low, high = motor.parameters[parameter].interval_95
        assert low <= truth <= high
        assert motor.parameters[parameter].value == pytest.approx(truth, rel=0.03)
    np.testing.assert_allclose(motor.friction([-1.0, 2.0]), [-2.5, 3.0], rtol=0.03)
    assert "load" not in (motor.terms or {}) or not (motor.terms or {})["load"].kept


def test_couplings_are_kept_and_shown(arm: Robot, simple: Result, tmp_path: Path) -> None:
    result = simple
    path = tmp_path / "result.json"
    path.write_text(result.to_json(), encoding="utf-8")
    assert read_result(path) == result
    assert result.couplings["motor"].joints == arm.couplings["motor"]
    assert "motor" not in result.joints
    write_report(result, tmp_path / "report.html")
    assert "motor: friction torque" in (tmp_path / "report.html").read_text(encoding="utf-8")
    evidence = result.evidence
    shown = evidence.samples  # the torque that is drawn over a velocity is what its own law has to explain
    for name, each in result.all_friction.items():
        column = shown.joint_names.index(name)
        left = shown.friction_torque[:, column] - each.friction(shown.velocity[:, column], offset=True)
        moving = np.abs(shown.velocity[:, column]) > 0.05
        assert np.sqrt(np.mean(left[moving] ** 2)) < 0.3
    assert "Cannot store the friction of couplings: motor." in summary(result, arm, TARGETS["urdf"], {}, [])

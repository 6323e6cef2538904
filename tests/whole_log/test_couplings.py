"""Friction on a sum of joint speeds is told from that of the joints themselves."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from tests.mujoco_arm import COULOMB, JOINTS, VISCOUS, friction, record, urdf
from tests.whole_log.logs import PLAIN

from stribeck import Robot, export, identify, write_report
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


@pytest.fixture(scope="module")
def simple(arm: Robot, log: RobotLog) -> Result:
    settings = Settings(method="whole-log", corrections="none", law="coulomb-viscous", fit_armature=["motor"])
    return identify(log, arm, settings)


def test_friction_of_a_coupling_is_distinguished_from_its_joints(arm: Robot, simple: Result) -> None:
    for name in arm.joint_names:
        for parameter, truth in PLAIN.items():
            assert simple.joints[name].parameters[parameter].value == pytest.approx(truth, abs=0.03)
    motor = simple.couplings["motor"]
    assert motor.verdict == "identified"
    assert "offset" not in motor.parameters
    for parameter, truth in (SHARED | {"armature": ROTOR}).items():
        low, high = motor.parameters[parameter].interval_95
        assert low <= truth <= high
        assert motor.parameters[parameter].value == pytest.approx(truth, rel=0.03)
    np.testing.assert_allclose(motor.friction([-1.0, 2.0]), [-2.5, 3.0], rtol=0.03)


def test_couplings_are_kept_and_shown(arm: Robot, simple: Result, tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    path.write_text(simple.to_json(), encoding="utf-8")
    assert read_result(path) == simple
    assert simple.couplings["motor"].joints == arm.couplings["motor"]
    write_report(simple, tmp_path / "report.html")
    assert "motor: friction torque" in (tmp_path / "report.html").read_text(encoding="utf-8")
    evidence = simple.evidence
    shown = evidence.samples  # the torque that is drawn over a velocity is what its own law has to explain
    for name, each in simple.all_friction.items():
        column = shown.joint_names.index(name)
        left = shown.friction_torque[:, column] - each.friction(shown.velocity[:, column], offset=True)
        moving = np.abs(shown.velocity[:, column]) > 0.05
        assert np.sqrt(np.mean(left[moving] ** 2)) < 0.3
    lines = summary(simple, arm, TARGETS["urdf"], {}, [], inertia=False, reason="")
    assert "Cannot store the friction of couplings: motor." in lines


MOTORS = {"a": {JOINTS[1]: 1.0, JOINTS[2]: 0.6}, "b": {JOINTS[1]: 1.0, JOINTS[2]: -0.6}}


def test_friction_of_two_motors_replaces_that_of_two_joints(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(urdf(), encoding="utf-8")
    speeds = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.6, -0.6]])
    np.savez(tmp_path / "log.npz", **record((3, 4, 4), motors=speeds), joint_names=JOINTS)
    lines = ["[robot]", "model = 'arm.urdf'", "base = 'fixed'", "torque_source = 'motor_current'"]
    for name, parts in MOTORS.items():
        joints = ", ".join(f"'{joint}' = {coefficient}" for joint, coefficient in parts.items())
        lines += ["[[robot.couplings]]", f"name = '{name}'", f"joints = {{ {joints} }}", "own_friction = false"]
    (tmp_path / "robot.toml").write_text("\n".join(lines), encoding="utf-8")
    result = identify(tmp_path / "log.npz", tmp_path / "robot.toml")
    found = [float(result[name].friction([3.0])[0]) for name in MOTORS]
    np.testing.assert_allclose(found, friction(np.full(3, 3.0))[1:], rtol=0.05)
    assert [result[name].verdict for name in (*MOTORS, *JOINTS[1:])] == ["identified"] * 2 + ["no friction"] * 2
    export(result, tmp_path / "robot.toml", tmp_path / "found.xml", "mjcf")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "found.xml"))
    np.testing.assert_allclose(model.tendon_frictionloss, COULOMB[1:], rtol=0.05)
    np.testing.assert_allclose(np.ravel(model.tendon_damping), VISCOUS[1:], rtol=0.05)
    assert not model.dof_frictionloss[1:].any()

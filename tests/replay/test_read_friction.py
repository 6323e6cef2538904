"""The friction that model files state: numbers, defaults, motors, and what is not understood."""

from pathlib import Path

import numpy as np
import pytest
from tests.exporters.found import joint, of_joint
from tests.exporters.test_sweep import EFFECT

from stribeck import export
from stribeck.replay.model_friction import JointFriction, ModelFriction
from stribeck.replay.replay import read_friction

MJCF = """<mujoco><default><joint damping="0.3" frictionloss="0.2"/></default>
<worldbody><body name="a"><joint name="hinge" {}/><inertial mass="1" pos="0 0 .1" diaginertia=".1 .1 .1"/></body>
</worldbody>{}</mujoco>"""
MOTOR = """<actuator><dcmotor name="f" joint="hinge" input="none" motorconst="0 0" resistance="1" gear="{}"
lugre="1000 1 1 1.5 0.1"/></actuator>"""


def read(tmp_path: Path, joint: str, more: str = "") -> tuple[JointFriction, list[str]]:
    (tmp_path / "model.xml").write_text(MJCF.format(joint, more))
    joints, _, notes = read_friction(tmp_path / "model.xml")
    return joints["hinge"], notes


@pytest.mark.parametrize("gear", [1, 2])
def test_a_lugre_motor_is_stribeck_friction(gear: int, tmp_path: Path) -> None:
    found, _ = read(tmp_path, "", MOTOR.format(gear))
    assert found.coulomb == pytest.approx(0.2 + gear * 1.0)
    assert found.rise == pytest.approx(gear * 0.5)
    assert found.stribeck_velocity == pytest.approx(0.1 / gear)


def test_what_export_writes_as_lugre_is_read_again(tmp_path: Path) -> None:
    result, robot, name = of_joint(joint(**EFFECT), tmp_path, "toro")
    export(result, robot, tmp_path / "new.xml", "mjcf", friction="lugre")
    found, _, _ = read_friction(tmp_path / "new.xml")
    speeds = np.array([-1.0, -0.05, 0.02, 0.1, 1.0])
    read_again = ModelFriction([found[name]]).torque(speeds[:, None])[:, 0]
    np.testing.assert_allclose(read_again, result.joints[name].friction(speeds), rtol=1e-3)


def test_a_fixed_tendons_friction_is_a_couplings(tmp_path: Path) -> None:
    tendon = '<tendon><fixed name="t" frictionloss="2" damping="0.5"><joint joint="hinge" coef="-3"/></fixed></tendon>'
    read(tmp_path, "", tendon)
    _, couplings, notes = read_friction(tmp_path / "model.xml")
    assert couplings == {"t": ({"hinge": -3.0}, JointFriction(coulomb=2.0, viscous=0.5))}
    assert notes == []


def test_the_damping_of_a_rollout_is_finite_at_rest() -> None:
    friction = ModelFriction([JointFriction(coulomb=1.0, viscous=0.5, rise=0.5, stribeck_velocity=0.1)])
    velocity = np.array([[-2.0], [0.0], [0.3]])
    damping = friction.damping(velocity)[:, :, 0]
    np.testing.assert_allclose((damping * velocity)[[0, 2]], friction.torque(velocity)[[0, 2]])
    assert damping[1, 0] == pytest.approx(1.5 / 1e-3, rel=1e-3)


def test_a_couplings_friction_acts_on_its_joints_and_takes_power() -> None:
    own = [JointFriction(coulomb=0.2), JointFriction(viscous=0.1)]
    friction = ModelFriction(own, [(np.array([1.0, -2.0]), JointFriction(coulomb=1.0, viscous=0.5))])
    velocity = np.array([[0.5, 1.0], [-1.0, 0.3]])
    coupled = velocity @ [1.0, -2.0]
    expected = np.outer(np.sign(coupled) + 0.5 * coupled, [1.0, -2.0])
    expected += np.column_stack([0.2 * np.sign(velocity[:, 0]), 0.1 * velocity[:, 1]])
    np.testing.assert_allclose(friction.torque(velocity), expected)
    np.testing.assert_allclose((friction.damping(velocity) @ velocity[:, :, None])[:, :, 0], expected)

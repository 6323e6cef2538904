"""The friction that model files state: numbers, defaults, motors, and what is not understood."""

from pathlib import Path

import numpy as np
import pytest
from tests.export.test_in_mujoco import EFFECT, toro_with_friction
from tests.models import EXAMPLES, MODELS

from stribeck import export
from stribeck.replay.model_friction import CREEP, JointFriction, ModelFriction
from stribeck.replay.read_friction import read_friction

MJCF = """<mujoco><default><joint damping="0.3" frictionloss="0.2"/></default>
<worldbody><body name="a"><joint name="hinge" {}/><inertial mass="1" pos="0 0 .1" diaginertia=".1 .1 .1"/></body>
</worldbody>{}</mujoco>"""
MOTOR = """<actuator><dcmotor name="f" joint="hinge" input="none" motorconst="0 0" resistance="1" gear="{}"
lugre="1000 1 1 1.5 0.1"/></actuator>"""


def read(tmp_path: Path, joint: str, more: str = "") -> tuple[JointFriction, list[str]]:
    (tmp_path / "model.xml").write_text(MJCF.format(joint, more))
    found, notes = read_friction(tmp_path / "model.xml")
    return found["hinge"], notes


def test_mjcf_has_its_defaults(tmp_path: Path) -> None:
    found, notes = read(tmp_path, 'damping="0.5"')
    assert found == JointFriction(coulomb=0.2, viscous=0.5)
    assert notes == []


@pytest.mark.parametrize("gear", [1, 2])
def test_a_lugre_motor_is_stribeck_friction(gear: int, tmp_path: Path) -> None:
    found, _ = read(tmp_path, "", MOTOR.format(gear))
    assert found.coulomb == pytest.approx(0.2 + gear * 1.0)
    assert found.rise == pytest.approx(gear * 0.5)
    assert found.stribeck_velocity == pytest.approx(0.1 / gear)


def test_what_is_not_understood_is_said(tmp_path: Path) -> None:
    tendon = '<tendon><fixed name="t" frictionloss="1"><joint joint="hinge" coef="1"/></fixed></tendon>'
    _, notes = read(tmp_path, 'stiffness="2"', tendon)
    assert notes == [
        "joint 'hinge': a spring (stiffness), which is left out",
        "1 tendon(s) with friction, damping or stiffness are left out",
    ]


def test_what_export_writes_as_lugre_is_read_again(tmp_path: Path) -> None:
    result, robot, name = toro_with_friction(tmp_path)
    export(result, robot, tmp_path / "new.xml", "mjcf", friction="lugre")
    found, _ = read_friction(tmp_path / "new.xml")
    speeds = np.array([-1.0, -0.05, 0.02, 0.1, 1.0])
    read_again = ModelFriction([found[name]]).torque(speeds[:, None])[:, 0]
    np.testing.assert_allclose(read_again, result.joints[name].friction(speeds), rtol=1e-3)
    assert EFFECT["stribeck_gain"] > 0


def test_urdf_and_sdf_have_dynamics(tmp_path: Path) -> None:
    urdf, _ = read_friction(EXAMPLES / MODELS["panda"][0])
    assert urdf["panda_joint1"] == JointFriction(viscous=0.003)
    (tmp_path / "model.sdf").write_text(
        '<sdf version="1.6"><model name="m"><joint name="j" type="revolute"><axis><dynamics><friction>0.4</friction>'
        "<damping>0.1</damping></dynamics></axis></joint></model></sdf>"
    )
    sdf, _ = read_friction(tmp_path / "model.sdf")
    assert sdf["j"] == JointFriction(coulomb=0.4, viscous=0.1)


def test_the_slope_of_a_rollout_is_finite_at_rest() -> None:
    friction = ModelFriction([JointFriction(coulomb=1.0, viscous=0.5, rise=0.5, stribeck_velocity=0.1)])
    velocity = np.array([[-2.0], [0.0], [0.3]])
    slope = friction.slope(velocity)
    np.testing.assert_allclose((slope * velocity)[[0, 2]], friction.torque(velocity)[[0, 2]])
    assert slope[1, 0] == pytest.approx(1.5 / CREEP, rel=1e-3)

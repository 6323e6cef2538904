"""Exported joints in MuJoCo: swept at steady speeds they resist as the law says, within the loss that was stated."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from tests.export.found import found_in
from tests.export.test_export import STEP, compiled, robot_of
from tests.export.test_forms import joint

from stribeck import Robot, export
from stribeck.errors import SettingsError
from stribeck.export.forms import SPEEDS
from stribeck.export.joints import joint_terms
from stribeck.export.write import TARGETS
from stribeck.result import Result

EFFECT = {"coulomb": 2.0, "viscous": 0.3, "stribeck_gain": 0.5, "stribeck_velocity": 0.1, "offset": 0.0}


TRAVEL = 0.01
"""After which the torque is steady [rad]."""


def swept(model: mujoco.MjModel, name: str, speeds: np.ndarray) -> np.ndarray:
    """Return the torque that resists a joint's steady motion, all else at rest."""
    data, found = mujoco.MjData(model), []
    dof, place = model.joint(name).dofadr[0], model.joint(name).qposadr[0]
    for speed in speeds:
        mujoco.mj_resetData(model, data)
        for _ in range(50 + int(TRAVEL / (abs(speed) * STEP))):
            data.qvel[:], data.qpos[place] = 0.0, 0.0
            data.qvel[dof] = speed
            mujoco.mj_forward(model, data)
            found_now = -(data.qfrc_passive + data.qfrc_actuator + data.qfrc_constraint)[dof]
            mujoco.mj_step(model, data)
        found.append(found_now)
    return np.array(found)


def toro_with_friction(folder: Path, **values: float) -> tuple[Result, Robot, str]:
    robot, _ = robot_of("toro", folder)
    name = robot.joint_names[0]
    own = joint(**(EFFECT | values))
    return replace(found_in(robot, "auto")[0], joints={name: own}, corrections=None), robot, name


@pytest.mark.parametrize("form", ["plain", "lugre"])
def test_its_steady_torque_is_the_laws_within_the_loss_that_was_stated(form: str, tmp_path: Path) -> None:
    result, robot, name = toro_with_friction(tmp_path, slope=80.0)
    export(result, robot, tmp_path / "new.xml", "mjcf", friction=form)
    own, terms = result.joints[name], joint_terms(result, TARGETS["mjcf"].forms[form])[name]
    assert terms.remains is not None
    speeds = np.arange(1, SPEEDS + 1) / SPEEDS
    resisting = swept(compiled(tmp_path / "new.xml"), name, speeds)
    off = np.sqrt(np.mean((resisting - own.friction(speeds)) ** 2))
    assert off == pytest.approx(terms.remains[0], rel=0.3, abs=2e-3)
    assert off < (0.02 if form == "lugre" else 0.3)


def test_the_form_that_loses_least_is_taken(tmp_path: Path) -> None:
    result, robot, name = toro_with_friction(tmp_path)
    lines = export(result, robot, tmp_path / "new.xml", "mjcf")
    (line,) = (line for line in lines if line.startswith(f"Joint {name}: "))
    assert "tau_c 2 N m" in line
    assert "tau_s 3 N m" in line
    resisting = swept(compiled(tmp_path / "new.xml"), name, np.array([-0.5, -0.05, 0.02, 0.1, 1.0]))
    law = result.joints[name].friction(np.array([-0.5, -0.05, 0.02, 0.1, 1.0]))
    np.testing.assert_allclose(resisting, law, rtol=1e-4)
    plain, robot, name = toro_with_friction(tmp_path, stribeck_gain=0.0)
    lines = export(plain, robot, tmp_path / "plain.xml", "mjcf")
    assert any(f"Joint {name}: frictionloss 2 N m" in line for line in lines)
    with pytest.raises(SettingsError, match="'dahl'; expected plain or lugre"):
        export(result, robot, tmp_path / "no.xml", "mjcf", friction="dahl")


def test_bristles_that_were_found_are_those_of_the_motor(tmp_path: Path) -> None:
    """After a reversal at 0.2 rad/s, until friction is steady again."""
    bristles = {"bristle_travel": 0.01, "bristle_damping": 1.5}
    result, robot, name = toro_with_friction(tmp_path, **bristles)
    own = replace(result.joints[name], law="lugre")
    result = replace(result, law="lugre", joints={name: own})
    lines = export(result, robot, tmp_path / "new.xml", "mjcf", friction="lugre")
    (line,) = (line for line in lines if line.startswith(f"Joint {name}: "))
    assert "sigma_1 1.5 N m s/rad, sigma_0 200 N m/rad" in line
    assert "bristle" not in line
    model = compiled(tmp_path / "new.xml")
    data, dof, place = mujoco.MjData(model), model.joint(name).dofadr[0], model.joint(name).qposadr[0]
    velocity, found = np.repeat([0.2, -0.2], round(0.4 / STEP)), []
    for speed in velocity:
        data.qvel[:], data.qpos[place] = 0.0, 0.0
        data.qvel[dof] = speed
        mujoco.mj_forward(model, data)
        found.append(-(data.qfrc_passive + data.qfrc_actuator + data.qfrc_constraint)[dof])
        mujoco.mj_step(model, data)
    law = own.friction(velocity, period=STEP)
    after = slice(len(velocity) // 2, None)
    np.testing.assert_allclose(found[after], law[after], atol=0.02)
    weak = replace(
        own, parameters={k: replace(p, verdict="weak") if "bristle" in k else p for k, p in own.parameters.items()}
    )
    lines = export(replace(result, joints={name: weak}), robot, tmp_path / "weak.xml", "mjcf", friction="lugre")
    (line,) = (line for line in lines if line.startswith(f"Joint {name}: "))
    assert "sigma" not in line
    assert "bristle_travel 0.01, bristle_damping 1.5" in line


def test_lugre_holds_at_rest_where_frictionloss_creeps(tmp_path: Path) -> None:
    """A torque of 60 % of Coulomb friction, after three seconds."""
    crept = {}
    for form in ("plain", "lugre"):
        result, robot, name = toro_with_friction(tmp_path, stribeck_gain=0.2)
        export(result, robot, tmp_path / f"{form}.xml", "mjcf", friction=form)
        model = compiled(tmp_path / f"{form}.xml")
        data = mujoco.MjData(model)
        place, dof = model.joint(name).qposadr[0], model.joint(name).dofadr[0]
        others = np.setdiff1d(np.arange(model.nv), dof)
        for k in range(20_000):
            data.qfrc_applied[dof] = 1.2
            data.qvel[others] = 0.0
            mujoco.mj_step(model, data)
            if k == 15_000:
                middle = data.qpos[place]
        crept[form] = abs(data.qpos[place] - middle)
    assert crept["lugre"] < 1e-4
    assert crept["lugre"] < 0.1 * crept["plain"]

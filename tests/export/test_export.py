"""Exported models are the robot that was found: to Pinocchio to rounding, and to MuJoCo, which simulates them."""

import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from tests.export.found import FRICTION, found_in, joint_result
from tests.models import EXAMPLES, MODELS

from stribeck import Robot, export
from stribeck.result import CurvePoint
from stribeck_simulation.robots.biped import MODELS as PACKAGED
from stribeck_simulation.robots.toro import ROBOT_FILE

STEP = 2e-4
"""Of simulations [s]."""

ROBOTS = ["toro", "arm", "biped", "quadruped", "talos", "g1", "go2", "panda", "kinova", "ur5", "cassie"]


def robot_of(name: str, folder: Path) -> tuple[Robot, str]:
    """Return a robot, read from a file in the folder, and its format."""
    packaged = {"toro": ROBOT_FILE, "arm": PACKAGED / "arm.toml", "biped": PACKAGED / "robot.toml"}
    packaged["quadruped"] = PACKAGED / "quadruped.toml"
    path = folder / "robot.toml"
    if name in packaged:
        text = packaged[name].read_text().replace('model = "', f'model = "{PACKAGED}/')
    else:
        model, keys, _ = MODELS[name]
        text = f'[robot]\nmodel = "{EXAMPLES / model}"\nbase = "{keys.get("base", "floating")}"\n'
        if name == "g1":
            text += "locked = { waist_roll_joint = 0.1, left_wrist_roll_joint = -0.4 }\n"
    path.write_text(text)
    return Robot.from_file(path), {"toro": "mjcf"}.get(name, "urdf")


def read_again(robot: Robot, model: Path) -> Robot:
    """Return the robot that the same robot file describes with another model file."""
    lines = Path(robot.path).read_text().splitlines()
    lines = [f'model = "{model}"' if line.startswith("model =") else line for line in lines]
    path = model.with_suffix(".toml")
    path.write_text("\n".join(lines))
    return Robot.from_file(path)


def assert_same_dynamics(one: Robot, other: Robot, tolerance: float = 1e-9) -> None:
    """Compare inertia matrices and bias torques at some states."""
    model = one.tree.model
    for seed in range(5):
        generator = np.random.default_rng(seed)
        position = pin.integrate(model, pin.neutral(model), generator.normal(size=model.nv))
        velocity = generator.normal(size=model.nv)
        terms = []
        for robot in (one, other):
            data = robot.tree.model.createData()
            matrix = np.triu(pin.crba(robot.tree.model, data, position))
            terms.append((matrix, pin.rnea(robot.tree.model, data, position, velocity, np.zeros(model.nv))))
        for a, b in zip(*terms, strict=True):
            np.testing.assert_allclose(a, b, atol=tolerance * np.abs(a).max(), rtol=0)


def compiled(path: Path) -> mujoco.MjModel:
    """Return what MuJoCo makes of a file, without meshes, whose packages are not here, and with room to move."""
    spec = mujoco.MjSpec.from_file(str(path))
    for geom in list(spec.geoms):
        if geom.type == mujoco.mjtGeom.mjGEOM_MESH:
            spec.delete(geom)
    for mesh in list(spec.meshes):
        spec.delete(mesh)
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    spec.option.gravity[:] = 0.0
    spec.option.timestep = STEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    return spec.compile()


@pytest.mark.parametrize("name", ROBOTS)
def test_what_is_read_again_is_the_corrected_robot(name: str, tmp_path: Path) -> None:
    robot, target = robot_of(name, tmp_path)
    result, corrected = found_in(robot)
    path = tmp_path / "new" / f"{name}.xml"
    export(result, robot, path, target)
    again = read_again(robot, path)
    assert again.joint_names == robot.joint_names
    assert len(again.warnings) == len(robot.warnings)
    assert_same_dynamics(corrected, again)


@pytest.mark.parametrize("name", ["toro", "arm", "biped", "talos", "g1"])
def test_mujoco_simulates_it_and_it_loses_what_friction_takes(name: str, tmp_path: Path) -> None:
    robot, target = robot_of(name, tmp_path)
    result, corrected = found_in(robot)
    path = tmp_path / f"{name}.xml"
    export(result, robot, path, target)
    model = compiled(path)
    joints = [model.joint(joint).dofadr[0] for joint in robot.joint_names]
    np.testing.assert_allclose(model.dof_frictionloss[joints], FRICTION["coulomb"][0])
    np.testing.assert_allclose(model.dof_damping[joints].reshape(len(joints), -1)[:, 0], FRICTION["viscous"][0])
    if robot.base == "floating" and target == "mjcf":
        assert model.body_mass.sum() == pytest.approx(corrected.mass, rel=1e-9)
    data = mujoco.MjData(model)
    data.qvel[joints] = np.random.default_rng(0).normal(size=len(joints))
    energies, powers = [], []
    for _ in range(500):
        mujoco.mj_forward(model, data)
        mujoco.mj_energyVel(model, data)
        speed = np.abs(data.qvel[joints])
        energies.append(data.energy[1])
        powers.append(FRICTION["coulomb"][0] * speed.sum() + FRICTION["viscous"][0] * (speed**2).sum())
        mujoco.mj_step(model, data)
    assert np.isfinite(data.qpos).all()
    lost, work = energies[0] - energies[-1], STEP * np.sum(powers)
    assert 0.6 * work < lost < 1.01 * work  # MuJoCo softens friction near standstill


@pytest.mark.parametrize("name", [*ROBOTS, "icub"])
def test_every_body_that_is_written_can_exist(name: str, tmp_path: Path) -> None:
    """iCub's own model has bodies that cannot; they are named, and become the nearest that can."""
    robot, target = robot_of(name, tmp_path)
    result, corrected = found_in(robot, seed=1)
    lines = export(result, robot, tmp_path / "new.xml", target)
    again = read_again(robot, tmp_path / "new.xml")
    assert result.corrections is not None
    for joint in result.corrections.bodies:
        body = again.tree.model.inertias[again.tree.model.getJointId(joint)]
        moments = np.linalg.eigvalsh(body.inertia)
        assert body.mass > 0
        assert moments[0] > 0
        assert moments[2] <= moments[0] + moments[1]
    impossible = [line for line in lines if line.startswith("No body has the inertia found")]
    assert bool(impossible) == (name == "icub")
    if impossible:
        assert "neck_roll" in impossible[0]
        assert_same_dynamics(corrected, again, 1e-4)


def test_friction_is_stated_in_the_formats_words_and_the_rest_is_told(tmp_path: Path) -> None:
    robot, _ = robot_of("arm", tmp_path)
    names = robot.joint_names
    told = {
        names[0]: joint_result({**FRICTION, "armature": (0.05, "kg m^2")}, weak=("viscous",)),
        names[1]: joint_result(FRICTION, weak=("viscous", "coulomb")),
        names[2]: joint_result({}),
    }
    result = replace(found_in(robot)[0], joints=told, corrections=None)
    lines = export(result, robot, tmp_path / "new.urdf", "urdf")
    joints = {joint.get("name"): joint for joint in ET.parse(tmp_path / "new.urdf").getroot().iter("joint")}
    before = {joint.get("name"): joint for joint in ET.parse(PACKAGED / "arm.urdf").getroot().iter("joint")}
    dynamics = joints[names[0]].find("dynamics")
    assert dynamics is not None
    assert dynamics.attrib == {"friction": "1.2", "damping": "0.3"}
    for name in names[1:]:
        assert ET.tostring(joints[name]) == ET.tostring(before[name])
    text = (tmp_path / "new.urdf").read_text()
    assert all(line.replace("--", "- -") in text for line in lines)
    assert (
        f"Joint {names[0]}: friction 1.2 N m, damping 0.3 N m s/rad; no place here for offset -0.4 N m, "
        "armature 0.05 kg m^2." in text
    )
    assert f"keep what the model said: {names[1]}, {names[2]}." in text
    assert_same_dynamics(robot, read_again(robot, tmp_path / "new.urdf"), 1e-15)


def test_a_joint_without_friction_has_none_in_the_model_and_its_bound_is_told(tmp_path: Path) -> None:
    robot, _ = robot_of("arm", tmp_path)
    points = [
        CurvePoint(velocity=speed, value=0.0, standard_error=0.1, interval_95=(0.0, 0.2), unit="N m")
        for speed in (0.1, 0.5, 1.0)
    ]
    none = replace(
        joint_result({"offset": (0.1, "N m")}),
        verdict="no friction",
        reason="no friction detectable, below 0.2 N m",
        curve=tuple(points),
    )
    result = replace(found_in(robot)[0], joints={robot.joint_names[0]: none}, corrections=None)
    export(result, robot, tmp_path / "new.urdf", "urdf")
    dynamics = ET.parse(tmp_path / "new.urdf").getroot().find(f"joint[@name='{robot.joint_names[0]}']/dynamics")
    assert dynamics is not None
    assert dynamics.attrib == {"friction": "0.0", "damping": "0.0"}
    told = f"Joint {robot.joint_names[0]}: friction 0 N m, damping 0 N m s/rad (no friction detectable, below 0.2 N m);"
    assert told in (tmp_path / "new.urdf").read_text()


def test_of_two_directions_models_get_the_mean(tmp_path: Path) -> None:
    robot, _ = robot_of("toro", tmp_path)
    names = robot.joint_names
    levels = {"viscous_positive": 0.2, "viscous_negative": 0.4, "coulomb_positive": 1.5, "coulomb_negative": 0.5}
    told = {
        names[0]: joint_result({name: (value, "N m") for name, value in levels.items()}),
        names[1]: joint_result({**FRICTION, "armature": (0.05, "kg m^2")}, weak=tuple(FRICTION)),
    }
    result = replace(found_in(robot, "asymmetric")[0], joints=told)
    export(result, robot, tmp_path / "new.xml", "mjcf")
    model = compiled(tmp_path / "new.xml")
    first, second = (model.joint(name).dofadr[0] for name in names[:2])
    assert model.dof_frictionloss[first] == pytest.approx(1.0)
    assert model.dof_damping.reshape(model.nv, -1)[first, 0] == pytest.approx(0.3)
    assert model.dof_frictionloss[second] == 0.0
    assert model.dof_armature[second] == pytest.approx(0.05)
    told_in_words = "the nearest to what was found with viscous_positive 0.2 N m, viscous_negative 0.4 N m"
    assert told_in_words in (tmp_path / "new.xml").read_text()

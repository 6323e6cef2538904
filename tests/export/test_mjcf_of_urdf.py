"""A URDF that becomes an MJCF is the same robot: to Pinocchio, and to MuJoCo."""

import struct
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from tests.arm import URDF, write_arm
from tests.export.found import FRICTION, found_in, joint_result
from tests.export.test_export import assert_same_dynamics, read_again, robot_of

from stribeck import Robot, export
from stribeck.errors import SettingsError

URDFS = ["arm", "biped", "quadruped", "talos", "g1", "go2", "panda", "kinova", "ur5"]


@pytest.mark.parametrize("name", URDFS)
def test_it_is_the_same_robot(name: str, tmp_path: Path) -> None:
    robot, _ = robot_of(name, tmp_path)
    result, corrected = found_in(robot)
    path = tmp_path / f"{name}.xml"
    export(result, robot, path, "mjcf")
    again = read_again(robot, path)  # which compares MuJoCo's inertia matrix with Pinocchio's
    assert again.joint_names == robot.joint_names
    assert_same_dynamics(corrected, again)
    model, ours = mujoco.MjModel.from_xml_path(str(path)), corrected.tree.model
    assert model.body_mass.sum() == pytest.approx(sum(body.mass for body in ours.inertias), rel=1e-9)
    for name in robot.joint_names:
        at, own = ours.joints[ours.getJointId(name)], model.joint(name)
        assert model.dof_frictionloss[own.dofadr[0]] == FRICTION["coulomb"][0]
        assert model.dof_damping.reshape(model.nv, -1)[own.dofadr[0], 0] == FRICTION["viscous"][0]
        limits = ours.lowerPositionLimit[at.idx_q], ours.upperPositionLimit[at.idx_q]
        if own.limited[0]:
            np.testing.assert_allclose(own.range, limits, rtol=1e-12)
        else:
            assert at.nq == 2 or np.isinf(limits).all()


def stl(path: Path) -> None:
    """Write a tetrahedron, binary."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=np.float32)
    faces = corners[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *face.ravel(), 0) for face in faces)
    path.write_bytes(bytes(80) + struct.pack("<I", len(faces)) + rows)


def converted(folder: Path, text: str, base: str = "fixed", keys: str = "") -> tuple[str, mujoco.MjModel]:
    """Write an arm whose URDF is another one as MJCF; its text and what MuJoCo makes of it."""
    folder.mkdir(exist_ok=True)
    robot_file = write_arm(folder)
    (folder / "arm.urdf").write_text(text)
    robot_file.write_text(robot_file.read_text().replace('base = "fixed"', f'base = "{base}"\n{keys}'))
    robot = Robot.from_file(robot_file)
    found = {robot.joint_names[0]: joint_result(FRICTION)}
    export(replace(found_in(robot)[0], joints=found, corrections=None), robot, folder / "new" / "arm.xml", "mjcf")
    written = (folder / "new" / "arm.xml").read_text()
    return written, mujoco.MjModel.from_xml_path(str(folder / "new" / "arm.xml"))


def test_shapes_stay_and_meshes_that_are_not_here_go(tmp_path: Path) -> None:
    shapes = """<link name="base">
      <visual><geometry><mesh filename="package://arm/meshes/base.stl" scale="2 2 2"/></geometry></visual>
      <collision><origin xyz="0 0 1" rpy="0 0 1"/><geometry><mesh filename="meshes/base.stl"/></geometry></collision>
      <visual><geometry><mesh filename="package://elsewhere/gone.stl"/></geometry></visual>
      <visual><geometry><mesh filename="meshes/base.dae"/></geometry></visual>
      <visual><geometry><box size="1 2 3"/></geometry><material name="blue"><color rgba="0 0 1 1"/></material></visual>
      <collision><geometry><cylinder radius="0.1" length="0.6"/></geometry></collision></link>"""
    stl(tmp_path / "arm" / "meshes" / "base.stl")
    (tmp_path / "arm" / "meshes" / "base.dae").write_text("")
    text, model = converted(tmp_path / "arm", URDF.replace('<link name="base"/>', shapes))
    assert model.ngeom == 4
    assert model.nmesh == 2
    gone = "Left out, as no such file is here that MuJoCo reads: package://elsewhere/gone.stl, meshes/base.dae."
    assert gone in text
    assert 'file="../meshes/base.stl"' in text
    kinds = {int(kind): k for k, kind in enumerate(model.geom_type)}
    box, cylinder = kinds[int(mujoco.mjtGeom.mjGEOM_BOX)], kinds[int(mujoco.mjtGeom.mjGEOM_CYLINDER)]
    np.testing.assert_allclose(model.geom_size[box], [0.5, 1.0, 1.5])
    np.testing.assert_allclose(model.geom_rgba[box], [0, 0, 1, 1])
    np.testing.assert_allclose(model.geom_size[cylinder][:2], [0.1, 0.3])
    assert (model.geom_contype[box], model.geom_contype[cylinder]) == (0, 1)
    assert model.body_mass.sum() == pytest.approx(6.0)


def test_a_floating_base_gets_a_free_joint(tmp_path: Path) -> None:
    heavy = '<link name="base"><inertial><mass value="4"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    text, model = converted(tmp_path, URDF.replace('<link name="base"/>', f"{heavy}</inertial></link>"), "floating")
    assert "The root link base moves freely." in text
    assert model.nv == 9
    assert model.body("base").mass[0] == 4.0


def test_a_free_joint_of_the_file_stays(tmp_path: Path) -> None:
    joint = '<joint name="free" type="floating"><parent link="world"/><child link="base"/></joint>'
    heavy = '<link name="base"><inertial><mass value="4"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    root = f'<link name="world"/>{joint}{heavy}</inertial></link>'
    _, model = converted(tmp_path, URDF.replace('<link name="base"/>', root))
    assert model.nv == 9
    assert model.joint("free").type[0] == mujoco.mjtJoint.mjJNT_FREE


def test_joints_keep_their_limits_efforts_and_couplings(tmp_path: Path) -> None:
    coupled = URDF.replace('<joint name="elbow" type="continuous">', '<joint name="elbow" type="continuous">'
                           '<mimic joint="shoulder" multiplier="2" offset="0.5"/>')  # fmt: skip
    _, model = converted(tmp_path, coupled)
    assert model.neq == 1
    np.testing.assert_allclose(model.eq_data[0, :2], [0.5, 2.0])
    np.testing.assert_allclose(model.joint("shoulder").range, [-3.0, 3.0])
    np.testing.assert_allclose(model.jnt_actfrcrange[model.joint("shoulder").id], [-100.0, 100.0])
    assert not model.joint("elbow").limited[0]
    assert model.joint("slide").type[0] == mujoco.mjtJoint.mjJNT_SLIDE


def test_what_mjcf_cannot_hold_is_refused(tmp_path: Path) -> None:
    floating = URDF.replace('"base"', '"world"')
    with pytest.raises(SettingsError, match="'world', as MuJoCo's own"):
        converted(tmp_path, floating, "floating")
    planar = URDF.replace('"slide" type="prismatic"', '"slide" type="planar"')
    with pytest.raises(SettingsError, match="joint 'slide' is planar, which MJCF has not there; export to urdf"):
        converted(tmp_path, planar, keys="locked = { slide = 0.0 }")
    assert not (tmp_path / "new").exists()

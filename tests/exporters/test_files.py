"""Exported files keep what was not found: comments, defaults, meshes that still lie where they lay."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from tests.arm import URDF as ARM
from tests.arm import write_arm
from tests.exporters.found import FRICTION, found_in, joint_result
from tests.exporters.test_models import assert_same_dynamics, read_again

from stribeck import Robot, export

MJCF = (Path(__file__).parent / "reader.xml").read_text()
REST = '<mujoco><!-- drives --><actuator><motor joint="hip"/></actuator><include file="parts/more.xml"/></mujoco>'
MORE = '<mujoco><sensor><jointpos joint="knee"/></sensor></mujoco>'
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
URDF = (Path(__file__).parent / "reader.urdf").read_text()


def exported(folder: Path, name: str, text: str, base: str, path: Path) -> Robot:
    """Write a robot to a folder and export a result of it, which is read again; return the corrected robot."""
    (folder / "parts").mkdir(parents=True)
    (folder / "shapes").mkdir()
    (folder / name).write_text(text)
    (folder / "parts/rest.xml").write_text(REST)
    (folder / "parts/more.xml").write_text(MORE)
    (folder / "shapes/block.obj").write_text(TETRAHEDRON)
    (folder / "robot.toml").write_text(f'[robot]\nmodel = "{name}"\nbase = "{base}"\n')
    robot = Robot.from_file(folder / "robot.toml")
    result, corrected = found_in(robot)
    export(result, robot, path, "mjcf" if path.suffix == ".xml" else "urdf", inertia=True)
    assert_same_dynamics(corrected, read_again(robot, path))
    return corrected


@pytest.mark.parametrize("rule", ["auto", "true"])
@pytest.mark.parametrize("place", ["robot/new.xml", "out/deep/new.xml"])
def test_mjcf_with_includes_classes_and_shapes(rule: str, place: str, tmp_path: Path) -> None:
    path = tmp_path / place
    exported(tmp_path / "robot", "reader.xml", MJCF.format(rule=rule), "floating", path)
    old, new = (mujoco.MjModel.from_xml_path(str(file)) for file in (tmp_path / "robot/reader.xml", path))
    assert (new.nu, new.nsensor, new.nmesh, new.ngeom, new.nbody) == (1, 1, 1, old.ngeom, old.nbody)
    np.testing.assert_array_equal(new.dof_armature, old.dof_armature)
    np.testing.assert_allclose(new.dof_frictionloss[6:], 1.2)
    text = path.read_text()
    assert all(words in text for words in ("whose it is", "a head", "drives", 'class="soft"'))


@pytest.mark.parametrize("place", ["robot/new.urdf", "out/new.urdf"])
def test_urdf_keeps_the_rest_and_links_that_are_fixed_to_each_other_share_in_proportion(place, tmp_path):
    path, text = tmp_path / place, URDF.format(compiler="", mesh="shapes/block.obj")
    corrected = exported(tmp_path / "robot", "arm.urdf", text, "fixed", path)
    text = path.read_text()
    assert all(words in text for words in ("whose it is", "xmlns:xacro", "package://arm/tube.stl", 'other="kept"'))
    mesh = text.partition('<mesh filename="')[2].partition('"')[0]
    assert (path.parent / mesh).resolve() == (tmp_path / "robot/shapes/block.obj").resolve()
    assert not Path(mesh).is_absolute()
    masses = [float(part.partition('"')[0]) for part in text.split('mass value="')[1:]]  # an empty link stays empty
    assert masses == pytest.approx([3 * corrected.mass / 3.3, 0.3 * corrected.mass / 3.3], rel=1e-12)


def converted(folder: Path, text: str, base: str = "fixed", keys: str = "") -> tuple[str, mujoco.MjModel]:
    """Write an arm whose ARM is another one as MJCF; its text and what MuJoCo makes of it."""
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
      <visual><geometry><mesh filename="package://arm/meshes/base.obj" scale="2 2 2"/></geometry></visual>
      <collision><origin xyz="0 0 1" rpy="0 0 1"/><geometry><mesh filename="meshes/base.obj"/></geometry></collision>
      <visual><geometry><mesh filename="package://elsewhere/gone.stl"/></geometry></visual>
      <visual><geometry><mesh filename="meshes/base.dae"/></geometry></visual>
      <visual><geometry><box size="1 2 3"/></geometry><material name="blue"><color rgba="0 0 1 1"/></material></visual>
      <collision><geometry><cylinder radius="0.1" length="0.6"/></geometry></collision></link>"""
    (tmp_path / "arm/meshes").mkdir(parents=True)
    (tmp_path / "arm/meshes/base.obj").write_text(TETRAHEDRON)
    (tmp_path / "arm" / "meshes" / "base.dae").write_text("")
    text, model = converted(tmp_path / "arm", ARM.replace('<link name="base"/>', shapes))
    assert model.ngeom == 4
    assert model.nmesh == 2
    gone = "Omitted, because MuJoCo cannot read these meshes: package://elsewhere/gone.stl, meshes/base.dae."
    assert gone in text
    assert 'file="../meshes/base.obj"' in text
    kinds = {int(kind): k for k, kind in enumerate(model.geom_type)}
    box, cylinder = kinds[int(mujoco.mjtGeom.mjGEOM_BOX)], kinds[int(mujoco.mjtGeom.mjGEOM_CYLINDER)]
    np.testing.assert_allclose(model.geom_size[box], [0.5, 1.0, 1.5])
    np.testing.assert_allclose(model.geom_rgba[box], [0, 0, 1, 1])
    np.testing.assert_allclose(model.geom_size[cylinder][:2], [0.1, 0.3])
    assert (model.geom_contype[box], model.geom_contype[cylinder]) == (0, 1)
    assert model.body_mass.sum() == pytest.approx(6.0)


def test_free_joints_limits_efforts_and_couplings_stay(tmp_path: Path) -> None:
    heavy = '<link name="base"><inertial><mass value="4"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    heavy += "</inertial></link>"
    mimic = '<mimic joint="shoulder" multiplier="2" offset="0.5"/>'
    coupled = ARM.replace('<joint name="elbow" type="continuous">', f'<joint name="elbow" type="continuous">{mimic}')
    text, model = converted(tmp_path / "root", coupled.replace('<link name="base"/>', heavy), "floating")
    assert "The root link base moves freely." in text
    assert model.nv == 9
    assert model.body("base").mass[0] == 4.0
    assert model.neq == 1
    np.testing.assert_allclose(model.eq_data[0, :2], [0.5, 2.0])
    np.testing.assert_allclose(model.joint("shoulder").range, [-3.0, 3.0])
    np.testing.assert_allclose(model.jnt_actfrcrange[model.joint("shoulder").id], [-100.0, 100.0])
    assert not model.joint("elbow").limited[0]
    assert model.joint("slide").type[0] == mujoco.mjtJoint.mjJNT_SLIDE
    free = '<link name="world"/><joint name="free" type="floating"><parent link="world"/><child link="base"/></joint>'
    _, model = converted(tmp_path / "free", ARM.replace('<link name="base"/>', free + heavy))
    assert model.nv == 9
    assert model.joint("free").type[0] == mujoco.mjtJoint.mjJNT_FREE


def test_repeated_elements_and_links_without_inertia_are_repaired(tmp_path: Path) -> None:
    twice = ARM.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0"/><axis xyz="1 0 0"/>')
    light = twice.replace(*('ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"', 'ixx="0" iyy="0" izz="0"'))
    text, model = converted(tmp_path, light)
    np.testing.assert_allclose(model.joint("shoulder").axis, [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(model.body("hand").inertia, 1e-6)
    assert model.body("hand").mass == 1.0
    assert "Raised to 1e-06 kg or kg m^2, because MuJoCo requires inertia: links hand." in text

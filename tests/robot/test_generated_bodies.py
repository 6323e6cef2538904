"""MJCF models whose elements generate bodies are read as MuJoCo compiles them, identified, and exported."""

from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from tests.exporters.found import found_in
from tests.exporters.test_files import TETRAHEDRON

from stribeck import Robot, Settings, export, identify
from stribeck.check.init.model import read_model
from stribeck.core.errors import RobotFileError
from stribeck.core.log import RobotLog

OPTION = '<option timestep="1e-3" integrator="implicitfast"/>'
SLIDES = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint type="slide"/>'
LINK = '<body name="{0}"><joint name="{0}" axis="{1}" pos="0 0 .1" frictionloss="{2}"/><geom size=".05 .1" {3}/>'
HAND = f"""<mujoco>{OPTION}<default><joint damping=".02" armature=".003" solreffriction=".002 1"/></default><worldbody>
  <body name="palm"><geom size=".1"/><replicate count="3" euler="0 0 120" sep="_">
  {LINK.format("knuckle", "0 1 0", 0.05, 'pos=".1 0 0"')}{LINK.format("tip", "0 1 0", 0.03, 'pos=".1 0 .1"')}
  <site name="pad"/></body></body></replicate></body></worldbody></mujoco>"""
ARM = f"""<mujoco model="arm"><compiler meshdir="shapes"/>
  <default><joint damping=".3" armature=".05" solreffriction=".002 1"/></default>
  <asset><mesh name="block" file="block.obj" scale=".1 .1 .1"/></asset><worldbody>
  {LINK.format("j1", "0 1 0", 0.6, 'type="capsule" mass="2"')}<geom type="mesh" mesh="block"/>
  {LINK.format("j2", "1 0 0", 0.4, 'pos="0 0 .2" mass="1"')}</body></body></worldbody></mujoco>"""
ATTACH = '<frame pos="0 {1} 0" euler="0 0 {2}"><attach model="arm" body="j1" prefix="{0}_"/></frame>'
SCENE = f"""<mujoco>{OPTION}<asset><model file="parts/arm.xml"/></asset><worldbody><geom type="plane" size="1 1 1"/>
  {ATTACH.format("left", 0.5, 90)}{ATTACH.format("right", -0.5, 0)}
  <flexcomp name="cloth" type="grid" count="3 3 1" spacing=".1 .1 .1" pos="2 0 1" dim="2"><edge equality="true"/>
  </flexcomp>
  <replicate count="4" offset="0 0 .1"><body name="grain" pos="3 0 1">{SLIDES}<geom size=".01"/></body></replicate>
  </worldbody></mujoco>"""
SELF = '<asset><model name="arm" file="{}"/></asset><worldbody><attach model="arm" prefix="a"/>{}</worldbody>'
COPIES = '<replicate count="100">'
TWICE = '<attach model="arm" prefix="b"/>'


def scene(folder: Path, text: str) -> Path:
    (folder / "parts/shapes").mkdir(parents=True)
    (folder / "parts/arm.xml").write_text(ARM)
    (folder / "parts/shapes/block.obj").write_text(TETRAHEDRON)
    (folder / "scene.xml").write_text(text)
    return folder / "scene.xml"


@pytest.mark.parametrize(("text", "count"), [(HAND, 6), (SCENE, 4)])
def test_the_model_is_what_mujoco_compiles(text: str, count: int, tmp_path: Path) -> None:
    path = scene(tmp_path, text)
    robot, compiled = Robot.from_model(path, base="fixed"), mujoco.MjModel.from_xml_path(str(path))
    joints = [compiled.joint(name) for name in robot.joint_names]
    assert robot.joint_names == tuple(n for k in range(compiled.njnt) if (n := compiled.joint(k).name))
    assert len(joints) == count
    data, rows = mujoco.MjData(compiled), [int(joint.dofadr[0]) for joint in joints]
    position = np.linspace(-0.5, 0.7, count)
    data.qpos[[int(joint.qposadr[0]) for joint in joints]], data.qvel[rows] = position, position[::-1]
    mujoco.mj_forward(compiled, data)
    torque = pin.rnea(robot.tree.model, robot.tree.model.createData(), position, position[::-1].copy(), 0 * position)
    np.testing.assert_allclose(torque, data.qfrc_bias[rows], rtol=1e-9)
    assert read_model(path).joints == robot.joint_names
    left_out = "scene.xml: objects beside the robot are left out: cloth_0, cloth_1, cloth_2, cloth_3, cloth_4, cloth_5"
    assert [line for line in robot.warnings if "scene" in line] == [f"{left_out} and 7 more"] * (text == SCENE)


def test_vertices_of_a_soft_part_of_the_robot_are_fixed(tmp_path: Path) -> None:
    pad = '<flexcomp name="pad" type="grid" count="2 2 2" spacing=".1 .1 .1" mass=".3" dim="3"><pin id="0"/></flexcomp>'
    text = HAND.replace("</replicate>", f"</replicate>{pad}").replace("damping", "stiffness")
    robot = Robot.from_model(scene(tmp_path, text), base="fixed")
    assert len(robot.joint_names) == 6


def record(path: Path) -> tuple[RobotLog, dict[str, tuple[float, float]]]:
    """Simulate the motion of all joints with a name by MuJoCo alone; also return their friction."""
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    named = [joint for joint in map(model.joint, range(model.njnt)) if joint.name]
    at, of = (np.array([int(getattr(joint, word)[0]) for joint in named]) for word in ("qposadr", "dofadr"))
    truth = model.dof_frictionloss[of], model.dof_damping.reshape(model.nv, -1)[of, 0]
    data, stiffness = mujoco.MjData(model), 50 * truth[0] / truth[0].max() * (20 if truth[0].max() > 0.1 else 0.1)
    omega, phase = np.random.default_rng(0).uniform(1.0, 5.0, (2, 4, len(named)))
    rows = []
    for time in np.arange(0, 12, model.opt.timestep):
        mujoco.mj_step1(model, data)
        goal = 0.6 * np.sum(np.sin(omega * time + phase) / omega, axis=0)
        torque = stiffness * (goal - data.qpos[at] - 0.1 * data.qvel[of]) + data.qfrc_bias[of]
        data.qfrc_applied[of] = torque
        rows.append((data.qpos[at].copy(), data.qvel[of].copy(), torque))
        mujoco.mj_step2(model, data)
    position, velocity, torque = np.swapaxes(rows[::4], 0, 1)
    names = tuple(joint.name for joint in named)
    time = 4 * model.opt.timestep * np.arange(len(torque))
    torque = torque + 2e-3 * torque.std(axis=0) * np.random.default_rng(1).normal(size=torque.shape)
    log = RobotLog(joint_names=names, time=time, position=position, velocity=velocity, torque=torque)
    return log, dict(zip(names, zip(*truth, strict=True), strict=True))


@pytest.mark.parametrize("text", [pytest.param(HAND, marks=pytest.mark.long), SCENE])
def test_known_friction_is_found_and_written_to_generated_joints(text: str, tmp_path: Path) -> None:
    path = scene(tmp_path, text)
    robot = Robot.from_model(path, base="fixed", torque_source="motor_current")
    log, truth = record(path)
    lines = export(identify(log, robot, Settings(law="coulomb-viscous")), robot, tmp_path / "out/new.xml", "mjcf")
    assert any("MuJoCo's own text" in line for line in lines)
    new, old = (mujoco.MjModel.from_xml_path(str(file)) for file in (tmp_path / "out/new.xml", path))
    assert (new.nbody, new.nmesh, new.nflex, new.neq) == (old.nbody, old.nmesh, old.nflex, old.neq)
    for name, friction in truth.items():
        row = int(new.joint(name).dofadr[0])
        written = new.dof_frictionloss[row], new.dof_damping.reshape(new.nv, -1)[row, 0]
        assert written == pytest.approx(friction, rel=0.01)
        shown = next(line for line in lines if line.startswith(name)).partition(" v")[0].split()
        assert [float(shown[k]) for k in (1, 3)] == pytest.approx(friction)


def test_inertias_are_written_to_generated_links(tmp_path: Path) -> None:
    path = scene(tmp_path, SCENE)
    robot = Robot.from_model(path, base="fixed")
    result, corrected = found_in(robot)
    export(result, robot, tmp_path / "new.xml", "mjcf", inertia=True)
    mass = mujoco.MjModel.from_xml_path(str(tmp_path / "new.xml")).body("left_j2").mass[0]
    assert mass == pytest.approx(corrected.tree.model.inertias[2].mass, rel=1e-9)
    assert mass != pytest.approx(1.0)


ENDLESS = {
    "itself": SELF.format("scene.xml", ""),
    "copies": f"<worldbody>{COPIES * 3}<body/>{'</replicate>' * 3}</worldbody>",
    "grid": '<worldbody><flexcomp name="c" count="90 90 1"/></worldbody>',
    "doubled": SELF.format("0.xml", TWICE),
    "large": SELF.format("scene.xml", "").replace("<attach", '<geom size="1"/>' * 50_000 + "<attach"),
}


@pytest.mark.parametrize("case", ENDLESS)
def test_a_model_that_generates_too_many_bodies_is_refused(case: str, tmp_path: Path) -> None:
    for number in range(16):
        text = SELF.format(f"{number + 1}.xml", TWICE) if number < 15 else "<worldbody><body/></worldbody>"
        (tmp_path / f"{number}.xml").write_text(f"<mujoco>{text}</mujoco>")
    with pytest.raises(RobotFileError, match="too many bodies; expected at most 5000 bodies and joints"):
        Robot.from_model(scene(tmp_path, f"<mujoco>{ENDLESS[case]}</mujoco>"), base="fixed")


def test_a_robot_with_too_many_generated_joints_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RobotFileError, match=r"scene\.xml: Pinocchio cannot read .* has more than 150 joints"):
        Robot.from_model(scene(tmp_path, HAND.replace('count="3"', 'count="90"')), base="fixed")

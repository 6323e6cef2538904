"""Model files are read correctly, or refused with link and line."""

import os
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from tests.models import EXAMPLES
from tests.robot.test_robot import MJCF, URDF, inertia, refuse, write_robot

from stribeck.core.robot import Robot
from stribeck.core.robot.model_check import check_urdf
from stribeck.core.robot.xml_file import DEEPEST, MOST_BODIES, read_xml

LOWER = '<inertia ixx="0.01" iyy="0.01" izz="0.005" ixy="0" ixz="0" iyz="0"/>'
LIMIT = '<limit lower="-2" upper="1" effort="1" velocity="1"/>'
MASS, CHILD, WORLD = '<mass value="1"/>', '<child link="lower"/>', "<worldbody>"
LEG = """<frame euler="10 20 30" pos="0 0 .1"><body name="{0}"><joint name="{0}_roll" axis="1 0 0" ref="20"/>
  <joint axis="0 -1 .2" pos=".1 0 0" armature="0.1"/><geom type="box" size=".1 .2 .05" pos="0 .1 0"/>
  <body euler="50 0 20" pos="0 0 -.4"><joint type="slide" name="{0}_slide" ref=".1"/><geom size=".1" pos=".1 0 0"/>
  </body></body></frame>"""
ANY = f"""<mujoco><compiler eulerseq="ZYX"/><worldbody><body name="cup"><freejoint/><geom size=".1"/></body>
  <body mocap="true"><geom size=".1"/></body>{LEG.format("left")}{LEG.format("right")}</worldbody></mujoco>"""
PICTURE = '<asset><texture name="t" type="2d" builtin="flat" width="99999" height="99999"/></asset><worldbody>'
UNSOUND = {
    "moment missing": (URDF, LOWER, LOWER.replace(' izz="0.005"', ""), "line 6: izz of link 'lower' is nothing;"),
    "moment negative": (URDF, 'izz="0.005"', 'izz="-0.005"', "izz of link 'lower' is -0.005 kg m.2; expected zero"),
    "mass negative": (URDF, MASS, '<mass value="-1"/>', "line 5: link 'lower' has a mass of -1 kg"),
    "no mass": (URDF, MASS, "", "line 5: link 'lower' has an <inertial> without <mass>"),
    "two numbers": (URDF, 'xyz="0 0 0.1"', 'xyz="0 0.1"', "line 5: xyz of link 'lower' is '0 0.1'; expected 3"),
    "no limit": (URDF, LIMIT, "", "line 8: joint 'elbow' has no limit"),
    "joint type": (URDF, '"revolute"', '"hinge"', "line 8: joint 'elbow' has the type 'hinge'; expected one of revo"),
    "two links": (URDF, 'name="lower"', 'name="upper"', "line 5: link 'upper' is already defined in line 3"),
    "two parents": (URDF, CHILD, '<child link="upper"/>', "'elbow' gives link 'upper' a second parent"),
    "no link": (URDF, CHILD, '<child link="hand"/>', "'elbow' has the child link 'hand', which the file does not"),
    "no parent": (URDF, '<parent link="upper"/>', "", "joint 'elbow' has the parent link 'None'"),
    "loop": (URDF, '<parent link="base"/>', '<parent link="lower"/>', "line 3: link 'upper' is in a loop of joints"),
    "no direction": (URDF, f'<axis xyz="0 1 0"/>{LIMIT}', f'<axis xyz="0 0 0"/>{LIMIT}', "'elbow' has no direction"),
    "entities": (URDF, "<robot", '<!DOCTYPE r [<!ENTITY m "1">]><robot', "line 1: defines the entity 'm'"),
    "links": (
        URDF,
        "</robot>",
        "<link/>" * MOST_BODIES + "</robot>",
        f"has {MOST_BODIES + 3} <link>; expected at most",
    ),
    "depth": (URDF, "</robot>", "<a>" * 10**6, f"at depth {DEEPEST + 1}; expected"),
    "size": (URDF, "</robot>", " " * (1 << 25), "has 33,555,102 bytes; expected"),
    "ball joint": (MJCF, '"hip" axis="0 1 0" armature="0.02"', '"hip" type="ball"', "'hip' is a Spherical.*or lock it"),
    "no number": (MJCF, 'mass="1"', 'mass="nan"', "line 4: mass of <geom> is 'nan'; expected a finite number"),
    "copies": (MJCF, WORLD, f'{WORLD}<replicate count="1000000000"/>', "count of <replicate> is 1000000000; expected"),
    "picture": (MJCF, WORLD, PICTURE, "line 1: width of <texture> is 99999; expected at most 5000"),
    "included": (MJCF, WORLD, f'<include file="more.xml"/>{WORLD}', "more.xml: line 1: pos of <body> is '0 0 n"),
    "attributes": (MJCF, 'mass="1"', 'mass="1" ' + " ".join(f'a{k}=""' for k in range(201)), "and as many attributes"),
}


def changed(folder: Path, model: str, old: str, new: str) -> Path:
    """Write a robot with another text in place of the last such one in its model."""
    assert old in model
    text = model[::-1].replace(old[::-1], new[::-1], 1)[::-1]
    return write_robot(folder, "", text, *(("hopper.xml", "floating") if "mujoco" in model else ("arm.urdf", "fixed")))


@pytest.mark.parametrize("case", UNSOUND)
def test_an_unsound_model_is_refused_by_line_before_native_code_sees_it(tmp_path: Path, case: str, capfd) -> None:
    (tmp_path / "more.xml").write_text('<mujoco><worldbody><body name="x" pos="0 0 nan"/></worldbody></mujoco>')
    *change, words = UNSOUND[case]
    refuse(changed(tmp_path, *change), words)
    capfd.readouterr()  # Pinocchio's own complaints


PLACE, NO_PRODUCTS = '<origin xyz="0 0 0.1"/>', LOWER.replace(' ixy="0" ixz="0" iyz="0"', "")
REPAIRED = {
    "repeated elements is used: <origin> of link 'l": (PLACE, f"{PLACE}<origin xyz='0 0 9'/>"),
    "are set to zero: ixy of link 'lower' in line 6": (LOWER, NO_PRODUCTS),
    "without their sign: effort of joint 'elbow'": (LIMIT, LIMIT.replace('effort="1"', 'effort="-1"')),
}
"""Warnings about texts and their replacements; the robot stays the same."""


@pytest.mark.parametrize("words", REPAIRED)
def test_a_urdf_that_other_readers_accept_is_read_with_a_warning(tmp_path: Path, words: str) -> None:
    robot = Robot.from_file(changed(tmp_path, URDF, *REPAIRED[words]))
    (warning,) = robot.warnings
    assert words in warning
    before = Robot.from_file(write_robot(tmp_path, "", URDF))
    np.testing.assert_array_equal(inertia(robot, 0.4), inertia(before, 0.4))
    np.testing.assert_array_equal(robot.effort_limits, before.effort_limits)


def test_every_urdf_of_the_makers_passes() -> None:
    """Links with impossible inertia, mostly dummies and sensors, are not refused."""
    paths = [path for path in sorted(EXAMPLES.rglob("*.urdf")) if path.name != "ur3.urdf"]  # it is empty
    impossible = {path.name for path in paths if check_urdf(read_xml(path))[1]}
    assert len(paths) > 60
    assert 5 < len(impossible) < 20


@pytest.mark.parametrize("name", ["left's", '"', "[left]", "[/]", "a&lt;b", "ä ö", "x" * 300])
def test_a_joint_may_have_any_name(tmp_path: Path, name: str) -> None:
    robot = Robot.from_file(write_robot(tmp_path, "", URDF.replace('"elbow"', f'"{name.replace(chr(34), "&quot;")}"')))
    assert robot.joint_names == ("shoulder", name.replace("&lt;", "<"))


def test_an_mjcf_without_a_free_joint_gets_one_whatever_its_keyframes(tmp_path: Path) -> None:
    whole = Robot.from_file(write_robot(tmp_path, "", MJCF, "hopper.xml", "floating"))
    key = '</worldbody><keyframe><key name="home" qpos="0.5 0.1"/></keyframe>'
    text = MJCF.replace("<freejoint/>", "").replace("</worldbody>", key)
    given = Robot.from_file(write_robot(tmp_path, "", text, "post.xml", "floating"))
    assert given.armature.tolist() == [0.02, 0.0]
    np.testing.assert_allclose(inertia(given, 0.4), inertia(whole, 0.4), rtol=1e-9, atol=1e-12)


def test_an_mjcf_is_what_mujoco_compiles(tmp_path: Path) -> None:
    """Frames, several joints in a body, joints without a name, and objects beside the robot."""
    robot = Robot.from_file(write_robot(tmp_path, "", ANY, "any.xml", "fixed"))
    assert robot.warnings[0] == "any.xml: objects beside the robot are left out: cup, body2"
    assert robot.joint_names[:3] == ("left_roll", "left_joint1", "left_slide")
    compiled = mujoco.MjModel.from_xml_path(str(tmp_path / "any.xml"))
    data, position = mujoco.MjData(compiled), np.linspace(-0.5, 0.7, 6)
    data.qpos[7:], data.qvel[6:] = position, position[::-1]
    mujoco.mj_forward(compiled, data)
    torque = pin.rnea(robot.tree.model, robot.tree.model.createData(), position, position[::-1].copy(), 0 * position)
    np.testing.assert_allclose(torque, data.qfrc_bias[6:], rtol=1e-9)


@pytest.mark.parametrize("what", ["folder", "named pipe", "device"])
@pytest.mark.parametrize("name", ["robot.toml", "arm.urdf"])
def test_only_regular_files_are_opened(tmp_path: Path, what: str, name: str) -> None:
    path = write_robot(tmp_path)
    (tmp_path / name).unlink()
    if what == "folder":
        (tmp_path / name).mkdir()
    elif what == "named pipe":
        os.mkfifo(tmp_path / name)
    else:
        (tmp_path / name).symlink_to("/dev/zero")
    refuse(path, f"{name}: is a (folder|pipe, a device or a socket); expected")

"""Model files are read correctly, or refused with link and line."""

import os
from pathlib import Path

import numpy as np
import pytest
from tests.models import EXAMPLES
from tests.robot.test_robot import MJCF, URDF, inertia, refuse, write_robot

from stribeck.robot import Robot
from stribeck.robot.model_check import check_urdf
from stribeck.robot.xml_file import DEEPEST, MOST_BODIES, read_xml

LOWER = '<inertia ixx="0.01" iyy="0.01" izz="0.005" ixy="0" ixz="0" iyz="0"/>'
UNSOUND_URDF = {
    "moment missing": (LOWER, LOWER.replace(' izz="0.005"', ""), "line 6: izz of link 'lower' is nothing; expected a"),
    "moment negative": ('izz="0.005"', 'izz="-0.005"', "izz of link 'lower' is -0.005 kg m.2; expected zero or more"),
    "mass negative": ('<mass value="1"/>', '<mass value="-1"/>', "line 5: link 'lower' has a mass of -1 kg"),
    "no mass": ('<mass value="1"/>', "", "line 5: link 'lower' has an <inertial> without <mass>"),
    "place of two numbers": ('xyz="0 0 0.1"', 'xyz="0 0.1"', "line 5: xyz of link 'lower' is '0 0.1'; expected 3"),
    "no limit": ('<limit lower="-2" upper="1" effort="1" velocity="1"/>', "", "line 8: joint 'elbow' has no limit"),
    "joint type": ('"revolute"', '"hinge"', "line 8: joint 'elbow' has the type 'hinge'; expected one of revolute"),
    "two links": ('name="lower"', 'name="upper"', "line 5: link 'upper' is already defined in line 3"),
    "two parents": ('<child link="lower"/>', '<child link="upper"/>', "'elbow' gives link 'upper' a second parent"),
    "entities": ("<robot", '<!DOCTYPE r [<!ENTITY m "1">]><robot', "line 1: defines the entity 'm'"),
}


@pytest.mark.parametrize("case", UNSOUND_URDF)
def test_an_unsound_urdf_is_refused_by_line(tmp_path: Path, case: str) -> None:
    old, new, words = UNSOUND_URDF[case]
    assert old in URDF
    refuse(write_robot(tmp_path, "", URDF[::-1].replace(old[::-1], new[::-1], 1)[::-1]), words)  # the last of them


ELBOW = '<limit lower="-2" upper="1" effort="1" velocity="1"/>'
REPAIRED_URDF = {
    "two places": (
        '<origin xyz="0 0 0.1"/>',
        "{}<origin xyz='0 0 9'/>",
        "repeated elements is used: <origin> of link 'l",
    ),
    "products missing": (
        LOWER,
        LOWER.replace(' ixy="0" ixz="0" iyz="0"', ""),
        "are set to zero: ixy of link 'lower' in line 6",
    ),
    "effort negative": (
        ELBOW,
        ELBOW.replace('effort="1"', 'effort="-1"'),
        "without their sign: effort of joint 'elbow'",
    ),
}
"""Text, its replacement, and the warning about it; the robot stays the same."""


@pytest.mark.parametrize("case", REPAIRED_URDF)
def test_a_urdf_that_other_readers_accept_is_read_with_a_warning(tmp_path: Path, case: str) -> None:
    old, new, words = REPAIRED_URDF[case]
    assert URDF.count(old) == 1
    robot = Robot.from_file(write_robot(tmp_path, "", URDF.replace(old, new.format(old))))
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


def chain(links: int) -> str:
    body = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    parts = ['<robot name="chain"><link name="l0"/>']
    for k in range(1, links):
        parts.append(f'<link name="l{k}">{body}</link><joint name="j{k}" type="continuous"><parent link="l{k - 1}"/>')
        parts.append(f'<child link="l{k}"/><axis xyz="0 1 0"/></joint>')
    return "".join([*parts, "</robot>"])


ABSURD = {
    "links": (
        chain(MOST_BODIES + 1),
        "arm.urdf",
        f"line 1: the model has {MOST_BODIES + 1} <link>; expected at most {MOST_BODIES}",
    ),
    "depth": ("<robot>" + "<a>" * 10**6, "arm.urdf", f"at depth {DEEPEST + 1}; expected"),
    "size": ("<robot>" + " " * (1 << 25), "arm.urdf", "has 33,554,439 bytes; expected"),
    "picture": (
        MJCF.replace(
            "<worldbody>",
            '<asset><texture name="t" type="2d" builtin="flat" width="99999" height="99999"/></asset><worldbody>',
        ),
        "hopper.xml",
        "line 1: width of <texture> is 99999; expected at most 5000",
    ),
}


@pytest.mark.parametrize("case", ABSURD)
def test_an_absurd_model_is_refused_before_native_code_sees_it(tmp_path: Path, case: str) -> None:
    text, name, words = ABSURD[case]
    refuse(write_robot(tmp_path, "", text, name), words)


UNSOUND_MJCF = {
    "mass": ('mass="1"', 'mass="nan"', "line 4: mass of <geom> is 'nan'; expected a finite number"),
    "copies": (
        "<worldbody>",
        '<worldbody><replicate count="1000000000"/>',
        "<replicate> generates bodies, which",
    ),
}


@pytest.mark.parametrize("case", UNSOUND_MJCF)
def test_an_unsound_mjcf_is_refused_by_line(tmp_path: Path, case: str) -> None:
    old, new, words = UNSOUND_MJCF[case]
    assert old in MJCF
    refuse(write_robot(tmp_path, "", MJCF.replace(old, new), "hopper.xml", "floating"), words)


def test_an_mjcf_without_a_free_joint_gets_one_whatever_its_keyframes(tmp_path: Path) -> None:
    whole = Robot.from_file(write_robot(tmp_path, "", MJCF, "hopper.xml", "floating"))
    key = '</worldbody><keyframe><key name="home" qpos="0.5 0.1"/></keyframe>'
    text = MJCF.replace("<freejoint/>", "").replace("</worldbody>", key)
    given = Robot.from_file(write_robot(tmp_path, "", text, "post.xml", "floating"))
    assert given.armature.tolist() == [0.02, 0.0]
    np.testing.assert_allclose(inertia(given, 0.4), inertia(whole, 0.4), rtol=1e-9, atol=1e-12)


def test_files_included_by_an_mjcf_are_checked(tmp_path: Path) -> None:
    (tmp_path / "more.xml").write_text('<mujoco><worldbody><body name="x" pos="0 0 nan"/></worldbody></mujoco>')
    text = MJCF.replace("<worldbody>", '<include file="more.xml"/><worldbody>')
    refuse(write_robot(tmp_path, "", text, "hopper.xml"), "more.xml: line 1: pos of <body> is '0 0 nan'")


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


UNSOUND_ROBOTS = {
    "world": ("[contacts.left]\nframe = 'universe'", "frame = 'universe' is not in the model"),
    "one frame": (
        "[contacts.left]\nframe = 'lower'\n[contacts.right]\nframe = 'lower'",
        r"\[contacts.right\] and \[contacts.left\] have the frame 'lower'; expected a different frame for each contact",
    ),
    "near key of a channel": (
        "[log.torque]\nunits = 'Nm'",
        "unknown key 'log.torque.units'; did you mean 'log.torque.unit'?",
    ),
}


@pytest.mark.parametrize("case", UNSOUND_ROBOTS)
def test_an_unsound_robot_file_is_refused(tmp_path: Path, case: str) -> None:
    table, words = UNSOUND_ROBOTS[case]
    refuse(write_robot(tmp_path, table, base="floating"), words)

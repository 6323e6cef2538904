"""Robots are read from URDF and MJCF; errors in robot files are described in one sentence."""

import re
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from tests.arm import arm_log, write_arm
from tests.models import MODELS, example_robot, plain_model

from stribeck import export, identify
from stribeck.core.errors import RobotFileError
from stribeck.core.robot import Robot

WARNINGS = {"icub": "carry links whose inertia is impossible", "panda": "joints are treated as independent"}


@pytest.mark.parametrize("name", MODELS)
def test_example_robots_are_read(name):
    robot, model = example_robot(name), plain_model(name)
    assert set(robot.joint_names) == set(model.names) - {"universe", "root_joint"}
    assert robot.mass == pytest.approx(sum(body.mass for body in model.inertias))
    assert robot.base == MODELS[name][1].get("base", "floating")
    assert [WARNINGS.get(name, "") in warning for warning in robot.warnings] == [True] * (name in WARNINGS)
    assert set(robot.contacts) == set(MODELS[name][2])


URDF = (Path(__file__).parent / "arm.urdf").read_text()
MJCF = (Path(__file__).parent / "hopper.xml").read_text()


def write_robot(folder: Path, table: str = "", model: str = URDF, name: str = "arm.urdf", base: str = "fixed") -> Path:
    (folder / name).write_text(model)
    path = folder / "robot.toml"
    path.write_text(f'[robot]\nmodel = "{name}"\n' + f'base = "{base}"\n' * bool(base) + table)
    return path


def inertia(robot: Robot, q: float = 0.0) -> np.ndarray:
    model = robot.tree.model
    configuration = pin.neutral(model)
    configuration[model.nq - len(robot.joint_names) :] = q
    matrix = pin.crba(model, model.createData(), configuration)
    return np.triu(matrix) + np.triu(matrix, 1).T


def test_a_robot_file_is_read_whole(tmp_path):
    table = 'name = "A"\ntorque_source = "motor_current"\narmature = { elbow = 0.5 }\ngravity = [0, 0, -1.62]\n'
    table += "locked = { shoulder = 1.5707963267948966 }\n[log]\nrate = 500.0\n[identify]\nlaw = 'asymmetric'\n"
    robot = Robot.from_file(write_robot(tmp_path, table))
    assert (robot.name, robot.torque_source, robot.joint_names) == ("A", "motor_current", ("elbow",))
    assert robot.armature.tolist() == [0.5]
    assert inertia(robot)[0, 0] == pytest.approx(0.5 + 0.01 + 1 * 0.1**2)
    assert (robot.log_table.rate, robot.settings.law) == (500.0, "asymmetric")
    # locked at a right angle, the forearm points along x: gravity turns the elbow the negative way
    effort = pin.rnea(robot.tree.model, robot.tree.model.createData(), np.zeros(1), np.zeros(1), np.zeros(1))
    assert effort[0] == pytest.approx(-1 * 1.62 * 0.1)
    assert robot.warnings == ()


@pytest.mark.parametrize(("base", "options"), [("fixed", ""), ("floating", "locked = { hip = 0.3 }")])
def test_a_body_may_be_called_as_its_joint_is(tmp_path, base, options):
    robots = [
        Robot.from_file(write_robot(tmp_path, options, MJCF.replace('"leg"', f'"{name}"'), "hopper.xml", base))
        for name in ("leg", "hip")
    ]
    assert robots[0].joint_names == robots[1].joint_names
    assert inertia(robots[0]).tolist() == inertia(robots[1]).tolist()
    places = []
    for robot, name in zip(robots, ("leg", "hip"), strict=True):
        model = robot.tree.model
        data = model.createData()
        pin.framesForwardKinematics(model, data, pin.neutral(model))
        places.append(data.oMf[model.getFrameId(name)].homogeneous.tolist())
    assert places[0] == places[1]


def test_impossible_and_missing_inertias_are_warned_of(tmp_path):
    bad = URDF.replace('iyy="0.01" izz="0.005"', 'iyy="0.5" izz="0.005"')
    _, warning = Robot.from_file(write_robot(tmp_path, "", bad.replace(' name="arm"', ""))).warnings  # and no name
    assert warning.endswith("whose inertia is impossible for a rigid body: elbow (link 'lower' in line 5)")
    empty = URDF.replace('<mass value="1"/>', '<mass value="0"/>').replace(
        'ixx="0.01" iyy="0.01" izz="0.005"', 'ixx="0" iyy="0" izz="0"'
    )
    (warning,) = Robot.from_file(write_robot(tmp_path, "", empty)).warnings
    assert warning.endswith("these joints move neither mass nor inertia: elbow")


TWO = "[[robot.couplings]]\nname = 'elbow'\njoints = { shoulder = 1.0, elbow = 1.0 }"
WRONG_TABLES = {
    "colour = 'red'": "unknown key 'robot.colour'",
    "armature = { elbow = -1.0 }": "elbow' is -1.0; expected a number from 0 to 1e\\+09",
    "position_controlled = ['knee']": "position_controlled names joint 'knee'.*shoulder, elbow",
    "[[robot.couplings]]\njoints = { shoulder = 0.0, elbow = 1.0 }": "'shoulder.elbow' needs at least two joints",
    TWO: "'elbow' has the name of another coupling or joint",
    "locked = { shoulder = 0.0, elbow = 0.0 }": "leaves no joint",
    "[contacts.left]\nframe = 'lower'": "are for a floating base",
    "base = 'floating'\n[contacts.left]\nframe = 'universe'": "frame = 'universe' is not in the model",
    "base = 'floating'\n[contacts]\na.frame = 'lower'\nb.frame = 'lower'": r"\[contacts.b\] and \[contacts.a\] have",
    "[log.torque]\nunits = 'Nm'": "unknown key 'log.torque.units'; did you mean 'log.torque.unit'?",
}


@pytest.mark.parametrize("table", WRONG_TABLES)
def test_wrong_robot_files_are_refused(tmp_path, table):
    base = "" if table.startswith("base") else "fixed"
    refuse(write_robot(tmp_path, table, base=base), WRONG_TABLES[table])


def test_missing_files_are_refused(tmp_path):
    refuse(tmp_path / "robot.toml", "cannot be read \\(No such file or directory\\); expected a robot file")
    path = write_robot(tmp_path)
    (tmp_path / "arm.urdf").unlink()
    refuse(path, "arm.urdf: cannot be read .No such file .* relative to the robot file")
    path.write_text("[robot]\nbase = 'fixed'")
    refuse(path, "key 'robot.model' is missing")
    path.write_bytes(b"[robot]\nmodel = '\xff'")
    refuse(path, "line 2 has the byte 0xff, which is not UTF-8")


def refuse(path: Path, words: str) -> None:
    """Expect one sentence with the path of the file and these words."""
    with pytest.raises(RobotFileError, match=words) as caught:
        Robot.from_file(path)
    message = str(caught.value)
    assert message.startswith(str(path.parent))
    assert "\n" not in message.strip()


def test_a_model_gets_feet_and_roles_without_a_robot_file(tmp_path):
    path = write_robot(tmp_path).parent / "arm.urdf"
    feet = {"left": "lower", "right": {"frame": "upper", "kind": "point"}}
    given, tilted = Robot.from_file(path.with_name("robot.toml")), (0, -9.81, 0)
    robot = Robot.from_urdf(
        path, contacts=feet, position_controlled=("elbow",), torque_source="motor_current", gravity=tilted
    )
    assert (robot.path, robot.model_path, robot.joint_names) == (str(path), given.model_path, given.joint_names)
    np.testing.assert_array_equal(robot.gravity, tilted)
    found = [(contact.frame, contact.kind) for contact in robot.contacts.values()]
    assert found == [("lower", "surface"), ("upper", "point")]
    assert (robot.base, robot.position_controlled, robot.torque_source) == ("floating", ("elbow",), "motor_current")
    assert re.fullmatch(r"Robot\('.*', floating base, 2 joints, .* kg, contacts left, right\)", repr(robot))


def test_a_pinocchio_model_is_a_robot_without_a_file(tmp_path):
    """Friction is identified on it, and exports that write its model file are refused."""
    write_arm(tmp_path)
    model = pin.buildModelFromUrdf(str(tmp_path / "arm.urdf"))
    made, read = Robot.from_model(model), Robot.from_model(tmp_path / "arm.urdf", base="fixed")
    assert (made.base, made.joint_names, made.path) == ("fixed", read.joint_names, "")
    model.gravity.linear = np.zeros(3)
    log = arm_log(read, duration=8.0)
    found = [identify(log, robot, method="curve-fit", law="coulomb-viscous") for robot in (made, read)]
    assert found[0].joints == found[1].joints
    assert export(found[0], made, tmp_path / "friction.yaml", "yaml")
    for target in ("urdf", "mjcf"):
        with pytest.raises(RobotFileError, match="made from a Pinocchio model, and this needs a model file; use"):
            export(found[0], made, tmp_path / "found.xml", target)
    floating = pin.buildModelFromUrdf(str(tmp_path / "arm.urdf"), pin.JointModelFreeFlyer())
    assert Robot.from_model(floating, contacts={"hand": "hand"}).base == "floating"
    assert Robot.from_model(floating, base="fixed").base == "fixed"
    with pytest.raises(RobotFileError, match=r"has a fixed root; expected one built with pin.JointModelFreeFlyer\(\)"):
        Robot.from_model(model, base="floating")


def test_an_mjcf_whose_meshes_are_elsewhere_is_read_by_its_inertias(tmp_path):
    text = (
        MJCF.replace("<worldbody>", '<asset><mesh name="skin" file="nowhere.stl"/></asset><worldbody>')
        .replace('<geom type="box" size=".1 .1 .1" mass="3"/>', '<geom type="mesh" mesh="skin"/>@')
        .replace("@", '<inertial pos="0 0 0" mass="3" diaginertia="0.02 0.02 0.02"/>')
    )
    robot = Robot.from_file(write_robot(tmp_path, 'torque_source = "command"', text, "hopper.xml", "floating"))
    assert robot.mass == pytest.approx(4.5)
    assert robot.warnings == ()

"""`stribeck init` drafts robot files for logs with other names, units, signs and orders, and friction is found."""

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pytest
from tests.arm import URDF, arm_log, save_npz, write_arm
from tests.cli.test_cli import refused, run
from tests.commanded import QUADRUPED
from tests.models import CASSIE, EXAMPLES, STRIBECK, example_log, example_robot

from stribeck import Robot, Settings, identify, read_log
from stribeck.check.init import draft_robot_file
from stribeck.check.init.model import read_model
from stribeck.check.init.names import match
from stribeck.check.init.search import find_columns_by_dynamics, other_orders
from stribeck.core.errors import LogError
from stribeck.core.log import RobotLog
from stribeck.core.log.sampling import regularise
from stribeck.core.robot import model_path
from stribeck.core.settings import LogTable
from stribeck.simulation.sensors.measure import measure, sensors_for
from stribeck.simulation.sensors.profiles import PROFILES

ARM = EXAMPLES / "ur_description/urdf/ur5_robot.urdf"


@cache
def noisy_log(name: str) -> RobotLog:
    """Simulate a log with realistic sensors."""
    exact, _ = example_log(name, 6.0 if name == "ur5" else 4.0, rate=250.0, seed=2)
    return measure(exact, sensors_for(exact, PROFILES["realistic"], 0))


def turned(log: RobotLog, joints: list[int]) -> RobotLog:
    """Invert these joints in a log."""
    signs = np.ones(len(log.joint_names))
    signs[joints] = -1
    return replace(log, position=log.position * signs, torque=log.torque * signs)


def drafted(model: str | Path, log: Path | None, folder: Path) -> tuple[Robot, str]:
    output = folder / "robot.toml"
    output.write_text(draft_robot_file(str(model), log, output).text)
    return Robot.from_file(output), output.read_text()


def test_an_arm_in_degrees_with_other_names_signs_and_units(tmp_path: Path) -> None:
    log = noisy_log("ur5")
    odd = turned(log, [1, 3])
    path = save_npz(
        odd,
        tmp_path / "log.npz",
        joint_names=None,
        time=log.time * 1e3,
        position=None,
        torque=None,
        q_actual=np.rad2deg(odd.position),
        qd_actual=np.gradient(np.rad2deg(odd.position), log.time, axis=0),
        tau_meas=-1e3 * odd.torque,
        tau_cmd=odd.torque,
    )
    robot, text = drafted(ARM, path, tmp_path)
    assert robot.log_table.position.unit == "deg"
    assert robot.log_table.time.unit == "ms"
    assert robot.log_table.torque.name == "tau_meas"
    read = read_log(path, robot)
    np.testing.assert_allclose(read.position, log.position, atol=1e-9)
    np.testing.assert_allclose(read.torque, log.torque, rtol=0.05, atol=0.2)
    result = identify(path, robot, Settings(method="curve-fit", law="coulomb-viscous"))
    for name, joint in result.joints.items():
        assert joint.parameters["coulomb"].value == pytest.approx(STRIBECK["coulomb"], rel=0.2), name
    assert "TODO" in text


def test_columns_without_names_in_another_order(tmp_path: Path) -> None:
    log = noisy_log("ur5")
    log, order = replace(log, external_torque=1e-3 * log.position), [2, 0, 1, 3, 5, 4]
    other = {name: getattr(log, name)[:, order] for name in ("position", "torque", "external_torque")}
    path = save_npz(log, tmp_path / "log.npz", joint_names=None, **other)
    robot, _ = drafted(ARM, path, tmp_path)
    assert robot.log_table.joint_order == [log.joint_names[k] for k in order]
    np.testing.assert_array_equal(read_log(path, robot).position, log.position)
    np.testing.assert_array_equal(read_log(path, robot).external_torque, log.external_torque)


def test_a_quadruped_numbered_breadth_first_with_its_quaternion_s_scalar_first(tmp_path):
    log, robot = noisy_log("go2"), example_robot("go2")
    legs_last = [12 // 4 * leg + joint for joint in range(3) for leg in range(4)]
    assert np.argsort(legs_last).tolist() in other_orders(robot)
    other = {name: getattr(log, name)[:, legs_last] for name in ("position", "torque")}
    other["base_orientation"] = log.base_orientation[:, [3, 0, 1, 2]]
    path = save_npz(log, tmp_path / "log.npz", joint_names=None, **other)
    found, _ = drafted("package:go2", path, tmp_path)
    assert found.base == "floating"
    feet = {name: (foot.frame, foot.kind) for name, foot in found.contacts.items()}
    assert feet == {leg: (f"{leg}_foot", "point") for leg in ("FL", "FR", "RL", "RR")}
    assert found.log_table.base_orientation.order == "wxyz"
    read = read_log(path, found)
    np.testing.assert_array_equal(read.position, log.position)
    np.testing.assert_array_equal(read.contact, log.contact)


def test_a_humanoid_with_other_names_and_joints_that_count_the_other_way(tmp_path):
    log, robot = noisy_log("talos"), example_robot("talos")
    names = [name.replace("_joint", "").replace("left", "L").replace("right", "R") for name in log.joint_names]
    joints = [log.joint_names.index(f"leg_{side}_joint") for side in ("left_4", "right_2")]
    kept = [k for k, name in enumerate(names) if "gripper" not in name]
    odd = turned(log, joints)
    odd.torque[:, [log.joint_names.index(name) for name in robot.position_controlled]] = 0.0
    arrays = {name: getattr(odd, name)[:, kept] for name in ("position", "torque")}
    path = save_npz(odd, tmp_path / "log.npz", joint_names=np.array(names)[kept], **arrays)
    found, text = drafted("package:talos_reduced", path, tmp_path)
    assert {name: foot.kind for name, foot in found.contacts.items()} == dict.fromkeys(("left", "right"), "surface")
    assert set(found.position_controlled) == set(robot.position_controlled)
    read = read_log(path, found)
    assert set(log.joint_names) - set(read.joint_names) == {"gripper_left_joint", "gripper_right_joint"}
    for k, name in enumerate(read.joint_names):
        np.testing.assert_allclose(read.position[:, k], log.position[:, log.joint_names.index(name)], err_msg=name)
    assert "gripper_left_joint = " in text


def test_a_standard_log_needs_no_settings(tmp_path: Path) -> None:
    path = save_npz(noisy_log("ur5"), tmp_path / "log.npz")
    robot, text = drafted(ARM, path, tmp_path)
    assert "[log" not in text
    assert robot.base == "fixed"


def test_columns_numbered_from_zero_of_joints_numbered_from_one(tmp_path):
    log = noisy_log("ur5")
    model = ARM.read_text()
    for k, joint in enumerate(log.joint_names):
        model = model.replace(f'"{joint}"', f'"joint_{k + 1}"')
    (tmp_path / "arm.urdf").write_text(model)
    columns = {"time": log.time}
    columns |= {f"{name}_{k}": getattr(log, name)[:, k] for name in ("position", "torque") for k in range(6)}
    pa.csv.write_csv(pa.table(columns), tmp_path / "log.csv")
    robot, _ = drafted(tmp_path / "arm.urdf", tmp_path / "log.csv", tmp_path)
    np.testing.assert_array_equal(read_log(tmp_path / "log.csv", robot).position, log.position)


def test_an_unexplained_torque_gives_no_signs() -> None:
    log, robot = noisy_log("ur5"), example_robot("ur5")
    noise = np.random.default_rng(0).normal(size=log.torque.shape)
    columns = find_columns_by_dynamics(replace(log, torque=noise), robot, range(6))
    assert columns.order == tuple(range(6))
    assert np.all(columns.position == 1)
    assert np.all(columns.torque == 1)


@pytest.mark.parametrize(
    ("model", "feet"),
    [
        ("g1_29dof_rev_1_0", {"left_ankle_roll_link": "surface", "right_ankle_roll_link": "surface"}),
        ("solo12", {f"{leg}_FOOT": "point" for leg in ("FL", "FR", "HL", "HR")}),
        ("anymal_c_simple_description/anymal", {f"{leg}_FOOT": "point" for leg in ("LF", "LH", "RF", "RH")}),
        ("icub", {"l_sole": "surface", "r_sole": "surface"}),
        (CASSIE, {"left-foot": "surface", "right-foot": "surface"}),
        (QUADRUPED, dict.fromkeys(("FL", "FR", "RL", "RR"), "point")),
        ("bolt", {"FL_FOOT": "point", "FR_FOOT": "point"}),
        ("panda", {}),
        ("so101", {}),
        ("tiago", {"wheel_left_link": "wheel", "wheel_right_link": "wheel"}),
    ],
)
def test_feet_are_found_by_name_and_shape(model: str | Path, feet: dict[str, str]) -> None:
    facts = read_model(model if isinstance(model, Path) else model_path(f"package:{model}", Path()))
    assert {foot.frame: foot.kind for foot in facts.feet} == feet
    assert facts.base == ("floating" if {"surface", "point"} & set(feet.values()) else "fixed")


@pytest.mark.parametrize(("model", "radius"), [("a1", 0.02), ("b1", 0.04), ("icub", 0.0), (QUADRUPED, 0.022)])
def test_the_radius_of_ball_feet_is_that_of_a_collision_sphere_at_the_foot(model: str | Path, radius: float) -> None:
    facts = read_model(model if isinstance(model, Path) else model_path(f"package:{model}", Path()))
    assert {foot.radius for foot in facts.feet} == {radius}


@pytest.mark.parametrize("base", ["fixed", "floating"])
def test_a_free_joint_at_the_root_of_a_urdf_is_the_base(tmp_path: Path, base: str) -> None:
    free = '<link name="ground"/><joint name="free" type="floating"><parent link="ground"/><child link="base"/></joint>'
    (tmp_path / "arm.urdf").write_text(URDF.replace("</robot>", free + "</robot>"))
    draft = draft_robot_file(str(tmp_path / "arm.urdf"), None, tmp_path / "robot.toml")
    assert "locked" not in draft.document["robot"]
    draft.document["robot"]["base"] = base
    assert (draft.robot().base, draft.robot().mass) == (base, 6.0)


def test_names_are_matched_by_their_meaning() -> None:
    names = ["l_knee", "R.KneeJoint", "frontLeftHip", "HR_KFE"]
    joints = ["left_knee", "right_knee", "FL_hip_joint", "RR_calf_joint"]
    assert match([*names, "motor_7"], [*joints, "joint_1"]) == dict(zip(names, joints, strict=True))


def test_the_command_asks_open_questions(tmp_path, capsys):
    output = tmp_path / "robot.toml"
    assert run("init", "package:panda", "-o", output) == 0
    assert "is the torque measured behind the gear" in capsys.readouterr().out
    assert (robot := Robot.from_file(output)).base == "fixed"
    assert robot.settings.fit_armature is True  # while the source of the torques is a guess
    assert "# TODO: is the torque" in output.read_text()
    assert "already exists" in refused(capsys, "init", "package:panda", "-o", output)


TIME = np.arange(400) / 200
MOVES, PUSHES = np.sin(TIME[:, None] * np.arange(1, 7)), np.cos(TIME[:, None] * np.arange(2, 8))
ODD = {
    "stamps that stand still": ({"time": 0 * TIME}, "the log has no usable time"),
    "other joints": (
        {"joint_names": np.array(["x", "y"]), "position": MOVES[:, :2], "torque": PUSHES[:, :2]},
        "none of the joints 'x', 'y' of the log is in the model",
    ),
    "no names": (
        {"time": None, "position": None, "torque": None, "a": MOVES, "b": PUSHES, "c": np.ones(3)},
        "no name suggests joint positions; which of 'a', 'b' are they?",
    ),
    "few rows": ({"time": TIME[:3], "position": MOVES[:3], "torque": PUSHES[:3]}, ""),
}


@pytest.mark.parametrize("model", ["ur5_robot", "g1_29dof_rev_1_0"])
@pytest.mark.parametrize(("changed", "words"), ODD.values(), ids=ODD)
def test_odd_logs_end_in_a_file_with_questions(model, changed, words, tmp_path):
    arrays = {"time": TIME, "position": MOVES, "torque": PUSHES, **changed}
    log = tmp_path / "log.npz"
    np.savez(log, **{name: array for name, array in arrays.items() if array is not None})
    robot, text = drafted(f"package:{model}", log, tmp_path)
    assert words in " ".join(text.replace("#", " ").split())
    assert f"{text.count('TODO:')} questions are open" in robot.warnings[-1]


def test_nameless_columns_without_a_torque_are_asked_for_as_grippers(tmp_path: Path) -> None:
    arrays = {"position": np.insert(MOVES, 3, 0.02, axis=1), "torque": np.insert(PUSHES, 3, 0.0, axis=1)}
    np.savez(tmp_path / "log.npz", time=TIME, **arrays)  # type: ignore[arg-type]
    robot, text = drafted("package:ur5_robot", tmp_path / "log.npz", tmp_path)
    assert robot.log_table.joint_order.index("unknown_0") == 3
    assert "TODO: the log has no column names, and no torque in columns 4" in text


@pytest.mark.parametrize(("repeats", "unit"), [(3, 1.0), (5, 1e-3), (50, 1.0)])
def test_rows_between_ticks_of_a_coarse_clock_are_evenly_spaced(repeats, unit, tmp_path):
    log = noisy_log("ur5")
    ticks = np.floor(np.arange(len(log.time)) / repeats) * repeats / 250.0
    path = save_npz(log, tmp_path / "log.npz", time=ticks / unit)
    robot, text = drafted(ARM, path, tmp_path)
    assert robot.log_table.rate == pytest.approx(250.0, rel=2e-3)
    assert "TODO: most stamps repeat" in text
    assert robot.log_table.torque == robot.log_table.position  # no setting explains the wrong stamps
    np.testing.assert_allclose(read_log(path, robot).time[-1], log.time[-1] - log.time[0], rtol=2e-3)
    read = read_log(path, replace(robot, log_table=robot.log_table.model_copy(update={"rate": None})))
    try:
        remedy = " ".join(regularise(read, LogTable())[1].notes)
    except LogError as error:
        remedy = str(error)
    assert float(remedy.rpartition("set [log] rate = ")[2].rstrip(".")) == pytest.approx(250.0, rel=2e-3)


def test_currents_stored_as_unsigned_integers_are_unwrapped(tmp_path: Path) -> None:
    log = noisy_log("ur5")
    counts = np.round(100 * log.torque)
    path = save_npz(log, tmp_path / "log.npz", torque=None, present_current=(counts % 65536).astype(np.uint16))
    robot, text = drafted(ARM, path, tmp_path)
    assert robot.log_table.torque.unwrap
    assert "negative integers were stored as unsigned ones" in text
    torque = read_log(path, robot).torque
    np.testing.assert_array_equal(torque / robot.log_table.torque.scale, counts)


def test_normalized_positions_are_asked_for_with_the_keys_to_set(tmp_path):
    """As LeRobot writes them, -100 to 100 of each joint's range, which could be degrees."""
    log, (low, high) = noisy_log("ur5"), example_robot("ur5").position_limits
    normalized = 200 * (log.position - low) / (high - low) - 100
    path = save_npz(log, tmp_path / "log.npz", position=normalized, velocity=None, acceleration=None)
    _, text = drafted(ARM, path, tmp_path)
    note = " ".join(line.lstrip("# ") for line in text.splitlines() if line.startswith("# "))
    scale, offset = re.findall(r"(?:scale|offset) = (?:{[^}]*}|[-+.e\d]*\d)", note)
    output = tmp_path / "robot.toml"
    output.write_text(text.replace('unit = "deg"', f"{scale}\n{offset}"))
    read = read_log(path, Robot.from_file(output))
    np.testing.assert_allclose(read.position, log.position, atol=1e-4)


def test_angles_of_the_motors_shafts_are_asked_for_with_gear_ratios(tmp_path: Path) -> None:
    log, ratio = noisy_log("ur5"), np.array([100.0, 100.0, 50.0, 9.0, 9.0, 6.0])
    path = save_npz(log, tmp_path / "log.npz", position=log.position * ratio, torque=log.torque / ratio, velocity=None)
    robot, text = drafted(ARM, path, tmp_path)
    assert "TODO: are these angles" in text
    read = read_log(path, robot)
    np.testing.assert_allclose(read.position[:, :5], log.position[:, :5], rtol=0.03, atol=0.01)


def test_degrees_scale_only_joints_that_turn(tmp_path: Path) -> None:
    log = arm_log(Robot.from_file(write_arm(tmp_path)), rate=250.0)
    path = save_npz(log, tmp_path / "log.npz", position=log.position * [57.2958, 57.2958, 1.0], velocity=None)
    read = read_log(path, drafted(tmp_path / "arm.urdf", path, tmp_path)[0])
    np.testing.assert_allclose(read.position, log.position, rtol=1e-4)


def test_currents_show_no_gear_ratios(tmp_path: Path) -> None:
    log, constants = noisy_log("ur5"), np.array([11.0, 9.0, 7.0, 4.0, 5.0, 3.0])
    current, angle = log.torque / constants, np.rad2deg(log.position)
    path = save_npz(log, tmp_path / "log.npz", position=None, torque=None, velocity=None, q_deg=angle, iq=current)
    assert drafted(ARM, path, tmp_path)[0].log_table.position.unit == "deg"

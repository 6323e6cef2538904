"""Logs of Unitree's robots, whose messages number the motors and count milliseconds."""

import numpy as np
import pytest
from tests.log.readers.formats import StubRobot, synthetic_log
from tests.log.readers.messages import START, blank, write_as, write_messages
from tests.log.readers.test_damaged import check_refused

from stribeck.core.settings import LogTable
from stribeck.io.readers import read_log
from stribeck.io.readers.unitree import ORDERS

GO, HG = "unitree_go/msg/LowState", "unitree_hg/msg/LowState"
GO2 = tuple(f"{leg}_{joint}_joint" for leg in ("FL", "FR", "RL", "RR") for joint in ("hip", "thigh", "calf"))
"""Joints in the model's order, which differs from the order in the messages."""
_ARM = ("shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow", "wrist_roll", "wrist_pitch", "wrist_yaw")
_WAIST = ("waist_yaw", "waist_roll", "waist_pitch")


def _body(leg, trunk, arm):
    sides = [[f"{side}_{joint}" for joint in joints] for joints in (leg, arm) for side in ("left", "right")]
    return tuple(f"{name}_joint" for name in [*sides[0], *sides[1], *trunk, *sides[2], *sides[3]])


HIPS_OF_G1 = ("hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll")
G1 = _body(HIPS_OF_G1, _WAIST, _ARM)
G1_23 = _body(HIPS_OF_G1, _WAIST[:1], _ARM[:5])
H1_2 = _body(("hip_yaw", "hip_pitch", "hip_roll", "knee", "ankle_pitch", "ankle_roll"), ("torso",), _ARM)
H1 = _body(("hip_yaw", "hip_roll", "hip_pitch", "knee", "ankle"), ("torso",), _ARM[:4])


def low_states(kind, log, motors, topic="/lowstate", late=0, counter=1, every=1):
    """Make messages of a log whose joints have these motor numbers; recorded late by up to so many ns."""
    rng = np.random.default_rng(3)
    for row in range(0, len(log.time), every):
        message = blank(kind)
        stamp = START + round(1e9 * log.time[row])
        message.tick = (4_294_967_200 + round(1e3 * log.time[row])) % 2**32 * counter  # which begins anew on the way
        for joint, motor in enumerate(motors):
            state = message.motor_state[motor]
            state.q, state.dq = log.position[row, joint], log.velocity[row, joint]
            state.tau_est = log.torque[row, joint]
            state.temperature = 40 if kind == GO else np.array([40, 70], dtype=np.int16)
        x, y, z, w = log.base_orientation[row]
        message.imu_state.quaternion = np.array([w, x, y, z], dtype=np.float32)
        message.imu_state.gyroscope = log.angular_velocity[row].astype(np.float32)
        message.imu_state.accelerometer = log.linear_acceleration[row].astype(np.float32)
        yield topic, kind, stamp + int(rng.integers(0, late + 1)), message


LOG = synthetic_log(25, joints=GO2)
FIRST, PARTS = {"FR": 0, "FL": 3, "RR": 6, "RL": 9}, ("hip", "thigh", "calf")
MOTORS = [FIRST[name[:2]] + PARTS.index(name.split("_")[1]) for name in GO2]


def check_same(read, log):
    imu = ("base_orientation", "angular_velocity", "linear_acceleration")
    for name in ("position", "velocity", "torque", *imu):
        atol = 1e-5 if name in ("velocity", "torque") else 1e-6
        np.testing.assert_allclose(getattr(read, name), getattr(log, name), atol=atol, err_msg=name)


@pytest.mark.parametrize("define", [True, False], ids=["defined", "not defined"])
@pytest.mark.parametrize("inside", ["mcap", "rosbag2"])
def test_a_quadruped_is_read_without_a_setting(inside, define, tmp_path):
    path = write_as(inside, define, tmp_path, low_states(GO, LOG, MOTORS))
    read = read_log(path, StubRobot(joint_names=GO2, torque_source="motor_current"))
    check_same(read, LOG)
    assert read.joint_names == GO2
    assert np.all(read.temperature == 40)
    assert read.torque_source == "motor_current"
    notes = " ".join(read.notes)
    assert "the order of Go1, Go2, A1, B2 was assumed: motor_0 is FR_hip_joint" in notes
    assert "millisecond counter" in notes
    assert "foot forces" in notes


HUMANOIDS = {"G1 of 29": (HG, G1, "G1"), "G1 of 23": (HG, G1_23, "G1"), "legs of G1": (HG, G1[:12], "G1")}
HUMANOIDS |= {"H1-2": (HG, H1_2, "H1-2"), "legs of H1-2": (HG, H1_2[:13], "H1-2"), "H1": (GO, H1, "H1")}


@pytest.mark.parametrize(("kind", "joints", "name"), HUMANOIDS.values(), ids=HUMANOIDS)
def test_humanoids_are_known_by_their_joints(kind, joints, name, tmp_path):
    order = [joint.replace("waist_yaw", "torso") if "torso_joint" in joints else joint for joint in ORDERS[kind][name]]
    motors = [order.index(joint.removesuffix("_joint")) for joint in joints]
    log = synthetic_log(5, joints=joints)
    read = read_log(write_messages(tmp_path / "log.mcap", low_states(kind, log, motors)), StubRobot(joint_names=joints))
    check_same(read, log)
    assert np.all(read.temperature == 40)  # the housing's, not the winding's
    assert any(f"the order of {name} was assumed" in note for note in read.notes)


def test_foot_forces_are_read_once_they_have_a_scale(tmp_path):
    messages = list(low_states(GO, LOG, MOTORS))
    counts = np.arange(25)[:, None] + [0, 100, 200, 300]
    for (*_, message), row in zip(messages, counts, strict=True):
        message.foot_force = row.astype(np.int16)
    path = write_messages(tmp_path / "log.mcap", messages)
    robot = {"joint_names": GO2, "contacts": {"RL": None, "FR": None}}
    assert read_log(path, StubRobot(**robot)).foot_force is None
    read = read_log(path, StubRobot(**robot, log_table=LogTable.model_validate({"foot_force": {"scale": 1.5}})))
    assert read.foot_names == ("RL", "FR")
    np.testing.assert_array_equal(read.foot_force, 1.5 * counts[:, [3, 0]])


def test_messages_are_placed_by_their_counter_where_the_network_is_late(tmp_path):
    path = write_messages(tmp_path / "log.mcap", low_states(GO, LOG, MOTORS, late=1_500_000))
    read = read_log(path, StubRobot(joint_names=GO2))
    np.testing.assert_allclose(np.diff(read.time), 0.002, atol=1e-9)
    robot = StubRobot(joint_names=GO2)
    stopped = write_messages(tmp_path / "stopped.mcap", low_states(GO, LOG, MOTORS, late=1_500_000, counter=0))
    read = read_log(stopped, robot)
    assert np.ptp(np.diff(read.time)) > 1e-3
    assert any("the recorder's time is used" in note for note in read.notes)


def in_parallel_mode(folder):
    messages = list(low_states(HG, synthetic_log(16, joints=G1), range(29)))
    messages[5][3].mode_pr = 1
    return write_messages(folder / "log.mcap", messages)


def sound(folder):
    return write_messages(folder / "log.mcap", low_states(HG, synthetic_log(16, joints=G1), range(29)))


@pytest.mark.parametrize(
    ("maker", "robot", "words"),
    [
        (in_parallel_mode, {}, ["'/lowstate' has mode_pr 1", "expected mode_pr 0"]),
        (sound, {"joint_names": (*G1, "left_hand_thumb_0_joint")}, ["no position of joint 'left_hand_thumb", "locked"]),
    ],
)
def test_errors_are_described_in_one_sentence(maker, robot, words, tmp_path):
    check_refused(maker, words, tmp_path, StubRobot(**{"joint_names": G1} | robot))

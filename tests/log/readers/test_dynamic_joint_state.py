"""Joints whose interfaces ros2_control's state broadcaster names, as it sends them."""

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore
from tests.log.readers.blank import STORE
from tests.log.readers.formats import JOINTS, START, StubRobot, synthetic_log
from tests.log.readers.test_damaged import check_message
from tests.log.readers.test_unitree import write_mcap, write_rosbag2

from stribeck.errors import LogError
from stribeck.log.readers import read_log

KIND = "control_msgs/msg/DynamicJointState"
LOG = synthetic_log(60)
ALL = {
    "position": "position",
    "velocity": "velocity",
    "acceleration": "acceleration",
    "effort": "torque",
    "temperature": "temperature",
}


def states(log, interfaces=ALL, change=lambda *_: None):
    """Messages of a log; `interfaces` of all joints, or by joint. A wrist sensor and a lamp are among them."""
    value, header = STORE.types["control_msgs/msg/InterfaceValue"], STORE.types["std_msgs/msg/Header"]
    for row, time in enumerate(log.time):
        stamp = START + round(1e9 * time)
        sec, nanosec = divmod(stamp, 10**9)
        values = [value(interface_names=["force.x"], values=np.array([1.0]))]
        for joint, name in enumerate(log.joint_names):
            own = interfaces.get(name, interfaces)
            values.append(
                value(
                    interface_names=list(own),
                    values=np.array([getattr(log, channel)[row, joint] for channel in own.values()]),
                )
            )
        message = STORE.types[KIND](
            header=header(stamp=STORE.types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec), frame_id=""),
            joint_names=["wrist_sensor", *log.joint_names],
            interface_values=values,
        )
        change(row, message)
        yield "/dynamic_joint_states", KIND, stamp, message


@pytest.mark.parametrize("define", [True, False], ids=["defined", "not defined"])
@pytest.mark.parametrize("inside", ["mcap", "rosbag2"])
def test_every_interface_is_read_by_name(inside, define, tmp_path):
    if inside == "mcap":
        path = write_mcap(tmp_path / "log.mcap", states(LOG), define)
    else:
        path = write_rosbag2(tmp_path / "bag", states(LOG), 9 if define else 8)
    read = read_log(path, StubRobot())
    for channel in ALL.values():
        np.testing.assert_array_equal(getattr(read, channel), getattr(LOG, channel))
    np.testing.assert_allclose(read.time, LOG.time, atol=1e-9)


def test_joints_of_other_interfaces_and_orders(tmp_path):
    """The wheel is position-controlled and has no effort; every third message has another order."""

    def turned(row, message):
        if row % 3 == 0:
            message.joint_names = message.joint_names[::-1]
            message.interface_values = message.interface_values[::-1]

    own = {"wheel": {"position": "position"}, "position": "position", "effort": "torque"}
    shared = {"position": "position", "effort": "torque"}
    path = write_mcap(tmp_path / "log.mcap", states(LOG, {"hip": shared, "knee": shared, **own}, turned))
    read = read_log(path, StubRobot(position_controlled=("wheel",)))
    assert len(read.time) == 60
    np.testing.assert_array_equal(read.position, LOG.position)
    np.testing.assert_array_equal(read.torque[:, :2], LOG.torque[:, :2])
    assert not read.torque[:, 2].any()
    with pytest.raises(LogError, match="no torque of joint 'wheel' in the log"):
        read_log(path, StubRobot())


def test_torque_and_effort_together(tmp_path):
    """The torque that the driver calls so is not taken where there is an effort, as JointState has it."""
    path = write_mcap(
        tmp_path / "log.mcap", states(LOG, {"position": "position", "torque": "velocity", "effort": "torque"})
    )
    np.testing.assert_array_equal(read_log(path, StubRobot()).torque, LOG.torque)


def at_row_five(change):
    def maker(folder):
        return write_mcap(folder / "log.mcap", states(LOG, change=lambda row, m: change(m) if row == 5 else None))

    return maker


def lose_a_name(message):
    message.joint_names = message.joint_names[:-1]


def lose_a_value(message):
    message.interface_values[1].values = message.interface_values[1].values[:-1]


def name_twice(message):
    message.joint_names = ["wrist_sensor", "hip", "hip", "wheel"]


def without(*interfaces):
    def maker(folder):
        return write_mcap(folder / "log.mcap", states(LOG, {k: v for k, v in ALL.items() if k not in interfaces}))

    return maker


@pytest.mark.parametrize(
    ("maker", "words"),
    [
        (at_row_five(lose_a_name), ["3 joint names and interfaces of 4", "expected as many"]),
        (at_row_five(lose_a_value), ["5 interface names and 4 values of joint 'hip'", "expected one value"]),
        (at_row_five(name_twice), ["'/dynamic_joint_states' names joint 'hip' twice", "expected each once"]),
        (without("position"), ["no joint positions"]),
        (without("effort"), ["no joint torques"]),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence(maker, words, tmp_path):
    path = maker(tmp_path)
    with pytest.raises(LogError) as caught:
        read_log(path, StubRobot())
    check_message(caught.value, path, words)


def test_the_names_are_those_of_the_robot():
    assert {"hip", "knee", "wheel"} == set(JOINTS)
    assert KIND not in get_typestore(Stores.ROS2_HUMBLE).types  # so that this needs a definition of its own

"""Interfaces of joints as sent by the state broadcaster of ros2_control."""

import numpy as np
import pytest
from tests.log.readers.blank import STORE
from tests.log.readers.formats import START, StubRobot, synthetic_log
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
    """Make messages of a log; `interfaces` are for all joints, or by joint. A wrist sensor and a lamp are included."""
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

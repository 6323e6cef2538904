"""Interfaces of joints as sent by the state broadcaster of ros2_control."""

import numpy as np
import pytest
from tests.log.readers.formats import StubRobot, synthetic_log
from tests.log.readers.messages import START, STORE, blank, write_as, write_messages

from stribeck.core.errors import LogError
from stribeck.io.readers import read_log

KIND = "control_msgs/msg/DynamicJointState"
LOG = synthetic_log(60)
ALL = {name: name for name in ("position", "velocity", "acceleration", "temperature")} | {"effort": "torque"}


def states(log, interfaces=ALL, change=lambda *_: None):
    """Make messages of a log; `interfaces` are for all joints, or by joint. A wrist sensor and a lamp are included."""
    value = STORE.types["control_msgs/msg/InterfaceValue"]
    for row, time in enumerate(log.time):
        values = [value(interface_names=["force.x"], values=np.array([1.0]))]
        for joint, name in enumerate(log.joint_names):
            own = interfaces.get(name, interfaces)
            found = np.array([getattr(log, channel)[row, joint] for channel in own.values()])
            values.append(value(interface_names=list(own), values=found))
        stamp, names = START + round(1e9 * time), ["wrist_sensor", *log.joint_names]
        message = blank(KIND, stamp, joint_names=names, interface_values=values)
        change(row, message)
        yield "/dynamic_joint_states", KIND, stamp, message


@pytest.mark.parametrize("define", [True, False], ids=["defined", "not defined"])
@pytest.mark.parametrize("inside", ["mcap", "rosbag2"])
def test_every_interface_is_read_by_name(inside, define, tmp_path):
    read = read_log(write_as(inside, define, tmp_path, states(LOG)), StubRobot())
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
    path = write_messages(tmp_path / "log.mcap", states(LOG, {"hip": shared, "knee": shared, **own}, turned))
    read = read_log(path, StubRobot(position_controlled=("wheel",)))
    assert len(read.time) == 60
    np.testing.assert_array_equal(read.position, LOG.position)
    np.testing.assert_array_equal(read.torque[:, :2], LOG.torque[:, :2])
    assert not read.torque[:, 2].any()
    with pytest.raises(LogError, match="no torque of joint 'wheel' in the log"):
        read_log(path, StubRobot())

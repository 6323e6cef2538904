"""Bags without joint states: fields of any message, bags without metadata, and messages in JSON."""

import json

import numpy as np
import pytest
from mcap.writer import Writer as McapWriter
from rosbags import rosbag2
from tests.log.readers.formats import StubRobot, synthetic_log
from tests.log.readers.messages import START, blank, store_with, write_bag, write_messages

from stribeck.check.init.columns import find_columns
from stribeck.core.settings import ChannelTable, LogTable
from stribeck.io.readers import read_log
from stribeck.io.readers.formats import open_log

LOG = synthetic_log(60)
STAMPS = START + np.round(LOG.time * 1e9).astype(np.int64)
FLOATS = "std_msgs/msg/Float64MultiArray"
MOTORS = "lab_msgs/msg/Motors"
DEFINITION = f"Drive[] drives\nuint8 mode\nstring note\n{'=' * 80}\nMSG: lab_msgs/Drive\nfloat64 pos\nfloat64 cur\n"


def write_custom(folder, plugin):
    """Write positions and currents as a message of an own type, and velocities as std_msgs/Float64MultiArray."""
    store = store_with({MOTORS: DEFINITION})
    messages = []
    for row, stamp in enumerate(STAMPS):
        pairs = zip(LOG.position[row], LOG.torque[row], strict=True)
        drives = [store.types["lab_msgs/msg/Drive"](*pair) for pair in pairs]
        messages.append(("/drives", MOTORS, stamp, blank(MOTORS, store=store, drives=drives)))
        messages.append(("/vel", FLOATS, stamp, blank(FLOATS, store=store, data=LOG.velocity[row])))
    return write_bag(folder / "bag", messages, store, plugin=plugin)


def as_given(path):
    return path


def without_metadata(path):
    (path / "metadata.yaml").unlink()
    return path


def bare_file(path):
    return next(file for file in path.iterdir() if file.suffix in (".db3", ".mcap"))


FIELDS = {"position": "/drives.drives.pos", "torque": "/drives.drives.cur", "velocity": "/vel"}
NAMED = StubRobot(log_table=LogTable(**{name: ChannelTable(name=field) for name, field in FIELDS.items()}))


@pytest.mark.parametrize("change", [as_given, without_metadata, bare_file])
@pytest.mark.parametrize("plugin", rosbag2.StoragePlugin)
def test_fields_of_own_messages_are_read_by_name(change, plugin, tmp_path):
    path = change(write_custom(tmp_path, plugin))
    read = read_log(path, NAMED)
    for channel in ("position", "torque", "velocity"):
        np.testing.assert_allclose(getattr(read, channel), getattr(LOG, channel), atol=1e-12, err_msg=channel)
    found, source = find_columns(open_log(path, LogTable()))  # `init` finds them by their words
    assert {name: table["name"] for name, table in found.items()} == FIELDS | {"velocity": "/vel.data"}
    assert source == "motor_current"


def test_arrays_of_two_controllers_have_the_joints_that_their_messages_name(tmp_path):
    kind, point = "lab_msgs/msg/ControllerState", "trajectory_msgs/JointTrajectoryPoint"
    store = store_with({kind: f"std_msgs/Header header\nstring[] joint_names\n{point} feedback\n{point} output\n"})
    backward = [*range(len(LOG.joint_names))][::-1]
    messages = []
    for row, stamp in enumerate(STAMPS):
        for side in ("left", "right"):
            message = blank(kind, stamp, store=store, joint_names=[LOG.joint_names[k] for k in backward])
            for part, channel in ((message.feedback, LOG.position), (message.output, LOG.torque)):
                for field in ("positions", "velocities", "accelerations", "effort"):
                    setattr(part, field, np.ascontiguousarray(channel[row, backward]))
            messages.append((f"/{side}/arm_controller/state", kind, stamp, message))
    fields = {"position": "feedback.positions", "torque": "output.effort"}
    names = {
        key: [f"/{side}/arm_controller/state.{field}" for side in ("left", "right")] for key, field in fields.items()
    }
    joints = {f"{side}/{joint}": f"{side}_{joint}" for side in ("left", "right") for joint in LOG.joint_names}
    table = LogTable(**{key: ChannelTable(name=own) for key, own in names.items()}, joint_names=joints)
    path = write_messages(tmp_path / "log.mcap", messages, store)
    read = read_log(path, StubRobot(log_table=table, joint_names=tuple(joints.values())))
    np.testing.assert_allclose(read.position, np.tile(LOG.position, 2), atol=1e-12)
    np.testing.assert_allclose(read.torque, np.tile(LOG.torque, 2), atol=1e-12)


def test_a_single_joint_is_the_number_of_a_message(tmp_path):
    kind = "std_msgs/msg/Float64"
    messages = [
        (f"/{joint}/{channel}", kind, stamp, blank(kind, data=float(getattr(LOG, channel)[row, k])))
        for row, stamp in enumerate(STAMPS)
        for k, joint in enumerate(LOG.joint_names)
        for channel in ("position", "torque")
    ]
    path = write_messages(tmp_path / "log.mcap", messages)
    names = {channel: [f"/{joint}/{channel}" for joint in LOG.joint_names] for channel in ("position", "torque")}
    joints = {name: name.split("/")[1] for own in names.values() for name in own}
    table = LogTable(**{name: ChannelTable(name=own) for name, own in names.items()}, joint_names=joints)
    read = read_log(path, StubRobot(log_table=table))
    np.testing.assert_allclose(read.position, LOG.position, atol=1e-12)
    np.testing.assert_allclose(read.torque, LOG.torque, atol=1e-12)


def write_json(path):
    """Write joint states in JSON, as `foxglove.JointStates` on one topic and `sensor_msgs/JointState` on another."""
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start()
        kinds = {"/foxglove": "foxglove.JointStates", "/ros": "sensor_msgs/msg/JointState"}
        schemas = {topic: writer.register_schema(kind, "jsonschema", b"{}") for topic, kind in kinds.items()}
        channels = {topic: writer.register_channel(topic, "json", schema) for topic, schema in schemas.items()}
        for row, stamp in enumerate(STAMPS.tolist()):
            sec, nsec = divmod(stamp, 10**9)
            arrays = {"position": LOG.position, "velocity": LOG.velocity, "effort": LOG.torque}
            lists = {"name": list(LOG.joint_names)} | {key: values[row].tolist() for key, values in arrays.items()}
            joints = [dict(zip(lists, joint, strict=True)) for joint in zip(*lists.values(), strict=True)]
            messages = {
                "/foxglove": {"timestamp": {"sec": sec, "nsec": nsec}, "joints": joints},
                "/ros": {"header": {"stamp": {"sec": sec, "nanosec": nsec}}, **lists},
            }
            for topic, message in messages.items():
                writer.add_message(channels[topic], stamp + 7_000_000, json.dumps(message).encode(), stamp)
        writer.finish()
    return path


@pytest.mark.parametrize("topic", ["/foxglove", "/ros"])
def test_joint_states_in_json(topic, tmp_path):
    path = write_json(tmp_path / "log.mcap")
    read = read_log(path, StubRobot(log_table=LogTable(position=ChannelTable(name=topic))))
    for channel in ("position", "torque", "velocity"):
        np.testing.assert_array_equal(getattr(read, channel), getattr(LOG, channel), err_msg=channel)
    assert f"{STAMPS[0] / 1e9:.6f}" in " ".join(read.notes)  # the message's stamp, not the recorder's

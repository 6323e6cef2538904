"""LCM event logs, written by LCM's own library with the types that its compiler makes."""

import importlib
import struct
import subprocess
import sys

import lcm
import numpy as np
import pytest
from tests.log.readers.formats import JOINTS, START, StubRobot, synthetic_log
from tests.log.readers.test_damaged import check_message

from stribeck.errors import LogError
from stribeck.log.readers import read_log
from stribeck.log.readers.lcm import READ, TYPES, fingerprint
from stribeck.settings import LogTable

LOG = synthetic_log(30)


@pytest.fixture(scope="module")
def types(tmp_path_factory):
    """Return the classes that lcm-gen makes of the definitions, in a package of their own, by name."""
    folder = tmp_path_factory.mktemp("lcm_types")
    text = "\n".join(f"struct {name} {{ {fields}; }}" for name, fields in TYPES.items())
    (folder / "types.lcm").write_text(f"package of_the_tests;\n{text}")
    generate = "import sys, lcm; sys.exit(lcm.run_gen())"
    command = [sys.executable, "-c", generate, "-p", "--ppath", str(folder), str(folder / "types.lcm")]
    subprocess.run(command, check=True, capture_output=True)
    sys.path.insert(0, str(folder))
    try:
        return {name: getattr(importlib.import_module(f"of_the_tests.{name}"), name) for name in TYPES}
    finally:
        sys.path.remove(str(folder))


def write(path, events):
    """Write (channel, stamp [us], message)."""
    log = lcm.EventLog(str(path), "w", overwrite=True)
    for channel, stamp, message in events:
        log.write_event(stamp, channel, message if isinstance(message, bytes) else message.encode())
    log.close()
    return path


def iiwa(types, log=LOG, start=START // 1000, channel="IIWA_STATUS", late=0):
    for row, time in enumerate(log.time):
        message = types["lcmt_iiwa_status"]()
        message.utime, message.num_joints = start + round(1e6 * time), len(log.joint_names)
        message.joint_position_measured = list(log.position[row])
        message.joint_velocity_estimated = list(log.velocity[row])
        message.joint_torque_measured = list(log.torque[row])
        for name in ("position_commanded", "position_ipo", "torque_commanded", "torque_external"):
            setattr(message, f"joint_{name}", [99.0] * len(log.joint_names))
        yield channel, message.utime + late * (row % 2), message


def check_joints(read, log=LOG, rtol=0.0, velocity=True):
    np.testing.assert_allclose(read.position, log.position, rtol=rtol)
    np.testing.assert_allclose(read.torque, log.torque, rtol=rtol)
    if velocity:
        np.testing.assert_allclose(read.velocity, log.velocity, rtol=rtol)


def test_fingerprints_are_those_of_the_compiler(types):
    for name, made in types.items():
        assert fingerprint(name).to_bytes(8, "big") == made._get_packed_fingerprint(), name


@pytest.mark.parametrize("name", ["log.lcm", "lcmlog-2026-01-01.00"])
def test_a_drivers_joints_are_taken_in_the_robots_order(name, types, tmp_path):
    events = [("UNKNOWN", 0, b"12345678"), *iiwa(types, late=700)]
    read = read_log(write(tmp_path / name, events), StubRobot())
    check_joints(read)
    np.testing.assert_allclose(read.time, LOG.time, atol=1e-9)
    assert any("'UNKNOWN'" in note for note in read.notes)


def test_joint_order_and_stamps_from_zero_as_of_a_simulation(types, tmp_path):
    robot = StubRobot(log_table=LogTable(joint_order=["wheel", "hip", "knee"]))
    read = read_log(write(tmp_path / "log.lcm", iiwa(types, start=0, late=5)), robot)
    np.testing.assert_array_equal(read.position, LOG.position[:, [1, 2, 0]])
    np.testing.assert_allclose(read.time, LOG.time, atol=1e-9)


def test_panda(types, tmp_path):
    def events():
        for row, time in enumerate(LOG.time):
            message = types["lcmt_panda_status"]()
            message.utime, message.num_joints = 1_000_000 + round(1e6 * time), 3
            message.joint_position, message.joint_velocity = LOG.position[row], LOG.velocity[row]
            message.joint_torque = LOG.torque[row]
            for name in ("position", "velocity", "acceleration", "torque"):
                setattr(message, f"joint_{name}_desired", np.zeros(3))
            message.joint_torque_external = np.zeros(3)
            yield "PANDA_STATUS", message.utime, message

    check_joints(read_log(write(tmp_path / "log.lcm", events()), StubRobot()))


def test_cassie_by_name(types, tmp_path):
    """The knee has a spring and no motor; the base is among the positions."""
    base = [f"base_q{axis}" for axis in "wxyz"]

    def events():
        for row, time in enumerate(LOG.time):
            message = types["lcmt_robot_output"]()
            message.timestamp = 1_000_000 + round(1e6 * time)
            message.position_names, message.velocity_names = [*base, *JOINTS], [f"{name}dot" for name in JOINTS]
            message.effort_names = ["wheel_motor", "hip_motor"]
            message.position = [*LOG.base_orientation[row][[3, 0, 1, 2]], *LOG.position[row]]
            message.velocity, message.effort = LOG.velocity[row], LOG.torque[row][[2, 0]]
            message.num_positions, message.num_velocities, message.num_efforts = 7, 3, 2
            message.imu_accel = LOG.linear_acceleration[row]
            yield "CASSIE_STATE_DISPATCHER", message.timestamp, message

    read = read_log(write(tmp_path / "log.lcm", events()), StubRobot(position_controlled=("knee",)))
    np.testing.assert_array_equal(read.position, LOG.position)
    np.testing.assert_array_equal(read.velocity, LOG.velocity)
    np.testing.assert_array_equal(read.torque[:, [0, 2]], LOG.torque[:, [0, 2]])
    np.testing.assert_allclose(read.base_orientation, LOG.base_orientation)
    np.testing.assert_array_equal(read.linear_acceleration, LOG.linear_acceleration)


def robot_states(types, kind="robot_state_t", log=LOG):
    for row, time in enumerate(log.time):
        message = types[kind]()
        message.utime, message.num_joints = 1_000_000 + round(1e6 * time), 3
        message.joint_name = list(log.joint_names)
        message.joint_position, message.joint_velocity = log.position[row], log.velocity[row]
        message.joint_effort = log.torque[row]
        if kind == "robot_state_t":
            turned = message.pose.rotation
            turned.x, turned.y, turned.z, turned.w = map(float, log.base_orientation[row])
        yield "EST_ROBOT_STATE", message.utime, message


@pytest.mark.parametrize("kind", ["robot_state_t", "joint_state_t"])
def test_robot_states_by_name(kind, types, tmp_path):
    path = write(tmp_path / "log.lcm", robot_states(types, kind))
    read = read_log(path, StubRobot(joint_names=JOINTS[::-1]))
    np.testing.assert_allclose(read.position, LOG.position[:, ::-1], rtol=1e-6)
    np.testing.assert_allclose(read.torque, LOG.torque[:, ::-1], rtol=1e-6)
    if kind == "robot_state_t":
        np.testing.assert_allclose(read.base_orientation, LOG.base_orientation)


def test_legs_at_the_recorders_time(types, tmp_path):
    log = synthetic_log(30, joints=tuple(f"j{k}" for k in range(12)))

    def events():
        for row, time in enumerate(log.time):
            message = types["leg_control_data_lcmt"]()
            message.q, message.qd, message.tau_est = log.position[row], log.velocity[row], log.torque[row]
            yield "leg_control_data", START // 1000 + round(1e6 * time), message

    read = read_log(write(tmp_path / "log.lcm", events()), StubRobot(joint_names=log.joint_names))
    check_joints(read, log, rtol=1e-6)
    assert any("the recorder's time" in note for note in read.notes)


def sound(types, folder):
    return write(folder / "log.lcm", iiwa(types))


def with_bytes(change):
    def maker(types, folder):
        path = sound(types, folder)
        path.write_bytes(change(path.read_bytes()))
        return path

    return maker


def damaged_event(content):
    """Another length of the second event's message."""
    place = content.index(content[:4], 4)
    return content[: place + 24] + struct.pack(">I", 300) + content[place + 28 :]


def with_message(change):
    """A log whose sixth message is encoded, and then changed."""

    def maker(types, folder):
        events = list(iiwa(types))
        events[5] = (*events[5][:2], change(events[5][2].encode()))
        return write(folder / "log.lcm", events)

    return maker


def of_unknown_types(_, folder):
    return write(folder / "log.lcm", [("A", 0, b"12345678"), ("B", 1, b"")])


def of_two_arms(types, folder):
    return write(folder / "log.lcm", [*iiwa(types, channel="LEFT"), *iiwa(types, channel="RIGHT")])


def of_four_joints(types, folder):
    return write(folder / "log.lcm", iiwa(types, synthetic_log(20, joints="abcd")))


def of_a_definition(_, folder):
    (folder / "log.lcm").write_text("package mine;\nstruct state_t { double q[7]; }\n")
    return folder / "log.lcm"


def of_a_text_too_long(types, folder):
    events = list(robot_states(types))
    data = events[3][2].encode()
    place = data.index(b"hip\0") - 4
    events[3] = (*events[3][:2], data[:place] + struct.pack(">i", 1 << 20) + data[place + 4 :])
    return write(folder / "log.lcm", events)


def of_a_joint_twice(types, folder):
    events = list(robot_states(types))
    events[2][2].joint_name = ["hip", "knee", "hip"]
    return write(folder / "log.lcm", events)


def a_negative_count(data):
    return data[:16] + struct.pack(">i", -3) + data[20:]


@pytest.mark.parametrize(
    ("maker", "words"),
    [
        (with_bytes(lambda content: content[:-5]), ["ends within the event at byte", "expected a log that was closed"]),
        (with_bytes(lambda content: content + content[:10]), ["ends within the event at byte"]),
        (with_bytes(lambda content: content[:1000] + b"x" + content[1000:]), ["no event at byte"]),
        (with_bytes(damaged_event), ["has 300 bytes of data; expected 188"]),
        (
            with_message(lambda data: data[:-8]),
            ["3 values in 'joint_torque_external' and 16 bytes left", "expected 8 bytes a value"],
        ),
        (with_message(lambda data: data + b"1234"), ["192 bytes of data; expected 188"]),
        (with_message(a_negative_count), ["-3 values in 'joint_position_measured'"]),
        (of_a_text_too_long, ["has a text of 1048576 bytes in 'joint_name'"]),
        (of_a_joint_twice, ["'EST_ROBOT_STATE' names joint 'hip' twice", "expected each once"]),
        (of_unknown_types, ["holds no messages of type 'lcmt_iiwa_status'", "found 'A', 'B'"]),
        (of_two_arms, ["'LEFT', 'RIGHT'", "[log.position] name"]),
        (of_four_joints, ["'position' has 4 columns", "joint_order"]),
        (of_a_definition, ["holds no event at byte 0", "expected an LCM event log"]),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence(maker, words, types, tmp_path):
    path = maker(types, tmp_path)
    with pytest.raises(LogError) as caught:
        read_log(path, StubRobot())
    check_message(caught.value, path, words)


def test_flipped_bytes_never_give_anything_but_a_log_or_a_log_error(types, tmp_path):
    content = write(tmp_path / "log.lcm", robot_states(types)).read_bytes()
    rng = np.random.default_rng(1)
    for _ in range(100):
        damaged = bytearray(content)
        for place in rng.integers(0, len(content), 6):
            damaged[place] = rng.integers(0, 256)
        (tmp_path / "log.lcm").write_bytes(damaged)
        try:
            read_log(tmp_path / "log.lcm", StubRobot())
        except LogError as error:
            check_message(error, tmp_path / "log.lcm", [])


def test_only_types_with_joints_are_read():
    assert set(READ) <= set(TYPES)

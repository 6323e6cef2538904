"""Properties of `[log]`: a log with other names, units, signs, orders and delays gives the same RobotLog."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from tests.log.readers.formats import JOINTS, StubRobot, columns_of, synthetic_log, write_arrays

from stribeck.core.errors import LogError, SettingsError
from stribeck.core.log.channels import COMMAND
from stribeck.core.log.sampling import regularise
from stribeck.core.settings import LogTable
from stribeck.io.readers import read_log
from stribeck.io.readers.mapping import CURRENT, UNITS

LOG = synthetic_log()
NAMED = {"joint_names": np.array(JOINTS), "foot_names": np.array(LOG.foot_names)}


def read(folder, table, robot=None, **arrays):
    base = {"time": LOG.time, "position": LOG.position, "torque": LOG.torque}
    arrays = {name: array for name, array in (base | arrays).items() if array is not None}
    robot = robot or StubRobot()
    robot.log_table = LogTable.model_validate(table)
    return read_log(write_arrays(folder, **arrays), robot)


FACTORS = {"deg": 180 / np.pi, "turn": 0.5 / np.pi, "mm": 1e3, "deg/s": 180 / np.pi, "turn/s": 0.5 / np.pi,
           "rpm": 30 / np.pi, "krpm": 0.03 / np.pi,
           "mm/s": 1e3, "deg/s^2": 180 / np.pi, "mm/s^2": 1e3, "mNm": 1e3, "kNm": 1e-3, "mN": 1e3,
           "kN": 1e-3, "mA": 1e3, "ms": 1e3, "us": 1e6, "ns": 1e9, "g": 1 / 9.80665}  # fmt: skip
CASES = [(channel, unit) for channel, units in UNITS.items() if channel not in COMMAND for unit in units]


@pytest.mark.parametrize(("channel", "unit"), CASES)
def test_every_unit_gives_si(channel, unit, tmp_path):
    wanted = LOG.channels()[channel]
    robot = StubRobot(torque_source="motor_current" if unit in CURRENT else "link_side_sensor")
    log = read(tmp_path, {channel: {"unit": unit}}, robot, **NAMED, **{channel: FACTORS.get(unit, 1) * wanted})
    np.testing.assert_allclose(log.channels()[channel], wanted, rtol=1e-12, atol=1e-15)


def test_an_imu_in_any_rotation_is_turned_into_the_base(tmp_path):
    mount, rpy = Rotation.from_euler("xyz", [0.3, -0.2, 1.2]), {"mount": [0.3, -0.2, 1.2]}
    imu = (Rotation.from_quat(LOG.base_orientation) * mount).as_quat()
    turned = {"base_orientation": imu, "angular_velocity": mount.inv().apply(LOG.angular_velocity)}
    log = read(tmp_path, dict.fromkeys(turned, rpy), **NAMED, **turned)
    np.testing.assert_allclose(log.angular_velocity, LOG.angular_velocity, atol=1e-12)
    np.testing.assert_allclose(log.base_orientation, LOG.base_orientation, atol=1e-12)


@settings(max_examples=40)
@given(scale=st.floats(0.01, 100) | st.floats(-100, -0.01), offset=st.floats(-10, 10), joint=st.sampled_from(JOINTS))
def test_scale_then_offset_a_joint(scale, offset, joint, tmp_path_factory):
    column = JOINTS.index(joint)
    logged = LOG.torque.copy()
    logged[:, column] = (logged[:, column] - offset) / scale
    table = {"torque": {"scale": {joint: scale}, "offset": {joint: offset}}}
    log = read(tmp_path_factory.mktemp("log"), table, **NAMED, torque=logged)
    np.testing.assert_allclose(log.torque, LOG.torque, atol=1e-9)


def test_lists_of_scales_follow_the_order_of_the_log_and_not_of_the_robot(tmp_path):
    scales = [2.0, -3.0, 4.0]
    robot = StubRobot(joint_names=("wheel", "hip"))
    log = read(tmp_path, {"torque": {"scale": scales}}, robot, **NAMED, torque=LOG.torque / scales)
    np.testing.assert_allclose(log.torque, LOG.torque[:, [2, 0]])


def test_names_of_joints_feet_and_arrays(tmp_path):
    table = {
        "position": {"name": "q"},
        "joint_names": {"a": "wheel", "b": "hip", "c": "knee"},
        "foot_names": {"lf": "left_foot", "rf": "right_foot"},
    }
    order = [2, 0, 1]
    arrays = {"q": LOG.position[:, order], "torque": LOG.torque[:, order], "contact": LOG.contact[:, ::-1]}
    names = {"joint_names": np.array(["a", "b", "c"]), "foot_names": np.array(["rf", "lf"])}
    log = read(tmp_path, table, position=None, **arrays, **names)
    np.testing.assert_array_equal(log.position, LOG.position)
    np.testing.assert_array_equal(log.torque, LOG.torque)
    np.testing.assert_array_equal(log.contact, LOG.contact)


def test_wxyz_is_turned_to_xyzw(tmp_path):
    logged = LOG.base_orientation[:, [3, 0, 1, 2]]
    log = read(tmp_path, {"base_orientation": {"order": "wxyz"}}, **NAMED, base_orientation=logged)
    np.testing.assert_array_equal(log.base_orientation, LOG.base_orientation)


def test_unwrapping_undoes_wrapping_and_passes_missing_values(tmp_path):
    turning = np.cumsum(np.full((200, 3), 0.2), axis=0)
    wrapped = np.rad2deg((turning + np.pi) % (2 * np.pi) - np.pi)
    wrapped[50, 1] = np.nan
    log = read(tmp_path, {"position": {"unit": "deg", "unwrap": True}}, **NAMED, position=wrapped)
    turning[50, 1], turning[:, 0] = np.nan, turning[:, 0] - 12 * np.pi  # within its limits
    np.testing.assert_allclose(log.position, turning, atol=1e-12)


@pytest.mark.parametrize("bits", [16, 32])
@pytest.mark.parametrize("channel", ["torque", "velocity"])
def test_signed_integers_stored_as_unsigned_are_refused_and_unwrapped(bits, channel, tmp_path):
    counts = np.round(1000 * LOG.channels()[channel])
    assert counts.min() < 0 < counts.max()
    stored = {channel: counts % 2**bits}
    if channel == "velocity":
        stored["torque"] = np.abs(LOG.torque)  # no integers
    with pytest.raises(LogError, match=rf"near \d[\d.e+]*: negative integers .* set \[log.{channel}\] unwrap = true"):
        read(tmp_path, {channel: {"scale": 1e-3}}, **NAMED, **stored)
    log = read(tmp_path, {channel: {"scale": 1e-3, "unwrap": True}}, **NAMED, **stored)
    np.testing.assert_allclose(log.channels()[channel], counts / 1000, atol=1e-12)
    for wrong in (np.abs(counts), np.linspace(0, 65535, counts.size).round().reshape(counts.shape)):
        read(tmp_path, {}, **NAMED, **{channel: wrong})  # small, or large in between


@settings(max_examples=40)
@given(delay=st.floats(-0.05, 0.05))
def test_a_delayed_channel_is_put_back_in_time(delay, tmp_path_factory):
    def ramp(time):
        return time[:, None] * np.array([1.0, -2.0, 3.0])

    folder = tmp_path_factory.mktemp("log")
    log = read(folder, {"torque": {"delay": delay}}, **NAMED, position=ramp(LOG.time), torque=ramp(LOG.time - delay))
    np.testing.assert_allclose(log.torque, ramp(log.time), atol=1e-12)
    np.testing.assert_array_equal(log.position, ramp(log.time))
    assert LOG.time[-1] - log.time[-1] + log.time[0] <= abs(delay) + 0.004


def test_a_delay_does_not_reach_across_a_gap(tmp_path):
    time = LOG.time + np.where(np.arange(200) >= 100, 1.0, 0.0)
    log = read(tmp_path, {"torque": {"delay": 0.001}}, **NAMED, time=time)
    assert np.isnan(log.torque[99]).all()
    assert np.isfinite(np.delete(log.torque, 99, axis=0)).all()
    even, sampling = regularise(log, LogTable())
    assert sampling.missing == {f"torque.{joint}": 1 for joint in JOINTS}
    assert np.isfinite(even.torque).all()


def test_delayed_orientation_and_flags_keep_their_kind(tmp_path):
    table = {"base_orientation": {"delay": 0.003}, "contact": {"delay": 0.003}}
    late = {"base_orientation": LOG.base_orientation, "contact": LOG.contact}
    log = read(tmp_path, table, **NAMED, **late)
    np.testing.assert_allclose(np.linalg.norm(log.base_orientation, axis=1), 1)
    rows = np.searchsorted(LOG.time, log.time + 0.003, side="right") - 1
    np.testing.assert_array_equal(log.contact, LOG.contact[rows])
    half = LOG.base_orientation[1:-1] + LOG.base_orientation[2:]
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    np.testing.assert_allclose(log.base_orientation, half[: len(log.time)], atol=1e-9)


def test_nanoseconds_since_1970_lose_nothing(tmp_path):
    stamps = 1_700_000_000_123_456_789 + np.arange(200) * 2_000_000 + np.arange(200) % 2
    log = read(tmp_path, {"time": {"unit": "ns"}}, **NAMED, time=stamps)
    np.testing.assert_allclose(np.diff(log.time), 2e-3 + 1e-9 * np.diff(np.arange(200) % 2), atol=1e-13)
    assert any("1700000000.123457 s" in note for note in log.notes)


def test_calendar_stamps_of_a_table(tmp_path):
    columns = columns_of(LOG) | {"time": pa.array((1e9 * LOG.time).astype(np.int64) + 10**18, pa.timestamp("ns"))}
    pyarrow.parquet.write_table(pa.table(columns), tmp_path / "log.parquet")
    np.testing.assert_allclose(read_log(tmp_path / "log.parquet", StubRobot()).time, LOG.time, atol=1e-9)
    table = pa.table(columns | {"time": pa.array((1e6 * LOG.time).astype(np.int64) + 10**15, pa.timestamp("us"))})
    pyarrow.csv.write_csv(table, tmp_path / "log.csv")
    np.testing.assert_allclose(read_log(tmp_path / "log.csv", StubRobot()).time, LOG.time, atol=1e-6)


def test_optional_channels_that_do_not_cover_the_robot(tmp_path):
    columns = columns_of(LOG)
    for channel in ("velocity", "temperature", "external_torque"):
        del columns[f"{channel}.knee"]
    pyarrow.parquet.write_table(pa.table(columns), tmp_path / "log.parquet")
    log = read_log(tmp_path / "log.parquet", StubRobot())
    assert log.velocity is None
    assert np.isnan(log.temperature[:, 1]).all()
    np.testing.assert_array_equal(log.temperature[:, [0, 2]], LOG.temperature[:, [0, 2]])
    np.testing.assert_array_equal(log.external_torque, LOG.external_torque * [1, 0, 1])
    assert "No external torque of 'knee': zero is used." in log.notes


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"position": {"unit": "rpm"}}, r"\[log.position\] unit is 'rpm'; expected 'rad', 'deg'"),
        ({"time": {"delay": 0.1}}, r"\[log.time\] has a delay"),
        ({"torque": {"scale": {"hop": 2.0}}}, r"\[log.torque\] scale names 'hop'; the log's columns are 'hip'"),
        ({"torque": {"offset": [1.0]}}, r"\[log.torque\] offset lists 1 values; expected 3"),
    ],
)
def test_invalid_settings_are_refused_with_the_robot_file_and_the_key(table, words, tmp_path):
    with pytest.raises(SettingsError, match=r"^robot.toml: " + words):
        read(tmp_path, table, **NAMED)

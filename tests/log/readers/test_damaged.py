"""Unusable logs are refused in one line that names the file and the valid choices.

`DAMAGED` is a list of (name, maker, words): `maker(folder)` writes a log and returns its path. Reading it raises a
LogError with the words. `BAD_SAMPLING` lists logs that can be read, but are refused when they are resampled.
"""

import errno
import os
import struct
import time
import zipfile
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from rosbags import rosbag2
from tests.log.readers import formats
from tests.log.readers.formats import AXES, FEET, StubRobot, main_file, synthetic_log, write_parquet, write_rosbag2
from tests.log.readers.messages import messages_of, write_messages

from stribeck.core.errors import LogError
from stribeck.core.log.sampling import regularise
from stribeck.io.readers import read_log

SUFFIXES = (".npz", ".h5", ".mat", ".csv", ".parquet", ".mcap", ".bag")


def truncated(writer, share, folder):
    path = writer(folder, synthetic_log(60))
    file = main_file(path)
    file.write_bytes(file.read_bytes()[: int(share * file.stat().st_size)])
    return path


def of_bytes(name, content, folder):
    (folder / name).write_bytes(content)
    return folder / name


def arrays(change, folder):
    """Write an .npz whose arrays are changed by `change`."""
    contents = formats.arrays_of(synthetic_log(60))
    change(contents)
    return formats.write_arrays(folder, **contents)


def table(change, folder, write=pyarrow.parquet.write_table, name="log.parquet"):
    columns = formats.columns_of(synthetic_log(60))
    change(columns)
    write(pa.table(columns), folder / name)
    return folder / name


def csv_line(row, text, folder):
    """Write a CSV with one line replaced; row 0 is the header."""
    path = formats.write_csv(folder, synthetic_log(60))
    lines = path.read_text().splitlines()
    lines[row] = text(lines[row]) if callable(text) else text
    path.write_text("\n".join(lines) + "\n")
    return path


def text_in_first_number(line):
    return ",".join([line.split(",")[0], "oops", *line.split(",")[2:]])


def a_folder(name, folder):
    (folder / name).mkdir()
    return folder / name


def mcap_without_joints(folder):
    messages = messages_of(synthetic_log(20))
    return write_messages(folder / "log.mcap", (message for message in messages if message[0] == "/imu"))


def mcap_of_two_sources(folder):
    messages = list(messages_of(synthetic_log(20)))
    doubled = [("/left" + m[0], *m[1:]) for m in messages] + [("/right" + m[0], *m[1:]) for m in messages]
    return write_messages(folder / "log.mcap", doubled)


def without(*names):
    return lambda contents: [contents.pop(name) for name in names]


def with_value(name, value):
    def change(contents):
        contents[name] = value(contents[name])

    return change


OTHER_JOINTS = partial(arrays, with_value("joint_names", lambda _: np.array(["hip", "kne", "wheel"])))
OTHER_AXES = [f"foot_wrench.{foot}.{axis}" for foot in FEET for axis in AXES if axis != "fz"]
DAMAGED = [
    *(
        (f"{name} cut at {share:.0%}", partial(truncated, writer, share), ["cannot be read"])
        for name, writer in formats.WRITERS.items()
        if name != "csv"  # cut at the end of a line, it is a shorter log
        for share in (0.05, 0.4, 0.8, 0.99)
    ),
    *((f"empty {suffix}", partial(of_bytes, "log" + suffix, b""), ["is empty"]) for suffix in SUFFIXES),
    *((f"a folder {suffix}", partial(a_folder, "log" + suffix), ["is a folder"]) for suffix in SUFFIXES),
    ("no file", lambda folder: folder / "log.npz", ["no such file"]),
    ("unknown suffix", partial(of_bytes, "log.xlsx", b"x"), ["unknown suffix '.xlsx'", ".parquet"]),
    ("npz without positions", partial(arrays, without("position")), ["no joint positions", "[log.position] name"]),
    ("npz without torques", partial(arrays, without("torque")), ["no joint torques", "[log.torque] name"]),
    ("npz without time", partial(arrays, without("time")), ["no time", "[log] rate"]),
    ("npz with a short torque", partial(arrays, with_value("torque", lambda a: a[:-1])), ["'torque' has 59 rows"]),
    ("npz with other joints", OTHER_JOINTS, ["of joint 'knee'", 'joint_names = { kne = "knee" } in [log]', "] locked"]),
    ("npz of contact forces", partial(arrays, with_value("contact", lambda a: a * 312.5)), ["312.5", "flags"]),
    ("csv with text", partial(csv_line, 20, text_in_first_number), ["cannot be read as CSV", "Row #21", "oops"]),
    ("parquet without a joint", partial(table, without("position.knee")), ["no position of joint 'knee'"]),
    ("parquet without a torque", partial(table, without("torque.knee")), ["no torque of joint 'knee'", "controlled"]),
    (
        "parquet of vertical forces",
        partial(table, without(*OTHER_AXES)),
        ["no column for 'left_foot.fx'", "foot_force'"],
    ),
    ("parquet of no rows", lambda folder: write_parquet(folder, synthetic_log(0)), ["0 samples"]),
    ("mcap without joint states", mcap_without_joints, ["sensor_msgs/JointState", "'/imu'"]),
    ("mcap of two robots", mcap_of_two_sources, ["'/left/imu'", "[log.base_orientation] name"]),
]


def backward(time):
    time = time.copy()
    time[30:] -= 0.1
    return time


def mostly_missing(torque):
    torque = torque.copy()
    torque[1:, 1] = np.nan
    return torque


BAD_SAMPLING = [
    ("time backwards", partial(arrays, with_value("time", backward)), ["backwards in row 30", "0.058", "-0.04"]),
    ("time in ms", partial(arrays, with_value("time", lambda t: 1e3 * t)), ['[log.time] unit = "ms"', "500 Hz"]),
    ("time in ns", partial(arrays, with_value("time", lambda t: (1e9 * t).astype(int))), ['[log.time] unit = "ns"']),
    ("time that stands", partial(arrays, with_value("time", np.zeros_like)), ["all stamps"]),
    ("long quaternions", partial(arrays, with_value("base_orientation", lambda q: 1.1 * q)), ["norm 1.1"]),
    ("no torque at all", partial(arrays, with_value("torque", np.zeros_like)), ["'torque' is zero"]),
    ("positions in degrees", partial(arrays, with_value("position", np.rad2deg)), ["in deg", "[log.position] unit"]),
    ("2 samples", lambda folder: formats.write_npz(folder, synthetic_log(2)), ["has 2 samples;"]),
    ("15 samples", lambda folder: formats.write_npz(folder, synthetic_log(15)), ["has 15 samples;"]),
    ("hardly a torque", partial(arrays, with_value("torque", mostly_missing)), ["torque.knee (59)"]),
    ("holes", partial(arrays, with_value("time", lambda t: t + 0.5 * (np.arange(len(t)) // 4))), ["max_gap"]),
]


def check_message(error, path, words):
    message = str(error)
    assert len(message.splitlines()) == 1
    assert len(message) < 700
    assert message.startswith(str(path))
    for word in words:
        assert word in message


def check_refused(maker, words, folder, robot=None):
    path = maker(folder)
    with pytest.raises(LogError) as caught:
        read_log(path, robot or StubRobot())
    check_message(caught.value, path, words)


@pytest.mark.parametrize(("maker", "words"), [case[1:] for case in DAMAGED], ids=[case[0] for case in DAMAGED])
def test_a_damaged_log_is_refused_in_one_sentence(maker, words, tmp_path):
    check_refused(maker, words, tmp_path)


@pytest.mark.parametrize(
    ("maker", "words"), [case[1:] for case in BAD_SAMPLING], ids=[case[0] for case in BAD_SAMPLING]
)
def test_a_log_that_cannot_be_made_regular_is_refused_in_one_sentence(maker, words, tmp_path):
    path = maker(tmp_path)
    log = read_log(path, StubRobot())
    with pytest.raises(LogError) as caught:
        regularise(log, StubRobot().log_table)
    check_message(caught.value, path, words)


@pytest.mark.parametrize("writer", formats.WHOLE.values(), ids=formats.WHOLE)
def test_a_file_that_is_nearly_all_a_hole(writer, tmp_path):
    path = writer(tmp_path, synthetic_log(20))
    os.truncate(path, 1 << 40)
    with pytest.raises(LogError, match=r"is 1\.1e\+12 bytes long, but .* on the disk; expected a complete file"):
        read_log(path, StubRobot())


@pytest.mark.parametrize("reason", [errno.EACCES, errno.EIO])
def test_a_file_that_the_system_cannot_read_is_reported(reason, tmp_path, monkeypatch):
    def refuse(path, *_):
        raise OSError(reason, os.strerror(reason), str(path))

    path = write_parquet(tmp_path, synthetic_log(20))
    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(LogError) as caught:
        read_log(path, StubRobot())
    assert str(caught.value) == f"{path}: cannot be read ({os.strerror(reason)}); expected a readable log"


LIMIT = 1 << 24
"""Memory limit of these tests [bytes]."""
ROWS = 1 << 20
"""Number of rows of time and two joints that exceeds the limit."""


def npz(path, rows=ROWS):
    """Write zeros, which compress to a thousandth."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, shape in (("time", (rows,)), ("position", (rows, 2)), ("torque", (rows, 2))):
            with archive.open(f"{name}.npy", "w") as file:
                np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": shape})
                for _ in range(0, 8 * int(np.prod(shape)), 1 << 22):
                    file.write(bytes(1 << 22))


def hdf5(path):
    with h5py.File(path, "w") as file:
        for name, shape in (("time", (10**12,)), ("position", (10**12, 2)), ("torque", (10**12, 2))):
            file.create_dataset(name, shape, float, chunks=(1024, *shape[1:]))


def parquet(path):
    names = ("time", "position.hip", "position.knee", "torque.hip", "torque.knee")
    batch = pa.table(dict.fromkeys(names, np.zeros(1 << 20)))
    with pyarrow.parquet.ParquetWriter(path, batch.schema) as writer:
        for _ in range(0, ROWS, 1 << 20):
            writer.write_table(batch)


@pytest.mark.parametrize(("make", "name"), [(npz, "log.npz"), (hdf5, "log.h5"), (parquet, "log.parquet")])
def test_more_samples_than_the_file_can_hold(make, name, tmp_path, monkeypatch):
    monkeypatch.setattr("stribeck.core.log.storage.IN_MEMORY_LIMIT", LIMIT)
    make(tmp_path / name)
    start = time.process_time()
    with pytest.raises(LogError, match=r"declares .* bytes of samples") as refused:
        read_log(tmp_path / name)
    assert time.process_time() - start < 1.0
    assert len(str(refused.value).splitlines()) == 1


def test_no_room_for_a_sound_log(tmp_path, monkeypatch):
    np.savez(tmp_path / "log.npz", time=np.arange(9.0), position=np.ones((9, 2)), torque=np.ones((9, 2)))
    monkeypatch.setattr("stribeck.core.log.storage.IN_MEMORY_LIMIT", 100)
    monkeypatch.setattr("stribeck.core.log.storage.shutil.disk_usage", lambda _: SimpleNamespace(free=100))
    with pytest.raises(LogError, match="too large for memory"):
        read_log(tmp_path / "log.npz")


LOG = synthetic_log(60)


def test_joints_whose_order_changes_are_matched_by_name(tmp_path):
    sent = list(messages_of(LOG))
    for *_, message in [each for each in sent if each[0] == "/joint_states"][::3]:
        message.name = [message.name[place] for place in (2, 0, 1)]
        for channel in ("position", "velocity", "effort"):
            setattr(message, channel, getattr(message, channel)[[2, 0, 1]])
    read = read_log(write_messages(tmp_path / "log.mcap", sent), StubRobot())
    np.testing.assert_allclose(read.time, LOG.time, atol=1e-9)
    np.testing.assert_allclose(read.position, LOG.position, atol=1e-12)
    np.testing.assert_allclose(read.torque, LOG.torque, atol=1e-12)


def test_a_slow_imu_is_ignored(tmp_path):
    sent = [m for row, m in enumerate(messages_of(synthetic_log(301))) if m[0] != "/imu" or row // 6 % 100 == 0]
    read = read_log(write_messages(tmp_path / "log.mcap", sent), StubRobot())
    assert len(read.time) == 301
    assert read.base_orientation is None
    assert any("'/imu' is ignored: 5 Hz" in note for note in read.notes)


def flip(path: Path, value: float) -> None:
    """Change one digit of a number in a file."""
    content = bytearray(path.read_bytes())
    content[content.index(struct.pack("<d", value)) + 6] ^= 0x10
    path.write_bytes(content)


@pytest.mark.parametrize("inside", [False, True], ids=["alone", "in a rosbag2"])
@pytest.mark.parametrize("chunked", [True, False], ids=["in chunks", "not in chunks"])
def test_an_mcap_with_another_number_than_was_written(inside, chunked, tmp_path):
    path = folder = formats.write_rosbag2_of_mcap(tmp_path, LOG)
    file = write_messages(main_file(path), messages_of(LOG), chunked=chunked)
    if not inside:
        path = file.rename(tmp_path / "log.mcap")
    np.testing.assert_allclose(read_log(path, StubRobot()).position, LOG.position, atol=1e-12)
    flip(path if path.is_file() else main_file(folder), LOG.position[30, 1])
    with pytest.raises(LogError, match=r"(?i)crc|checksum"):
        read_log(path, StubRobot())


PLUGINS = pytest.mark.parametrize("plugin", rosbag2.StoragePlugin)


@PLUGINS
@pytest.mark.parametrize("mode", [rosbag2.CompressionMode.FILE, rosbag2.CompressionMode.MESSAGE])
def test_a_compressed_bag_is_read(plugin, mode, tmp_path):
    path = write_rosbag2(tmp_path, LOG, plugin, mode)
    np.testing.assert_allclose(read_log(path, StubRobot()).position, LOG.position, atol=1e-12)


@pytest.mark.parametrize("lost", [1, 100, 2000, 4096])
def test_a_database_cut_in_its_last_page(lost, tmp_path):
    path = write_rosbag2(tmp_path, synthetic_log(190))
    file = main_file(path)
    size = file.stat().st_size
    file.write_bytes(file.read_bytes()[:-lost])
    with pytest.raises(LogError, match=f"db3 ends after {size - lost} of {size} bytes|disk image is malformed"):
        read_log(path, StubRobot())


def test_a_bag_that_was_not_closed(tmp_path):
    path = write_rosbag2(tmp_path, LOG)
    main_file(path).with_name(main_file(path).name + "-wal").write_bytes(b"messages")
    with pytest.raises(LogError, match=r"db3-wal: contains messages that were not merged"):
        read_log(path, StubRobot())

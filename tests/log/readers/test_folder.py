"""Several files of one run, one per channel."""

from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
import pytest
from tests.log.readers.formats import JOINTS, StubRobot, columns_of, robot_with, synthetic_log

from stribeck.core.errors import LogError
from stribeck.io.readers import read_log

LOG = synthetic_log(200)
MATRICES = {"position": LOG.position, "torque": LOG.torque}


def write(folder, name, columns):
    """Write a table of named columns, or a matrix without a header line."""
    folder.mkdir(exist_ok=True)
    if isinstance(columns, np.ndarray):
        np.savetxt(folder / name, columns, delimiter=",", fmt="%.17g")
        return folder
    save = pyarrow.parquet.write_table if name.endswith(".parquet") else pyarrow.csv.write_csv
    save(pa.table(columns), folder / name)
    return folder


def joints(values, time=LOG.time):
    return {"time": time} | {joint: values[:, k] for k, joint in enumerate(JOINTS)}


def motion_at(time, name):
    return np.stack([np.interp(time, LOG.time, column) for column in getattr(LOG, name).T], axis=1)


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_file_a_channel_is_the_log(suffix, tmp_path):
    of_files: dict[str, dict[str, np.ndarray]] = {}
    for name, column in columns_of(LOG).items():
        channel, _, label = name.partition(".")
        if label:
            of_files.setdefault(channel, {"time": LOG.time})[label] = column
    for channel, columns in of_files.items():
        write(tmp_path / "run", channel + suffix, columns)
    log = read_log(tmp_path / "run", StubRobot())
    np.testing.assert_allclose(log.time, LOG.time, atol=1e-9)
    for name, channel in LOG.channels().items():
        np.testing.assert_allclose(log.channels()[name], channel, atol=1e-15, err_msg=name)
    assert log.path == str(tmp_path / "run")
    assert not any("interpolated" in note for note in log.notes)


def test_files_of_other_clocks_are_brought_to_that_of_the_positions(tmp_path):
    late = np.arange(0.0107, 0.37, 0.003)
    folder = write(tmp_path / "run", "position.csv", joints(LOG.position))
    write(folder, "torque.csv", joints(motion_at(late, "torque"), late))
    log = read_log(folder, StubRobot())
    kept = (LOG.time >= late[0]) & (LOG.time <= late[-1])
    np.testing.assert_array_equal(log.position, LOG.position[kept])
    np.testing.assert_allclose(log.torque, LOG.torque[kept], atol=1e-4)
    assert "'torque.csv' is resampled from 333.3 Hz (interpolated)." in log.notes


@pytest.mark.parametrize("names", [("position", "torque"), ("q", "tau")])
def test_matrices_without_names_beside_a_file_of_times(names, tmp_path):
    for name, values in zip(names, MATRICES.values(), strict=True):
        write(tmp_path / "run", f"{name}.csv", values)
    with pytest.raises(LogError, match=r"contains no time; expected 'time', .* or \[log\] rate"):
        read_log(tmp_path / "run", StubRobot())
    np.testing.assert_allclose(read_log(tmp_path / "run", robot_with(rate=500.0)).time, LOG.time, atol=1e-9)
    write(tmp_path / "run", "time.csv", 1e3 * LOG.time[:, None])
    log = read_log(tmp_path / "run", robot_with(time={"unit": "ms"}, joint_order=["knee", "hip", "wheel"]))
    np.testing.assert_allclose(log.time, LOG.time, atol=1e-9)
    np.testing.assert_array_equal(log.position, LOG.position[:, [1, 0, 2]])
    np.testing.assert_array_equal(log.torque, LOG.torque[:, [1, 0, 2]])


def test_a_setting_names_the_file_of_a_channel(tmp_path):
    folder = write(tmp_path / "run", "encoders.csv", joints(LOG.position))
    write(folder, "position.csv", joints(0 * LOG.position))  # which another setting leaves alone
    write(folder, "strain.csv", joints(2 * LOG.torque))
    log = read_log(folder, robot_with(position={"name": "encoders"}, torque={"name": "strain", "scale": 0.5}))
    np.testing.assert_array_equal(log.position, LOG.position)
    np.testing.assert_array_equal(log.torque, LOG.torque)


def test_a_channel_may_lie_in_two_files_of_other_joints(tmp_path):
    whole = columns_of(LOG)
    for name, own in (("left", JOINTS[:1]), ("right", JOINTS[1:])):
        columns = {f"{c}.{joint}": whole[f"{c}.{joint}"] for c in MATRICES for joint in own}
        write(tmp_path / "run", f"{name}.csv", {"time": LOG.time} | columns)
    for k, joint in enumerate(JOINTS):  # or a file is a joint's
        write(tmp_path / "joints", f"{joint}.csv", {"time": LOG.time} | {c: m[:, k] for c, m in MATRICES.items()})
    for folder in ("run", "joints"):
        np.testing.assert_array_equal(read_log(tmp_path / folder, StubRobot()).torque, LOG.torque)


def both(**changed):
    """Make files of positions and torques with some changes."""
    files = {f"{name}.csv": joints(values) for name, values in MATRICES.items()}
    return files | {f"{name}.csv": columns for name, columns in changed.items()}


HOLE = joints(LOG.torque) | {"time": np.where(LOG.time == LOG.time[7], np.nan, LOG.time)}
REFUSED: list[Any] = [
    ("a stamp missing", both(torque=HOLE), {}, r"torque\.csv: row 8 has no time; expected one in every row"),
    ("another day", both(torque=joints(LOG.torque, LOG.time + 100)), {}, "do not overlap in time"),
    ("nanoseconds", both(torque=joints(LOG.torque, 1e18 + LOG.time)), {}, "up to 1e.18 s; expected seconds"),
    ("a file short of times",
     {"position.csv": LOG.position, "torque.csv": LOG.torque[:9], "time.csv": LOG.time[:, None]}, {},
     r"torque\.csv: has 9 rows and no time, but 'time.csv' has 200; expected as many"),
    ("a misspelled name", both(), {"position": {"name": ["position.hip", "position.kne"]}}, "is .position.kne."),
    ("the same joints twice", both(arms={"time": LOG.time, "torque.hip": LOG.time}), {}, "same joints is in 'arms"),
    ]  # fmt: skip


@pytest.mark.parametrize(("files", "table", "words"), [case[1:] for case in REFUSED], ids=[case[0] for case in REFUSED])
def test_a_folder_that_cannot_be_used_is_refused_in_one_sentence(files, table, words, tmp_path):
    for name, columns in files.items():
        write(tmp_path / "run", name, columns)
    with pytest.raises(LogError, match=words) as caught:
        read_log(tmp_path / "run", robot_with(**table))
    assert str(caught.value).startswith(str(tmp_path / "run"))
    assert len(str(caught.value).splitlines()) == 1

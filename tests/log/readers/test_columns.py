"""Tables and frames: unnamed or numbered columns, alternative names, lists in every row, settings and indices."""

import csv
from typing import Any

import h5py
import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.parquet
import pytest
from tests.log.readers.formats import JOINTS, StubRobot, columns_of, robot_with, synthetic_log, write_arrays

from stribeck.core.errors import LogError
from stribeck.core.log import RobotLog
from stribeck.io.readers import read_log

LOG = synthetic_log(30)
CHANNELS = ("position", "velocity", "torque")


def write_rows(path, names, rows, delimiter=","):
    with path.open("w", newline="") as file:
        writer = csv.writer(file, delimiter=delimiter)
        writer.writerows(([names] if names else []) + list(rows))
    return path


def write_columns(folder, **columns):
    """Write a Parquet table; a matrix becomes a column of lists."""
    columns = {name: list(values) if getattr(values, "ndim", 1) == 2 else values for name, values in columns.items()}
    pyarrow.parquet.write_table(pa.table(columns), folder / "log.parquet", row_group_size=8)
    return folder / "log.parquet"


def numbered(pattern, values, first=0):
    return {pattern.format(first + k): column for k, column in enumerate(values.T)}


def check_motion(log, channels=CHANNELS, columns=(0, 1, 2)):
    assert log.joint_names == JOINTS
    for name in channels:
        np.testing.assert_array_equal(getattr(log, name), getattr(LOG, name)[:, columns], err_msg=name)


@pytest.mark.parametrize("delimiter", [",", ";", "\t", " "])
def test_a_csv_without_a_line_of_names(delimiter, tmp_path):
    columns = columns_of(LOG)
    path = write_rows(tmp_path / "log.csv", [], zip(*columns.values(), strict=True), delimiter)
    log = read_log(path, robot_with(columns=list(columns)))
    for name, channel in LOG.channels().items():
        np.testing.assert_array_equal(log.channels()[name], channel, err_msg=name)


@pytest.mark.parametrize("pattern", ["{}_{{}}", "{}{{}}", "{}.{{}}", "{}[{{}}]", "{}_[{{}}]"])
@pytest.mark.parametrize("first", [0, 1])
def test_numbered_columns_are_the_joints_in_order(pattern, first, tmp_path):
    columns = {"time": LOG.time}
    for name in CHANNELS:
        columns |= dict(reversed(numbered(pattern.format(name), getattr(LOG, name), first).items()))
    log = read_log(write_columns(tmp_path, **columns), StubRobot())
    check_motion(log)
    assert "The columns of 'position' have no known names: taken in the order of the robot file" in log.notes[0]


def test_a_prefix_of_another_name_takes_only_its_numbers(tmp_path):
    columns = {"time": LOG.time} | numbered("p_{}", LOG.position) | numbered("pd_{}", LOG.velocity)
    columns |= numbered("tau_{}", LOG.torque)
    table = {"position": {"name": "p"}, "velocity": {"name": "pd"}}
    check_motion(read_log(write_columns(tmp_path, **columns), robot_with(**table)))


def test_vectors_and_feet_may_be_numbered(tmp_path):
    columns = columns_of(LOG)
    renamed = {name: values for name, values in columns.items() if not name.startswith(("base", "foot", "contact"))}
    renamed |= numbered("base_orientation_{}", LOG.base_orientation) | numbered("contact_{}", LOG.contact)
    renamed |= numbered("foot_wrench[{}]", LOG.foot_wrench.reshape(30, -1)) | numbered("foot_force{}", LOG.foot_force)
    log = read_log(write_columns(tmp_path, **renamed), StubRobot())
    for name, channel in LOG.channels().items():
        np.testing.assert_array_equal(log.channels()[name], channel, err_msg=name)


@pytest.mark.parametrize("names", [("t", "q", "qd", "tau"), ("timestamp", "joint_pos", "joint_vel", "effort")])
def test_usual_names_are_read_and_noted(names, tmp_path):
    arrays = dict(zip(names, (LOG.time, LOG.position, LOG.velocity, LOG.torque), strict=True))
    note = f"Alternative names in the log: '{names[0]}' as time, '{names[1]}' as position, '{names[2]}' as velocity, "
    write_columns(tmp_path, **arrays)
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file.update(arrays)
    for path in (write_arrays(tmp_path, **arrays), tmp_path / "log.h5", tmp_path / "log.parquet"):
        log = read_log(path, StubRobot())
        check_motion(log)
        assert f"{note}'{names[3]}' as torque." in log.notes


def test_a_usual_name_counts_only_without_the_channels_own_and_beside_as_many_positions(tmp_path):
    path = write_arrays(tmp_path, time=LOG.time, position=LOG.position, torque=LOG.torque, q=0 * LOG.position,
                        dq=LOG.velocity[:, :2])  # fmt: skip
    log = read_log(path, StubRobot())
    check_motion(log, ("position", "torque"))
    assert log.velocity is None
    assert not any("usual" in note for note in log.notes)


@pytest.mark.parametrize("fixed", [False, True])
def test_a_parquet_column_of_lists(fixed, tmp_path):
    kind = pa.list_(pa.float64(), 3) if fixed else pa.list_(pa.float64())
    columns = {name: pa.array(list(getattr(LOG, name)), kind) for name in CHANNELS}
    columns["foot_wrench"] = pa.array(list(LOG.foot_wrench.reshape(30, -1)))
    columns["base_orientation"] = pa.array(list(LOG.base_orientation))
    pyarrow.parquet.write_table(pa.table({"time": LOG.time} | columns), tmp_path / "log.parquet", row_group_size=8)
    log = read_log(tmp_path / "log.parquet", StubRobot())
    check_motion(log)
    np.testing.assert_array_equal(log.foot_wrench, LOG.foot_wrench)
    np.testing.assert_array_equal(log.base_orientation, LOG.base_orientation)


@pytest.mark.parametrize("delimiter", [",", ";"])
@pytest.mark.parametrize("text", [lambda row: str(row.tolist()), str, lambda row: str(row.tolist()).replace(" ", "\n")])
def test_cells_of_lists_in_a_csv(text, delimiter, tmp_path):
    rows = [[t, text(q), text(tau)] for t, q, tau in zip(LOG.time, LOG.position, LOG.torque, strict=True)]
    path = write_rows(tmp_path / "log.csv", ["t", "q", "tau"], rows, delimiter)
    log = read_log(path, StubRobot())
    np.testing.assert_allclose(log.position, LOG.position, atol=1e-8)  # NumPy prints eight digits
    np.testing.assert_allclose(log.torque, LOG.torque, atol=1e-7)


ROWS = [[0.0, 1.0, 2.0, 3.0], [0.002, 1.0, 2.0, 3.0]]
REFUSED: list[Any] = [
    ("names nowhere", [], ROWS, {}, r"contains numbers \('0.0', '1.0', '2.0' and 1 more\); expected a line"),
    ("a joint too many", ["t", "q_0", "q_1", "q_2", "q_3"], [[0, 1, 2, 3, 4]] * 2, {}, "4 columns without names"),
    ("a number twice", ["t", "q_0", "q0", "q_1"], ROWS, {}, "have the numbers '0', '0', '1'"),
    ("lists of two lengths", ["t", "q", "tau"], [[0, "[1, 2, 3]", "[1, 2, 3]"], [1, "[1, 2]", "[1, 2, 3]"]], {},
     "column 'q' contains 2 values in row 2, 3 before; expected the same number in every row"),
    ]  # fmt: skip


@pytest.mark.parametrize(("names", "rows", "table", "words"), [c[1:] for c in REFUSED], ids=[c[0] for c in REFUSED])
def test_ambiguous_tables_are_refused_in_one_sentence(names, rows, table, words, tmp_path):
    path = write_rows(tmp_path / "log.csv", names, rows)
    with pytest.raises(LogError, match=words) as caught:
        read_log(path, robot_with(**table))
    assert str(caught.value).startswith(f"{path}: ")
    assert len(str(caught.value).splitlines()) == 1


FRAMES = pytest.mark.parametrize("make", [pd.DataFrame, pl.DataFrame], ids=["pandas", "polars"])


@pytest.mark.parametrize("frame", [LOG.to_frame(), pl.DataFrame(columns_of(LOG))], ids=["pandas", "polars"])
def test_every_channel_is_read(frame):
    log = RobotLog.from_frame(frame, StubRobot())
    assert (log.joint_names, log.foot_names, log.path, log.notes) == (JOINTS, LOG.foot_names, "", ())
    for name, channel in LOG.channels().items():
        np.testing.assert_array_equal(log.channels()[name], channel, err_msg=name)


@FRAMES
def test_settings_of_the_robot_file_and_missing_values(make):
    torque = LOG.torque[:, 0].copy()
    torque[7] = np.nan
    robot = robot_with(torque={"scale": -1.0}, time={"name": "when"})
    columns = {"when": pd.to_datetime(1_700_000_000_000_000_000 + np.arange(30) * 2_000_000)} | columns_of(LOG)
    log = RobotLog.from_frame(make(columns | {"torque.hip": torque}), robot)
    np.testing.assert_array_equal(log.torque[:, 0], -torque)
    np.testing.assert_allclose(log.time, LOG.time, atol=1e-9)


def test_an_index_with_a_name_is_a_column():
    frame = pd.DataFrame(columns_of(LOG)).set_index("time")
    np.testing.assert_array_equal(RobotLog.from_frame(frame, StubRobot()).time, LOG.time)
    since = frame.set_index(pd.to_timedelta(frame.index, unit="s").rename("time"))
    np.testing.assert_allclose(RobotLog.from_frame(since, StubRobot()).time, LOG.time, atol=1e-9)

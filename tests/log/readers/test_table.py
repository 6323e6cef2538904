"""Features of tables: variants of CSV, and types of columns."""

import gzip
import json
import re

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.feather
import pyarrow.parquet
import pytest
from tests.log.readers.formats import StubRobot, columns_of, synthetic_log, write_csv

from stribeck.core.errors import LogError
from stribeck.core.settings import ChannelTable, LogTable
from stribeck.io.readers import read_log
from stribeck.io.readers.tables import open_csv

LOG = synthetic_log(30)


def _in_two_lines(text):
    """Write channel and label one below the other, as pandas does."""
    head, rest = text.replace('"', "").split("\n", 1)
    return "\n".join([re.sub(r"\.[^,]*", "", head), re.sub(r"(^|,)[^,.]*\.?", r"\1", head), rest])


def _with_units(text, units):
    """Add a line of units in SI after the names."""
    names = next(line for line in text.splitlines() if "," in line)
    row = ",".join(units[k % len(units)] for k in range(names.count(",") + 1))
    return text.replace(names, names + "\n" + row)


def _with_integers(text):
    """Write decimal commas, and integers in the first line as programs do."""
    german = re.sub(r"(?<=\d)\.", ",", text.replace(",", ";"))
    return german.replace("0,0;", "0;", 1)


DIALECTS = {
    "semicolons": lambda text: text.replace(",", ";"),
    "tabs": lambda text: text.replace(",", "\t"),
    "decimal commas": lambda text: re.sub(r"(?<=\d)\.", ",", text.replace(",", ";")),
    "a hash and spaces": lambda text: "# " + text.replace('"', "").replace(",", " "),
    "a byte order mark": lambda text: "\ufeff" + text,
    "UTF-16": lambda text: text.encode("utf-16"),
    "two lines of names": _in_two_lines,
    "a line of units": lambda text: _with_units(text, ["s", "[rad]", "Nm", "-"]),
    "units and comments of MATLAB": lambda text: _with_units("% run 7\n% " + text, ["(s)", "", "N m", "rad/s^2"]),
    "decimal commas after a line of integers": lambda text: _with_integers(text),
}


@pytest.mark.parametrize("dialect", DIALECTS)
def test_csv_as_people_write_it(dialect, tmp_path):
    path = write_csv(tmp_path, LOG)
    text = DIALECTS[dialect](path.read_text())
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    log = read_log(path, StubRobot())
    for name, channel in LOG.channels().items():
        np.testing.assert_array_equal(log.channels()[name], channel, err_msg=name)


def test_seconds_and_nanoseconds_are_one_time(tmp_path):
    columns = columns_of(LOG)
    stamps = 1_700_000_000_250_000_000 + np.round(1e9 * columns.pop("time")).astype(np.int64)
    columns |= {"header.stamp.sec": stamps // 10**9, "header.stamp.nanosec": stamps % 10**9}
    pyarrow.csv.write_csv(pa.table(columns), tmp_path / "log.csv")
    read = read_log(tmp_path / "log.csv", StubRobot())
    np.testing.assert_allclose(read.time - read.time[0], LOG.time - LOG.time[0], atol=1e-9)


def _records():
    """Make a record of time, a list of positions and torques by joint for each sample."""
    torques = [dict(zip(LOG.joint_names, row, strict=True)) for row in LOG.torque.tolist()]
    rows = zip(LOG.time.tolist(), LOG.position.tolist(), torques, strict=True)
    return [{"time": time, "position": position, "torque": torque} for time, position, torque in rows]


def _structured(path):
    array = np.zeros(len(LOG.time), [("time", "f8"), ("position", "f8", 3), ("torque", "f8", 3)])
    array["time"], array["position"], array["torque"] = LOG.time, LOG.position, LOG.torque
    np.save(path, array)


CONTAINERS = {
    ".csv.gz": lambda path: path.write_bytes(gzip.compress(write_csv(path.parent, LOG).read_bytes())),
    ".feather": lambda path: pyarrow.feather.write_feather(pa.table(columns_of(LOG)), path),
    ".json": lambda path: path.write_text(json.dumps(_records())),
    ".jsonl": lambda path: path.write_text("\n".join(map(json.dumps, _records()))),
    ".npy": _structured,
}


@pytest.mark.parametrize("suffix", CONTAINERS)
def test_records_in_other_containers(suffix, tmp_path):
    CONTAINERS[suffix](tmp_path / f"run{suffix}")
    log = read_log(tmp_path / f"run{suffix}", StubRobot())
    for name in ("time", "position", "torque"):
        np.testing.assert_array_equal(log.channels()[name], LOG.channels()[name], err_msg=name)


def test_names_in_latin_1_and_other_units(tmp_path):
    columns = {"time": LOG.time, "Höhe": LOG.position[:, 0], "torque.Höhe": LOG.torque[:, 0]}
    lines = [";".join(f"{x:g}".replace(".", ",") for x in row) for row in zip(*columns.values(), strict=True)]
    text = "\n".join(["Zeit;position.Höhe;torque.Höhe", "ms;°;mNm", *lines])
    (tmp_path / "log.csv").write_bytes(text.encode("latin-1"))
    assert open_csv(tmp_path / "log.csv", LogTable()).others[0] == "Zeit [ms]"
    table = LogTable(
        time=ChannelTable(name="Zeit [ms]", unit="ms"),
        position=ChannelTable(name=["position.Höhe [°]"], unit="deg"),
        torque=ChannelTable(name=["torque.Höhe [mNm]"], unit="mNm"),
    )
    read = read_log(tmp_path / "log.csv", StubRobot(joint_names=("Höhe",), log_table=table))
    np.testing.assert_allclose(read.position, np.deg2rad(LOG.position[:, :1]), rtol=1e-5)
    np.testing.assert_allclose(read.torque, LOG.torque[:, :1] / 1e3, rtol=1e-5)
    np.testing.assert_allclose(read.time, LOG.time / 1e3, rtol=1e-5)


def test_a_wrench_by_a_list_of_columns_needs_the_order_of_the_feet(tmp_path):
    columns = {
        name.replace("foot_wrench.", "ft_").replace(".", "_"): column for name, column in columns_of(LOG).items()
    }
    asked = [f"ft_right_foot_{axis}" for axis in ("fx", "fy", "fz", "tx", "ty", "tz")]
    table = {name: {"name": f"{name}_"} for name in ("position", "torque")}
    pyarrow.parquet.write_table(pa.table(columns), tmp_path / "log.parquet")
    robot = StubRobot(log_table=LogTable.model_validate(table | {"foot_wrench": {"name": asked}}))
    with pytest.raises(LogError, match=r"'foot_wrench' has 6 columns without names, the robot has 12.*foot_order"):
        read_log(tmp_path / "log.parquet", robot)
    robot.log_table = LogTable.model_validate(table | {"foot_wrench": {"name": asked}, "foot_order": ["right_foot"]})
    log = read_log(tmp_path / "log.parquet", robot)
    assert log.foot_names == ("right_foot",)
    np.testing.assert_array_equal(log.foot_wrench[:, 0], LOG.foot_wrench[:, 1])


def test_topics_in_alternating_rows_are_brought_to_the_rows_of_the_positions(tmp_path):
    log = synthetic_log(300)
    late = log.time + 0.0007
    columns = columns_of(log)
    torques = {name for name in columns if name.startswith("torque")}
    rows = [
        {"time": t} | {n: v[k] for n, v in columns.items() if n not in torques | {"time"}}
        for k, t in enumerate(log.time)
    ]
    rows += [{"time": t} | {n: np.interp(t, log.time, columns[n]) for n in torques} for t in late[::2]]
    rows.sort(key=lambda row: row["time"])
    rows = [row for row in rows if not (row.keys() & torques and 0.2 < row["time"] < 0.3)]  # a pause of one topic
    lines = [",".join(repr(float(row[name])) if name in row else "" for name in columns) for row in rows]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([",".join(columns), *lines]))
    read = read_log(path, StubRobot())
    np.testing.assert_allclose(read.time, log.time, atol=1e-12)
    np.testing.assert_allclose(read.position, log.position, atol=1e-12)
    missing = np.isnan(read.torque[:, 0])
    assert missing[(log.time > 0.205) & (log.time < 0.295)].all()
    assert missing.sum() < 60
    np.testing.assert_allclose(read.torque[~missing], log.torque[~missing], atol=5e-3)
    assert "Interpolated to the 300 rows with positions: torque." in read.notes

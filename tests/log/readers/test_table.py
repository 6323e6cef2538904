"""Features of tables: variants of CSV, and types of columns."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from tests.log.readers.formats import StubRobot, columns_of, synthetic_log, write_csv

from stribeck.errors import LogError
from stribeck.log.readers import read_log
from stribeck.settings import LogTable

LOG = synthetic_log(30)


def with_commas(text):
    return text


def with_semicolons(text):
    return text.replace(",", ";")


def with_tabs(text):
    return text.replace(",", "\t")


def with_spaces(text):
    return text.replace(",", " ")


def with_decimal_commas(text):
    names, numbers = text.split("\n", 1)
    return names.replace(",", ";") + "\n" + numbers.replace(",", ";").replace(".", ",")


def with_commas_and_spaces(text):
    return text.replace(",", ", ")


def with_a_hash(text):
    return "# " + text.replace('"', "")


def with_a_hash_and_spaces(text):
    return "# " + text.replace('"', "").replace(",", " ")


def with_a_byte_order_mark(text):
    return "\ufeff" + text


def with_windows_lines(text):
    return text.replace("\n", "\r\n")


def without_a_last_newline(text):
    return text.rstrip("\n")


@pytest.mark.parametrize(
    "dialect",
    [with_commas, with_semicolons, with_tabs, with_decimal_commas, with_spaces, with_commas_and_spaces, with_a_hash,
     with_a_hash_and_spaces, with_a_byte_order_mark, with_windows_lines, without_a_last_newline],
)  # fmt: skip
def test_csv_as_people_write_it(dialect, tmp_path):
    path = write_csv(tmp_path, LOG)
    path.write_bytes(dialect(path.read_text()).encode())
    log = read_log(path, StubRobot())
    for name, channel in LOG.channels().items():
        np.testing.assert_array_equal(log.channels()[name], channel, err_msg=name)


@pytest.mark.parametrize("blank", ["", "nan", "NaN", "NULL"])
def test_blank_cells_are_missing_values(blank, tmp_path):
    path = write_csv(tmp_path, LOG)
    lines = path.read_text().splitlines()
    cells = lines[11].split(",")
    lines[11] = ",".join([cells[0], blank, *cells[2:]])
    path.write_text("\n".join(lines))
    expected = LOG.position.copy()
    expected[10, 0] = np.nan
    np.testing.assert_array_equal(read_log(path, StubRobot()).position, expected)


@pytest.mark.parametrize("kind", [pa.float32(), pa.int64(), pa.uint16(), pa.bool_()])
def test_numbers_of_every_type(kind, tmp_path):
    whole = np.arange(30) % 2
    columns = columns_of(LOG) | {"torque.hip": pa.array(whole.astype(bool) if kind == pa.bool_() else whole, kind)}
    pyarrow.parquet.write_table(pa.table(columns), tmp_path / "log.parquet")
    np.testing.assert_array_equal(read_log(tmp_path / "log.parquet", StubRobot()).torque[:, 0], whole)


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

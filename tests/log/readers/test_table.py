"""Features of tables: variants of CSV, and types of columns."""

import re

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from tests.log.readers.formats import StubRobot, columns_of, synthetic_log, write_csv

from stribeck.errors import LogError
from stribeck.log.readers import read_log
from stribeck.settings import LogTable

LOG = synthetic_log(30)


DIALECTS = {
    "semicolons": lambda text: text.replace(",", ";"),
    "tabs": lambda text: text.replace(",", "\t"),
    "decimal commas": lambda text: re.sub(r"(?<=\d)\.", ",", text.replace(",", ";")),
    "commas and spaces": lambda text: text.replace(",", ", "),
    "a hash and spaces": lambda text: "# " + text.replace('"', "").replace(",", " "),
    "a byte order mark": lambda text: "\ufeff" + text,
    "lines of Windows": lambda text: text.replace("\n", "\r\n"),
    "no last newline": lambda text: text.rstrip("\n"),
}


@pytest.mark.parametrize("dialect", DIALECTS)
def test_csv_as_people_write_it(dialect, tmp_path):
    path = write_csv(tmp_path, LOG)
    path.write_bytes(DIALECTS[dialect](path.read_text()).encode())
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

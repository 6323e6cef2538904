"""Arbitrary tables, bytes or settings give a RobotLog or an error of one line."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from tests.log.readers.formats import FEET, JOINTS, StubRobot, arrays_of, columns_of, synthetic_log, write_arrays

from stribeck.errors import StribeckError
from stribeck.log import RobotLog
from stribeck.log.readers import read_log
from stribeck.log.readers.mapping import UNITS
from stribeck.log.sampling import regularise
from stribeck.settings import LogTable

LOG = synthetic_log(40)
COLUMNS = columns_of(LOG)
QUICK = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])

names = st.sampled_from([*COLUMNS, "position", "time.x", "position.", "contact.", "foot_wrench.left_foot"]) | st.text(
    max_size=8
)
cells = st.none() | st.floats() | st.integers(-(2**62), 2**62) | st.booleans() | st.text(max_size=3)
scalars = st.floats(allow_nan=False, allow_infinity=False) | st.integers(-3, 3).map(float)
channel_tables = st.fixed_dictionaries(
    {},
    optional={
        "name": names | st.lists(names, max_size=4),
        "unit": st.sampled_from(sorted({unit for units in UNITS.values() for unit in units})),
        "scale": scalars | st.lists(scalars, max_size=4) | st.dictionaries(st.sampled_from(JOINTS), scalars),
        "offset": scalars,
        "delay": st.floats(-0.2, 0.2),
        "unwrap": st.booleans(),
        "order": st.sampled_from(["xyzw", "wxyz"]),
    },
)
log_tables = st.fixed_dictionaries(
    {},
    optional={
        **dict.fromkeys(UNITS, channel_tables),
        "joint_names": st.dictionaries(st.sampled_from(JOINTS), st.sampled_from(JOINTS)),
        "joint_order": st.lists(st.sampled_from(JOINTS), max_size=4),
        "foot_names": st.dictionaries(st.sampled_from(FEET), st.sampled_from(FEET)),
        "foot_order": st.lists(st.sampled_from(FEET), max_size=3),
        "rate": st.floats(1, 1e4),
        "max_gap": st.floats(1e-6, 10),
    },
)


def read_and_regularise(path, robot):
    """Read a log and check that the result is a valid RobotLog, or a StribeckError of one line."""
    try:
        log = read_log(path, robot)
        assert isinstance(log, RobotLog)
        assert log.joint_names == robot.joint_names
        even, sampling = regularise(log, robot.log_table)
        assert sum(part.stop - part.start for part in sampling.segments) == len(even.time)
        assert np.isfinite(even.position).all()
        assert np.isfinite(even.torque).all()
    except StribeckError as error:
        check_one_line(str(error))


def check_one_line(message):
    assert len(message.splitlines()) == 1


@QUICK
@given(
    changes=st.dictionaries(st.sampled_from(list(COLUMNS)), st.lists(cells, min_size=1, max_size=3), max_size=3),
    dropped=st.sets(st.sampled_from(list(COLUMNS)), max_size=2),
    kind=st.sampled_from(["csv", "parquet"]),
)
def test_any_table(changes, dropped, kind, tmp_path):
    columns = {name: list(column) for name, column in COLUMNS.items() if name not in dropped}
    for name, values in changes.items():
        if name in columns:
            columns[name][7 : 7 + len(values)] = values
    try:
        table = pa.table(columns)
    except (pa.ArrowInvalid, pa.ArrowTypeError, OverflowError):  # cells of several types are no column
        table = pa.table({name: list(map(str, column)) for name, column in columns.items()})
    path = tmp_path / f"log.{kind}"
    (pyarrow.parquet.write_table if kind == "parquet" else pyarrow.csv.write_csv)(table, path)
    read_and_regularise(path, StubRobot())


@QUICK
@given(table=log_tables, kind=st.sampled_from(["npz", "parquet"]))
def test_any_settings(table, kind, tmp_path):
    try:
        robot = StubRobot(log_table=LogTable.model_validate(table))
    except ValidationError:  # the robot file's reader refuses these
        return
    if kind == "npz":
        path = write_arrays(tmp_path, **arrays_of(LOG))
    else:
        path = tmp_path / "log.parquet"
        pyarrow.parquet.write_table(pa.table(COLUMNS), path)
    read_and_regularise(path, robot)

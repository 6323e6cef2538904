"""A frame in memory is read like the file with the same content."""

import numpy as np
import pandas as pd
import polars as pl
import pytest
from tests.log.readers.formats import JOINTS, StubRobot, columns_of, synthetic_log

from stribeck.log import RobotLog
from stribeck.settings import LogTable

LOG = synthetic_log(60)
FRAMES = pytest.mark.parametrize("make", [pd.DataFrame, pl.DataFrame], ids=["pandas", "polars"])


@FRAMES
def test_every_channel_is_read(make):
    log = RobotLog.from_frame(make(columns_of(LOG)), StubRobot())
    assert (log.joint_names, log.foot_names, log.path, log.notes) == (JOINTS, LOG.foot_names, "", ())
    for name, channel in LOG.channels().items():
        np.testing.assert_array_equal(log.channels()[name], channel, err_msg=name)


@FRAMES
def test_settings_of_the_robot_file_and_missing_values(make):
    torque = LOG.torque[:, 0].copy()
    torque[7] = np.nan
    robot = StubRobot(log_table=LogTable.model_validate({"torque": {"scale": -1.0}, "time": {"name": "when"}}))
    columns = {"when": pd.to_datetime(1_700_000_000_000_000_000 + np.arange(60) * 2_000_000)} | columns_of(LOG)
    log = RobotLog.from_frame(make(columns | {"torque.hip": torque}), robot)
    np.testing.assert_array_equal(log.torque[:, 0], -torque)
    np.testing.assert_allclose(log.time, LOG.time, atol=1e-9)


def test_an_index_with_a_name_is_a_column():
    frame = pd.DataFrame(columns_of(LOG)).set_index("time")
    np.testing.assert_array_equal(RobotLog.from_frame(frame, StubRobot()).time, LOG.time)
    since = frame.set_index(pd.to_timedelta(frame.index, unit="s").rename("time"))
    np.testing.assert_allclose(RobotLog.from_frame(since, StubRobot()).time, LOG.time, atol=1e-9)

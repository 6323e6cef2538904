"""What is particular to HDF5: groups, attributes and text of several kinds."""

import h5py
import numpy as np
import pytest
from tests.readers.formats import JOINTS, StubRobot, synthetic_log

from stribeck.readers import read_log
from stribeck.settings import LogTable

LOG = synthetic_log(30)


@pytest.mark.parametrize("kind", ["attribute", "bytes", "variable length"])
def test_groups_are_reached_by_path_and_names_come_in_any_form(kind, tmp_path):
    path = tmp_path / "log.hdf5"
    with h5py.File(path, "w") as file:
        file["robot/joints/q"] = LOG.position
        file.create_dataset("robot/joints/tau", data=LOG.torque, chunks=(7, 2), compression="gzip")
        file["time"] = LOG.time
        if kind == "attribute":
            file.attrs["joint_names"] = list(JOINTS)
        elif kind == "bytes":
            file["joint_names"] = np.array(JOINTS, dtype="S")
        else:
            file.create_dataset("joint_names", data=list(JOINTS), dtype=h5py.string_dtype())
    table = {"position": {"name": "robot/joints/q"}, "torque": {"name": "robot/joints/tau"}}
    log = read_log(path, StubRobot(joint_names=JOINTS[::-1], log_table=LogTable.model_validate(table)))
    np.testing.assert_array_equal(log.position, LOG.position[:, ::-1])
    np.testing.assert_array_equal(log.torque, LOG.torque[:, ::-1])

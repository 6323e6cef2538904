"""Features of HDF5: groups, attributes and several kinds of text."""

import os

import h5py
import numpy as np
import pytest
from tests.log.readers.formats import JOINTS, StubRobot, synthetic_log

from stribeck.core.errors import LogError
from stribeck.core.settings import LogTable
from stribeck.io.readers import read_log

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


def in_a_pipe(file, pipe):
    file.create_dataset("position", LOG.position.shape, float, external=[(pipe, 0, h5py.h5f.UNLIMITED)])


def virtual(file, pipe):
    layout = h5py.VirtualLayout(LOG.position.shape, float)
    layout[:] = h5py.VirtualSource(pipe, "position", LOG.position.shape)
    file.create_virtual_dataset("position", layout)


def linked(file, pipe):
    file["position"] = h5py.ExternalLink(pipe, "position")
    file["joint_names"] = h5py.ExternalLink(pipe, "joint_names")


@pytest.mark.parametrize(
    ("store", "words"),
    [(in_a_pipe, "'position' is stored in"), (virtual, "'position' is stored in"), (linked, "position")],
)
def test_other_files_are_not_opened(store, words, tmp_path):
    pipe = str(tmp_path / "pipe")
    os.mkfifo(pipe)  # to open it would take forever
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["time"], file["torque"] = LOG.time, LOG.torque
        store(file, pipe)
    with pytest.raises(LogError, match=words) as refused:
        read_log(tmp_path / "log.h5")
    assert len(str(refused.value).splitlines()) == 1


def test_a_pipe_is_no_log(tmp_path):
    for suffix in (".h5", ".npz", ".csv", ".parquet", ".mcap", ".bag"):
        os.mkfifo(tmp_path / f"log{suffix}")
        with pytest.raises(LogError, match="is a pipe"):
            read_log(tmp_path / f"log{suffix}")
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag/metadata.yaml").write_text("")
    os.mkfifo(tmp_path / "bag/bag.db3")
    (tmp_path / "linked").symlink_to("bag")
    with pytest.raises(LogError, match=r"bag\.db3: is a pipe"):
        read_log(tmp_path / "linked")

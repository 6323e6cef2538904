"""Features of MATLAB's files: orientation, structs, cells, and the layout of YARP's loggers."""

import numpy as np
import pytest
import scipy.io
from scipy.spatial.transform import Rotation
from tests.log.readers.formats import FEET, JOINTS, StubRobot, arrays_of, cell_of, synthetic_log, write_hdf5_of_matlab
from tests.log.readers.test_damaged import check_refused

from stribeck.core.settings import LogTable
from stribeck.io.readers import read_log

LOG = synthetic_log(40)


def version_5(folder, contents):
    def cells(value):
        if isinstance(value, dict):
            return {key: cells(part) for key, part in value.items()}
        return cell_of(value) if isinstance(value, np.ndarray) else value

    scipy.io.savemat(folder / "log.mat", cells(contents), do_compression=True)
    return folder / "log.mat"


def version_7_3(folder, contents):
    return write_hdf5_of_matlab(folder / "log.mat", contents)


WRITERS = pytest.mark.parametrize("write", [version_5, version_7_3], ids=["version 5", "version 7.3"])


@WRITERS
def test_samples_are_along_the_axis_with_the_length_of_time(write, tmp_path):
    contents = arrays_of(LOG)
    contents |= {"time": LOG.time[None], "position": LOG.position.T, "foot_wrench": np.moveaxis(LOG.foot_wrench, 0, 1)}
    read = read_log(write(tmp_path, contents), StubRobot())
    np.testing.assert_array_equal(read.position, LOG.position)
    np.testing.assert_array_equal(read.torque, LOG.torque)
    np.testing.assert_array_equal(read.foot_wrench, LOG.foot_wrench)


@WRITERS
def test_structs_are_reached_by_name(write, tmp_path):
    contents = {"t": LOG.time, "robot": {"q": LOG.position, "dynamics": {"tau": 1e3 * LOG.torque}}}
    table = {"time": {"name": "t"}, "position": {"name": "robot.q"}}
    table["torque"] = {"name": "robot.dynamics.tau", "unit": "mNm"}
    read = read_log(write(tmp_path, contents), StubRobot(log_table=LogTable.model_validate(table)))
    np.testing.assert_array_equal(read.position, LOG.position)
    np.testing.assert_allclose(read.torque, LOG.torque, rtol=1e-12)


@WRITERS
def test_signals_of_a_scope_of_simulink_are_read_by_their_labels(write, tmp_path):
    signals = [{"values": LOG.position, "label": "q"}, {"values": LOG.torque, "label": "tau"}]
    read = read_log(write(tmp_path, {"Scope": {"time": LOG.time, "signals": signals}}), StubRobot())
    np.testing.assert_array_equal(read.torque, LOG.torque)


def signal(time, values, names=None):
    """Make a signal in robometry's layout: features x 1 x samples."""
    data = values.T[:, None, :]
    found = {"data": data, "dimensions": np.array(data.shape, dtype=float), "timestamps": time}
    return found | ({"elements_names": np.array(names)} if names is not None else {})


def telemetry(log=LOG, start=1_600_000_000.0, **joints):
    """Make a log of YARP's robot logger; `joints` replaces signals, or removes those that are None."""
    time = start + log.time
    names = list(log.joint_names)
    state = {
        "positions": signal(time, log.position, names),
        "velocities": signal(time, log.velocity, names),
        "accelerations": signal(time, log.acceleration, names),
        "torques": signal(time, log.torque),
    } | joints
    rpy = Rotation.from_quat(log.base_orientation).as_euler("xyz")
    device = {
        "description_list": np.array(names),
        "yarp_robot_name": np.array("iCubGenova11"),
        "joints_state": {name: one for name, one in state.items() if one is not None},
        "motors_state": {"positions": signal(time, 100 * log.position, names)},
        "orientations": {"root_imu": signal(time, rpy, list("rpy")), "head_imu": signal(time, 0 * rpy, list("rpy"))},
        "gyros": {"root_imu": signal(time, log.angular_velocity, list("xyz"))},
        "FTs": {"l_leg_ft": signal(time, log.foot_wrench[:, 0])},
        "cartesian_wrenches": {
            f"{foot}_wrench": signal(time, log.foot_wrench[:, number]) for number, foot in enumerate(FEET)
        },
    }
    return {"robot_logger_device": device}


@WRITERS
def test_a_log_of_yarp_is_read_without_a_setting(write, tmp_path):
    read = read_log(write(tmp_path, telemetry()), StubRobot(joint_names=JOINTS[::-1]))
    for channel in ("position", "velocity", "acceleration", "torque"):
        np.testing.assert_array_equal(getattr(read, channel), getattr(LOG, channel)[:, ::-1])
    np.testing.assert_allclose(read.time, LOG.time, atol=2e-7)
    np.testing.assert_array_equal(read.foot_wrench, LOG.foot_wrench)
    assert read.base_orientation is None
    assert any("'/orientations/root_imu'" in note and "'/motors_state/positions'" in note for note in read.notes)


@WRITERS
def test_sensors_that_are_named_are_read(write, tmp_path):
    table = {
        "base_orientation": {"name": "/orientations/root_imu"},
        "angular_velocity": {"name": "/gyros/root_imu"},
        "foot_wrench": {"name": "/FTs/l_leg_ft"},
        "foot_names": {"/FTs/l_leg_ft": "left_foot"},
    }
    read = read_log(write(tmp_path, telemetry()), StubRobot(log_table=LogTable.model_validate(table)))
    np.testing.assert_allclose(read.base_orientation, LOG.base_orientation, atol=1e-12)
    np.testing.assert_array_equal(read.angular_velocity, LOG.angular_velocity)
    np.testing.assert_array_equal(read.foot_wrench[:, 0], LOG.foot_wrench[:, 0])


def in_degrees(positions):
    time = LOG.time + 1
    units = {"units_of_measure": np.array(["deg"] * 3)}
    angles, speeds = (signal(time, np.rad2deg(own)) | units for own in (positions, LOG.velocity))
    return telemetry(start=1.0, positions=angles, velocities=speeds)


def test_the_dumpers_degrees(tmp_path):
    read = read_log(version_7_3(tmp_path, in_degrees(LOG.position)), StubRobot())
    np.testing.assert_allclose(read.position, LOG.position, rtol=1e-12)
    np.testing.assert_allclose(read.velocity, LOG.velocity, rtol=1e-12)
    np.testing.assert_array_equal(read.torque, LOG.torque)


def changed(change):
    def maker(folder):
        contents = telemetry()
        change(contents["robot_logger_device"])
        return version_7_3(folder, contents)

    return maker


def nameless(device):
    del device["description_list"]


def test_joints_without_names_are_refused_in_one_sentence(tmp_path):
    words = ["joints_state.torques' has no names of joints", "expected 'elements_names'"]
    check_refused(changed(nameless), words, tmp_path)

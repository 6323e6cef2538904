"""Known log, and writers for every format."""

from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
import scipy.io
from rosbags import rosbag1, rosbag2
from tests.log.readers.messages import ROS1, messages_of, send, write_bag, write_messages

from stribeck.core.log import RobotLog
from stribeck.core.settings import LogTable

JOINTS = ("hip", "knee", "wheel")
FEET = ("left_foot", "right_foot")
AXES = ("fx", "fy", "fz", "tx", "ty", "tz")


@dataclass
class StubRobot:
    """Attributes of a robot that readers use."""

    joint_names: tuple = JOINTS
    position_controlled: tuple = ()
    contacts: dict = field(default_factory=lambda: dict.fromkeys(FEET))
    log_table: LogTable = field(default_factory=LogTable)
    torque_source: str = "link_side_sensor"
    base: str = "floating"
    passive: tuple = ()
    motors: dict = field(default_factory=dict)
    command_gains: tuple | None = None
    path: str = "robot.toml"
    prismatic: tuple = (False, False, True)
    position_limits: tuple = ((-39.0, -2.0, -9.0), (3.0, 1e3, 9.0))

    @property
    def torque_controlled(self):
        return [k for k, name in enumerate(self.joint_names) if name not in self.position_controlled]


def robot_with(**table):
    """Make a robot whose file has this `[log]`."""
    return StubRobot(log_table=LogTable.model_validate(table))


def synthetic_log(samples=200, rate=500.0, joints=JOINTS, seed=0):
    """Make a log of smooth motion, for checks of interpolation, with all channels."""
    rng = np.random.default_rng(seed)
    time = np.arange(samples) / rate
    phase = rng.uniform(0, 6, len(joints))
    position = np.sin(3 * time[:, None] + phase)
    tilt = 0.2 * np.sin(2 * time)
    zero = np.zeros(samples)
    return RobotLog(
        time=time,
        joint_names=tuple(joints),
        position=position,
        torque=5 * np.cos(2 * time[:, None] + phase),
        velocity=3 * np.cos(3 * time[:, None] + phase),
        acceleration=-9 * position,
        base_orientation=np.stack([np.sin(tilt / 2), zero, zero, np.cos(tilt / 2)], axis=1),
        angular_velocity=rng.normal(size=(samples, 3)),
        linear_acceleration=rng.normal(size=(samples, 3)),
        foot_names=FEET,
        contact=np.stack([np.sin(9 * time) > -0.1, np.sin(9 * time) < 0.1], axis=1),
        foot_wrench=rng.normal(size=(samples, 2, 6)),
        foot_force=rng.normal(size=(samples, 2)),
        temperature=rng.uniform(20, 60, (samples, len(joints))),
        external_torque=rng.normal(size=(samples, len(joints))),
    )


def arrays_of(log):
    names = {"joint_names": np.array(log.joint_names), "foot_names": np.array(log.foot_names)}
    return {**log.channels(), **names, "torque_source": np.array(log.torque_source)}


def columns_of(log):
    """Convert the log to columns named `<channel>.<label>`."""
    columns = {"time": log.time}
    for name in ("position", "velocity", "acceleration", "torque", "temperature", "external_torque"):
        columns |= {f"{name}.{joint}": getattr(log, name)[:, j] for j, joint in enumerate(log.joint_names)}
    for name in ("base_orientation", "angular_velocity", "linear_acceleration"):
        channel = getattr(log, name)
        columns |= {f"{name}.{'xyzw'[i]}": channel[:, i] for i in range(channel.shape[1])}
    for f, foot in enumerate(log.foot_names):
        columns[f"contact.{foot}"] = log.contact[:, f]
        columns[f"foot_force.{foot}"] = log.foot_force[:, f]
        columns |= {f"foot_wrench.{foot}.{axis}": log.foot_wrench[:, f, i] for i, axis in enumerate(AXES)}
    return columns


def main_file(path: Path) -> Path:
    """Return the file of a log that contains its samples."""
    return path if path.is_file() else next(file for file in sorted(path.iterdir()) if file.suffix != ".yaml")


def write_npz(folder, log):
    np.savez(folder / "log.npz", **arrays_of(log))
    return folder / "log.npz"


def write_h5(folder, log):
    with h5py.File(folder / "log.h5", "w") as file:
        for name, array in arrays_of(log).items():
            file[name] = array.astype("S") if array.dtype.kind == "U" else array
    return folder / "log.h5"


def write_mat(folder, log, compress=True):
    path = folder / "log.mat"
    scipy.io.savemat(path, {name: cell_of(array) for name, array in arrays_of(log).items()}, do_compression=compress)
    return path


def cell_of(array):
    """Store text in a cell array, as MATLAB does."""
    return array.astype(object) if array.dtype.kind == "U" and array.ndim else array


def write_mat_73(folder, log):
    path = folder / "log73.mat"
    return write_hdf5_of_matlab(path, arrays_of(log))


def write_hdf5_of_matlab(path, contents):
    """Write a file like MATLAB's `save -v7.3` and matio: axes in the opposite order, texts in cells of references."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in contents.items():
            _store_for_matlab(file, name, value)
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    return path


def _store_for_matlab(file, name, value):
    if isinstance(value, dict):
        for key, part in value.items():
            _store_for_matlab(file, f"{name}/{key}", part)
        return
    if isinstance(value, list) and isinstance(value[0], dict):  # structs: references for each field
        for key in value[0]:
            places = [f"#refs#/{name.replace('/', '_')}_{key}_{number}" for number in range(len(value))]
            for place, struct in zip(places, value, strict=True):
                _store_for_matlab(file, place, struct[key])
            file.create_dataset(f"{name}/{key}", data=[[file[place].ref] for place in places], dtype=h5py.ref_dtype)
        return
    value = np.asarray(value)
    if value.dtype.kind == "U":
        letters = []
        for text in np.ravel(value):
            number = len(file.require_group("#refs#"))
            letters.append(file.create_dataset(f"#refs#/{number}", data=np.array([*map(ord, text)], "u2")[:, None]))
            letters[-1].attrs["MATLAB_class"] = np.bytes_("char")
        if value.ndim:
            file.create_dataset(name, data=[[one.ref for one in letters]], dtype=h5py.ref_dtype)
        else:
            file[name] = letters[0]
        file[name].attrs["MATLAB_class"] = np.bytes_("cell" if value.ndim else "char")
        return
    value = value[:, None] if value.ndim == 1 else value
    file[name] = value.astype("u1" if value.dtype == bool else value.dtype).T
    file[name].attrs["MATLAB_class"] = np.bytes_("logical" if value.dtype == bool else "double")


def write_csv(folder, log):
    pyarrow.csv.write_csv(pa.table(columns_of(log)), folder / "log.csv")
    return folder / "log.csv"


def write_parquet(folder, log):
    pyarrow.parquet.write_table(
        pa.table(columns_of(log)), folder / "log.parquet", row_group_size=64, write_page_checksum=True
    )
    return folder / "log.parquet"


def write_mcap(folder, log):
    return write_messages(folder / "log.mcap", messages_of(log))


def write_mcap_of_ros1(folder, log):
    return write_messages(folder / "ros1.mcap", messages_of(log, ROS1), ROS1)


def write_rosbag2(folder, log, plugin=rosbag2.StoragePlugin.SQLITE3, compression=None):
    path = folder / f"bag_{plugin.name.lower()}"
    return write_bag(path, messages_of(log), plugin=plugin, compression=compression)


def write_rosbag2_of_mcap(folder, log):
    return write_rosbag2(folder, log, rosbag2.StoragePlugin.MCAP)


def write_bag_of_ros1(folder, log):
    return write_messages_of_ros1(folder / "log.bag", messages_of(log, ROS1))


def write_messages_of_ros1(path, messages):
    send(rosbag1.Writer(path), messages, ROS1, ROS1.serialize_ros1)
    return path


WHOLE = {"npz": write_npz, "h5": write_h5, "mat": write_mat, "mat of 7.3": write_mat_73, "csv": write_csv}
WHOLE["parquet"] = write_parquet
"""Formats with every channel."""

ROS = {"mcap": write_mcap, "mcap of ROS 1": write_mcap_of_ros1, "bag": write_bag_of_ros1}
ROS |= {"rosbag2": write_rosbag2, "rosbag2 of mcap": write_rosbag2_of_mcap}
"""Formats of messages, which lack acceleration, temperature and external torque."""

WRITERS = WHOLE | ROS


def write_arrays(folder: Path, **arrays) -> Path:
    np.savez(folder / "log.npz", **arrays)
    return folder / "log.npz"

"""A trajectory as files: a table, and a message for ROS 2."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as csv
from mcap.writer import Writer
from rosbags.typesys import Stores, get_typestore

from stribeck.planning.trajectory import Trajectory
from stribeck.typing import Array

TOPIC = "/joint_trajectory_controller/joint_trajectory"
KIND = "trajectory_msgs/msg/JointTrajectory"


def write_csv(trajectory: Trajectory, path: Path) -> None:
    """Write a row a sample: time [s], then position, velocity and acceleration of each joint, in SI units."""
    time = _times(trajectory, 0.01)
    state = trajectory.at(time)
    columns = {"time": time}
    for kind in ("position", "velocity", "acceleration"):
        for name, signal in zip(trajectory.joint_names, getattr(state, kind).T, strict=True):
            columns[f"{kind}.{name}"] = np.round(signal, 9) + 0.0
    csv.write_csv(pa.table(columns), path, csv.WriteOptions(quoting_style="needed"))


def write_message(trajectory: Trajectory, path: Path) -> None:
    """Write an MCAP with one message trajectory_msgs/msg/JointTrajectory, which `ros2 bag play` publishes."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    point, duration, header, stamp = (
        store.types[f"{package}/msg/{name}"]
        for package, name in (
            ("trajectory_msgs", "JointTrajectoryPoint"),
            ("builtin_interfaces", "Duration"),
            ("std_msgs", "Header"),
            ("builtin_interfaces", "Time"),
        )
    )
    time = _times(trajectory, 0.02)  # controllers join points by quintic splines
    state = trajectory.at(time)
    points = []
    for k, nanoseconds in enumerate(np.round(time * 1e9).astype(int).tolist()):
        at = duration(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
        motion = (signal[k] for signal in (state.position, state.velocity, state.acceleration))
        points.append(point(*motion, effort=np.empty(0), time_from_start=at))
    now = header(stamp=stamp(sec=0, nanosec=0), frame_id="")  # a controller begins at once
    message = store.types[KIND](header=now, joint_names=list(trajectory.joint_names), points=points)
    definition, _ = store.generate_msgdef(KIND, ros_version=2)
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="stribeck")
        schema = writer.register_schema(KIND, "ros2msg", definition.encode())
        channel = writer.register_channel(TOPIC, "cdr", schema)
        writer.add_message(channel, 0, bytes(store.serialize_cdr(message, KIND)), 0)
        writer.finish()  # type: ignore[no-untyped-call]


def _times(trajectory: Trajectory, period: float) -> Array:
    return np.linspace(0.0, trajectory.duration, round(trajectory.duration / period) + 1)

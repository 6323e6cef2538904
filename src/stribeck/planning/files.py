"""A trajectory as files: a table, and a message for ROS 2."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as csv
from mcap.writer import Writer
from rosbags.typesys import Stores, get_typestore

from stribeck.planning.trajectory import Trajectory
from stribeck.typing import Array

CSV_PERIOD, POINT_PERIOD = 0.01, 0.02
"""Between rows of the table, and between points of the message, which controllers join by quintic splines [s]."""

TOPIC = "/joint_trajectory_controller/joint_trajectory"
KIND = "trajectory_msgs/msg/JointTrajectory"
NANO = 1_000_000_000
"""Nanoseconds in a second [1]."""


def write_csv(trajectory: Trajectory, path: Path) -> None:
    """Write a row a sample: time [s], then position, velocity and acceleration of each joint, in SI units."""
    time = _times(trajectory, CSV_PERIOD)
    state = trajectory.at(time)
    columns = {"time": time}
    for kind in ("position", "velocity", "acceleration"):
        for name, signal in zip(trajectory.joint_names, getattr(state, kind).T, strict=True):
            columns[f"{kind}.{name}"] = np.round(signal, 9) + 0.0
    csv.write_csv(pa.table(columns), path, csv.WriteOptions(quoting_style="needed"))


def write_message(trajectory: Trajectory, path: Path) -> None:
    """Write an MCAP with one message trajectory_msgs/msg/JointTrajectory, which `ros2 bag play` publishes."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    time = _times(trajectory, POINT_PERIOD)
    state = trajectory.at(time)
    stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)  # of which a controller begins at once
    message = types[KIND](
        header=types["std_msgs/msg/Header"](stamp=stamp, frame_id=""),
        joint_names=list(trajectory.joint_names),
        points=[
            types["trajectory_msgs/msg/JointTrajectoryPoint"](
                positions=position,
                velocities=velocity,
                accelerations=acceleration,
                effort=np.empty(0),
                time_from_start=types["builtin_interfaces/msg/Duration"](sec=at // NANO, nanosec=at % NANO),
            )
            for position, velocity, acceleration, at in zip(
                state.position,
                state.velocity,
                state.acceleration,
                np.round(time * NANO).astype(int).tolist(),
                strict=True,
            )
        ],
    )
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

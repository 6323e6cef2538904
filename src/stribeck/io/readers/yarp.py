"""Logs of YARP's robot logger and telemetry dumper (robometry), which are MATLAB structs of signals."""

from collections.abc import Callable, Iterable, Iterator, Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.errors import LogError
from stribeck.core.log.channels import VECTOR_CHANNELS
from stribeck.core.settings import LogTable
from stribeck.io.readers.join import NANO, Stream, join
from stribeck.io.readers.mapping import asked_names
from stribeck.io.readers.messages import refuse_twice
from stribeck.io.readers.recording import Recording

POSITIONS = ".joints_state.positions.data"
JOINTS = {
    "joints_state.positions": "position",
    "joints_state.velocities": "velocity",
    "joints_state.accelerations": "acceleration",
    "joints_state.torques": "torque",
    "motors_state.temperatures": "temperature",
}
"""Joint signals -> channels. Signals of motor encoders are measured before the gears."""
SENSORS = {
    "orientations": ("base_orientation", 3),
    "gyros": ("angular_velocity", 3),
    "accelerometers": ("linear_acceleration", 3),
    "cartesian_wrenches": ("foot_wrench", 6),
    "FTs": ("foot_wrench", 6),
}
"""Groups of sensors -> channel and number of values."""


Arrays = Mapping[str, Callable[[], Array]]
Texts = Mapping[str, tuple[str, ...]]


def is_telemetry(names: Iterable[str]) -> bool:
    """Return whether a file with these variables comes from YARP's loggers."""
    return any(name.endswith(POSITIONS) for name in names)


def open_telemetry(path: str, arrays: Arrays, texts: Texts, table: LogTable) -> Recording:
    """Make the recording of a log: joints, and the sensors that `[log]` names.

    A signal is a struct of `data`, features x 1 x samples, `timestamps` [s] and, since version 0.4, `elements_names`;
    in earlier versions, the robot's `description_list` names the joints. The file does not define a sensor's place and
    orientation, so `[log]` must name it, except for a Cartesian wrench whose name contains a contact's name.

    Raises
    ------
    LogError
        If a signal's parts do not fit together.
    """
    root = next(name for name in arrays if name.endswith(POSITIONS)).removesuffix(POSITIONS)
    signals = [name.removeprefix(f"{root}.").removesuffix(".data") for name in arrays if name.endswith(".data")]
    known = [name for name in JOINTS if name in signals]
    streams = [*_make_joint_streams(path, root, known, arrays, texts, table)]
    others = []
    for name in signals:
        group, _, sensor = name.partition(".")
        if group in SENSORS and sensor and (group == "cartesian_wrenches" or _is_named(f"/{group}/{sensor}", table)):
            channel, width = SENSORS[group]
            stamps, values = _read_signal(path, f"{root}.{name}", arrays, width)
            if channel == "base_orientation":
                values = Rotation.from_euler("xyz", values).as_quat()  # roll, pitch and yaw [rad] about fixed axes
            streams.append(Stream(f"/{group}/{sensor}", group, (), stamps, {channel: values}))
        elif name not in JOINTS:
            others.append(f"/{name.replace('.', '/')}")
    return join(path, streams, others, table)


def _is_named(topic: str, table: LogTable) -> bool:
    """Return whether `[log]` names a sensor, for any channel or as a foot."""
    asked = (name for channel in (*VECTOR_CHANNELS, "foot_wrench") for name in asked_names(table, channel))
    return topic in table.foot_names or topic in asked


def _make_joint_streams(
    path: str, root: str, signals: Iterable[str], arrays: Arrays, texts: Texts, table: LogTable
) -> Iterator[Stream]:
    """Make one stream per signal of joints."""
    degrees = _is_in_degrees(path, root, arrays, texts, table)
    for signal in signals:
        name, channel = f"{root}.{signal}", JOINTS[signal]
        labels = texts.get(f"{name}.elements_names") or texts.get(f"{root}.description_list")
        if not labels:
            raise LogError(
                f"{path}: '{name}' has no names of joints; expected 'elements_names' in it, or "
                f"'{root}.description_list'"
            )
        refuse_twice(labels, f"{path}: '{name}'")
        stamps, values = _read_signal(path, name, arrays, len(labels))
        if degrees and signal.startswith("joints_state") and channel != "torque":
            values = np.deg2rad(values)
        yield Stream("/joints_state", "joints_state", labels, stamps, {channel: values})


def _is_in_degrees(path: str, root: str, arrays: Arrays, texts: Texts, table: LogTable) -> bool:
    """Return whether positions are in degrees; the unit "deg" in the file can mean radians too."""
    unit = texts.get(f"{root}.joints_state.positions.units_of_measure", ("rad",))[0]
    if unit != "deg" or table.position.unit:
        return False
    if np.nanmax(np.abs(arrays[root + POSITIONS]()), initial=0.0) > 4 * np.pi:  # [rad], farther than any joint turns
        return True
    raise LogError(
        f"{path}: '{root}.joints_state.positions' has the unit deg, but could be in radians, for which the "
        "telemetry dumper writes deg too; set the units of [log.position], [log.velocity] and [log.acceleration]"
    )


def _read_signal(path: str, name: str, arrays: Arrays, width: int) -> tuple[IntArray, Array]:
    """Read stamps [ns], shape (T,), and values, shape (T, width)."""
    if f"{name}.timestamps" not in arrays:
        raise LogError(f"{path}: '{name}' has no 'timestamps'; expected one per sample")
    data, seconds = arrays[f"{name}.data"](), arrays[f"{name}.timestamps"]().reshape(-1)
    samples = len(seconds)
    if data.size != samples * width:
        raise LogError(
            f"{path}: '{name}' has data of shape {data.shape}; expected {width} values at each of its "
            f"{samples} timestamps"
        )
    strange = ~(np.abs(seconds) < 9e9)  # in the year 2255, nanoseconds no longer fit 64 bits
    if strange.any():
        raise LogError(f"{path}: '{name}.timestamps' contains {seconds[strange][0]:g}; expected seconds")
    values = data.reshape(width, samples).T if data.shape[-1:] == (samples,) else data.reshape(samples, width)
    return np.round(seconds * NANO).astype(np.int64), np.ascontiguousarray(values)

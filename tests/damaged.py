"""Unusable logs, each with words that its error message must contain.

`DAMAGED` is a list of (name, maker, words): `maker(folder)` writes a log and returns its path. Reading it for a robot
with the joints `JOINTS` of `tests.log.readers.formats` raises a LogError of one line with the path and the words.
`BAD_SAMPLING` lists logs that can be read, but are refused when they are resampled.
"""

from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet
from rosbags.typesys import Stores, get_typestore
from tests.log.readers.formats import (
    AXES,
    FEET,
    JOINTS,
    WRITERS,
    arrays_of,
    columns_of,
    messages_of,
    synthetic_log,
    write_arrays,
    write_csv,
    write_messages,
    write_npz,
    write_parquet,
)

SUFFIXES = (".npz", ".h5", ".mat", ".csv", ".parquet", ".mcap", ".bag")


def main_file(path: Path) -> Path:
    """Return the file of a log that contains its samples."""
    return path if path.is_file() else next(file for file in sorted(path.iterdir()) if file.suffix != ".yaml")


def truncated(writer, share, folder):
    path = writer(folder, synthetic_log(60))
    file = main_file(path)
    file.write_bytes(file.read_bytes()[: int(share * file.stat().st_size)])
    return path


def of_bytes(name, content, folder):
    (folder / name).write_bytes(content)
    return folder / name


def arrays(change, folder):
    """Write an .npz whose arrays are changed by `change`."""
    contents = arrays_of(synthetic_log(60))
    change(contents)
    return write_arrays(folder, **contents)


def table(change, folder, write=pyarrow.parquet.write_table, name="log.parquet"):
    columns = columns_of(synthetic_log(60))
    change(columns)
    write(pa.table(columns), folder / name)
    return folder / name


def csv_line(row, text, folder):
    """Write a CSV with one line replaced; row 0 is the header."""
    path = write_csv(folder, synthetic_log(60))
    lines = path.read_text().splitlines()
    lines[row] = text(lines[row]) if callable(text) else text
    path.write_text("\n".join(lines) + "\n")
    return path


def text_in_first_number(line):
    return ",".join([line.split(",")[0], "oops", *line.split(",")[2:]])


def a_folder(name, folder):
    (folder / name).mkdir()
    return folder / name


def h5_without_positions(folder):
    with h5py.File(folder / "log.h5", "w") as file:
        file["group/q"] = np.zeros((5, 3))
    return folder / "log.h5"


def mcap_without_joints(folder):
    messages = messages_of(synthetic_log(20), get_typestore(Stores.ROS2_HUMBLE))
    return write_messages(folder / "log.mcap", (message for message in messages if message[0] == "/imu"))


def mcap_of_two_sources(folder):
    messages = list(messages_of(synthetic_log(20), get_typestore(Stores.ROS2_HUMBLE)))
    doubled = [("/left" + m[0], *m[1:]) for m in messages] + [("/right" + m[0], *m[1:]) for m in messages]
    return write_messages(folder / "log.mcap", doubled)


def mcap_with_uneven_joints(folder):
    messages = list(messages_of(synthetic_log(20), get_typestore(Stores.ROS2_HUMBLE)))
    messages[0][3].name = list(JOINTS[:2])
    return write_messages(folder / "log.mcap", messages)


def without(*names):
    return lambda contents: [contents.pop(name) for name in names]


def with_value(name, value):
    def change(contents):
        contents[name] = value(contents[name])

    return change


DAMAGED = [
    *(
        (f"{name} cut at {share:.0%}", partial(truncated, writer, share), ["cannot be read"])
        for name, writer in WRITERS.items()
        if name != "csv"  # cut at the end of a line, it is a shorter log
        for share in (0.05, 0.4, 0.8, 0.99)
    ),
    (
        "csv cut in a line",
        partial(csv_line, 40, lambda line: line[: len(line) // 2]),
        ["cannot be read as CSV", "Row #41"],
    ),
    *((f"{suffix} of nonsense", partial(of_bytes, "log" + suffix, b"nonsense" * 99), []) for suffix in SUFFIXES),
    *((f"{suffix} of zeros", partial(of_bytes, "log" + suffix, bytes(4096)), []) for suffix in SUFFIXES),
    *((f"empty {suffix}", partial(of_bytes, "log" + suffix, b""), ["is empty"]) for suffix in SUFFIXES),
    *((f"a folder {suffix}", partial(a_folder, "log" + suffix), ["is a folder"]) for suffix in SUFFIXES),
    ("no file", lambda folder: folder / "log.npz", ["no such file"]),
    ("unknown suffix", partial(of_bytes, "log.xlsx", b"x"), ["unknown suffix '.xlsx'", ".parquet"]),
    ("no suffix", partial(of_bytes, "log", b"x"), ["unknown suffix"]),
    ("npz without positions", partial(arrays, without("position")), ["no joint positions", "[log.position] name"]),
    ("npz without torques", partial(arrays, without("torque")), ["no joint torques", "[log.torque] name"]),
    ("npz without time", partial(arrays, without("time")), ["no time", "[log] rate"]),
    ("npz with a short torque", partial(arrays, with_value("torque", lambda a: a[:-1])), ["'torque' has 59 rows"]),
    ("npz of text", partial(arrays, with_value("torque", lambda a: a.astype(str))), ["'torque'", "expected numbers"]),
    ("npz of one number", partial(arrays, with_value("position", lambda _: np.float64(3))), ["shape ()"]),
    (
        "npz with other joints",
        partial(arrays, with_value("joint_names", lambda _: np.array(["hip", "kne", "wheel"]))),
        ["no position of joint 'knee'", "'kne'", 'joint_names = {kne = "knee"} in [log]', "[robot] locked"],
    ),
    ("npz of contact forces", partial(arrays, with_value("contact", lambda a: a * 312.5)), ["312.5", "flags"]),
    ("npz of one sample", lambda folder: write_arrays(folder, **arrays_of(synthetic_log(1))), ["1 samples"]),
    ("npz of nothing", lambda folder: write_arrays(folder), ["no arrays"]),
    ("h5 without positions", h5_without_positions, ["no joint positions", "group/q"]),
    (
        "csv with text in a number",
        partial(csv_line, 20, text_in_first_number),
        ["cannot be read as CSV", "Row #21", "oops"],
    ),
    (
        "csv with a column twice",
        partial(csv_line, 0, lambda line: line.replace("position.knee", "position.hip")),
        ["'position.hip' more than once"],
    ),
    ("csv with a header alone", partial(of_bytes, "log.csv", b"time,position.hip,position.knee,position.wheel\n"), []),
    ("parquet without a joint", partial(table, without("position.knee")), ["no position of joint 'knee'"]),
    ("parquet without a torque", partial(table, without("torque.knee")), ["no torque of joint 'knee'", "controlled"]),
    ("parquet of text", partial(table, with_value("torque.hip", lambda a: a.astype(str).tolist())), ["'torque.hip'"]),
    ("parquet with half a wrench", partial(table, without("foot_wrench.left_foot.ty")), ["'left_foot.ty'"]),
    (
        "parquet with vertical forces as wrenches",
        partial(table, without(*(f"foot_wrench.{foot}.{axis}" for foot in FEET for axis in AXES if axis != "fz"))),
        ["'foot_wrench' has no column for 'left_foot.fx'", "'foot_force'"],
    ),
    ("parquet with half a quaternion", partial(table, without("base_orientation.w")), ["base_orientation"]),
    ("parquet of no rows", lambda folder: write_parquet(folder, synthetic_log(0)), ["0 samples"]),
    ("mcap without joint states", mcap_without_joints, ["sensor_msgs/JointState", "'/imu'"]),
    ("mcap of two robots", mcap_of_two_sources, ["'/left/joint_states'", "[log.position] name"]),
    ("mcap with uneven joint states", mcap_with_uneven_joints, ["2 joint names and 3 values"]),
]


def backward(time):
    time = time.copy()
    time[30:] -= 0.1
    return time


def mostly_missing(torque):
    torque = torque.copy()
    torque[1:, 1] = np.nan
    return torque


BAD_SAMPLING = [
    (
        "time running backwards",
        partial(arrays, with_value("time", backward)),
        ["backwards in row 30", "0.058", "-0.04"],
    ),
    ("time that stands", partial(arrays, with_value("time", np.zeros_like)), ["all stamps"]),
    ("time in ms", partial(arrays, with_value("time", lambda t: 1e3 * t)), ['[log.time] unit = "ms"', "500 Hz"]),
    ("time in us", partial(arrays, with_value("time", lambda t: 1e6 * t)), ['[log.time] unit = "us"']),
    ("time in ns", partial(arrays, with_value("time", lambda t: (1e9 * t).astype(int))), ['[log.time] unit = "ns"']),
    ("no torque at all", partial(arrays, with_value("torque", np.zeros_like)), ["'torque' is zero"]),
    ("long quaternions", partial(arrays, with_value("base_orientation", lambda q: 1.1 * q)), ["norm 1.1"]),
    (
        "positions in degrees",
        partial(arrays, with_value("position", np.rad2deg)),
        ["in deg", "[log.position] unit"],
    ),
    (
        "positions beyond any robot",
        partial(arrays, with_value("position", lambda q: 1e11 * q)),
        ["position of '", "expected at most 1e8 in rad or m, set its unit by [log.position] unit"],
    ),
    *(
        (f"{rows} samples", lambda folder, rows=rows: write_npz(folder, synthetic_log(rows)), [f"has {rows} samples;"])
        for rows in (2, 15)
    ),
    ("velocities in rpm", partial(arrays, with_value("velocity", lambda v: v * 30 / np.pi)), ["rpm"]),
    ("hardly a torque", partial(arrays, with_value("torque", mostly_missing)), ["torque.knee (59)"]),
    ("all positions missing", partial(arrays, with_value("position", lambda q: q * np.nan)), ["0 of 60 rows"]),
    (
        "holes everywhere",
        partial(arrays, with_value("time", lambda t: t + 0.5 * (np.arange(len(t)) // 4))),
        ["max_gap"],
    ),
]

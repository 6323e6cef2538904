"""Unusable logs, each with words that its error message must contain.

`DAMAGED` is a list of (name, maker, words): `maker(folder)` writes a log and returns its path. Reading it for a robot
with the joints `JOINTS` of `tests.log.readers.formats` raises a LogError of one line with the path and the words.
`BAD_SAMPLING` lists logs that can be read, but are refused when they are resampled.
"""

from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet
from rosbags.typesys import Stores, get_typestore
from tests.log.readers.formats import (
    AXES,
    FEET,
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


def mcap_without_joints(folder):
    messages = messages_of(synthetic_log(20), get_typestore(Stores.ROS2_HUMBLE))
    return write_messages(folder / "log.mcap", (message for message in messages if message[0] == "/imu"))


def mcap_of_two_sources(folder):
    messages = list(messages_of(synthetic_log(20), get_typestore(Stores.ROS2_HUMBLE)))
    doubled = [("/left" + m[0], *m[1:]) for m in messages] + [("/right" + m[0], *m[1:]) for m in messages]
    return write_messages(folder / "log.mcap", doubled)


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
    *((f"empty {suffix}", partial(of_bytes, "log" + suffix, b""), ["is empty"]) for suffix in SUFFIXES),
    *((f"a folder {suffix}", partial(a_folder, "log" + suffix), ["is a folder"]) for suffix in SUFFIXES),
    ("no file", lambda folder: folder / "log.npz", ["no such file"]),
    ("unknown suffix", partial(of_bytes, "log.xlsx", b"x"), ["unknown suffix '.xlsx'", ".parquet"]),
    ("npz without positions", partial(arrays, without("position")), ["no joint positions", "[log.position] name"]),
    ("npz without torques", partial(arrays, without("torque")), ["no joint torques", "[log.torque] name"]),
    ("npz without time", partial(arrays, without("time")), ["no time", "[log] rate"]),
    ("npz with a short torque", partial(arrays, with_value("torque", lambda a: a[:-1])), ["'torque' has 59 rows"]),
    (
        "npz with other joints",
        partial(arrays, with_value("joint_names", lambda _: np.array(["hip", "kne", "wheel"]))),
        ["no position of joint 'knee'", "'kne'", 'joint_names = {kne = "knee"} in [log]', "[robot] locked"],
    ),
    ("npz of contact forces", partial(arrays, with_value("contact", lambda a: a * 312.5)), ["312.5", "flags"]),
    (
        "csv with text in a number",
        partial(csv_line, 20, text_in_first_number),
        ["cannot be read as CSV", "Row #21", "oops"],
    ),
    ("parquet without a joint", partial(table, without("position.knee")), ["no position of joint 'knee'"]),
    ("parquet without a torque", partial(table, without("torque.knee")), ["no torque of joint 'knee'", "controlled"]),
    (
        "parquet with vertical forces as wrenches",
        partial(table, without(*(f"foot_wrench.{foot}.{axis}" for foot in FEET for axis in AXES if axis != "fz"))),
        ["'foot_wrench' has no column for 'left_foot.fx'", "'foot_force'"],
    ),
    ("parquet of no rows", lambda folder: write_parquet(folder, synthetic_log(0)), ["0 samples"]),
    ("mcap without joint states", mcap_without_joints, ["sensor_msgs/JointState", "'/imu'"]),
    ("mcap of two robots", mcap_of_two_sources, ["'/left/joint_states'", "[log.position] name"]),
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
    ("time in ms", partial(arrays, with_value("time", lambda t: 1e3 * t)), ['[log.time] unit = "ms"', "500 Hz"]),
    ("time in ns", partial(arrays, with_value("time", lambda t: (1e9 * t).astype(int))), ['[log.time] unit = "ns"']),
    ("time that stands", partial(arrays, with_value("time", np.zeros_like)), ["all stamps"]),
    ("long quaternions", partial(arrays, with_value("base_orientation", lambda q: 1.1 * q)), ["norm 1.1"]),
    ("no torque at all", partial(arrays, with_value("torque", np.zeros_like)), ["'torque' is zero"]),
    (
        "positions in degrees",
        partial(arrays, with_value("position", np.rad2deg)),
        ["in deg", "[log.position] unit"],
    ),
    *(
        (f"{rows} samples", lambda folder, rows=rows: write_npz(folder, synthetic_log(rows)), [f"has {rows} samples;"])
        for rows in (2, 15)
    ),
    ("hardly a torque", partial(arrays, with_value("torque", mostly_missing)), ["torque.knee (59)"]),
    (
        "holes everywhere",
        partial(arrays, with_value("time", lambda t: t + 0.5 * (np.arange(len(t)) // 4))),
        ["max_gap"],
    ),
]

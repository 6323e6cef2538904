"""Logs of every format: their bytes and blocks, the numbers in their headers, and what they say."""

import os
import shutil
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from rosbags.typesys import Stores, get_typestore
from tests.log.readers.formats import START, WRITERS, arrays_of, columns_of, messages_of, synthetic_log, write_messages

from fuzz.damage import bytes_damaged, pick, text_damaged
from stribeck.log import RobotLog
from stribeck.log.readers import read_log
from stribeck.robot import Robot

FORMATS = {name.replace(" ", "-"): write for name, write in WRITERS.items()}
CHECKED = ("npz", "parquet", "mcap", "mcap-of-ROS-1")
"""Formats whose checksums, as they are written here, cover all samples: other ones must never be read."""
EXTREME = (b"\xff", b"\x7f", b"\x80", b"\x00")
NUMBERS = (0.0, -0.0, 1e-300, 1e12, 1e300, -1e300, np.nan, np.inf, -np.inf, 2.0**63, 1e15)
HOLE = 1 << 40
"""Bytes by which a file with a hole says to be longer."""


def make_logs(folder: Path, joints: tuple[str, ...]) -> None:
    """Write the same log in every format, each in a folder of the format's name."""
    for name, write in FORMATS.items():
        (folder / name).mkdir(parents=True)
        write(folder / name, _sound(joints))


@cache
def _sound(joints: tuple[str, ...]) -> RobotLog:
    return synthetic_log(200, joints=joints)


def make_damaged(kind: str, generator: np.random.Generator, folder: Path, seeds: Path) -> list[str]:
    """Write a log with another byte, a block that is lost, doubled or moved, or a number that is extreme."""
    sound = next((seeds / "logs" / kind).iterdir())
    path = folder / sound.name
    (shutil.copytree if sound.is_dir() else shutil.copy)(sound, path)
    file = pick(generator, sorted(path.iterdir())) if path.is_dir() else path
    content = file.read_bytes()
    for _ in range(int(generator.geometric(0.7))):
        match int(generator.integers(6)):
            case 0 | 1:
                content = bytes_damaged(generator, content)
            case 2:
                content = _blocks_damaged(generator, content)
            case 3 | 4:
                content = _header_damaged(generator, content)
            case 5 if file.suffix in (".csv", ".yaml"):
                content = text_damaged(generator, content.decode(errors="replace")).encode(errors="surrogatepass")
    file.write_bytes(content)
    if generator.random() < 0.02:
        os.truncate(file, len(content) + HOLE)
    if generator.random() < 0.01:
        file.unlink()
        os.mkfifo(file)
    return ["inspect", path.name, "-r", str(seeds / "robot.toml")]


def _blocks_damaged(generator: np.random.Generator, content: bytes) -> bytes:
    """Return bytes of which two blocks have changed places, or one is empty or another's."""
    size = int(2 ** generator.integers(3, 13))
    blocks = [content[start : start + size] for start in range(0, len(content), size)]
    one, other = (int(k) for k in generator.integers(0, len(blocks), 2)) if blocks else (0, 0)
    match int(generator.integers(3)) if blocks else -1:
        case 0:
            blocks[one], blocks[other] = blocks[other], blocks[one]
        case 1:
            blocks[one] = bytes(len(blocks[one]))
        case 2:
            blocks[one] = blocks[other]
    return b"".join(blocks)


def _header_damaged(generator: np.random.Generator, content: bytes) -> bytes:
    """Return bytes in whose first or last kilobytes a number of 2 to 8 bytes is extreme."""
    width = int(2 ** generator.integers(1, 4))
    place = int(2 ** generator.uniform(0, 12))
    start = max(0, min(place, len(content)) if generator.random() < 0.5 else len(content) - place)
    number = pick(generator, EXTREME) * (width - 1) + pick(generator, EXTREME)
    return content[:start] + number + content[start + width :]


def differs(kind: str, command: list[str], folder: Path, seeds: Path) -> bool:
    """Return whether a log that was accepted has other samples than were written."""
    robot = Robot.from_file(seeds / "robot.toml")
    written, read = (read_log(path, robot) for path in (seeds / "logs" / kind / command[1], folder / command[1]))
    there = read.channels()
    return any(
        there[name].shape != channel.shape or not np.array_equal(there[name], channel, equal_nan=True)
        for name, channel in written.channels().items()
        if name in there and channel.dtype.kind == "f"
    )


def make_strange(generator: np.random.Generator, folder: Path, seeds: Path) -> list[str]:
    """Write a log of any format that is whole, and says what no log means."""
    robot = Robot.from_file(seeds / "robot.toml")
    log = _sound(robot.joint_names)
    writers: tuple[Callable[..., Path], ...] = (_npz, _hdf5, partial(_table, "csv"), partial(_table, "parquet"), _mcap)
    path = pick(generator, writers)(generator, folder, log)
    return ["inspect", path.name, "-r", str(seeds / "robot.toml")]


def _array_changed(generator: np.random.Generator, array: Any) -> Any:
    """Return an array with other values, of another type or shape."""
    array = np.array(array)
    match int(generator.integers(9)):
        case 0 if array.dtype.kind == "f" and array.size:
            flat = array.reshape(-1)
            flat[generator.integers(0, len(flat), max(1, int(len(flat) * 10 ** generator.uniform(-4, 0))))] = pick(
                generator, NUMBERS
            )
        case 1:
            return array.astype(pick(generator, ("f2", "f4", "i8", "u1", "S8", "?", "c16", "U4")), casting="unsafe")
        case 2:
            return array[: int(generator.integers(0, len(array) + 1))] if array.ndim else array
        case 3:
            return array.T
        case 4:
            return array[..., None]
        case 5:
            return np.repeat(array, 2, axis=0) if array.ndim else array
        case 6:
            return array[generator.permutation(len(array))] if array.ndim else array
        case 7:
            return array[()] if array.ndim == 0 else array[0]
        case 8:
            return array * pick(generator, NUMBERS) if array.dtype.kind == "f" else array
    return array


@np.errstate(all="ignore")
def _changed(generator: np.random.Generator, contents: dict[str, Any]) -> dict[str, Any]:
    """Return arrays of which some are changed, lost, or under another's name."""
    for _ in range(int(generator.integers(1, 4))):
        name, other = pick(generator, sorted(contents)), pick(generator, sorted(contents))
        match int(generator.integers(6)):
            case 0 if len(contents) > 1:
                del contents[name]
            case 1:
                contents[name], contents[other] = contents[other], contents[name]
            case _:
                try:
                    contents[name] = _array_changed(generator, contents[name])
                except (TypeError, ValueError):  # such a change is not possible
                    continue
    return contents


def _npz(generator: np.random.Generator, folder: Path, log: RobotLog) -> Path:
    save = pick(generator, (np.savez, np.savez_compressed))
    save(folder / "log.npz", **_changed(generator, arrays_of(log)))
    return folder / "log.npz"


def _hdf5(generator: np.random.Generator, folder: Path, log: RobotLog) -> Path:
    with h5py.File(folder / "log.h5", "w") as file:
        for name, array in _changed(generator, arrays_of(log)).items():
            file[name] = np.asarray(array).astype("S") if np.asarray(array).dtype.kind == "U" else array
        match int(generator.integers(8)):
            case 0:
                file["outside"] = h5py.ExternalLink("/etc/hostname", "/")
            case 1:
                file["link"] = h5py.SoftLink("/link")
            case 2:
                file.create_dataset("velocity2", (10**12, 3), float, chunks=(1024, 3))
            case 3:
                file.create_dataset("torque2", (100, 3), float, external=[("/dev/zero", 0, 2400)])
            case 4:
                file["group/itself"] = file["/"]
    return folder / "log.h5"


def _table(suffix: str, generator: np.random.Generator, folder: Path, log: RobotLog) -> Path:
    columns = {
        name: [value.item() if isinstance(value, np.generic) else str(value) for value in np.ravel(np.asarray(column))]
        for name, column in _changed(generator, columns_of(log)).items()
    }
    most = max(map(len, columns.values()))
    for values in columns.values():
        values.extend([None] * (most - len(values)))
    path = folder / f"log.{suffix}"
    try:
        table = pa.table(columns)
    except (pa.ArrowInvalid, pa.ArrowTypeError, pa.ArrowNotImplementedError, OverflowError):
        table = pa.table({name: [str(value) for value in values] for name, values in columns.items()})
    (pyarrow.parquet.write_table if suffix == "parquet" else pyarrow.csv.write_csv)(table, path)
    return path


def _mcap(generator: np.random.Generator, folder: Path, log: RobotLog) -> Path:
    sent = [list(message) for message in messages_of(log, get_typestore(Stores.ROS2_HUMBLE))]
    for _ in range(int(10 ** generator.uniform(0, 2.5))):
        row = int(generator.integers(len(sent)))
        message = sent[row][3]
        match int(generator.integers(8)):
            case 0:
                sent[row][2] = int(pick(generator, (0, 1, 2**62, START, 2**64 - 1)))
            case 1 if hasattr(message, "header"):
                message.header.stamp.sec = int(pick(generator, (0, -1, 2**31 - 1, -(2**31))))
            case 2 if hasattr(message, "name"):
                order = generator.permutation(len(message.name))
                message.name = [message.name[k] for k in order]
                for channel in ("position", "velocity", "effort"):
                    if len(values := getattr(message, channel)) == len(order):
                        setattr(message, channel, values[order])
            case 3 if hasattr(message, "name"):
                channel = pick(generator, ("position", "velocity", "effort", "name"))
                setattr(message, channel, getattr(message, channel)[: int(generator.integers(4))])
            case 4 if hasattr(message, "name") and len(message.effort):
                message.effort = np.array(message.effort)
                message.effort[0] = pick(generator, NUMBERS)
            case 5:
                sent.insert(row, list(sent[int(generator.integers(len(sent)))]))
            case 6 if len(sent) > 1:
                del sent[row]
            case 7 if hasattr(message, "name"):
                message.name = [pick(generator, ("", "x", "\x00", message.name[0] if message.name else "a"))] * len(
                    message.name
                )
    return write_messages(folder / "log.mcap", map(tuple, sent))

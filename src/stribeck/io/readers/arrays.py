"""Files of named arrays: NumPy archives (`.npz`, without pickled objects) and HDF5."""

import io
import math
import zipfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import IO, Any

import h5py
import numpy as np
from numpy.typing import NDArray

from stribeck.core.errors import LogError, listed
from stribeck.core.log.channels import CHANNELS, FOOT_CHANNELS, JOINT_CHANNELS, WRENCH, widened
from stribeck.core.log.storage import BLOCK_ROWS, allocate, check_size
from stribeck.core.settings import LogTable
from stribeck.io.readers.mapping import alias_note, asked_names, find_aliases
from stribeck.io.readers.recording import Channel, Loaded, Recording, Wanted, foreign

WORDS = ("joint_names", "foot_names", "torque_source")
"""Arrays of text that describe the others."""


@dataclass(frozen=True)
class StoredArray:
    """Array in a file: shape, type, and a function that reads it."""

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    read: Callable[[], NDArray[Any]]

    @property
    def columns(self) -> int:
        """Number of columns after flattening all axes but the first."""
        return math.prod(self.shape[1:])

    @property
    def size(self) -> int:
        """Declared number of bytes, at least one value per row."""
        return self.dtype.itemsize * math.prod(max(1, length) for length in self.shape)


def open_npz(path: Path, table: LogTable) -> Recording:
    """Open an `.npz` file with arrays named as the channels of RobotLog.

    Raises
    ------
    LogError
        If it is damaged, contains pickled objects in a used array, or lacks an array that `[log]` names.
    """
    with foreign(str(path), "NumPy .npz"), zipfile.ZipFile(path) as archive:
        for member in archive.infolist():
            archive.open(member).close()  # checks that its header has the same name as the directory
        members = [name for name in archive.namelist() if name.endswith(".npy")]
        arrays = {name.removesuffix(".npy"): _open_member(path, archive, name) for name in members}
    return source_of_arrays(str(path), "NumPy .npz", arrays, {}, table)


def _open_member(path: Path, archive: zipfile.ZipFile, member: str) -> StoredArray:
    with archive.open(member) as file:
        shape, dtype = _read_header(file)
        if math.prod(shape) * dtype.itemsize + file.tell() > archive.getinfo(member).file_size:
            raise ValueError(f"array {member} is shorter than its header declares")

    def read() -> NDArray[Any]:
        with zipfile.ZipFile(path) as archive, archive.open(member) as file:
            return np.asarray(np.lib.format.read_array(file, allow_pickle=False))

    return StoredArray(shape, dtype, read)


def _read_header(file: IO[bytes]) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Read an array's header, which may claim to be gigabytes long."""
    start = io.BytesIO(file.read(1 << 16))
    first = np.lib.format.read_magic(start) == (1, 0)
    read = np.lib.format.read_array_header_1_0 if first else np.lib.format.read_array_header_2_0
    shape, _, dtype = read(start)
    file.seek(start.tell())
    return shape, dtype


def open_hdf5(path: Path, table: LogTable) -> Recording:
    """Open an HDF5 file with datasets named as the channels of RobotLog at its root.

    `[log] <channel>.name` refers to datasets in groups by their path. `joint_names`, `foot_names` and `torque_source`
    may be datasets or attributes of the root.

    Raises
    ------
    LogError
        If it is damaged, contains other values than numbers in a used dataset, or lacks a dataset that `[log]` names.
    """

    def read(name: str) -> NDArray[Any]:
        with h5py.File(path, "r") as file:
            return np.asarray(file[name])

    with foreign(str(path), "HDF5"), h5py.File(path, "r") as file:
        arrays = {
            name: StoredArray(node.shape, node.dtype, partial(read, name))
            for name, node in datasets(file, path).items()
            if node.shape is not None
        }
        words = {name: _texts(file.attrs[name], name, str(path)) for name in WORDS if name in file.attrs}
    return source_of_arrays(str(path), "HDF5", arrays, words, table)


def datasets(file: h5py.File, path: Path) -> dict[str, h5py.Dataset]:
    """Find the datasets of an HDF5 file by path; refuse datasets stored in other files."""
    nodes: dict[str, h5py.Dataset] = {}

    def visit(name: str, node: h5py.Dataset | h5py.Group) -> None:
        name = name if isinstance(name, str) else repr(name)  # h5py returns bytes if it is not UTF-8
        if isinstance(node, h5py.Dataset):
            if node.is_virtual or node.external:  # even its shape may be elsewhere
                raise LogError(
                    f"{path}: '{name}' is stored in other files, which are not opened; expected it in this file"
                )
            nodes[name] = node

    file.visititems(visit)  # does not follow links to other files
    return nodes


def _texts(values: object, name: str, path: str) -> tuple[str, ...]:
    """Convert an array of text, or a single text, to strings."""
    flat = np.ravel(np.asarray(values, dtype=object))
    if not all(isinstance(value, (bytes, str)) and len(value) <= 1000 for value in flat):
        raise LogError(f"{path}: '{name}' contains other values than text of at most 1,000 characters; expected names")
    return tuple(value.decode() if isinstance(value, bytes) else value for value in flat)


def source_of_arrays(
    path: str, what: str, arrays: Mapping[str, StoredArray], words: Mapping[str, tuple[str, ...]], table: LogTable
) -> Recording:
    """Make the recording of a file of arrays, and of `words` (see `WORDS`) that are no arrays; `what` is its format."""
    if not arrays:
        raise LogError(f"{path}: contains no arrays; expected at least 'position' and 'torque'")
    stored_words = {name: arrays[name] for name in WORDS if name in arrays}
    check_size(path, sum(array.size for array in stored_words.values()))
    with foreign(path, what):
        words = {name: _texts(array.read(), name, path) for name, array in stored_words.items()} | {**words}
    offers = {
        key: array.columns
        for key, array in arrays.items()
        if key in CHANNELS or (array.dtype.kind in "fiu" and 1 <= len(array.shape) <= 2)
    }
    aliases = find_aliases(table, offers)
    used = {name: _find_names(name, arrays, table, aliases.get(name, name), path) for name in CHANNELS}
    used = {name: keys for name, keys in used.items() if keys}
    parts = {name: [arrays[key] for key in keys] for name, keys in used.items()}

    def load(wanted: Wanted) -> Loaded:
        check_size(path, sum(part.size for name in wanted for part in parts[name]))
        with foreign(path, what):
            loaded = {name: _load(name, parts[name], list(columns), path) for name, columns in wanted.items()}
        return loaded, alias_note(aliases)

    taken = {key for keys in used.values() for key in keys} | set(WORDS)
    lengths = Counter(array.shape[0] for array in arrays.values() if array.shape)
    rows = parts["time"][0].shape[0] if "time" in parts else max(lengths, key=lambda n: (n > 1, lengths[n]), default=0)
    return Recording(
        path=path,
        channels={
            name: Channel(sum(part.columns for part in stored), _find_labels(name, used[name], stored, words))
            for name, stored in parts.items()
        },
        load=load,
        others=tuple(key for key, array in arrays.items() if key not in taken and array.shape[:1] == (rows,)),
        wide=frozenset(key for key, array in arrays.items() if array.columns > 1),
        torque_source=next(iter(words.get("torque_source", ())), None),
    )


def _find_names(channel: str, arrays: Mapping[str, StoredArray], table: LogTable, usual: str, path: str) -> list[str]:
    """Find the arrays of a channel: as `[log]` names them, or by the standard or alternative name."""
    names = asked_names(table, channel) or [usual] * (usual in arrays)
    if missing := [name for name in names if name not in arrays]:
        raise LogError(
            f"{path}: [log.{channel}] name lists array {listed(missing)}; the file contains {listed(list(arrays))}"
        )
    for name in names:
        _check(arrays[name], name, channel, path)
    return names


def _check(array: StoredArray, key: str, channel: str, path: str) -> None:
    if array.dtype.kind not in "fiub":
        raise LogError(f"{path}: array '{key}' contains values of type {array.dtype}; expected numbers for '{channel}'")
    deepest = 3 if channel == "foot_wrench" else 2
    if not 1 <= len(array.shape) <= deepest:
        raise LogError(
            f"{path}: array '{key}' has shape {array.shape}; expected samples along the first axis and at most "
            f"{deepest} axes for '{channel}'"
        )


def _find_labels(
    channel: str, keys: list[str], stored: list[StoredArray], words: Mapping[str, tuple[str, ...]]
) -> tuple[str, ...] | None:
    """Find the log's names of a channel's columns: the names of several arrays, or its lists of names."""
    if channel in JOINT_CHANNELS and len(keys) > 1 and all(array.columns == 1 for array in stored):
        return tuple(keys)
    if channel in JOINT_CHANNELS and "joint_names" in words:
        return words["joint_names"]
    if channel in FOOT_CHANNELS and "foot_names" in words:
        return widened(words["foot_names"], len(WRENCH) if channel == "foot_wrench" else 1)
    return None


def _load(name: str, parts: Sequence[StoredArray], columns: list[int], path: str) -> NDArray[Any]:
    """Read columns of arrays that are laid side by side."""
    if len(rows := {part.shape[0] for part in parts}) > 1:
        raise LogError(f"{path}: the arrays of channel '{name}' have unequal lengths {sorted(rows)}")
    if name == "time":
        return parts[0].read().reshape(parts[0].shape[0], parts[0].columns)
    result = allocate((rows.pop(), len(columns)))
    first = 0
    for part in parts:
        target = [place for place, column in enumerate(columns) if first <= column < first + part.columns]
        source = [columns[place] - first for place in target]
        first += part.columns
        flat = part.read().reshape(len(result), part.columns) if target else result[:, :0]
        for start in range(0, len(result) if target else 0, BLOCK_ROWS):
            result[start : start + BLOCK_ROWS, target] = flat[start : start + BLOCK_ROWS, source]
    return result

"""MATLAB files: `.mat`, of version 7.3 (which is HDF5) and of those before it."""

import math
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import scipy.io
from numpy.typing import NDArray

from stribeck.errors import LogError
from stribeck.log.readers.aliases import ALIASES
from stribeck.log.readers.arrays import WORDS, StoredArray, source_of_arrays
from stribeck.log.readers.source import Source, foreign
from stribeck.log.readers.yarp import is_telemetry, open_telemetry
from stribeck.log.storage import BLOCK_ROWS, check_size
from stribeck.settings import LogTable

HEADER = 128  # bytes
COMPRESSED = 15  # type of an element
UNPACKED = 1 << 20  # bytes at once
UNREAD = {"MATLAB_empty", "MATLAB_object_decode"}
"""Attributes of what is empty in version 7.3, or an object of a class, such as a string or a table."""


@dataclass(frozen=True)
class Variable:
    """Numbers in a file, in MATLAB's shape without axes of length one; `read(axis, start, stop)` gives part of them."""

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    read: Callable[[int, int, int], NDArray[Any]]


Contents = tuple[dict[str, Variable], dict[str, tuple[str, ...]]]
"""Numbers and texts of a file by their names, those of structs with dots."""


def open_matlab(path: Path, table: LogTable) -> Source:
    """Open a `.mat` file with variables named as the channels of RobotLog, or one of YARP's robot logger.

    `[log] <channel>.name` reaches variables in structs, as `robot.joints.q`. Samples lie along the axis that is as long
    as `time`. A file of version 7 or before is read into memory whole.

    Raises
    ------
    LogError
        If it is damaged, holds anything but numbers where numbers are wanted, or lacks a variable that `[log]` names.
    """
    with foreign(str(path), "MATLAB"):
        variables, texts = (_read_hdf5 if h5py.is_hdf5(path) else _read_before_7_3)(path)
    if not variables:
        raise LogError(f"{path}: holds no arrays; expected at least 'position' and 'torque'")
    if is_telemetry(variables):
        whole = {name: partial(_whole, str(path), variable) for name, variable in variables.items()}
        with foreign(str(path), "a log of YARP"):
            return open_telemetry(str(path), whole, texts, table)
    asked = table.time.name or ("time", *ALIASES["time"])
    time = next((name for name in ([asked] if isinstance(asked, str) else asked) if name in variables), None)
    samples = max(variables[time].shape) if time else None
    arrays = {name: _stored(variable, samples, path) for name, variable in variables.items()}
    return source_of_arrays(str(path), arrays, {name: texts[name] for name in WORDS if name in texts}, table)


def _stored(variable: Variable, samples: int | None, path: Path) -> StoredArray:
    """Return a variable with its samples along the first axis: the one of that length, or else its longest."""
    shape = variable.shape
    axis = shape.index(max(shape)) if samples is None else shape.index(samples) if samples in shape else 0
    moved = (shape[axis], *shape[:axis], *shape[axis + 1 :])
    return StoredArray(moved, variable.dtype, partial(_blocks, variable, axis, path))


def _blocks(variable: Variable, axis: int, path: Path) -> Iterator[NDArray[np.generic]]:
    with foreign(str(path), "MATLAB"):
        for start in range(0, variable.shape[axis], BLOCK_ROWS):
            stop = min(start + BLOCK_ROWS, variable.shape[axis])
            yield np.moveaxis(variable.read(axis, start, stop), axis, 0)


def _whole(path: str, variable: Variable) -> NDArray[np.float64]:
    if variable.dtype.kind not in "fiub":
        raise LogError(f"{path}: holds values of type {variable.dtype}; expected numbers")
    check_size(path, 8 * math.prod(variable.shape))
    return np.asarray(variable.read(0, 0, variable.shape[0]), dtype=np.float64)


def _read_before_7_3(path: Path) -> Contents:
    """Read a file of version 4 to 7 whole; those that unpack to far more than they are would fill the memory."""
    check_size(str(path), _unpacked(path))
    found: Mapping[str, Any] = scipy.io.loadmat(path, simplify_cells=True)
    variables: dict[str, Variable] = {}
    texts: dict[str, tuple[str, ...]] = {}

    def visit(name: str, value: object) -> None:
        if isinstance(value, Mapping):
            for key, part in value.items():
                visit(f"{name}.{key}", part)
        elif isinstance(value, str):
            texts[name] = (value.rstrip(),)
        elif isinstance(value, (list, np.ndarray)) and _all_text(value):
            texts[name] = tuple(str(one).rstrip() for one in np.ravel(np.asarray(value, dtype=object)))
        elif isinstance(value, (int, float, complex, np.generic, np.ndarray)):
            array = np.atleast_1d(np.squeeze(np.asarray(value)))
            if array.dtype.kind in "fiubc":
                variables[name] = Variable(array.shape, array.dtype, partial(_slab, array))

    for name, value in found.items():
        if not name.startswith("__"):
            visit(name, value)
    return variables, texts


def _all_text(values: list[Any] | NDArray[Any]) -> bool:
    flat = np.ravel(np.asarray(values, dtype=object))
    return bool(flat.size) and all(isinstance(one, str) for one in flat)


def _slab(array: NDArray[Any], axis: int, start: int, stop: int) -> NDArray[Any]:
    return array[(slice(None),) * axis + (slice(start, stop),)]


def _unpacked(path: Path) -> int:
    """Return how many bytes the variables of a file of version 5 to 7 take when they are unpacked."""
    size, total = path.stat().st_size, 0
    with path.open("rb") as file:
        order = "<" if file.read(HEADER)[126:] == b"IM" else ">"
        while len(tag := file.read(8)) == 8:
            kind, length = (int(word) for word in np.frombuffer(tag, dtype=f"{order}u4"))
            following = file.tell() + length
            if kind == COMPRESSED:
                unpacker, left = zlib.decompressobj(), length
                while left > 0 and not unpacker.eof:
                    data = file.read(min(left, UNPACKED))
                    left -= len(data)
                    while data and not unpacker.eof:
                        total += len(unpacker.decompress(data, UNPACKED))
                        data = unpacker.unconsumed_tail
                    if not data and file.tell() >= size:
                        break
                    check_size(str(path), total)
            file.seek(following)
    return total


def _read_hdf5(path: Path) -> Contents:
    variables: dict[str, Variable] = {}
    texts: dict[str, tuple[str, ...]] = {}
    with h5py.File(path, "r") as file:

        def visit(name: str, node: h5py.Dataset | h5py.Group) -> None:
            name = name if isinstance(name, str) else repr(name)  # h5py gives bytes for what is not UTF-8
            if name.startswith("#") or not isinstance(node, h5py.Dataset) or not UNREAD.isdisjoint(node.attrs):
                return
            if node.is_virtual or node.external:
                raise LogError(
                    f"{path}: '{name}' is stored in other files, which are not opened; expected it in this file"
                )
            dotted = name.replace("/", ".")
            kind = bytes(node.attrs.get("MATLAB_class", b"")).decode(errors="replace")
            if kind == "char" or (kind == "cell" and h5py.check_ref_dtype(node.dtype)):
                check_size(str(path), node.size * node.dtype.itemsize)
                lines = [_text(node)] if kind == "char" else [_text(file[one]) for one in np.ravel(node[()])]
                if all(line is not None for line in lines):
                    texts[dotted] = tuple(line or "" for line in lines)
            elif node.shape is not None and node.dtype.kind != "O":
                shape = tuple(length for length in node.shape[::-1] if length != 1) or (1,)
                variables[dotted] = Variable(shape, node.dtype, partial(_hyperslab, path, name, shape))

        file.visititems(visit)  # which follows no links to other files
    return variables, texts


def _text(node: h5py.Dataset | h5py.Group) -> str | None:
    """Return a row of characters, None if it is something else."""
    if not isinstance(node, h5py.Dataset) or node.dtype.kind not in "u" or node.dtype.itemsize > 2:
        return None
    if not UNREAD.isdisjoint(node.attrs):
        return ""
    check_size(str(node.file.filename), node.size * node.dtype.itemsize)
    return "".join(chr(letter) for letter in np.ravel(node[()])).rstrip()


def _hyperslab(path: Path, name: str, shape: tuple[int, ...], axis: int, start: int, stop: int) -> NDArray[Any]:
    """Return part of a dataset, whose axes are MATLAB's in the opposite order."""
    with foreign(str(path), "MATLAB"), h5py.File(path, "r") as file:
        dataset = file[name]
        long = [place for place, length in enumerate(dataset.shape) if length != 1][::-1]  # MATLAB's order
        part = [slice(start, stop) if place in long[axis : axis + 1] else slice(None) for place in range(dataset.ndim)]
        return np.asarray(dataset[tuple(part)]).T.reshape(*shape[:axis], stop - start, *shape[axis + 1 :])

"""MATLAB files: `.mat` of version 7.3 (HDF5) and of earlier versions."""

import math
import zlib
from collections import Counter
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import scipy  # its io is slow to import: loaded at its first use
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.core.errors import LogError
from stribeck.core.log.storage import check_size
from stribeck.core.settings import LogTable
from stribeck.io.readers.arrays import WORDS, StoredArray, datasets, source_of_arrays
from stribeck.io.readers.mapping import ALIASES, asked_names
from stribeck.io.readers.recording import Recording, foreign
from stribeck.io.readers.yarp import is_telemetry, open_telemetry

UNREAD = {"MATLAB_empty", "MATLAB_object_decode"}
"""Attributes that mark empty variables of version 7.3, or objects of a class, such as strings or tables."""


Contents = tuple[dict[str, StoredArray], dict[str, tuple[str, ...]]]
"""Numbers and texts of a file by name, with dots for structs; shapes are MATLAB's without axes of length one."""


def open_matlab(path: Path, table: LogTable) -> Recording:
    """Open a `.mat` file with variables named as the channels of RobotLog, or a log of YARP's robot logger.

    `[log] <channel>.name` can refer to variables in structs, such as `robot.joints.q`. Samples are along the axis that
    has the length of `time`. Files of version 7 or earlier are read into memory completely.

    Raises
    ------
    LogError
        If it is damaged, contains other values than numbers in a used variable, or lacks a variable that `[log]` names.
    """
    with foreign(str(path), "MATLAB"):
        variables, texts = (_read_hdf5 if h5py.is_hdf5(path) else _read_before_7_3)(path)
    if not variables:
        raise LogError(
            f"{path}: contains no arrays; expected at least 'position' and 'torque'. Objects such as timeseries are "
            "readable in MATLAB only: save To Workspace and Scope blocks as 'Structure With Time', or "
            "'time = ts.Time; position = ts.Data;'"
        )
    if is_telemetry(variables):
        whole = {name: partial(_read_whole, str(path), variable) for name, variable in variables.items()}
        with foreign(str(path), "a log of YARP"):
            return open_telemetry(str(path), whole, texts, table)
    asked = asked_names(table, "time") or ("time", *ALIASES["time"])
    time = next((name for name in asked if name in variables), None)
    lengths = Counter(max(variable.shape) for variable in variables.values())
    common = (length for length, count in lengths.items() if count > 1)  # shared by variables
    samples = max(variables[time].shape) if time else max(common, default=max(lengths))
    arrays = {name: _move_samples(variable, samples) for name, variable in variables.items()}
    return source_of_arrays(str(path), "MATLAB", arrays, {name: texts[name] for name in WORDS if name in texts}, table)


def _move_samples(variable: StoredArray, samples: int) -> StoredArray:
    """Move the samples of a variable to the first axis, from the axis with their number."""
    shape = variable.shape
    axis = shape.index(samples) if samples in shape else 0
    moved = (shape[axis], *shape[:axis], *shape[axis + 1 :])
    return StoredArray(moved, variable.dtype, lambda: np.moveaxis(variable.read(), axis, 0))


def _read_whole(path: str, variable: StoredArray) -> Array:
    if variable.dtype.kind not in "fiub":
        raise LogError(f"{path}: contains values of type {variable.dtype}; expected numbers")
    check_size(path, 8 * math.prod(variable.shape))
    return np.asarray(variable.read(), dtype=np.float64)


def _flatten(contents: Mapping[str, Any]) -> Contents:
    """Name numbers and texts in structs with dots, and those of a Scope or To Workspace block by their labels."""
    variables: dict[str, StoredArray] = {}
    texts: dict[str, tuple[str, ...]] = {}

    def visit(name: str, value: object) -> None:
        flat = np.ravel(value if isinstance(value, np.ndarray) else np.asarray(value, dtype=object))
        if isinstance(value, StoredArray):
            variables[name] = value
        elif isinstance(value, Mapping) and (signals := _signals(value.get("signals"))):
            for signal in signals:
                visit(str(signal.get("label") or name) if len(signals) > 1 else name, signal["values"])
            visit("time", value.get("time", ()))
        elif isinstance(value, Mapping):
            for key, part in value.items():
                visit(f"{name}.{key}", part)
        elif flat.size and all(isinstance(text, str) for text in flat):
            texts[name] = tuple(str(text).rstrip() for text in flat)
        elif isinstance(value, (int, float, complex, np.generic, np.ndarray)):
            array = np.atleast_1d(np.squeeze(np.asarray(value)))
            if array.dtype.kind in "fiubc":
                variables[name] = StoredArray(array.shape, array.dtype, array.view)

    for name, value in contents.items():
        visit(name, value)
    return variables, texts


def _signals(found: object) -> list[Mapping[str, Any]]:
    """List the signals of a Scope: a struct, several, or (version 7.3) a struct of a list for each field."""
    if isinstance(found, Mapping) and isinstance(found.get("values"), list):
        lists = {key: parts for key, parts in found.items() if isinstance(parts, list)}
        found = [dict(zip(lists, parts, strict=True)) for parts in zip(*lists.values(), strict=True)]
    signals = [found] if isinstance(found, Mapping) else list(found) if isinstance(found, (list, np.ndarray)) else []
    return signals if all(isinstance(signal, Mapping) and "values" in signal for signal in signals) else []


def _read_before_7_3(path: Path) -> Contents:
    """Read a file of version 4 to 7 completely; refuse files that would unpack to fill the memory."""
    check_size(str(path), _measure(path))
    contents: Mapping[str, Any] = scipy.io.loadmat(path, simplify_cells=True)
    return _flatten({name: value for name, value in contents.items() if not name.startswith("__")})


def _measure(path: Path) -> int:
    """Compute the unpacked size [bytes] of the variables of a file of version 5 to 7."""
    total = 0
    with path.open("rb") as file:
        order = "<" if file.read(128)[126:] == b"IM" else ">"
        while len(tag := file.read(8)) == 8:
            kind, length = (int(word) for word in np.frombuffer(tag, dtype=f"{order}u4"))
            following = file.tell() + length
            if kind == 15:  # compressed
                unpacker, data = zlib.decompressobj(), file.read(length)
                while data and not unpacker.eof:
                    total += len(unpacker.decompress(data, 1 << 26))
                    check_size(str(path), total)
                    data = unpacker.unconsumed_tail
            file.seek(following)
    return total


def _read_hdf5(path: Path) -> Contents:
    contents: dict[str, Any] = {}
    with h5py.File(path, "r") as file:
        nodes = datasets(file, path)
        leaves = {name: node for name, node in nodes.items() if not h5py.check_ref_dtype(node.dtype)}
        for name, node in nodes.items():
            if not name.startswith("#") and UNREAD.isdisjoint(node.attrs):
                *outer, last = name.split("/")
                inside = contents
                for struct in outer:
                    inside = inside.setdefault(struct, {})
                inside[last] = _value(path, name, node, leaves)
    return _flatten(contents)


def _value(path: Path, name: str, node: h5py.Dataset | None, leaves: Mapping[str, h5py.Dataset]) -> object:
    """Read text, or list the values of a cell or of a field of several structs; numbers are read later."""
    if node is None or node.shape is None or (node.dtype.kind == "O" and not h5py.check_ref_dtype(node.dtype)):
        return None
    if h5py.check_ref_dtype(node.dtype):
        check_size(str(path), node.size * node.dtype.itemsize)
        places = [str(node.file[ref].name).lstrip("/") for ref in np.ravel(node[()])]
        return [_value(path, place, leaves.get(place), leaves) for place in places]
    if bytes(node.attrs.get("MATLAB_class", b"")) == b"char" and node.dtype.kind == "u" and node.dtype.itemsize <= 2:
        check_size(str(path), node.size * node.dtype.itemsize)
        letters = np.ravel(node[()]) if UNREAD.isdisjoint(node.attrs) else ()
        return "".join(map(chr, letters)).rstrip()
    shape = tuple(length for length in node.shape[::-1] if length != 1) or (1,)
    return StoredArray(shape, node.dtype, partial(_read_dataset, path, name, shape))


def _read_dataset(path: Path, name: str, shape: tuple[int, ...]) -> NDArray[Any]:
    """Read a dataset, whose axes are in the opposite order of MATLAB's."""
    with h5py.File(path, "r") as file:
        return np.asarray(file[name]).T.reshape(shape)

"""HDF5 files: `.h5`, `.hdf5`."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from stribeck.errors import LogError
from stribeck.log.readers.arrays import WORDS, StoredArray, source_of_arrays
from stribeck.log.readers.source import Source, foreign
from stribeck.log.storage import BLOCK_ROWS, check_size
from stribeck.settings import LogTable


def open_hdf5(path: Path, table: LogTable) -> Source:
    """Open an HDF5 file with datasets named as the channels of RobotLog at its root.

    `[log] <channel>.name` reaches datasets in groups by their path. `joint_names`, `foot_names` and `torque_source`
    may be datasets or attributes of the root.

    Raises
    ------
    LogError
        If it is damaged, holds anything but numbers where numbers are wanted, or lacks a dataset that `[log]` names.
    """
    arrays: dict[str, StoredArray] = {}

    def visit(name: str, node: h5py.Dataset | h5py.Group) -> None:
        name = name if isinstance(name, str) else repr(name)  # h5py gives bytes for what is not UTF-8
        if isinstance(node, h5py.Dataset) and (node.is_virtual or node.external):  # even its shape may be elsewhere
            raise LogError(f"{path}: '{name}' is stored in other files, which are not opened; expected it in this file")
        if isinstance(node, h5py.Dataset) and node.shape is not None:
            arrays[name] = StoredArray(node.shape, node.dtype, partial(_blocks, path, name))

    with foreign(str(path), "HDF5"), h5py.File(path, "r") as file:
        file.visititems(visit)  # which follows no links to other files
        check_size(str(path), sum(arrays[name].size for name in WORDS if name in arrays))
        words = {name: _words(file, name, path) for name in WORDS if name in arrays or name in file.attrs}
    if not arrays:
        raise LogError(f"{path}: holds no datasets; expected at least 'position' and 'torque'")
    return source_of_arrays(str(path), arrays, words, table)


def _blocks(path: Path, name: str) -> Iterator[NDArray[np.generic]]:
    with foreign(str(path), "HDF5"), h5py.File(path, "r") as file:
        dataset = file[name]
        for start in range(0, dataset.shape[0], BLOCK_ROWS):
            yield np.asarray(dataset[start : start + BLOCK_ROWS])


def _words(file: h5py.File, name: str, path: Path) -> tuple[str, ...]:
    """Return the texts of a dataset or an attribute."""
    node = file[name] if name not in file.attrs else file.attrs[name]
    values = np.ravel(np.asarray(node[()] if isinstance(node, h5py.Dataset) else node, dtype=object))
    if not all(isinstance(value, (bytes, str)) for value in values):
        raise LogError(f"{path}: '{name}' holds something else than text")
    return tuple(value.decode() if isinstance(value, bytes) else value for value in values)

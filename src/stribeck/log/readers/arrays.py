"""Channels of files that hold whole arrays under names (npz, HDF5)."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from stribeck.errors import LogError
from stribeck.log.readers.aliases import alias_note, find_aliases
from stribeck.log.readers.source import CHANNELS, FOOT_CHANNELS, JOINT_CHANNELS, WRENCH, Channel, Loaded, Source, listed
from stribeck.log.storage import allocate, check_size
from stribeck.settings import LogTable

WORDS = ("joint_names", "foot_names", "torque_source")
"""Arrays of text that describe the others."""


@dataclass(frozen=True)
class StoredArray:
    """An array in a file: its shape, its type, and its rows in blocks."""

    shape: tuple[int, ...]
    dtype: np.dtype[np.generic]
    blocks: Callable[[], Iterator[NDArray[np.generic]]]

    @property
    def columns(self) -> int:
        """How many columns it has when everything after the first axis is laid side by side."""
        return math.prod(self.shape[1:])

    @property
    def size(self) -> int:
        """How many bytes it is said to take, at least one value a row: rows are worked through even if empty."""
        return self.dtype.itemsize * math.prod(max(1, length) for length in self.shape)


def source_of_arrays(
    path: str, arrays: Mapping[str, StoredArray], words: Mapping[str, tuple[str, ...]], table: LogTable
) -> Source:
    """Return the source of a file with these arrays and these texts (`joint_names`, `foot_names`, `torque_source`)."""
    offers = {key: array.columns for key, array in arrays.items() if key in CHANNELS or _is_plain(array)}
    aliases = find_aliases(table, offers)
    used = {name: _names_of(name, arrays, table, aliases.get(name, name), path) for name in CHANNELS}
    parts = {name: [arrays[key] for key in keys] for name, keys in used.items() if keys}
    for name, stored in parts.items():
        for key, array in zip(used[name], stored, strict=True):
            _check(array, key, name, path)
    channels = {
        name: Channel(sum(part.columns for part in stored), _labels(name, used[name], stored, words))
        for name, stored in parts.items()
    }
    taken = {key for keys in used.values() for key in keys} | set(WORDS)
    return Source(
        path=path,
        channels=channels,
        load=partial(_load, parts, path, alias_note(aliases)),
        others=tuple(key for key in arrays if key not in taken),
        wide=frozenset(key for key, array in arrays.items() if array.columns > 1),
        torque_source=next(iter(words.get("torque_source", ())), None),
    )


def _is_plain(array: StoredArray) -> bool:
    return array.dtype.kind in "fiu" and 1 <= len(array.shape) <= 2


def _names_of(channel: str, arrays: Mapping[str, StoredArray], table: LogTable, usual: str, path: str) -> list[str]:
    """Return the arrays that hold a channel: as `[log]` names them, or the one of the channel's own or usual name."""
    asked = getattr(table, channel).name
    if asked is None:
        return [usual] if usual in arrays else []
    names = [asked] if isinstance(asked, str) else list(asked)
    missing = [name for name in names if name not in arrays]
    if missing:
        raise LogError(
            f"{path}: [log.{channel}] name asks for array {listed(missing)}; the file holds {listed(list(arrays))}"
        )
    return names


def _check(array: StoredArray, key: str, channel: str, path: str) -> None:
    if array.dtype.kind not in "fiub":
        raise LogError(f"{path}: array '{key}' holds values of type {array.dtype}; expected numbers for '{channel}'")
    deepest = 3 if channel == "foot_wrench" else 2
    if not 1 <= len(array.shape) <= deepest:
        raise LogError(
            f"{path}: array '{key}' has shape {array.shape}; expected samples along the first axis and at most "
            f"{deepest} axes for '{channel}'"
        )


def _labels(
    channel: str, keys: list[str], stored: list[StoredArray], words: Mapping[str, tuple[str, ...]]
) -> tuple[str, ...] | None:
    """Return the log's names of a channel's columns: those of several arrays, or its own lists of names."""
    if channel in JOINT_CHANNELS and len(keys) > 1 and all(array.columns == 1 for array in stored):
        return tuple(keys)
    if channel in JOINT_CHANNELS and "joint_names" in words:
        return words["joint_names"]
    if channel in FOOT_CHANNELS and "foot_names" in words:
        feet = words["foot_names"]
        return feet if channel != "foot_wrench" else tuple(f"{foot}.{axis}" for foot in feet for axis in WRENCH)
    return None


def _load(
    parts: Mapping[str, Sequence[StoredArray]], path: str, notes: Sequence[str], wanted: Mapping[str, Sequence[int]]
) -> Loaded:
    check_size(path, sum(part.size for name in wanted for part in parts[name]))
    arrays = {name: _load_channel(name, parts[name], list(columns), path) for name, columns in wanted.items()}
    return Loaded(arrays, tuple(notes))


def _load_channel(name: str, parts: Sequence[StoredArray], columns: list[int], path: str) -> NDArray[np.generic]:
    """Return the wanted columns of arrays laid side by side, block by block, so that memory holds them once."""
    rows = {part.shape[0] for part in parts}
    if len(rows) > 1:
        raise LogError(f"{path}: the arrays of channel '{name}' have unequal lengths {sorted(rows)}")
    if name == "time":
        blocks = [block.reshape(len(block), -1) for block in parts[0].blocks()]
        return np.concatenate(blocks) if blocks else np.zeros((0, 1))
    result = allocate((rows.pop(), len(columns)))
    first = 0
    for part in parts:
        here = [place for place, column in enumerate(columns) if first <= column < first + part.columns]
        source = [columns[place] - first for place in here]
        first += part.columns
        if here:
            _copy_blocks(part, source, result, here)
    return result


def _copy_blocks(part: StoredArray, source: list[int], result: NDArray[np.float64], target: list[int]) -> None:
    everything = source == list(range(part.columns)) and target == list(range(result.shape[1]))
    row = 0
    for block in part.blocks():
        flat = block.reshape(len(block), -1)
        rows = slice(row, row + len(flat))
        if everything:
            result[rows] = flat
        else:
            result[rows, target] = flat[:, source]
        row += len(flat)

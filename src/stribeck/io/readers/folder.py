"""Folders of tables of one run: `position.csv`, `torque.csv`, ..., each with its own clock."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.errors import LogError, listed
from stribeck.core.log.channels import CHANNELS
from stribeck.core.log.clock import TIME
from stribeck.core.settings import LogTable
from stribeck.io.readers.columns import group_of, source_of_columns
from stribeck.io.readers.join import KINDS, NANO, Stream, join
from stribeck.io.readers.mapping import ALIASES, asked_names
from stribeck.io.readers.recording import Recording, foreign
from stribeck.io.readers.tables import csv_table, find_layout, is_data, parquet_table

USUAL = {*CHANNELS, *(name for names in ALIASES.values() for name in names)}
"""Names that identify a channel."""


@dataclass(frozen=True)
class _File:
    """Content of a file: names of columns, labels by channel, values, and stamps [ns], if it has any."""

    name: str
    columns: Sequence[str]
    labels: Mapping[str, tuple[str, ...]]
    values: Mapping[str, Array]
    stamps: IntArray | None
    rows: int
    others: tuple[str, ...]
    notes: list[str]


def tables_in(path: Path) -> list[Path]:
    """List the tables of a folder."""
    return sorted(file for file in path.iterdir() if file.suffix.lower() in (".csv", ".parquet") and file.is_file())


def open_folder(path: Path, table: LogTable) -> Recording:
    """Open a folder of tables; a column `c` of `position.csv` corresponds to `position.c` in a single table.

    Raises
    ------
    LogError
        If a file is damaged, two contain the same signal, one has no time and not as many rows as `time.csv`, or none
        contains a name in `[log]`.
    """
    with foreign(str(path), "a folder of tables"):
        paths = tables_in(path)
    files = [_read(file, table) for file in paths]
    names = [name for file in files for name in file.columns]
    for channel in CHANNELS[1:]:  # without time
        exact = isinstance(getattr(table, channel).name, list)
        if absent := [name for name in asked_names(table, channel) if not _offers([name] if exact else name, names)]:
            raise LogError(f"{path}: [log.{channel}] name is {listed(absent)}; expected a name of {listed(names)}")
    timed = any(file.stamps is not None for file in files)
    clock = next((file for file in files if file.stamps is not None and Path(file.name).stem == "time"), None)
    streams = [stream for file in files for stream in _make_streams(file, clock, files, path)]
    for channel in KINDS:
        holders = {file.name: file.labels[channel] for file in files if channel in file.labels}
        if len(set[str]().union(*holders.values())) < sum(map(len, holders.values())):  # nameless columns are numbered
            same = f"'{channel}' of the same joints is in {listed(list(holders))}"
            raise LogError(f"{path}: {same}; expected one recording, and each joint in one file per channel")
    idle = [file.name for file in files if not file.labels and file is not clock]
    others = [*dict.fromkeys(name for file in files for name in file.others), *idle]
    remarks = dict.fromkeys(note for file in files for note in file.notes)
    here = {name: getattr(table, name).model_copy(update={"name": None}) for name in CHANNELS}  # names are of columns
    source = join(str(path), streams, others, table.model_copy(update=here), remarks=[*remarks])
    return replace(source, channels={name: own for name, own in source.channels.items() if timed or name != "time"})


def _make_streams(file: _File, clock: _File | None, files: Sequence[_File], path: Path) -> Iterator[Stream]:
    """Make one stream per channel of a file."""
    if file.labels and not file.rows:
        raise LogError(f"{path / file.name}: has column names but no rows; expected one row per sample")
    stamps = file.stamps if file.stamps is not None else _find_stamps(file, clock, files, path)
    for channel, labels in file.labels.items():
        yield Stream(file.name, "table", labels, stamps, {channel: file.values[channel]})


def _read(path: Path, settings: LogTable) -> _File:
    """Read a file; names that do not identify a channel get the file's name as a prefix."""
    if path.suffix.lower() == ".parquet":
        table = parquet_table(path)
    else:
        layout = find_layout(path)
        first = [f"[{k}]" for k in range(len(layout.cells))] if is_data(layout.cells) else layout.cells
        table = csv_table(path, first, layout)
    asked = {channel: name for channel in CHANNELS if (name := getattr(settings, channel).name) is not None}
    full = [_complete_name(name, path.stem, asked) for name in table.names]
    elsewhere = [channel for channel, name in asked.items() if not _offers(name, full)]
    names = {key: [each for each in name if each in full] for key, name in asked.items() if isinstance(name, list)}
    here = {key: getattr(settings, key).model_copy(update={"name": name}) for key, name in names.items()}
    here |= {key: getattr(settings, key).model_copy(update={"name": None}) for key in elsewhere}
    log_table = settings.model_copy(update=here)
    renamed = replace(
        table, names=full, places={name: table.places[column] for name, column in zip(full, table.names, strict=True)}
    )
    source = source_of_columns(renamed, log_table)
    channels = {name: channel for name, channel in source.channels.items() if name == "time" or name not in elsewhere}
    loaded, notes = source.load({name: range(channel.columns) for name, channel in channels.items()})
    rows = len(next(iter(loaded.values()), ()))
    stamps, unit = loaded.pop("time", None), source.time_unit or settings.time.unit
    return _File(
        name=path.name,
        columns=full,
        labels={
            name: channel.labels or tuple(map(str, range(channel.columns)))
            for name, channel in channels.items()
            if name != "time"
        },
        values={name: np.asarray(array, dtype=np.float64) for name, array in loaded.items()},
        stamps=None if stamps is None else _to_nanoseconds(stamps.ravel(), unit, str(path)),
        rows=rows,
        others=source.others,
        notes=notes,
    )


def _complete_name(name: str, stem: str, asked: Mapping[str, str | list[str]]) -> str:
    """Prefix a column's name with its file's name, unless it identifies a channel; `knee.csv` may be a joint's."""
    prefixes = [prefix for names in asked.values() for prefix in ([names] if isinstance(names, str) else names)]
    if stem == "time" and name.startswith("["):
        return "time"
    if name in USUAL - {"time", *ALIASES["time"]} and stem not in USUAL:
        return f"{name}.{stem}"
    if group_of(name) in USUAL or any(name.startswith(prefix) for prefix in prefixes):
        return name
    return f"{stem}{name}" if name.startswith("[") else f"{stem}.{name}"


def _offers(asked: str | list[str], names: Sequence[str]) -> bool:
    return any(name in names for name in asked) if isinstance(asked, list) else any(n.startswith(asked) for n in names)


def _to_nanoseconds(stamps: NDArray[np.generic], unit: str | None, path: str) -> IntArray:
    """Convert stamps to nanoseconds."""
    factor = TIME[unit or "s"] * NANO
    known = np.isfinite(stamps.astype(np.float64))
    if not known.all():
        raise LogError(f"{path}: row {int(np.argmin(known)) + 1} has no time; expected one in every row")
    largest = float(np.abs(stamps.astype(np.float64)).max(initial=0.0))
    if largest * factor > np.iinfo(np.int64).max:
        raise LogError(
            f"{path}: time goes up to {largest:.3g} {unit or 's'}; expected seconds, or the unit as [log.time] "
            f"unit, one of {listed(list(TIME))}"
        )
    if stamps.dtype.kind in "iu":
        return stamps.astype(np.int64) * round(factor)
    return np.round(stamps.astype(np.float64) * factor).astype(np.int64)


def _find_stamps(file: _File, clock: _File | None, files: Sequence[_File], path: Path) -> IntArray:
    """Find the stamps of a file without any: from the file of times, or its row numbers if no file has a time."""
    if not file.labels:
        return np.zeros(0, dtype=np.int64)
    if clock is not None and clock.stamps is not None:
        if len(clock.stamps) != file.rows:
            raise LogError(
                f"{path / file.name}: has {file.rows} rows and no time, but '{clock.name}' has {len(clock.stamps)}; "
                "expected as many rows, or a time column"
            )
        return clock.stamps
    if len({other.rows for other in files if other.labels}) > 1 or any(other.stamps is not None for other in files):
        raise LogError(
            f"{path / file.name}: contains no time; expected a column 'time', a file time.csv with as many rows, or "
            "[log] rate in Hz if no file has a time and all have the same number of rows"
        )
    return np.arange(file.rows, dtype=np.int64) * round(NANO)

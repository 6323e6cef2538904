"""LeRobot datasets (version 2 and 3): a folder of Parquet files with lists, and a JSON file with names of entries."""

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from stribeck.core.base.typing import Array
from stribeck.core.errors import LogError, listed
from stribeck.core.log.storage import check_size
from stribeck.core.settings import LogTable
from stribeck.io.readers.columns import OpenedTable, source_of_columns
from stribeck.io.readers.recording import Recording, foreign
from stribeck.io.readers.tables import parquet_table

INFO = Path("meta", "info.json")
STATE, STAMP = "observation.state", "timestamp"
_SHORT = {"position": "state pos", "velocity": "vel", "acceleration": "acc", "torque": "eff effort"}
_SHORT |= {"temperature": "temp"}
ENDINGS = {word: channel for channel, words in _SHORT.items() for word in (channel, *words.split())}
"""Ending of a feature, such as `observation.effort`, or of a name in the state, such as `elbow.pos` -> channel."""


def open_lerobot(path: Path, table: LogTable) -> Recording:
    """Open a dataset: `observation.state` and other features of joints, with all episodes concatenated.

    Raises
    ------
    LogError
        If its files do not fit together.
    """
    features, tables = _read_features(path), _open_tables(path)
    time, episodes = _concatenate_time(tables, table)
    with foreign(str(path / INFO), "LeRobot's info.json"):  # it may be nested without end
        names = _rename_columns(tables[0].names, features)
    stored = dict(zip(names, tables[0].names, strict=True))
    if twice := [name for name in stored if names.count(name) > 1]:
        raise LogError(f"{path / INFO}: contains {listed(twice)} twice; expected one entry per joint and channel")
    places = {name: tables[0].places[column] for name, column in stored.items()}
    whole = replace(
        tables[0],
        path=str(path),
        names=list(stored),
        places=places,
        rows=sum(part.rows for part in tables),
        read=partial(_read, tables, time),
        on_disk=False,
    )
    notes = [f"{episodes} episodes were concatenated, with a pause between them."][: max(0, episodes - 1)]
    if table.position.unit is None:
        notes.append(
            "LeRobot datasets do not state units, so positions are assumed to be in radians. For an arm that records "
            'degrees, set [log.position] unit = "deg"; for one that records normalized positions, its scale and offset.'
        )
    source = source_of_columns(whole, table, notes)
    return replace(
        source,
        others=tuple(name for name in source.others if name not in ("frame_index", "episode_index")),
        expected={
            "position": f"numbers in '{STATE}', named '<joint>.pos' or like the joints",
            "torque": f"a feature 'observation.effort', or names '<joint>.effort' in '{STATE}', present if the "
            "arm's driver reports efforts",
        },
    )


def _open_tables(path: Path) -> list[OpenedTable]:
    """Open the data of all episodes; refuse files with different columns."""
    files = [file for file in sorted(path.glob("data/**/*.parquet")) if file.is_file()]
    if not files:
        raise LogError(f"{path}: contains no data/chunk-000/*.parquet; expected the data next to the meta folder")
    tables = [parquet_table(file) for file in files]
    if not any(table.rows for table in tables):
        raise LogError(f"{path}: its {len(files)} Parquet files contain no rows; expected at least one episode")
    for other in tables[1:]:
        if other.names != tables[0].names:
            raise LogError(
                f"{other.path}: has columns {listed(other.names)}; expected the same as in {files[0].name}: "
                f"{listed(tables[0].names)}"
            )
    for table in tables:
        check_size(table.path, 8 * table.rows * len(table.names))
    return tables


def _read_features(path: Path) -> Mapping[str, Any]:
    """Read the features from the dataset's info.json."""
    where = path / INFO
    with foreign(str(where), "LeRobot's info.json"):
        info = json.loads(where.read_text(encoding="utf-8"))
    features = info.get("features") if isinstance(info, dict) else None
    if not isinstance(features, dict) or not all(isinstance(feature, dict) for feature in features.values()):
        raise LogError(f"{where}: contains no table 'features'; expected a LeRobot dataset of version 2 or 3")
    if STATE not in features:
        raise LogError(f"{where}: has features {listed(list(features))}; expected '{STATE}' among them")
    return features


def _rename_columns(columns: Sequence[str], features: Mapping[str, Any]) -> list[str]:
    """Rename columns as in tables: `<channel>.<joint>`, or `<feature>.<joint>` for other features."""
    names = []
    of_state = _list_names(features[STATE])
    for column in columns:
        feature, _, place = column.removesuffix("]").rpartition("[")
        if not feature or not place.isdecimal():
            names.append(column)
            continue
        width = sum(other.startswith(f"{feature}[") for other in columns)
        order = next((known for known in (_list_names(features.get(feature, {})), of_state) if len(known) == width), ())
        name = order[int(place)] if order else ""
        stem, dot, ending = name.rpartition(".")
        channel = ENDINGS.get(feature.removeprefix("observation."), feature)
        if dot and ending in ENDINGS:
            name, channel = stem, ENDINGS[ending] if feature == STATE else channel
        names.append(f"{channel}.{name}" if name else f"{channel}[{place}]")
    return names


def _list_names(feature: Mapping[str, Any]) -> tuple[str, ...]:
    """Collect the names of a feature's entries from a list, lists in a list, or lists in a table."""

    def flat(value: object) -> Iterator[str]:
        if isinstance(value, str):
            yield value
        elif isinstance(value, (list, dict)):
            for part in value.values() if isinstance(value, dict) else value:
                yield from flat(part)

    return tuple(flat(feature.get("names")))


def _concatenate_time(tables: Sequence[OpenedTable], table: LogTable) -> tuple[Array | None, int]:
    """Compute time [s] of all rows, with a pause between episodes, and count the episodes."""
    wanted = [STAMP, "episode_index"]
    if not set(wanted) <= set(tables[0].names):
        return None, 1
    batches = [batch for batch in _read(tables, None, wanted, wanted) if batch.num_rows]
    with foreign(tables[0].path, "a LeRobot dataset"):
        stamps, episode = (
            np.concatenate([np.asarray(batch[name], dtype=np.float64) for batch in batches]) for name in wanted
        )
    first = np.flatnonzero(np.diff(episode, prepend=np.nan) != 0)
    pause = max(1.0, 2 * (table.max_gap or 0.0))  # [s], because the stamps of each episode start at zero
    ends = np.concatenate([stamps[first[1:] - 1], stamps[-1:]]) - stamps[first] + pause
    shift = np.concatenate([[0.0], np.cumsum(ends)[:-1]]) - stamps[first] + stamps[first[0]]
    return stamps + np.repeat(shift, np.diff(first, append=len(stamps))), len(first)


def _read(
    tables: Sequence[OpenedTable], time: Array | None, columns: list[str], free: Collection[str]
) -> Iterator[pa.RecordBatch]:
    """Read columns of all files one after the other, with the computed time as the timestamp."""
    row = 0
    for table in tables:
        for batch in table.read(columns, free):
            if time is not None and STAMP in columns:
                stamps = pa.array(time[row : row + batch.num_rows])
                batch = batch.set_column(batch.schema.get_field_index(STAMP), STAMP, stamps)
            yield batch
            row += batch.num_rows

"""Store of a fleet: one Parquet file per log, in a folder per robot, readable at any time.

    STORE/robot=R1 -> .versions/R1.0/      a link, which `compact` exchanges
    STORE/robot=R1/<key>.parquet           one row: the log, with its joints, curves and so on as lists
    STORE/robot=R1/2026-03.parquet         rows of that month, merged by `compact`
    STORE/.damaged/R1.2026-03.parquet      a damaged file that a run has set aside

A file is written under a temporary name and renamed. A reader that has listed a folder can read its files until the
next but one compaction.
"""

import fcntl
import glob
import hashlib
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import duckdb
import pyarrow as pa
import pyarrow.parquet as pq

from stribeck.core.errors import SettingsError

NUMBER, TEXT, COUNT = pa.float64(), pa.string(), pa.int64()
TABLES = {
    "joints": {"joint": TEXT, "verdict": TEXT, "reason": TEXT, "samples": COUNT, "top_speed": NUMBER,
               "residual_rms": NUMBER, "torque_r2": NUMBER},
    "curves": {"joint": TEXT, "velocity": NUMBER, "friction": NUMBER, "standard_error": NUMBER, "low": NUMBER,
               "high": NUMBER, "unit": TEXT, "speed_unit": TEXT},
    "parameters": {"joint": TEXT, "parameter": TEXT, "value": NUMBER, "standard_error": NUMBER, "low": NUMBER,
                   "high": NUMBER, "unit": TEXT, "verdict": TEXT},
    "corrections": {"correction": TEXT, "of": TEXT, "value": NUMBER, "standard_error": NUMBER, "unit": TEXT},
    "findings": {"check": TEXT, "joints": pa.list_(TEXT), "text": TEXT, "remedy": TEXT},
}  # fmt: skip
"""Tables of a log, and their columns."""
SCHEMA = pa.schema({
    "key": TEXT, "log": TEXT, "sha256": TEXT, "size": COUNT, "modified": NUMBER, "robot_file": TEXT,
    "robot_sha256": TEXT, "start": pa.timestamp("us", "UTC"), "note": TEXT, "settings": TEXT, "version": TEXT,
    "status": TEXT, "error": TEXT, "duration": NUMBER, "seconds": NUMBER, "peak_memory": NUMBER,
    "finished": pa.timestamp("us", "UTC"),
    **{name: pa.list_(pa.struct(of)) for name, of in TABLES.items()},
})  # fmt: skip
"""Columns of the table of logs, and the tables of each log."""
IDENTIFIED = "identified"
"""Status of a log with a result; the others have an error, and a separate file, which the next try replaces."""


def key_of(*parts: str) -> str:
    """Name a row by everything it depends on: contents of log and robot file, settings, version."""
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]


def folder_of(store: Path, robot: str) -> Path:
    """Find the folder of a robot, and make it if needed."""
    link = store / f"robot={robot}"
    if not link.exists():
        version = store / ".versions" / f"{robot}.0"
        version.mkdir(parents=True, exist_ok=True)
        _link(version, link)
    return link


def row_of(store: Path, robot: str, key: str) -> dict[str, Any] | None:
    """Find the newest row of a key, in a separate file or a merged one; None if a robot's folder has no such row."""
    folder = store / f"robot={robot}"
    file = folder / f"{key}.parquet"
    # merged files have shorter names than keys
    files = [file] if file.exists() else [path for path in folder.glob("*.parquet") if len(path.stem) < len(key)]
    tables = (_read(path, filters=[("key", "=", key)]).to_pylist() for path in files)
    return next((rows[0] for rows in tables if rows), None)


def write_row(store: Path, robot: str, row: dict[str, Any]) -> None:
    """Write the row of a log, completely or not at all."""
    _write(pa.Table.from_pylist([row], SCHEMA), folder_of(store, robot) / f"{row['key']}.parquet")


def connect(store: str | Path) -> duckdb.DuckDBPyConnection:
    """Open a store for queries.

    Parameters
    ----------
    store
        Folder that `stribeck fleet` wrote.

    Returns
    -------
    connection
        DuckDB connection with the views `logs`, `joints`, `curves`, `parameters`, `corrections` and `findings`. A
        log that was identified again, for instance with other settings, has only its newest row there.

    Raises
    ------
    SettingsError
        If the folder is not a store.
    """
    _require_store(Path(store))
    connection = duckdb.connect()
    with naming_damaged_files(store):
        connection.execute(views(Path(store)))
    return connection


@contextmanager
def naming_damaged_files(store: str | Path) -> Iterator[None]:
    """Replace an error of DuckDB by one that names a damaged file of the store, if it has any.

    Raises
    ------
    SettingsError
        If a file is damaged.
    """
    try:
        yield
    except duckdb.Error as error:
        damaged = next((path for path in _files(Path(store)) if _damage(path)), None)
        if damaged is None:
            raise
        first = f"{damaged}: is damaged ({_damage(damaged)}); `stribeck fleet --compact {store}` sets it aside"
        raise SettingsError(f"{first}, and `stribeck fleet` repeats its logs") from error


def set_aside(store: Path) -> list[Path]:
    """Move damaged files to STORE/.damaged, so that a run repeats their logs; return their new paths."""
    moved = []
    for path in _files(store):
        if _damage(path):
            target = store / ".damaged" / f"{path.parent.name.removeprefix('robot=')}.{path.name}"
            target.parent.mkdir(exist_ok=True)
            moved.append(path.replace(target))
    return moved


def _files(store: Path) -> list[Path]:
    return sorted(store.glob("robot=*/*.parquet"))


def _read(path: Path, **more: Any) -> pa.Table:
    return pq.read_table(path, schema=SCHEMA, partitioning=None, **more)


def _damage(path: Path) -> str:
    """Describe the damage of a file; "" for a sound one."""
    try:
        rows = _read(path)
        rows.validate(full=True)  # text is UTF-8, ends of lists are in order
        missing = [name for name in ("key", "start", "status", "sha256", "finished") if rows[name].null_count]
    except (pa.ArrowException, OSError, ValueError) as error:
        return str(error).rpartition("': ")[2].partition(". ")[0].partition("\n")[0] or "unreadable"
    return f"rows without {missing[0]}" if missing else ""


def _require_store(folder: Path) -> None:
    if not any(folder.glob("robot=*/*.parquet")):
        raise SettingsError(f"{folder}: is no store; expected a folder that `stribeck fleet` wrote")


def views(store: Path) -> str:
    """Write the SQL of the views, for DuckDB."""
    files = (glob.escape(str(store.absolute())) + "/robot=*/*.parquet").replace("'", "''")
    last = "QUALIFY row_number() OVER (PARTITION BY sha256, robot ORDER BY finished DESC) = 1"
    robot = "regexp_extract(filename, 'robot=([^/]+)/[^/]+$', 1) AS robot"  # DuckDB's partitions include outer folders
    read = f"read_parquet('{files}', filename = true, hive_partitioning = false, union_by_name = true)"
    read = f"(SELECT * EXCLUDE (filename), {robot} FROM {read} WHERE start IS NOT NULL)"
    newest = f"{read} AS rows SEMI JOIN (SELECT key, robot, finished FROM {read} {last}) USING (key, robot, finished)"
    queries = {"newest": f"SELECT * FROM {newest}", "logs": f"SELECT * EXCLUDE ({', '.join(TABLES)}) FROM newest"}
    queries |= {name: f"SELECT key, robot, start, unnest({name}, recursive := true) FROM newest" for name in TABLES}
    return "".join(f"CREATE OR REPLACE TEMP VIEW {name} AS {query};\n" for name, query in queries.items())


def compact(store: Path) -> tuple[int, int, list[Path]]:
    """Merge the files of each robot and month; logs without a result keep their own files.

    Returns
    -------
    before, after
        Number of files.
    damaged
        Damaged files that were set aside.

    Raises
    ------
    SettingsError
        If the folder is not a store, or a run writes to it.
    """
    _require_store(store)
    with locked(store):
        damaged = set_aside(store)
        files = {link: sorted(link.glob("*.parquet")) for link in sorted(store.glob("robot=*"))}
        after = sum(_compact_robot(store, link, paths) for link, paths in files.items() if paths)
    return sum(map(len, files.values())), after, damaged


def _compact_robot(store: Path, link: Path, files: list[Path]) -> int:
    """Write a new version of a robot's folder, exchange the link, and remove the versions before the last."""
    robot, versions = link.name.removeprefix("robot="), store / ".versions"
    versions.mkdir(exist_ok=True)
    paths = {path.name.removeprefix(f"{robot}."): path for path in versions.glob(f"{robot}.*")}
    paths = {number: path for number, path in paths.items() if number.isdecimal()}
    free = max(map(int, paths), default=-1) + 1
    last, version = link.resolve(), versions / f"{robot}.{free + 1}"
    version.mkdir()
    rows = pa.concat_tables([_read(path) for path in files]).sort_by("finished")
    keys, starts, states = (rows[name].to_pylist() for name in ("key", "start", "status"))
    merged: dict[str, list[int]] = {}
    for key, number in {key: number for number, key in enumerate(keys)}.items():  # corrected rows come last
        name = f"{starts[number]:%Y-%m}" if states[number] == IDENTIFIED else key
        merged.setdefault(name, []).append(number)
    for name, numbers in merged.items():
        _write(rows.take(numbers), version / f"{name}.parquet")
    if not link.is_symlink():  # the store was copied without links
        last = link.rename(versions / f"{robot}.{free}").resolve()
    _link(version, link)
    for path in paths.values():
        if path.resolve() != last:
            shutil.rmtree(path, ignore_errors=True)
    return len(merged)


@contextmanager
def locked(store: Path) -> Iterator[None]:
    """Keep other runs from writing to a store; the system ends the lock of a process that dies.

    Raises
    ------
    SettingsError
        If another process writes to the store.
    """
    store.mkdir(parents=True, exist_ok=True)
    with (store / ".lock").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise SettingsError(f"{store}: another `stribeck fleet` writes to it; wait until it has ended") from error
        yield


def _write(table: pa.Table, path: Path) -> None:
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    try:
        pq.write_table(table, temporary, compression="zstd")
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def _link(version: Path, link: Path) -> None:
    temporary = link.with_name(f".{link.name}.{secrets.token_hex(4)}")
    temporary.symlink_to(Path(".versions") / version.name)
    temporary.replace(link)


def time_of(seconds: float) -> datetime:
    """Convert seconds since 1970 to a time in UTC."""
    return datetime.fromtimestamp(seconds, UTC)

"""Formats of logs: each file or folder has a reader, chosen by suffix and content."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from stribeck.core.base.outputs import check_name
from stribeck.core.base.parts import Parts
from stribeck.core.errors import LogError, listed
from stribeck.core.log.storage import EXPANSION, IN_MEMORY_LIMIT, stored_bytes
from stribeck.core.settings import LogTable
from stribeck.io.readers.folder import open_folder, tables_in
from stribeck.io.readers.lerobot import INFO, open_lerobot
from stribeck.io.readers.recording import Recording, foreign

FORMATS = Parts[Callable[[Path, LogTable], Recording]]("stribeck.readers")
"""Readers by suffix. A rosbag2 is a folder with a metadata.yaml, a LeRobot dataset a folder with a meta/info.json."""


def open_log(path: Path, table: LogTable) -> Recording:
    """Open a log with the reader of its format, without reading its samples.

    Raises
    ------
    LogError
        If it is missing, damaged or of an unknown format.
    """
    return choose_opener(path)(path, table)


def choose_opener(path: Path) -> Callable[[Path, LogTable], Recording]:
    """Choose the reader of a file by its suffix, and of a folder by its content."""
    check_name(path)
    with foreign(str(path), "a log"):
        size = path.stat().st_size if path.exists() else None
        files = sorted(path.iterdir()) if path.is_dir() else [path]
        strange = next((file for file in files if file.exists() and not (file.is_file() or file.is_dir())), None)
    if size is None:
        raise LogError(f"{path}: no such file; expected a log")
    if strange:  # reading it may never end
        raise LogError(f"{strange}: is a pipe, a device or a socket; expected a log file, or a rosbag2 folder")
    if path.is_dir():
        if (path / "metadata.yaml").is_file() or any(file.suffix.lower() in (".db3", ".mcap") for file in files):
            return FORMATS[".bag"]
        if (path / INFO).is_file():
            return open_lerobot
        if tables := tables_in(path):
            for table in tables:
                _check_whole(table)
            return open_folder
        raise LogError(
            f"{path}: is a folder without metadata.yaml, {INFO} or tables; expected a log file, a rosbag2 folder, a "
            "LeRobot dataset, or a folder with one .csv or .parquet file per channel"
        )
    if path.suffix.lower() not in FORMATS:
        raise LogError(
            f"{path}: unknown suffix '{path.suffix}'; expected {listed(list(FORMATS), 20)}, a rosbag2 folder or a "
            f"LeRobot dataset{'; the page of log formats shows how to convert PyTorch' * (path.suffix == '.pt')}"
        )
    _check_whole(path)
    return FORMATS[path.suffix.lower()]


def _check_whole(path: Path) -> None:
    """Refuse a file that is empty, cannot be opened, or consists mostly of a hole."""
    with foreign(str(path), "a log"):
        size = path.stat().st_size
        if size == 0:
            raise LogError(f"{path}: is empty; expected a log")
        path.open("rb").close()
        stored = stored_bytes(path)
    if size > max(IN_MEMORY_LIMIT, EXPANSION * stored):
        raise LogError(f"{path}: is {size:.2g} bytes long, but only {stored} are on the disk; expected a complete file")

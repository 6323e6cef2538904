"""Jobs of a fleet: which log belongs to which robot, from paths, globs, URLs or a manifest."""

import csv
import io
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any

import fsspec

from stribeck.core.base.files import read_text
from stribeck.core.errors import LogError, SettingsError
from stribeck.io import FORMATS

COLUMNS = ("log", "robot_file", "robot", "start", "note")
"""Columns of a manifest; the last two are optional."""


@dataclass(frozen=True, kw_only=True)
class Job:
    """Log of a robot.

    Attributes
    ----------
    log
        Path or URL.
    size, modified
        Bytes, and time of the last change [s since 1970]; 0 if unknown.
    robot_file
        Path of the robot file.
    robot
        Robot id, e.g. the serial number.
    start
        Start of the log [s since 1970]: of the manifest, or the time of the last change.
    note
        Note of the manifest.
    """

    log: str
    size: int
    modified: float
    robot_file: str
    robot: str
    start: float
    note: str = ""


def jobs_of_logs(logs: Sequence[str], robot_file: Path) -> list[Job]:
    """List the logs at paths, globs and URLs; folders are searched. The folder of a log is its robot's id.

    Raises
    ------
    LogError
        If a place has no log, or the name of its folder cannot be a robot id.
    """
    jobs = []
    for place in logs:
        batch = [_job(url, info, str(robot_file)) for url, info in _logs_at(place)]
        if not batch:
            raise LogError(f"{place}: has no log; expected {', '.join(FORMATS)} files, or folders that have some")
        jobs += batch
    return list({job.log: job for job in jobs}.values())


def jobs_of_manifest(path: Path) -> list[Job]:
    """List the logs of a manifest, a CSV table with a header; relative paths start at its folder.

    Raises
    ------
    SettingsError
        If columns or values are missing or wrong.
    LogError
        If a log does not exist.
    """
    table = csv.DictReader(io.StringIO(read_text(path, "a manifest (CSV)", SettingsError), newline=""))
    try:
        rows = [(table.line_num, row) for row in table]
    except csv.Error as error:
        raise SettingsError(f"{path}: line {table.line_num}: {error}; expected a CSV table") from error
    if not rows or not set(COLUMNS[:3]) <= set(table.fieldnames or ()):
        raise SettingsError(f"{path}: expected a header with the columns {', '.join(COLUMNS)} (the last two optional)")
    jobs = []
    for line, row in rows:
        where = f"{path}: line {line}"
        if missing := [name for name in COLUMNS[:3] if not row[name]]:
            raise SettingsError(f"{where}: has no '{missing[0]}'; expected a log, its robot file and its robot's id")
        log = row["log"] if "://" in row["log"] else str(path.parent / row["log"])
        places = list(_logs_at(log))
        if len(places) != 1:
            raise LogError(f"{where}: {log} is {len(places)} logs; expected one log per line")
        job = _job(*places[0], str(path.parent / row["robot_file"]), row["robot"], row.get("note") or "")
        jobs.append(job if not row.get("start") else _started(job, row["start"], where))
    return jobs


def _started(job: Job, text: str, where: str) -> Job:
    try:
        start = datetime.fromisoformat(text).timestamp()
    except (ValueError, OverflowError) as error:
        raise SettingsError(f"{where}: start is '{text}'; expected a time such as 2026-03-01T12:30:00+00:00") from error
    return replace(job, start=start)


def _logs_at(place: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """Find the logs at a place: path or URL, with size and times from the file system."""
    if re.match(r"s?ftp://(/|$)", place):  # fsspec would print a traceback
        raise LogError(f"{place}: has no host; expected an address such as ftp://HOST/FOLDER")
    try:
        files, root = fsspec.core.url_to_fs(place)
        paths = sorted(files.glob(root)) if "*" in root else [root]
        for path in paths:
            if files.isdir(path):
                yield from _logs_in(files, path)
            elif files.exists(path) and (len(paths) == 1 or Path(path).suffix.lower() in FORMATS):
                yield _named(files, path), files.info(path)
    except Exception as error:  # file systems differ in what they raise
        raise LogError(f"{place}: cannot be listed ({error}); expected a path or a URL that fsspec opens") from error


def _logs_in(files: Any, folder: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """Find the logs in a folder and its folders, except in stores of fleets; some folders are one log."""
    inside = files.find(folder, detail=True)
    stores = [path.removesuffix(".lock") for path in inside if path.endswith("/.lock")]
    rows = tuple(store + part for store in stores for part in ("robot=", ".versions/", ".damaged/"))
    inside = {path: info for path, info in inside.items() if not path.startswith(rows)}
    marks = ("/metadata.yaml", "/meta/info.json")  # of rosbag2 and LeRobot
    whole = {path.removesuffix(mark) for path in inside for mark in marks if path.endswith(mark)}
    for log in sorted(whole):
        parts = [info for path, info in inside.items() if path.startswith(f"{log}/")]
        size, modified = sum(info["size"] for info in parts), max(_modified(info) for info in parts)
        yield _named(files, log), {"size": size, "mtime": modified}
    for path, info in sorted(inside.items()):
        if Path(path).suffix.lower() in FORMATS and not any(path.startswith(f"{log}/") for log in whole):
            yield _named(files, path), info


def _named(files: Any, path: str) -> str:
    return path if "file" in files.protocol else files.unstrip_protocol(path)


def _job(url: str, info: dict[str, Any], robot_file: str, robot: str = "", note: str = "") -> Job:
    robot = robot or Path(os.path.abspath(url.partition("://")[2] or url)).parent.name
    if not re.fullmatch("[A-Za-z0-9][A-Za-z0-9._-]*", robot):  # it names a folder of the store
        raise LogError(
            f"{url}: its robot's id is '{robot}'; expected letters, digits, '.', '_', '-'; a manifest can name it"
        )
    modified = _modified(info)
    size = int(info.get("size") or 0)
    return Job(log=url, size=size, modified=modified, robot_file=robot_file, robot=robot, start=modified, note=note)


def _modified(info: dict[str, Any]) -> float:
    """Find the time of the last change [s since 1970], which file systems name differently; 0 if unknown."""
    names = ("mtime", "LastModified", "last_modified", "updated", "created")
    stamp = next((info[name] for name in names if name in info), 0)
    if isinstance(stamp, str):
        stamp = datetime.fromisoformat(stamp)
    return stamp.timestamp() if isinstance(stamp, datetime) else float(stamp or 0)

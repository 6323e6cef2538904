"""Values of the command line: lists of names, parts of logs, overridden settings."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stribeck.errors import SettingsError

if TYPE_CHECKING:
    from stribeck.log import RobotLog
    from stribeck.robot import Robot
    from stribeck.settings import Settings

RESULT, REPORT, TABLE = "result.json", "report.html", "friction_torque.parquet"


def split_names(text: str | None) -> list[str] | None:
    """Split the names of a list `a,b,c`."""
    return None if text is None else [name.strip() for name in text.split(",")]


def part_of(path: Path, robot: Robot, start: float | None, stop: float | None) -> RobotLog | Path:
    """Read the part of a log between `start` and `stop` [s after its start]; without limits, return its path."""
    if start is None and stop is None:
        return path
    low, high = start or 0.0, float("inf") if stop is None else stop
    if not 0 <= low < high:
        raise SettingsError(f"--from is {low:g} s and --to is {high:g} s; expected 0 <= --from < --to")
    from stribeck.log.readers import read_log

    return read_log(path, robot).between(start, stop)


def with_settings(settings: Settings, options: dict[str, str | None], assignments: list[str]) -> Settings:
    """Override settings by options of the command line and by `key.key=value` assignments (TOML values).

    Raises
    ------
    SettingsError
        If an assignment is malformed, or a key or value is not valid.
    """
    from pydantic import ValidationError

    from stribeck.settings import Settings, describe, parse_toml

    document: dict[str, Any] = settings.model_dump(exclude_unset=True)
    document.update({key: value for key, value in options.items() if value is not None})
    for assignment in assignments:
        key, equals, text = assignment.partition("=")
        if not equals:
            raise SettingsError(f"--set {assignment}: expected KEY=VALUE, e.g. filter.window=31")
        try:
            value = parse_toml(f"value = {text}")["value"]
        except tomllib.TOMLDecodeError:
            value = text
        except ValueError as error:
            raise SettingsError(f"--set {key}: {error}; expected a value of [identify]") from error
        place = document
        *tables, last = key.strip().split(".")
        for table in tables:
            place = place.setdefault(table, {})
            if not isinstance(place, dict):
                raise SettingsError(f"--set {assignment}: '{table}' is not a table of settings")
        place[last] = value
    try:
        return Settings.model_validate(document)
    except ValidationError as error:
        raise SettingsError(f"settings: {describe(error, Settings)}") from error


def robot_of(path: Path, exclude: list[str]) -> Robot:
    """Read a robot file, and add spans A:B or LOG:A:B to its `[log] exclude`."""
    from stribeck.robot import Robot
    from stribeck.settings import LogTable

    robot = Robot.from_file(path)
    found: list[Any] = list(robot.log_table.exclude)
    for text in exclude:
        try:
            *name, start, end = text.rsplit(":", 2)
            found += LogTable(exclude=[(*name, float(start), float(end))]).exclude
        except (ValueError, SettingsError) as error:
            expected = "expected START:END in seconds, e.g. 40:70, or LOG:START:END"
            raise SettingsError(f"--exclude {text}: {expected}") from error
    return replace(robot, log_table=robot.log_table.model_copy(update={"exclude": found}))


def files_of(robot: Robot) -> list[Path]:
    """List the robot file and its model file."""
    return [Path(robot.path), robot.model_file]


def result_file(path: Path) -> Path:
    """Return the path of a result, given the file or its folder."""
    return path / RESULT if path.is_dir() else path

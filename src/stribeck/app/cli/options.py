"""Arguments and options that commands share, their values, and the files of a result."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand

from stribeck.core.base.outputs import check_name, check_outputs
from stribeck.core.base.parts import Parts
from stribeck.core.errors import SettingsError

if TYPE_CHECKING:
    from stribeck.core.equations.friction_torque.preparation import Progress
    from stribeck.core.log import RobotLog
    from stribeck.core.result import Result
    from stribeck.core.robot import Robot
    from stribeck.core.settings import Settings

RESULT, REPORT, TABLE = "result.json", "report.html", "friction_torque.parquet"
FORMATS_READ = "Log: npz, h5, mat, csv, parquet, mcap or bag file, or a folder (rosbag2, LeRobot)."


def argument(metavar: str, text: str, **more: Any) -> Any:
    """Build an argument with its help."""
    return typer.Argument(metavar=metavar, help=text, **more)


def option(metavar: str, text: str, *flags: str, **more: Any) -> Any:
    """Build an option with a value and its help; without flags, its parameter names it."""
    return typer.Option(*flags, metavar=metavar, help=text, **more)


def flag(name: str, text: str) -> Any:
    """Build an option without a value, and without an opposite."""
    return typer.Option(name, help=text)


def output_option(metavar: str, text: str) -> Any:
    """Build the option `--output`, `-o`."""
    return option(metavar, text, "--output", "-o")


def robot_option(text: str) -> Any:
    """Build the option `--robot`, `-r`."""
    return option("FILE", text, "--robot", "-r")


def _choice(metavar: str, text: str, names: Sequence[str], default: str = "", *flags: str) -> Any:
    """Build an option whose help and completion list its values; `default` applies without a robot file's entry."""
    text += f": {', '.join(names)}." + f"  [default: {default}, or as in the robot file]" * bool(default)
    return option(metavar, text, *flags, autocompletion=lambda: names)


def result_file(path: Path) -> Path:
    """Return the path of a result, given the file or its folder."""
    return path / RESULT if path.is_dir() else path


Logs = Annotated[list[Path], argument("LOG", FORMATS_READ)]
LogFile = Annotated[Path, argument("LOG", FORMATS_READ)]
ResultFile = Annotated[Path, argument("RESULT", "A result.json written by `stribeck identify`.", callback=result_file)]
Page = Annotated[Path | None, output_option("FILE", "Also write the result as an HTML page.")]
Recording = Annotated[Path | None, option("FILE", "Also write a .rrd file for Rerun.", "--rerun")]
RobotFile = Annotated[Path, robot_option("Robot file (robot.toml).")]
ItsRobot = Annotated[Path | None, robot_option("Robot file (robot.toml).  [default: that of the identification]")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print only errors (and JSON with --json).")]
Json = Annotated[bool, flag("--json", "Print the result as JSON on stdout.")]
Set = Annotated[
    list[str], option("KEY=VALUE", "Override a setting of [identify], e.g. --set filter.window=31.", "--set")
]
LAW_NAMES = (*Parts[object]("stribeck.laws"), *Parts[object]("stribeck.laws_with_state"), "auto")
METHOD_NAMES = tuple(Parts[object]("stribeck.methods"))
TARGETS = tomllib.loads((Path(__file__).parents[1] / "exporters/targets.toml").read_text(encoding="utf-8"))
FORMATS = [*TARGETS, *Parts[object]("stribeck.targets")]
Force = Annotated[bool, flag("--force", "Continue although the audit found a fatal error.")]
From = Annotated[float | None, option("SECONDS", "Start of the used part of each log.", "--from")]
To = Annotated[float | None, option("SECONDS", "End of the used part of each log.", "--to")]
Exclude = Annotated[
    list[str], option("A:B", "Span of each log that is not used [s], or LOG:A:B; repeatable.", "--exclude")
]
Overwrite = Annotated[bool, flag("--overwrite", "Overwrite existing outputs.")]
Law = Annotated[str | None, _choice("NAME", "Friction law", LAW_NAMES, "auto")]
Method = Annotated[str | None, _choice("NAME", "Estimation method", METHOD_NAMES, "whole-log")]
Format = Annotated[str, _choice("FORMAT", "Format", FORMATS, "", "--to", "--format")]
Form = Annotated[
    str | None,
    option("FORM", "Friction model. mjcf: plain or lugre  [default: plain]; yaml: all or plain  [default: all]."),
]
Inertia = Annotated[
    str | None,
    _choice(
        "HOW",
        "Inertias of a robot model; by default written if they lower the held-out torque error",
        ("keep", "write"),
    ),
]
Planned = Annotated[str | None, option("NAMES", "Comma-separated joints.  [default: all weak or not excited]")]
Held = Annotated[str | None, option("AXIS", "Base axis that points up: x, -x, y, ...; if a floating base is held.")]


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
    from stribeck.io import read_log

    return read_log(path, robot).between(start, stop)


def with_settings(settings: Settings, options: dict[str, str | None], assignments: list[str]) -> Settings:
    """Override settings by options of the command line and by `key.key=value` assignments (TOML values).

    Raises
    ------
    SettingsError
        If an assignment is malformed, or a key or value is not valid.
    """
    from pydantic import ValidationError

    from stribeck.core.base.checked_table import describe
    from stribeck.core.base.toml import parse_toml
    from stribeck.core.settings import Settings

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


def robot_of(path: Path, exclude: list[str], logs: list[Path]) -> Robot:
    """Read a robot file, and add spans A:B or LOG:A:B of some logs to its `[log] exclude`."""
    from stribeck.core.base.spans import names_log
    from stribeck.core.robot import Robot
    from stribeck.core.settings import LogTable

    robot = Robot.from_file(path)
    spans: list[Any] = list(robot.log_table.exclude)
    for text in exclude:
        try:
            *name, start, end = text.rsplit(":", 2)
            spans += LogTable.model_validate({"exclude": [(*name, float(start), float(end))]}).exclude
        except (ValueError, SettingsError) as error:
            expected = "expected START:END in seconds, e.g. 40:70, or LOG:START:END"
            raise SettingsError(f"--exclude {text}: {expected}") from error
        if name and not any(names_log(name[0], str(log)) for log in logs):
            given = ", ".join(map(str, logs))
            raise SettingsError(f"--exclude {text}: '{name[0]}' is none of the logs; expected a name of {given}")
    return replace(robot, log_table=robot.log_table.model_copy(update={"exclude": spans}))


def files_of(robot: Robot) -> list[Path]:
    """List the robot file and its model file."""
    return [*([Path(robot.path)] if robot.path else []), robot.model_file]


def check_files(outputs: Iterable[Path], inputs: Sequence[Path], overwrite: bool) -> None:
    """Refuse missing inputs, and the outputs that `check_outputs` refuses."""
    for path in inputs:
        check_name(path)
        if not path.exists():
            raise SettingsError(f"{path}: no such file; check the path")
    check_outputs(outputs, inputs, overwrite)


def write_result(result: Result, folder: Path, progress: Progress, **shown: Any) -> None:
    """Write result.json and report.html; `shown` are options of the report."""
    from stribeck.app.report import write_report

    progress("writing the report", 0.9)
    (folder / RESULT).write_text(result.to_json(), encoding="utf-8")
    write_report(result, folder / REPORT, **shown)


def planned_robot(source: str, robot: Path | None, held: str | None) -> tuple[Path | None, Robot]:
    """Find the result to plan from, None before the first log, and the robot; a model stands still or is held."""
    from stribeck.core.result import read_result
    from stribeck.core.robot import Robot

    if source.endswith(".json") or Path(source).is_dir():
        return result_file(Path(source)), read_result(source).find_robot(robot)
    if robot is not None:
        raise SettingsError(f"plan: {source} is no result.json; expected one with --robot, or a robot without")
    if source.endswith(".toml"):
        return None, Robot.from_file(source)
    return None, Robot.from_model(source, base="floating" if held else "fixed")


class Command(TyperCommand):
    """A command whose help shows `LOG...` instead of `{LOG}...`, and no Python types."""

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """List the parts of the usage line without braces."""
        return [piece.replace("{", "").replace("}", "") for piece in super().collect_usage_pieces(ctx)]

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the tables of arguments and options."""
        for title, kind in (("Arguments", "argument"), ("Options", "option")):
            parameters = [parameter for parameter in self.get_params(ctx) if parameter.param_type_name == kind]
            records = [record for parameter in parameters if (record := parameter.get_help_record(ctx))]
            if records:
                with formatter.section(title):
                    formatter.write_dl([(name.partition(" <")[0], text) for name, text in records])

"""The command line: parses, calls, prints."""

from __future__ import annotations

import signal
import sys
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from pydantic import ValidationError
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from stribeck import console
from stribeck.errors import SettingsError, StribeckError
from stribeck.export import TARGETS
from stribeck.export import export as write_model
from stribeck.friction import AUTO, LAWS
from stribeck.methods import METHODS
from stribeck.outputs import staged_folder
from stribeck.result import Result, read_result
from stribeck.robot import Robot
from stribeck.settings import Settings, describe
from stribeck.version import __version__

app = typer.Typer(add_completion=False, no_args_is_help=True, rich_markup_mode=None, pretty_exceptions_enable=False)

Logs = Annotated[list[Path], typer.Argument(metavar="LOG...", help="npz, h5, csv, parquet, mcap, bag, rosbag2 folder.")]
RobotOption = Annotated[Path, typer.Option("--robot", "-r", help="The robot file (robot.toml).")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON on stdout, and nothing else there.")]
SetOption = Annotated[
    list[str], typer.Option("--set", metavar="KEY=VALUE", help="A setting of [identify], e.g. --set filter.window=31.")
]
RESULT, REPORT, TABLE = "result.json", "report.html", "friction_torque.parquet"


@app.callback(invoke_without_command=True)
def stribeck(
    version: Annotated[bool, typer.Option("--version", "-V", help="Print the version.")] = False,
) -> None:
    """Joint friction of legged robots and arms, from the logs they already record."""
    if version:
        typer.echo(__version__)
        raise typer.Exit


@app.command()
def identify(
    logs: Logs,
    robot: RobotOption,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for result, report and friction torque.")],
    law: Annotated[str | None, typer.Option(help=f"Friction law: {', '.join([*LAWS, AUTO])}.")] = None,
    method: Annotated[str | None, typer.Option(help=f"How to fit: {', '.join(METHODS)}.")] = None,
    settings: SetOption = [],  # noqa: B006
    json: JsonOption = False,
) -> None:
    """Find the friction of every joint: writes result.json, report.html and friction_torque.parquet."""
    from stribeck.pipeline import identify as run
    from stribeck.report import write_report

    machine = Robot.from_file(robot)
    chosen = with_settings(machine.settings, {"law": law, "method": method}, settings)
    with staged_folder(output) as staging, progress_bar() as progress:
        result = run(logs, machine, chosen, table=staging / TABLE, progress=progress)
        progress("writing the report", 0.9)
        (staging / RESULT).write_text(result.to_json(), encoding="utf-8")
        write_report(result, staging / REPORT)
    if json:
        typer.echo(result.to_json(), nl=False)
    else:
        console.print_result(result)
        console.print_paths([output / name for name in (RESULT, REPORT, TABLE)])


@app.command()
def inspect(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="The log.")],
    robot: RobotOption,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Write an HTML page here.")] = None,
    settings: SetOption = [],  # noqa: B006
    json: JsonOption = False,
) -> None:
    """Show what a log holds: rate, gaps, channels, support phases, ranges, delays and signs."""
    from stribeck.inspection import inspect_log
    from stribeck.report.inspection import write_inspection

    machine = Robot.from_file(robot)
    with progress_bar() as progress:
        progress("inspecting", 0.1)
        found = inspect_log(log, machine, with_settings(machine.settings, {}, settings))
    if output is not None:
        write_inspection(found, output)
    if json:
        typer.echo(found.to_json(), nl=False)
    else:
        console.print_inspection(found)
        console.print_paths([output] if output else [])


@app.command()
def export(
    result: Annotated[Path, typer.Argument(metavar="OUT/result.json", help="What was found.")],
    robot: RobotOption,
    to: Annotated[str, typer.Option(help=f"Format, that of the robot's model: {', '.join(TARGETS)}.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="The model file to write.")],
) -> None:
    """Write the robot's model with the inertias and the friction that were found."""
    lines = write_model(read_result(_result_file(result)), Robot.from_file(robot), output, to)
    typer.echo("\n".join(lines))
    console.print_paths([output])


@app.command()
def compare(
    first: Annotated[Path, typer.Argument(metavar="A/result.json", help="A result.")],
    second: Annotated[
        Path | None, typer.Argument(metavar="[B/result.json]", help="Another one; without it, left against right of A.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Show what changed between two results, or between left and right of one."""
    from stribeck.compare import compare as compare_results
    from stribeck.compare import compare_sides

    a = read_result(_result_file(first))
    found = compare_sides(a) if second is None else compare_results(a, read_result(_result_file(second)))
    if json:
        typer.echo(found.to_json(), nl=False)
    else:
        console.print_comparison(found)


@app.command()
def simulate(
    scenario: Annotated[Path, typer.Argument(metavar="SCENARIO.toml", help="What happens.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="The log (.npz); its truth is written beside it.")],
) -> None:
    """Make a log of a simulated robot, with its truth beside it."""
    from stribeck.simulation.files import write_simulated
    from stribeck.simulation.run import run_scenario
    from stribeck.simulation.scenario import read_scenario

    if output.suffix != ".npz":
        raise SettingsError(f"--output {output}: the suffix is '{output.suffix}'; simulated logs are written as .npz")
    with progress_bar() as progress:
        found = run_scenario(
            read_scenario(scenario), scenario.parent, lambda share: progress(f"simulating {scenario.stem}", share)
        )
    truth = write_simulated(found.log, found.truth, output)
    console.print_paths([output, truth, Path(found.robot.path)])


@app.command()
def demo(
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for the log and what is found in it.")] = Path(
        "demo"
    ),
) -> None:
    """Let a simulated humanoid walk, find its friction from its log, and compare it with the truth."""
    from stribeck.pipeline import identify as run
    from stribeck.report import write_report
    from stribeck.simulation.demo import make_demo
    from stribeck.simulation.truth import with_truth

    with staged_folder(output) as staging, progress_bar() as progress:
        example = make_demo(staging, lambda share: progress("simulating a walk", share))
        machine = Robot.from_file(example.robot_file)
        result = run([example.log], machine, table=staging / TABLE, progress=progress)
        result = _moved(result, str(staging), str(output))
        progress("writing the report", 0.9)
        (staging / RESULT).write_text(result.to_json(), encoding="utf-8")
        write_report(with_truth(result, example.law, example.parameters, example.walk), staging / REPORT)
    console.print_truth(result, example.parameters)
    console.print_paths([output / name for name in (example.log.name, RESULT, TABLE, REPORT)])


def _moved(result: Result, staging: str, output: str) -> Result:
    """Return a result that knows its one log and its robot file where they end up."""
    assert isinstance(result.log.path, str)
    assert result.evidence is not None
    provenance = [(label, text.replace(staging, output)) for label, text in result.evidence.provenance]
    return replace(
        result,
        log=replace(result.log, path=result.log.path.replace(staging, output)),
        evidence=replace(result.evidence, provenance=provenance),
    )


def with_settings(settings: Settings, options: dict[str, str | None], assignments: list[str]) -> Settings:
    """Return the settings with options of the command line, and `key.key=value` assignments (TOML values), put in.

    Raises
    ------
    SettingsError
        If an assignment is malformed, or a key or value is not valid.
    """
    document: dict[str, Any] = settings.model_dump(exclude_unset=True)
    document.update({key: value for key, value in options.items() if value is not None})
    for assignment in assignments:
        key, equals, text = assignment.partition("=")
        if not equals:
            raise SettingsError(f"--set {assignment}: expected KEY=VALUE, e.g. filter.window=31")
        try:
            value = tomllib.loads(f"value = {text}")["value"]
        except tomllib.TOMLDecodeError:
            value = text
        place = document
        *tables, last = key.strip().split(".")
        for table in tables:
            place = place.setdefault(table, {})
            if not isinstance(place, dict):
                raise SettingsError(f"--set {assignment}: '{table}' is not a table of settings")
        place[last] = value
    try:
        chosen = Settings.model_validate(document)
    except ValidationError as error:
        raise SettingsError(f"settings: {describe(error)}") from error
    return chosen


def _result_file(path: Path) -> Path:
    return path / RESULT if path.is_dir() else path


@contextmanager
def progress_bar() -> Iterator[Any]:
    """Give a function to call with a stage and its share; it draws on stderr if that is a terminal."""
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console.ERRORS, transient=True, disable=not console.ERRORS.is_terminal) as progress:
        task = progress.add_task("starting", total=1.0)
        yield lambda stage, share: progress.update(task, description=stage, completed=share)


class Interrupted(BaseException):
    """The user or the system asks to stop; what is half written is taken away on the way out."""


def _stop(*_: object) -> NoReturn:
    raise Interrupted


def main() -> None:
    """Run the command line; wrong input ends with one sentence on stderr and exit code 2, nothing found with 3."""
    for request in (signal.SIGINT, signal.SIGTERM):
        signal.signal(request, _stop)
    try:
        app()
    except StribeckError as error:
        console.print_error(str(error))
        sys.exit(error.exit_code)
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        console.print_error(f"{place}{error.strerror or error}")
        sys.exit(2)
    except Interrupted:
        console.print_error("interrupted; nothing was written")
        sys.exit(130)

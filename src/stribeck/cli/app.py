"""The command line: parses, calls, prints.

What is slow to import is imported where a command needs it, so that `--help` and `--version` answer at once.
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from importlib.util import find_spec
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from stribeck.base.outputs import check_name, check_outputs, staged_folder
from stribeck.cli import console
from stribeck.errors import SettingsError, StribeckError, findings_kept

if TYPE_CHECKING:
    from stribeck.log import RobotLog
    from stribeck.result import Result
    from stribeck.robot import Robot
    from stribeck.settings import Settings

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

Logs = Annotated[
    list[Path], typer.Argument(metavar="LOG", help="npz, h5, mat, csv, parquet, mcap, bag; rosbag2, LeRobot.")
]
LogFile = Annotated[Path, typer.Argument(metavar="LOG", help="The log.")]
ResultFile = Annotated[Path, typer.Argument(metavar="OUT/result.json", help="What was found.")]
PageOption = Annotated[Path | None, typer.Option("--output", "-o", help="Write an HTML page here.")]
RobotOption = Annotated[Path, typer.Option("--robot", "-r", help="The robot file (robot.toml).")]
QuietOption = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors alone, and JSON if asked for.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON on stdout, and nothing else there.")]
SetOption = Annotated[
    list[str], typer.Option("--set", metavar="KEY=VALUE", help="A setting of [identify], e.g. --set filter.window=31.")
]
LAW_NAMES = ("coulomb-viscous", "stribeck", "stribeck-exponent", "asymmetric", "lugre", "auto")
METHOD_NAMES = ("whole-log", "curve-fit", "observer", "ground-reaction", "direct")
FORMATS = ("mjcf", "urdf", "drake", "c", "python", "yaml", "table", "isaaclab", "pinocchio")
ForceOption = Annotated[bool, typer.Option("--force", help="Go on with a log that makes every number wrong.")]
FromOption = Annotated[float | None, typer.Option("--from", metavar="SECONDS", help="Use each LOG from here on.")]
ToOption = Annotated[float | None, typer.Option("--to", metavar="SECONDS", help="Use each LOG up to here.")]
OverwriteOption = Annotated[bool, typer.Option("--overwrite", help="Write over outputs that are there already.")]
LawOption = Annotated[
    str | None, typer.Option(help=f"Friction law: {', '.join(LAW_NAMES)}.", autocompletion=lambda: LAW_NAMES)
]
MethodOption = Annotated[
    str | None, typer.Option(help=f"How to fit: {', '.join(METHOD_NAMES)}.", autocompletion=lambda: METHOD_NAMES)
]
PLAN, TRAJECTORY = "plan.json", "trajectory.csv"
REPLAY, REPLAY_PAGE = "replay.json", "replay.html"
RESULT, REPORT, TABLE = "result.json", "report.html", "friction_torque.parquet"


def _print_version(asked: bool) -> None:
    if asked:
        from stribeck.base.version import __version__

        typer.echo(__version__)
        raise typer.Exit


@app.callback()
def stribeck(
    version: Annotated[
        bool, typer.Option("--version", "-V", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Joint friction of legged robots and arms, from the logs they already record."""


@app.command()
def identify(
    logs: Logs,
    robot: RobotOption,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for result, report and friction torque.")],
    law: LawOption = None,
    method: MethodOption = None,
    settings: SetOption = [],  # noqa: B006
    validate: Annotated[
        list[Path], typer.Option("--validate", metavar="LOG", help="A log that no fit sees, to test the fit on.")
    ] = [],  # noqa: B006
    start: FromOption = None,
    stop: ToOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Find the friction of every joint: writes result.json, report.html and friction_torque.parquet."""
    from stribeck.pipeline import identify as run
    from stribeck.report import write_report
    from stribeck.robot import Robot

    machine = Robot.from_file(robot)
    chosen = with_settings(machine.settings, {"law": law, "method": method}, settings)
    check_outputs([output / name for name in (RESULT, REPORT, TABLE)], [*logs, *validate, *_files_of(robot)], overwrite)
    with staged_folder(output) as staging, progress_bar(quiet) as progress:
        parts = [_part(log, machine, start, stop) for log in logs]
        result = run(parts, machine, chosen, table=staging / TABLE, validate=validate, force=force, progress=progress)
        progress("writing the report", 0.9)
        (staging / RESULT).write_text(result.to_json(), encoding="utf-8")
        write_report(result, staging / REPORT)
    _show(result, console.print_result, [output / name for name in (RESULT, REPORT, TABLE)], json=json, quiet=quiet)


@app.command()
def init(
    model: Annotated[str, typer.Argument(metavar="MODEL", help="URDF or MJCF file, or package:NAME.")],
    log: Annotated[Path | None, typer.Argument(metavar="[LOG]", help="A log of the robot.")] = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="The robot file to write.")] = Path("robot.toml"),
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Write a first robot file from a model and a log of the robot; what neither says is marked TODO."""
    from stribeck.base.outputs import whole_or_not_at_all
    from stribeck.init import draft_robot_file
    from stribeck.robot import model_path

    check_outputs([output], [model_path(model, Path()), *([log] if log else [])], overwrite)
    with progress_bar(quiet) as progress:
        progress("comparing model and log", 0.1)
        found = draft_robot_file(model, log, output)
    with whole_or_not_at_all(output) as staging:
        staging.write_text(found.text, encoding="utf-8")
    if not quiet:
        for question in found.questions:
            typer.echo(f"TODO: {question}")
        console.print_paths([output])


@app.command()
def inspect(
    log: LogFile,
    robot: RobotOption,
    output: PageOption = None,
    settings: SetOption = [],  # noqa: B006
    start: FromOption = None,
    stop: ToOption = None,
    json: JsonOption = False,
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Show what a log holds: rate, gaps, channels, support phases, ranges, delays and signs."""
    from stribeck.audit.inspection import inspect_log
    from stribeck.report.inspection import write_inspection
    from stribeck.robot import Robot

    machine = Robot.from_file(robot)
    check_outputs([output] if output else [], [log, *_files_of(robot)], overwrite)
    with progress_bar(quiet) as progress:
        progress("inspecting", 0.1)
        found = inspect_log(_part(log, machine, start, stop), machine, with_settings(machine.settings, {}, settings))
    if output is not None:
        write_inspection(found, output)
    _show(found, console.print_inspection, [output] if output else [], json=json, quiet=quiet)


@app.command()
def convert(
    log: LogFile,
    output: Annotated[Path, typer.Option("--output", "-o", help="The file to write: .npz or .parquet.")],
    robot: Annotated[
        Path | None, typer.Option("--robot", "-r", help="Whose joints, in whose order, units and signs.")
    ] = None,
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Write a log again, in SI units and under the names that are read without any setting."""
    from stribeck.log.readers import read_log
    from stribeck.log.writers import write_log
    from stribeck.robot import Robot

    check_outputs([output], [log, *(_files_of(robot) if robot else [])], overwrite)
    with progress_bar(quiet) as progress:
        progress("reading", 0.1)
        found = read_log(log, Robot.from_file(robot) if robot else None)
        progress("writing", 0.6)
        write_log(found, output)
    if quiet:
        return
    for note in found.notes:
        typer.echo(note)
    console.print_paths([output])


@app.command()
def export(
    result: ResultFile,
    robot: RobotOption,
    to: Annotated[str, typer.Option(help=f"What to write: {', '.join(FORMATS)}.", autocompletion=lambda: FORMATS)],
    output: Annotated[Path, typer.Option("--output", "-o", help="The file to write; with --samples the folder.")],
    samples: Annotated[int | None, typer.Option(help="Write as many robots that the log cannot tell apart.")] = None,
    ranges: Annotated[bool, typer.Option("--ranges", help="Write 95 % ranges of the numbers to draw from.")] = False,
    joints: Annotated[str | None, typer.Option(help="Joints whose friction is written, a,b,c; all if none.")] = None,
    include_weak: Annotated[bool, typer.Option("--include-weak", help="Write weak friction too.")] = False,
    strict: Annotated[bool, typer.Option("--strict", help="Refuse what cannot say all of the friction.")] = False,
    friction: Annotated[str | None, typer.Option(help="Form: plain or lugre (mjcf), all or plain (yaml).")] = None,
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Write what was found for a simulator or a controller: the robot's model again, or a file of its own kind."""
    from stribeck.exporters import export as write_model
    from stribeck.exporters import export_ranges, export_samples
    from stribeck.result import read_result
    from stribeck.robot import Robot

    found = read_result(_result_file(result))
    machine = Robot.from_file(robot)
    chosen: dict[str, Any] = {"joints": _names(joints), "include_weak": include_weak}
    if ranges and (samples is not None or strict or friction is not None):
        raise SettingsError("--ranges takes neither --samples, --strict nor --friction; leave them out")
    if samples is not None:
        if output.is_dir() and any(output.iterdir()) and not overwrite:
            raise SettingsError(f"{output}: is there already; name another folder, or add --overwrite")
        with findings_kept([*machine.warnings, *found.warnings]):
            paths = export_samples(found, machine, output, to, samples, friction=friction, **chosen)
        if not quiet:
            console.print_paths(paths)
        return
    check_outputs([output], [_result_file(result), *_files_of(robot)], overwrite)
    with findings_kept([*machine.warnings, *found.warnings]):
        if ranges:
            lines = export_ranges(found, machine, output, to, **chosen)
        else:
            lines = write_model(found, machine, output, to, strict=strict, friction=friction, **chosen)
    if not quiet:
        typer.echo("\n".join(lines))
        console.print_paths([output])


@app.command()
def plan(
    result: ResultFile,
    robot: RobotOption,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder for plan.json and a trajectory.")
    ] = None,
    joints: Annotated[
        str | None, typer.Option(help="Joints to plan for, a,b,c; weak or not excited ones if none.")
    ] = None,
    held: Annotated[
        str | None, typer.Option(help="A floating base hangs or lies, this axis of it up: x, -x, y, -y, z or -z.")
    ] = None,
    duration: Annotated[float, typer.Option(help="Length of the trajectory [s].")] = 60.0,
    json: JsonOption = False,
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Say which motion would make the friction of weak joints known, and write the trajectory of it."""
    from stribeck.plan.plan import plan as run
    from stribeck.robot import Robot

    file = _result_file(result)
    outputs = [output / name for name in (PLAN, TRAJECTORY)] if output else []
    machine, asked = Robot.from_file(robot), _names(joints)
    check_outputs(outputs, [file, *_files_of(robot)], overwrite)
    with progress_bar(quiet) as progress:
        found = run(file, machine, joints=asked, held=held, duration=duration if output else None, progress=progress)
    if output is not None:
        with staged_folder(output) as staging:
            (staging / PLAN).write_text(found.to_json(), encoding="utf-8")
            if found.trajectory:
                found.trajectory.write_csv(staging / TRAJECTORY)
    _show(found, console.print_plan, outputs if found.trajectory else outputs[:1], json=json, quiet=quiet)


@app.command()
def replay(
    log: LogFile,
    robot: RobotOption,
    model: Annotated[Path, typer.Option("--model", "-m", help="A URDF or MJCF with the robot's joints.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder for replay.json and replay.html.")
    ] = None,
    settings: SetOption = [],  # noqa: B006
    start: FromOption = None,
    stop: ToOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Compare a log with a model: torques, and short simulations, with and without the model's friction."""
    from stribeck.replay.replay import replay as run
    from stribeck.report.replay import write_replay
    from stribeck.robot import Robot

    machine = Robot.from_file(robot)
    chosen = with_settings(machine.settings, {}, settings)
    outputs = [output / name for name in (REPLAY, REPLAY_PAGE)] if output else []
    check_outputs(outputs, [log, model, *_files_of(robot)], overwrite)
    with progress_bar(quiet) as progress:
        part = _part(log, machine, start, stop)
        found = run(part, machine, model, chosen, force=force, progress=progress)
    if output is not None:
        with staged_folder(output) as staging:
            (staging / REPLAY).write_text(found.to_json(), encoding="utf-8")
            write_replay(found, staging / REPLAY_PAGE)
    _show(found, console.print_replay, outputs, json=json, quiet=quiet)


@app.command()
def compare(
    results: Annotated[
        list[Path],
        typer.Argument(metavar="RESULT", help="Two result.json of a robot, older first; of one, its left and right."),
    ],
    names: Annotated[str | None, typer.Option(help="What to call the two results, a,b; by their logs if none.")] = None,
    output: PageOption = None,
    json: JsonOption = False,
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Show what changed between two results of a robot, or between left and right of one."""
    from stribeck.report.comparison import write_comparison
    from stribeck.result import read_result
    from stribeck.result.compare import compare as compare_two
    from stribeck.result.compare import compare_sides

    files = [_result_file(path) for path in results]
    check_outputs([output] if output else [], files, overwrite)
    labels = _names(names)
    if len(files) > 2:
        raise SettingsError(f"compare: {len(files)} results are given; expected two, or one for its left and right")
    if labels and len(files) == 1:
        raise SettingsError("--names: one result has its left and right to compare; leave the names out")
    if labels and len(set(labels)) != 2:
        raise SettingsError(f"--names: found {', '.join(labels)}; expected 2 names, each once")
    if len(files) == 1:
        found = compare_sides(read_result(files[0]))
    else:
        found = compare_two(files[0], files[1], names=(labels[0], labels[1]) if labels else None)
    if output is not None:
        write_comparison(found, output)
    _show(found, console.print_comparison, [output] if output else [], json=json, quiet=quiet)


@app.command()
def simulate(
    scenario: Annotated[Path, typer.Argument(metavar="SCENARIO.toml", help="What happens.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="The log (.npz); its truth is written beside it.")],
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Make a log of a simulated robot, with its truth beside it."""
    _require_simulation()
    from stribeck_simulation.files import truth_file, write_simulated
    from stribeck_simulation.run import run_scenario
    from stribeck_simulation.scenario import read_scenario

    if output.suffix != ".npz":
        raise SettingsError(f"--output {output}: the suffix is '{output.suffix}'; simulated logs are written as .npz")
    chosen = read_scenario(scenario)
    check_outputs([output, truth_file(output)], [scenario, scenario.parent / chosen.robot], overwrite)
    with progress_bar(quiet) as progress:
        found = run_scenario(chosen, scenario.parent, lambda share: progress(f"simulating {scenario.stem}", share))
    truth = write_simulated(found.log, found.truth, output)
    if not quiet:
        console.print_paths([output, truth, Path(found.robot.path)])


@app.command()
def demo(
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for the log and what is found in it.")] = Path(
        "demo"
    ),
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Let a simulated humanoid walk, find its friction from its log, and compare it with the truth."""
    _require_simulation()
    from stribeck.pipeline import identify as run
    from stribeck.report import write_report
    from stribeck.robot import Robot
    from stribeck_simulation.demo import FILES, make_demo, truth_reference
    from stribeck_simulation.pictures.section import walk_section

    check_outputs([output / name for name in (*FILES, RESULT, REPORT, TABLE)], [], overwrite)
    with staged_folder(output) as staging, progress_bar(quiet) as progress:
        example = make_demo(staging, lambda share: progress("simulating a walk", share))
        machine = Robot.from_file(example.robot_file)
        result = run([example.log], machine, table=staging / TABLE, progress=progress)
        result = _moved(result, str(staging), str(output))
        progress("writing the report", 0.9)
        (staging / RESULT).write_text(result.to_json(), encoding="utf-8")
        truth = truth_reference(result, example.law, example.parameters)
        write_report(result, staging / REPORT, reference=truth, further=[walk_section(example.walk)])
    if not quiet:
        console.print_truth(result, example.parameters)
        console.print_paths([output / name for name in (example.log.name, RESULT, TABLE, REPORT)])


def _show(found: Any, show: Callable[[Any], None], paths: list[Path], *, json: bool, quiet: bool) -> None:
    """Print what was found as JSON, or as tables with the files that were written."""
    if json:
        typer.echo(found.to_json(), nl=False)
    elif not quiet:
        show(found)
        console.print_paths(paths)


def _names(text: str | None) -> list[str] | None:
    """Return the names of a list `a,b,c`."""
    return None if text is None else [name.strip() for name in text.split(",")]


def _require_simulation() -> None:
    """Refuse to simulate without what the extra of that name installs."""
    missing = [name for name in ("mujoco", "daqp") if find_spec(name) is None]
    if missing:
        raise SettingsError(f"simulation needs {' and '.join(missing)}: pip install 'stribeck[simulation]'")


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


def _part(path: Path, robot: Robot, start: float | None, stop: float | None) -> RobotLog | Path:
    """Return a log's part from `start` to `stop` [s] after its begin, or the path of one that is used as a whole."""
    if start is None and stop is None:
        return path
    low, high = start or 0.0, float("inf") if stop is None else stop
    if not 0 <= low < high:
        raise SettingsError(f"--from is {low:g} s and --to {high:g} s; expected 0 or more, and --to after --from")
    from stribeck.log.readers import read_log

    return read_log(path, robot).between(start, stop)


def with_settings(settings: Settings, options: dict[str, str | None], assignments: list[str]) -> Settings:
    """Return the settings with options of the command line, and `key.key=value` assignments (TOML values), put in.

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


def _files_of(robot: Path) -> list[Path]:
    """Return the robot file and the model that it names."""
    from stribeck.robot import model_path, read_robot_file

    return [robot, model_path(read_robot_file(robot).robot.model, robot.parent)]


def _result_file(path: Path) -> Path:
    return path / RESULT if path.is_dir() else path


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Any]:
    """Give a function to call with a stage and its share; it draws on stderr if that is a terminal, and not `quiet`."""
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn())
    hidden = quiet or not console.ERRORS.is_terminal
    with Progress(*columns, console=console.ERRORS, transient=True, disable=hidden) as progress:
        task = progress.add_task("starting", total=1.0)
        yield lambda stage, share: progress.update(task, description=stage, completed=share)


def run() -> None:
    """Run the command line; wrong input ends with one sentence on stderr and exit code 2, nothing found with 3.

    What was found before is printed above the sentence, a line each.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # an encoding may lack what a file is called
            stream.reconfigure(errors="backslashreplace")
    try:
        for word in sys.argv[1:]:
            check_name(Path(word))
        app()
    except StribeckError as error:
        for finding in getattr(error, "__notes__", ()):
            console.print_error(f"note: {finding}")
        console.print_error(str(error))
        sys.exit(error.exit_code)
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        console.print_error(f"{place}{error.strerror or error}")
        sys.exit(2)
    except MemoryError:
        console.print_error("the log and what is worked out of it do not fit in memory; expected a shorter log")
        sys.exit(2)

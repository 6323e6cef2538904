"""Commands: parse arguments, call the library, print the results.

Slow imports stand inside the commands, so that `--help` and `--version` respond at once.
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from typer.core import TyperCommand

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
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)


class Command(TyperCommand):
    """A command whose help shows `LOG...` instead of `{LOG}...`, and no Python types."""

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """List the parts of the usage line without braces."""
        return [piece.replace("{", "").replace("}", "") for piece in super().collect_usage_pieces(ctx)]

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the tables of arguments and options."""
        for title, kind in (("Arguments", "argument"), ("Options", "option")):
            parameters = [each for each in self.get_params(ctx) if each.param_type_name == kind]
            records = [record for each in parameters if (record := each.get_help_record(ctx))]
            if records:
                with formatter.section(title):
                    formatter.write_dl([(name.partition(" <")[0], text) for name, text in records])


command = partial(app.command, cls=Command)

FORMATS_READ = "Log: npz, h5, mat, csv, parquet, mcap or bag file, or a folder (rosbag2, LeRobot)."
Logs = Annotated[list[Path], typer.Argument(metavar="LOG", help=FORMATS_READ)]
LogFile = Annotated[Path, typer.Argument(metavar="LOG", help=FORMATS_READ)]
ResultFile = Annotated[Path, typer.Argument(metavar="RESULT", help="A result.json written by `stribeck identify`.")]
PageOption = Annotated[
    Path | None, typer.Option("--output", "-o", metavar="FILE", help="Also write the result as an HTML page.")
]
RobotOption = Annotated[Path, typer.Option("--robot", "-r", metavar="FILE", help="Robot file (robot.toml).")]
QuietOption = Annotated[bool, typer.Option("--quiet", "-q", help="Print only errors (and JSON with --json).")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as JSON on stdout.")]
SetOption = Annotated[
    list[str],
    typer.Option("--set", metavar="KEY=VALUE", help="Override a setting of [identify], e.g. --set filter.window=31."),
]
LAW_NAMES = ("coulomb-viscous", "stribeck", "stribeck-exponent", "asymmetric", "lugre", "auto")
METHOD_NAMES = ("whole-log", "curve-fit", "observer", "ground-reaction", "direct")
FORMATS = ("mjcf", "urdf", "drake", "c", "python", "yaml", "table", "isaaclab", "pinocchio")
ForceOption = Annotated[bool, typer.Option("--force", help="Continue although the audit found a fatal error.")]
FromOption = Annotated[
    float | None, typer.Option("--from", metavar="SECONDS", help="Start of the used part of each log.")
]
ToOption = Annotated[float | None, typer.Option("--to", metavar="SECONDS", help="End of the used part of each log.")]
OverwriteOption = Annotated[bool, typer.Option("--overwrite", help="Overwrite existing outputs.")]
LawOption = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help=f"Friction law: {', '.join(LAW_NAMES)}.  [default: auto, or as in the robot file]",
        autocompletion=lambda: LAW_NAMES,
    ),
]
MethodOption = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help=f"Estimation method: {', '.join(METHOD_NAMES)}.  [default: whole-log, or as in the robot file]",
        autocompletion=lambda: METHOD_NAMES,
    ),
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
    """Identify joint friction of legged robots and arms from logs.

    Typical use: `init`, `inspect`, `identify`, `export`. To see an example first, run `demo`.
    """


@command()
def init(
    model: Annotated[str, typer.Argument(metavar="MODEL", help="URDF or MJCF file, or package:NAME.")],
    log: Annotated[Path | None, typer.Argument(metavar="LOG", help="A log of the robot.")] = None,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Robot file to write.")] = Path(
        "robot.toml"
    ),
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Write a robot file for a model, with settings for a log.

    Settings that neither the model nor the log determines are marked TODO.
    """
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


@command()
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
    """Check a log: rate, gaps, channels, ranges, signs, delays."""
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


@command()
def identify(
    logs: Logs,
    robot: RobotOption,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FOLDER", help="Folder for the outputs.")],
    law: LawOption = None,
    method: MethodOption = None,
    settings: SetOption = [],  # noqa: B006
    validate: Annotated[
        list[Path], typer.Option("--validate", metavar="LOG", help="Log for validation, not used for the fit.")
    ] = [],  # noqa: B006
    start: FromOption = None,
    stop: ToOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Identify the friction of every joint from logs.

    Writes result.json, report.html and friction_torque.parquet.
    """
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


@command()
def export(
    result: ResultFile,
    robot: RobotOption,
    to: Annotated[
        str, typer.Option(metavar="FORMAT", help=f"Format: {', '.join(FORMATS)}.", autocompletion=lambda: FORMATS)
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="PATH", help="File to write, or folder for --samples.")
    ],
    samples: Annotated[
        int | None, typer.Option(metavar="N", help="Draw N models from the uncertainty of the result.")
    ] = None,
    ranges: Annotated[bool, typer.Option("--ranges", help="Write 95 % ranges for domain randomization.")] = False,
    joints: Annotated[
        str | None, typer.Option(metavar="NAMES", help="Comma-separated joints to export.  [default: all]")
    ] = None,
    include_weak: Annotated[bool, typer.Option("--include-weak", help="Also export friction that is weak.")] = False,
    strict: Annotated[
        bool, typer.Option("--strict", help="Fail if the format cannot represent all of the friction.")
    ] = False,
    friction: Annotated[
        str | None,
        typer.Option(
            metavar="FORM",
            help="Friction model. mjcf: plain or lugre  [default: the closer fit]; yaml: all or plain  [default: all].",
        ),
    ] = None,
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Export a result to a simulator, a model file or code."""
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
            raise SettingsError(f"{output}: already exists; choose another -o, or pass --overwrite")
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


@command()
def compare(
    results: Annotated[
        list[Path],
        typer.Argument(metavar="RESULT", help="Two results, older first; or one, to compare left and right."),
    ],
    names: Annotated[
        str | None, typer.Option(metavar="A,B", help="Labels of the results.  [default: log file names]")
    ] = None,
    output: PageOption = None,
    json: JsonOption = False,
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Compare two results, or left and right joints of one."""
    from stribeck.report.comparison import write_comparison
    from stribeck.result import read_result
    from stribeck.result.compare import compare as compare_two
    from stribeck.result.compare import compare_sides

    files = [_result_file(path) for path in results]
    check_outputs([output] if output else [], files, overwrite)
    labels = _names(names)
    if len(files) > 2:
        raise SettingsError(f"compare: {len(files)} results were given; expected two, or one to compare left and right")
    if labels and len(files) == 1:
        raise SettingsError("--names applies to two results; omit it to compare left and right of one")
    if labels and len(set(labels)) != 2:
        raise SettingsError(f"--names: found {', '.join(labels)}; expected 2 different names")
    if len(files) == 1:
        found = compare_sides(read_result(files[0]))
    else:
        found = compare_two(files[0], files[1], names=(labels[0], labels[1]) if labels else None)
    if output is not None:
        write_comparison(found, output)
    _show(found, console.print_comparison, [output] if output else [], json=json, quiet=quiet)


@command()
def plan(
    result: ResultFile,
    robot: RobotOption,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FOLDER", help="Folder for plan.json and trajectory.csv.")
    ] = None,
    joints: Annotated[
        str | None, typer.Option(metavar="NAMES", help="Comma-separated joints.  [default: all weak or not excited]")
    ] = None,
    held: Annotated[
        str | None,
        typer.Option(metavar="AXIS", help="Base axis that points up: x, -x, y, ...; if a floating base is held."),
    ] = None,
    duration: Annotated[float, typer.Option(metavar="SECONDS", help="Duration of the trajectory.")] = 60.0,
    json: JsonOption = False,
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Plan the motion that weak joints need, with trajectory."""
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


@command()
def replay(
    log: LogFile,
    robot: RobotOption,
    model: Annotated[Path, typer.Option("--model", "-m", metavar="FILE", help="URDF or MJCF with friction to test.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FOLDER", help="Folder for replay.json and replay.html.")
    ] = None,
    settings: SetOption = [],  # noqa: B006
    start: FromOption = None,
    stop: ToOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Test a model on a log: torques and short simulations.

    Compares the model of the robot file with another model, without and with the friction of the latter.
    """
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


@command()
def convert(
    log: LogFile,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="File to write: .npz or .parquet.")],
    robot: Annotated[
        Path | None,
        typer.Option("--robot", "-r", metavar="FILE", help="Robot file with joint order, units and signs."),
    ] = None,
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Convert a log to standard channel names and SI units."""
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


@command()
def simulate(
    scenario: Annotated[
        Path, typer.Argument(metavar="SCENARIO", help="Scenario file: robot, motion, sensors and friction.")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Log to write (.npz).")],
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Simulate a robot: write a log and its ground truth."""
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


@command()
def demo(
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FOLDER", help="Folder for the log and the results.")
    ] = Path("demo"),
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Identify a simulated walking humanoid, compare with truth."""
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


@command()
def explain(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="Verdict or check, e.g. weak, torque-sign.")
    ] = None,
) -> None:
    """Explain a verdict or a finding, or list their names."""
    from stribeck.cli.explain import explanation, explanation_names

    typer.echo("\n".join(explanation_names()) if name is None else explanation(name))


def _show(found: Any, show: Callable[[Any], None], paths: list[Path], *, json: bool, quiet: bool) -> None:
    """Print a result as JSON, or as tables followed by the paths of the written files."""
    if json:
        typer.echo(found.to_json(), nl=False)
    elif not quiet:
        show(found)
        console.print_paths(paths)


def _names(text: str | None) -> list[str] | None:
    """Split the names of a list `a,b,c`."""
    return None if text is None else [name.strip() for name in text.split(",")]


def _require_simulation() -> None:
    """Raise SettingsError if the packages of the extra `simulation` are not installed."""
    missing = [name for name in ("mujoco", "daqp") if find_spec(name) is None]
    if missing:
        raise SettingsError(f"simulation needs {' and '.join(missing)}: pip install 'stribeck[simulation]'")


def _moved(result: Result, staging: str, output: str) -> Result:
    """Replace the staging folder by the output folder in the paths of a result with one log."""
    assert isinstance(result.log.path, str)
    assert result.evidence is not None
    provenance = [(label, text.replace(staging, output)) for label, text in result.evidence.provenance]
    return replace(
        result,
        log=replace(result.log, path=result.log.path.replace(staging, output)),
        evidence=replace(result.evidence, provenance=provenance),
    )


def _part(path: Path, robot: Robot, start: float | None, stop: float | None) -> RobotLog | Path:
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


def _files_of(robot: Path) -> list[Path]:
    """List the robot file and its model file."""
    from stribeck.robot import model_path, read_robot_file

    return [robot, model_path(read_robot_file(robot).robot.model, robot.parent)]


def _result_file(path: Path) -> Path:
    return path / RESULT if path.is_dir() else path


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Any]:
    """Draw a progress bar on stderr if it is a terminal, and not `quiet`; give its callback `(stage, fraction)`."""
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn())
    hidden = quiet or not console.ERRORS.is_terminal
    with Progress(*columns, console=console.ERRORS, transient=True, disable=hidden) as progress:
        task = progress.add_task("starting", total=1.0)
        yield lambda stage, share: progress.update(task, description=stage, completed=share)


def run() -> None:
    """Run the command line: exit code 2 and one sentence on stderr for invalid input, 3 if nothing was identified.

    Findings made before the error are printed above the sentence, one per line.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # file names may contain characters that the encoding lacks
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
        console.print_error(
            "the log and its intermediate results do not fit in memory; use a shorter part of it (--from, --to)"
        )
        sys.exit(2)

"""Commands: parse arguments, call the library, print the results.

Slow imports stand inside the commands, so that `--help` and `--version` respond at once.
"""

import sys
from collections.abc import Callable
from io import TextIOWrapper
from pathlib import Path
from typing import Annotated

import typer

from stribeck.app.cli import console, options
from stribeck.app.cli.options import REPORT, RESULT, TABLE, argument, option, output_option, robot_option
from stribeck.core.base.outputs import check_name, staged_folder
from stribeck.core.base.parts import Parts
from stribeck.core.errors import StribeckError, require_extra

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)


def _print_version(asked: bool) -> None:
    if asked:
        from stribeck.core.base.version import __version__

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


def init(
    model: Annotated[str, argument("MODEL", "URDF or MJCF file, or package:NAME.")],
    log: Annotated[Path | None, argument("LOG", "A log of the robot.")] = None,
    output: Annotated[Path, output_option("FILE", "Robot file to write.")] = Path("robot.toml"),
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Write a robot file for a model, with settings for a log.

    Settings that neither the model nor the log determines are marked TODO.
    """
    from stribeck.check import draft_robot_file
    from stribeck.core.base.outputs import whole_or_not_at_all
    from stribeck.core.robot import model_path

    options.check_files([output], [model_path(model, Path()), *([log] if log else [])], overwrite)
    with console.progress_bar(quiet) as progress:
        progress("comparing model and log", 0.1)
        draft = draft_robot_file(model, log, output)
    with whole_or_not_at_all(output) as staging:
        staging.write_text(draft.text, encoding="utf-8")
    if not quiet:
        for line in [*(f"Warning: {text}" for text in draft.warnings), *(f"TODO: {text}" for text in draft.questions)]:
            typer.echo(line)
        console.print_paths([output])


def inspect(
    log: options.LogFile,
    robot: options.RobotFile,
    output: options.Page = None,
    settings: options.Set = [],  # noqa: B006
    start: options.From = None,
    stop: options.To = None,
    exclude: options.Exclude = [],  # noqa: B006
    json: options.Json = False,
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Check a log: rate, gaps, channels, ranges, signs, delays."""
    from stribeck.app.report.inspection import write_inspection
    from stribeck.check import inspect_log

    machine = options.robot_of(robot, exclude, [log])
    options.check_files([output] if output else [], [log, *options.files_of(machine)], overwrite)
    with console.progress_bar(quiet) as progress:
        progress("inspecting", 0.1)
        chosen = options.with_settings(machine.settings, {}, settings)
        inspection = inspect_log(options.part_of(log, machine, start, stop), machine, chosen)
    if output is not None:
        write_inspection(inspection, output)
    console.show(inspection, console.print_inspection, [output] if output else [], json=json, quiet=quiet)


def identify(
    logs: options.Logs,
    robot: options.RobotFile,
    output: Annotated[Path, output_option("FOLDER", "Folder for the outputs.")],
    law: options.Law = None,
    method: options.Method = None,
    settings: options.Set = [],  # noqa: B006
    validate: Annotated[list[Path], option("LOG", "Log for validation, not used for the fit.")] = [],  # noqa: B006
    start: options.From = None,
    stop: options.To = None,
    exclude: options.Exclude = [],  # noqa: B006
    force: options.Force = False,
    rerun: options.Recording = None,
    json: options.Json = False,
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Identify the friction of every joint from logs.

    Writes result.json, report.html and friction_torque.parquet. With --quiet, exit code 3 means that no joint is
    identified.
    """
    from stribeck.core.identify.pipeline import identify as run

    machine = options.robot_of(robot, exclude, [*logs, *validate])
    chosen = options.with_settings(machine.settings, {"law": law, "method": method}, settings)
    outputs = [*(output / name for name in (RESULT, REPORT, TABLE)), *([rerun] if rerun else [])]
    options.check_files(outputs, [*logs, *validate, *options.files_of(machine)], overwrite)
    if rerun:
        require_extra("rerun", "rerun")
    with staged_folder(output) as staging, console.progress_bar(quiet) as progress:
        parts = [options.part_of(log, machine, start, stop) for log in logs]
        result = run(parts, machine, chosen, table=staging / TABLE, validate=validate, force=force, progress=progress)
        options.write_result(result, staging, progress)
        if rerun:
            from stribeck.app.report.replay import curves_of_result, write_recording

            write_recording(curves_of_result(result), rerun, result.robot)
    console.show(result, console.print_result, outputs, json=json, quiet=quiet)
    if quiet and {"identified", "no friction"}.isdisjoint(joint.verdict for joint in result.values()):
        raise typer.Exit(3)


def convert(
    log: options.LogFile,
    output: Annotated[Path, output_option("FILE", "File to write: .npz or .parquet.")],
    robot: Annotated[Path | None, robot_option("Robot file with joint order, units and signs.")] = None,
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Convert a log to standard channel names and SI units."""
    from stribeck.core.robot import Robot
    from stribeck.io import read_log, write_log

    machine = Robot.from_file(robot) if robot else None
    options.check_files([output], [log, *(options.files_of(machine) if machine else [])], overwrite)
    with console.progress_bar(quiet) as progress:
        progress("reading", 0.1)
        recording = read_log(log, machine)
        progress("writing", 0.6)
        write_log(recording, output)
    if quiet:
        return
    for note in recording.notes:
        typer.echo(note)
    console.print_paths([output])


def paper(
    log: options.LogFile,
    robot: options.RobotFile,
    output: Annotated[Path, output_option("FILE", "Page to write (.html).")],
    settings: options.Set = [],  # noqa: B006
    start: options.From = None,
    stop: options.To = None,
    exclude: options.Exclude = [],  # noqa: B006
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Draw the figures of the term paper for a log of your robot.

    Estimated acceleration, double support, spectrum with cutoff, power of friction, and sensitivity to inertias.
    """
    from stribeck.app.report.paper import write_paper
    from stribeck.core.base.parts import SERVICES

    machine = options.robot_of(robot, exclude, [log])
    options.check_files([output], [log, *options.files_of(machine)], overwrite)
    with console.progress_bar(quiet) as progress:
        chosen = options.with_settings(machine.settings, {}, settings)
        part = options.part_of(log, machine, start, stop)
        sections = SERVICES["paper_sections"](part, machine, chosen, progress)
        sentences = write_paper(sections, output, machine.name)
    if not quiet:
        console.say(sentences)
        console.print_paths([output])


def explain(name: Annotated[str | None, argument("NAME", "Verdict or check, e.g. weak, torque-sign.")] = None) -> None:
    """Explain a verdict or a finding, or list their names."""
    from stribeck.app.cli.explain import explanation, explanation_names

    typer.echo("\n".join(explanation_names()) if name is None else explanation(name))


commands = Parts[Callable[..., None]]("stribeck.commands")
usual = ["init", "inspect", "identify", "export", "compare", "plan", "replay", "convert", "fleet", "trends", "rehearse"]
for name in dict.fromkeys([*usual, "watch", "paper", "simulate", "demo", "explain", *commands]):
    app.command(name, cls=options.Command)(commands[name])


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
        console.print_error("; ".join(filter(None, (str(error), error.option))))
        sys.exit(error.exit_code)
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        console.print_error(f"{place}{error.strerror or error}")
        sys.exit(2)
    except MemoryError:
        console.print_error("the log does not fit in memory; use a shorter part of it (--from, --to)")
        sys.exit(2)

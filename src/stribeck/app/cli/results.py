"""Commands on results: `export`, `compare`, `plan` and `replay`."""

from pathlib import Path
from typing import Annotated, Any

from stribeck.app.cli import console, options
from stribeck.app.cli.options import argument, flag, option, output_option
from stribeck.core.base.outputs import staged_folder
from stribeck.core.errors import SettingsError, require_extra


def export(
    result: options.ResultFile,
    to: options.Format,
    output: Annotated[Path, output_option("PATH", "File to write, or folder for --samples.")],
    robot: options.ItsRobot = None,
    samples: Annotated[int | None, option("N", "Draw N models from the uncertainty of the result.")] = None,
    ranges: Annotated[bool, flag("--ranges", "Write 95 % ranges for domain randomization.")] = False,
    joints: Annotated[str | None, option("NAMES", "Comma-separated joints to export.  [default: all]")] = None,
    include_weak: Annotated[bool, flag("--include-weak", "Also export friction that is weak.")] = False,
    strict: Annotated[bool, flag("--strict", "Fail if the format cannot represent all of the friction.")] = False,
    friction: options.Form = None,
    inertia: options.Inertia = None,
    more: Annotated[str | None, option("inertia", "Older name of --inertia write.", "--with", hidden=True)] = None,
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Export a result to a simulator, a model file or code."""
    from stribeck.app.exporters import export as write_model
    from stribeck.app.exporters import export_ranges, export_samples
    from stribeck.core.result import read_result

    source = read_result(result)
    machine = source.find_robot(robot)
    chosen: dict[str, Any] = {"joints": options.split_names(joints), "include_weak": include_weak}
    if more not in (None, "inertia"):
        raise SettingsError(f"--with {more}: expected inertia")
    if inertia not in (None, "keep", "write"):
        raise SettingsError(f"--inertia {inertia}: expected keep or write")
    write = True if more else None if inertia is None else inertia == "write"
    if ranges and (samples is not None or strict or write is not None or friction is not None):
        raise SettingsError("--ranges takes neither --samples, --strict, --friction nor --inertia; leave them out")
    if samples is None:
        options.check_files([output], [result, *options.files_of(machine)], overwrite)
    elif output.is_dir() and any(output.iterdir()) and not overwrite:
        raise SettingsError(f"{output}: already exists", option="choose another -o, or pass --overwrite")
    lines, paths = list[str](), [output]
    if samples is not None:
        paths = export_samples(source, machine, output, to, samples, friction=friction, inertia=write, **chosen)
    elif ranges:
        lines = export_ranges(source, machine, output, to, **chosen)
    else:
        lines = write_model(source, machine, output, to, strict=strict, friction=friction, inertia=write, **chosen)
    if not quiet:
        console.say(lines)
        console.print_paths(paths)


def compare(
    results: Annotated[list[Path], argument("RESULT", "Two results, older first; or one, to compare left and right.")],
    names: Annotated[str | None, option("A,B", "Labels of the results.  [default: log file names]")] = None,
    output: options.Page = None,
    json: options.Json = False,
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Compare two results, or left and right joints of one."""
    from stribeck.app.comparison import compare as compare_two
    from stribeck.app.comparison import compare_sides
    from stribeck.app.report.curves import write_comparison
    from stribeck.core.result import read_result

    files = [options.result_file(path) for path in results]
    options.check_files([output] if output else [], files, overwrite)
    labels = options.split_names(names)
    if len(files) > 2:
        raise SettingsError(f"compare: {len(files)} results were given; expected two, or one to compare left and right")
    if labels and len(files) == 1:
        raise SettingsError("--names applies to two results; omit it to compare left and right of one")
    if labels and len(set(labels)) != 2:
        raise SettingsError(f"--names: found {', '.join(labels)}; expected 2 different names")
    if len(files) == 1:
        comparison = compare_sides(read_result(files[0]))
    else:
        comparison = compare_two(files[0], files[1], names=(labels[0], labels[1]) if labels else None)
    if output is not None:
        write_comparison(comparison, output)
    console.show(comparison, console.print_comparison, [output] if output else [], json=json, quiet=quiet)


def plan(
    source: Annotated[
        str, argument("RESULT", "A result.json; before the first log, a robot file or a model (as for `init`).")
    ],
    robot: options.ItsRobot = None,
    output: Annotated[Path | None, output_option("FOLDER", "Folder for plan.json and trajectory.csv.")] = None,
    joints: options.Planned = None,
    held: options.Held = None,
    duration: Annotated[float, option("SECONDS", "Duration of the trajectory.")] = 60.0,
    json: options.Json = False,
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Plan the motion that weak joints need, with trajectory.

    Before the first log, plan a trajectory within the model's limits.
    """
    from stribeck.design import plan as run

    file, machine = options.planned_robot(source, robot, held)
    outputs = [output / name for name in ("plan.json", "trajectory.csv")] if output else []
    asked = options.split_names(joints)
    options.check_files(outputs, [*([file] if file else []), *options.files_of(machine)], overwrite)
    with console.progress_bar(quiet) as progress:
        proposal = run(
            file, machine, joints=asked, held=held, duration=duration if output or not file else None, progress=progress
        )
    if output is not None:
        with staged_folder(output) as staging:
            (staging / "plan.json").write_text(proposal.to_json(), encoding="utf-8")
            if proposal.trajectory:
                proposal.trajectory.write_csv(staging / "trajectory.csv")
    console.show(proposal, console.print_plan, outputs if proposal.trajectory else outputs[:1], json=json, quiet=quiet)


def replay(
    logs: options.Logs,
    robot: options.RobotFile,
    model: Annotated[Path, option("FILE", "URDF or MJCF with friction to test.", "--model", "-m")],
    output: Annotated[Path | None, output_option("FOLDER", "Folder for replay.json and replay.html.")] = None,
    settings: options.Set = [],  # noqa: B006
    start: options.From = None,
    stop: options.To = None,
    exclude: options.Exclude = [],  # noqa: B006
    force: options.Force = False,
    horizon: Annotated[float, option("SECONDS", "Duration of the short simulations.")] = 0.5,
    rerun: options.Recording = None,
    json: options.Json = False,
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Test a model: torques and short simulations of a log, and free simulations of all logs under their commands.

    Compares the model of the robot file with another model.
    """
    from stribeck.app.report.replay import curves_of_replay, write_recording, write_replay
    from stribeck.design import replay as run

    machine = options.robot_of(robot, exclude, logs)
    chosen = options.with_settings(machine.settings, {}, settings)
    outputs = [output / name for name in ("replay.json", "replay.html")] if output else []
    if rerun:
        require_extra("rerun", "rerun")
        outputs.append(rerun)
    options.check_files(outputs, [*logs, model, *options.files_of(machine)], overwrite)
    with console.progress_bar(quiet) as progress:
        part, *more = (options.part_of(log, machine, start, stop) for log in logs)
        playback = run(part, machine, model, chosen, more=more, horizon=horizon, force=force, progress=progress)
    if output is not None:
        with staged_folder(output) as staging:
            (staging / "replay.json").write_text(playback.to_json(), encoding="utf-8")
            write_replay(playback, staging / "replay.html")
    if rerun:
        write_recording(curves_of_replay(playback), rerun, playback.robot)
    console.show(playback, console.print_replay, outputs, json=json, quiet=quiet)

"""Commands on the logs of many robots: `fleet` and `trends`."""

import json as json_format
import sys
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from stribeck.app.cli import console, options
from stribeck.app.cli.options import REPORT, argument, flag, option, output_option, robot_option
from stribeck.core.base.outputs import check_outputs, resumable
from stribeck.core.errors import SettingsError, require_extra


def fleet(
    logs: Annotated[list[str], argument("[LOGS]", "Files, folders, globs or URLs (s3://, gs://).")] = [],  # noqa: B006
    output: Annotated[Path | None, output_option("STORE", "Folder of the store.")] = None,
    robot: Annotated[Path | None, robot_option("Robot file of all logs.")] = None,
    manifest: Annotated[
        Path | None, option("FILE", "CSV with log, robot_file, robot, and start and note, if known.")
    ] = None,
    workers: Annotated[int, option("N", "Logs at a time.", "--jobs", show_default="one per core")] = -1,
    backend: Annotated[str, option("NAME", "loky, ray or dask.")] = "loky",
    timeout: Annotated[float | None, option("SECONDS", "Longest time for one log.")] = None,
    memory: Annotated[float | None, option("GB", "Most memory for one log.")] = None,
    again: Annotated[bool, flag("--retry-failed", "Try logs again that failed.")] = False,
    compacted: Annotated[Path | None, option("STORE", "Merge the store's files.", "--compact")] = None,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Identify the logs of many robots, and add them to a store.

    Logs that the store has are skipped, so an interrupted run continues where it stopped. Without a manifest, the
    folder of a log is its robot's id.
    """
    require_extra("fleet", "joblib", "duckdb", "fsspec")
    from stribeck.service import Limits, compact, jobs_of_logs, jobs_of_manifest, run_fleet

    if compacted is not None:
        if logs or robot or manifest or output:
            raise SettingsError("fleet: --compact merges the files of one store; run it without logs and outputs")
        before, after, damaged = compact(compacted)
        if json:
            counts = {"before": before, "after": after, "damaged": list(map(str, damaged))}
            typer.echo(json_format.dumps(counts, indent=2))
        elif not quiet:
            _print_damaged(map(str, damaged))
            typer.echo(f"{compacted}: {before} files merged into {after}")
        return
    if output is None:
        raise SettingsError("fleet: has no store to write to; expected -o STORE")
    if bool(logs) == bool(manifest) or bool(logs) != bool(robot):
        raise SettingsError("fleet: expected LOGS and --robot FILE, or --manifest FILE")
    jobs = jobs_of_manifest(manifest) if manifest else jobs_of_logs(logs, robot or Path())
    limits = Limits(timeout=timeout, memory=memory)
    remainder = f"{output} has the logs that are done; repeat the command to continue"
    with resumable(remainder), console.progress_bar(quiet) as progress:
        tally = run_fleet(jobs, output, workers=workers, backend=backend, limits=limits, again=again, progress=progress)
    if json:
        typer.echo(json_format.dumps(asdict(tally), indent=2))
    elif not quiet:
        _print_damaged(tally.damaged)
        for outcome in tally.failed:
            typer.echo(f"{outcome.status}: {outcome.error}")
        typer.echo(f"{tally.line}; {output}")
    if tally.failed:
        sys.exit(3)  # a log has no result


def _print_damaged(paths: Iterable[str]) -> None:
    for path in paths:
        typer.echo(f"set aside as damaged: {path}")


def trends(
    store: Annotated[Path, argument("STORE", "Folder that `stribeck fleet` wrote.")],
    output: Annotated[Path | None, output_option("FOLDER", "Folder for report.html.")] = None,
    logs_per_false_alarm: Annotated[float, option("N", "Mean number of logs between false alarms.")] = 1000.0,
    overwrite: options.Overwrite = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Show joints that changed, and robots that differ.

    Also prints the friction of the robot type.
    """
    require_extra("fleet", "joblib", "duckdb", "fsspec")
    from stribeck.app.report.trends import write_trends
    from stribeck.service import find_trends

    paths = [output / REPORT] if output else []
    check_outputs(paths, [], overwrite)
    fleet_trends = find_trends(store, logs_per_false_alarm=logs_per_false_alarm)
    for path in paths:
        write_trends(fleet_trends, path)
    console.show(fleet_trends, lambda trends: typer.echo(trends.summary()), paths, json=json, quiet=quiet)

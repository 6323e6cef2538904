"""Command on a robot in service: `watch`."""

from __future__ import annotations

import json as json_format
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.live import Live
from rich.text import Text

from stribeck.app.cli import options
from stribeck.app.cli.console import drawn, print_table, terminal
from stribeck.app.cli.options import flag, option
from stribeck.core.base.text_table import TextTable, number, span
from stribeck.core.errors import SettingsError, require_extra

if TYPE_CHECKING:
    from stribeck.core.log import RobotLog
    from stribeck.service import Alarm, OnlineFriction


def watch(
    result: options.ResultFile,
    robot: options.RobotFile,
    log: Annotated[Path | None, option("LOG", "Log to replay.")] = None,
    mcap: Annotated[Path | None, option("FILE", "MCAP to follow; - for standard input.")] = None,
    speed: Annotated[float | None, option("N", "Speed of the replay; 1 is real time.")] = None,
    state: Annotated[Path | None, option("FILE", "State to continue, saved each minute.")] = None,
    hours: Annotated[float, option("H", "Mean time between false alarms.", "--hours-per-false-alarm")] = 100.0,
    rerun: Annotated[bool, flag("--rerun", "Also stream to the Rerun viewer.")] = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Track friction of a robot in service, with alarms.

    Shows a live table in a terminal, else alarms; with --json, one line per second and per alarm.
    """
    if (log is None) == (mcap is None):
        raise SettingsError("watch: expected a source, either --log LOG or --mcap FILE")
    if speed is not None and (log is None or not 0 < speed < float("inf")):
        raise SettingsError(f"--speed: found {speed:g}; expected a positive number, and --log")
    if rerun:
        require_extra("rerun", "rerun")
    from stribeck.core.result import read_result
    from stribeck.core.robot import Robot
    from stribeck.service import estimator_for, feed, stream_of

    machine, reference = Robot.from_file(robot), read_result(result)
    online, saved = None, time.monotonic()
    with ExitStack() as stack:
        live = None
        if terminal().is_terminal and not (json or quiet):  # a table that is drawn anew
            live = stack.enter_context(Live(console=terminal(), auto_refresh=False))
        for part, rate in stream_of(log, mcap, machine, reference):
            if online is None:
                online = estimator_for(reference, machine, rate, hours)
                if state is not None and state.exists():
                    online.load(state)
                shown, began = online.checked, float(part.time[0])
            for batch in _paced(part, rate, speed):
                for alarm in feed(online, batch):
                    _print_alarm(alarm, live, began, json=json, quiet=quiet)
                if online.checked != shown:
                    shown = online.checked
                    _show(online, live, began, json=json, rerun=rerun)
                if state is not None and time.monotonic() - saved > 60.0:  # [s] between two writes
                    saved = time.monotonic()
                    online.save(state)
        if online is None:
            raise SettingsError(f"{log or mcap}: contains no segment that is long enough")
        if state is not None:
            online.save(state)
    if live is None and not (json or quiet):
        print_table(_table_of_state(online, began))


def _paced(part: RobotLog, rate: float, speed: float | None) -> Iterator[RobotLog]:
    """Cut samples into batches of 10 ms, at a speed."""
    begin, length = time.monotonic(), max(1, round(0.01 * rate))
    for start in range(0, len(part.time), length):
        if speed is not None:
            time.sleep(max(0.0, begin + float(part.time[start] - part.time[0]) / speed - time.monotonic()))
        yield part.take(slice(start, start + length))


def _show(online: OnlineFriction, live: Live | None, began: float, *, json: bool, rerun: bool) -> None:
    """Print the state as JSON, draw it, or send it to the Rerun viewer."""
    joints = online.state()
    if json:
        states = {name: asdict(state) for name, state in joints.items()}
        typer.echo(json_format.dumps({"time": online.checked, "joints": states}))
    elif live is not None:
        live.update(drawn(_table_of_state(online, began)), refresh=True)
    if rerun:
        viewer = import_module("rerun")
        viewer.init("stribeck watch", spawn=True)
        viewer.set_time("stream", duration=online.time)
        for name, state in joints.items():
            viewer.log(f"friction/{name}", viewer.Scalars([state.friction, *state.interval_95, state.baseline]))


def _print_alarm(alarm: Alarm, live: Live | None, began: float, *, json: bool, quiet: bool) -> None:
    """Print an alarm as JSON, or as a line, above a live table if there is one."""
    if json:
        typer.echo(json_format.dumps({"alarm": asdict(alarm)}))
    elif not quiet:
        line = Text(f"{alarm.time - began:.1f} s  {alarm.line}", style="red" if alarm.raised else "green")
        (live.console if live else terminal()).print(line, soft_wrap=True)


def _table_of_state(online: OnlineFriction, began: float) -> TextTable:
    """Make a table of the current friction of each joint, and of the raised alarms, since the stream `began`."""
    rows = [
        [
            name,
            number(state.baseline),
            number(state.friction),
            span(state.interval_95),
            f"{100 * (state.friction / state.baseline - 1):+.0f}",
            "ALARM" if state.alarm else "",
        ]
        for name, state in online.state().items()
    ]
    return TextTable(
        title=f"Alarms: {len(online.alarms)} after {online.time - began:.0f} s. Friction at middle speed [N m], [N]",
        left=["joint"],
        right=["identified", "now", "95 % interval", "change [%]"],
        last=["alarm"],
        rows=rows,
        notes=[alarm.line for alarm in online.alarms.values()],
    )

"""Console output: tables on stdout, errors on stderr."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

from rich.cells import cell_len
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from stribeck.core.base.text_table import TextTable, number

if TYPE_CHECKING:
    from stribeck.app.comparison import Comparison
    from stribeck.check import Inspection
    from stribeck.core.result import Result
    from stribeck.design import Plan, Replay

STYLES = {"identified": "green", "weak": "yellow", "no friction": "cyan", "not excited": "dim"}
STYLES |= dict.fromkeys(("opposite", "no", "ALARM"), "red")
WIDE = 165
"""Minimum width of a terminal [columns] for friction at three speeds; narrower tables show the middle speed."""
PLAIN_WIDTH = 185
"""Width of tables that are not printed to a terminal [columns]."""


def terminal(plain_width: int = 0, *, stderr: bool = False) -> Console:
    """Open the terminal, or a wide output without colors."""
    console = Console(stderr=stderr, highlight=False, emoji=False)
    if not console.is_terminal:
        console.width = plain_width or PLAIN_WIDTH
    return console


def say(lines: Iterable[str], console: Console | None = None) -> None:
    """Print lines without interpreting markup, wrapped between words and indented where they continue."""
    console = console or terminal()
    for line in lines:
        text = fill(line, console.width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
        console.print(text, markup=False, highlight=False, soft_wrap=True)


def print_error(message: str) -> None:
    """Print one sentence on stderr, wrapped only in a terminal."""
    say([f"stribeck: {message}"], terminal(10**6, stderr=True))


def print_paths(paths: Sequence[Path]) -> None:
    """Print the paths of written files, one per line."""
    for path in paths:
        print(path)


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Any]:
    """Draw a progress bar on stderr if it is a terminal, and not `quiet`; give its callback `(stage, fraction)`."""
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn())
    errors = terminal(stderr=True)
    with Progress(*columns, console=errors, transient=True, disable=quiet or not errors.is_terminal) as progress:
        task = progress.add_task("starting", total=1.0)
        yield lambda stage, share: progress.update(task, description=stage, completed=share)


def print_table(table: TextTable) -> None:
    """Print a table and its notes; long cells are folded, never cut, and rows of one name form a section.

    Names in the first column stay on one line unless they need half of the width.
    """
    console = terminal()
    console.print(drawn(table, console.width))
    say(table.notes)


def drawn(table: TextTable, width: int = WIDE) -> Table:
    """Draw a table for a console of this width."""
    drawn = Table(title=Text(table.title, style="table.title"))
    for headings, justify in ((table.left, "left"), (table.right, "right"), (table.last, "left")):
        for heading in headings:
            drawn.add_column(Text(heading), justify=justify, overflow="fold")  # type: ignore[arg-type]
    names = [row[0] for row in table.rows]
    for k, row in enumerate(table.rows):
        first = "" if k and names[k - 1] == names[k] else row[0]
        ends = len(set(names)) < len(names) and names[k + 1 : k + 2] != [names[k]]
        drawn.add_row(Text(first), *(Text(cell, style=_style(cell)) for cell in row[1:]), end_section=ends)
    longest = max(map(cell_len, names), default=0)
    if longest <= width // 2:
        drawn.columns[0].no_wrap, drawn.columns[0].min_width = True, longest
    return drawn


def _style(cell: str) -> str:
    """Choose the color of a cell: that of its verdict, yellow for weak parameters."""
    return "yellow" if cell.endswith("?") else STYLES.get(cell.partition(",")[0], "")


def print_result(result: Result) -> None:
    """Print one line per joint, its parameters unless the law is "auto", reasons of weak verdicts, and warnings."""
    from stribeck.app.report.overview import FIRST, by_priority, unknown_friction
    from stribeck.core.base.finding import listed
    from stribeck.core.friction import AUTO
    from stribeck.core.result.estimates import verdict_place
    from stribeck.core.result.tables import advice, bound_text, main_reason

    print_table(_lines_of_joints(result, all_speeds=terminal().width >= WIDE))
    without = {name: joint for name, joint in result.all_friction.items() if joint.verdict == "no friction"}
    if without:
        bounds = ", ".join(f"{name} ({bound_text(joint) or joint.reason})" for name, joint in without.items())
        say([f"friction below the resolution of the log: {bounds} ({verdict_place('no friction')})"])
    if result.law != AUTO:
        print_table(_columns_of_parameters(result))
    for log in result.held_out:
        print(f"validation log {log.path}, {number(log.duration)} s:")
        rows = [
            [joint, number(error.rms), number(error.rms_zero_friction), f"{error.torque_r2:.3f}"]
            for joint, error in log.joints.items()
        ]
        numbers = ["RMS\nwith friction", "RMS\nwithout friction", "torque R²"]
        print_table(TextTable(title="torque error [N m]", left=["joint"], right=numbers, rows=rows))
    say([result.log.usage])
    doubtful = {name: joint for name, joint in result.all_friction.items() if joint.verdict in ("weak", "not excited")}
    first = sorted(doubtful, key=lambda name: -unknown_friction(doubtful[name]))[:FIRST]
    for name in first:
        step = advice(doubtful[name])
        step = f"{step[0].upper()}{step[1:]} ({verdict_place(doubtful[name].verdict)})."
        say([f"{name} {doubtful[name].verdict}: {main_reason(doubtful[name])}. {step}"])
    if others := [name for name in doubtful if name not in first]:
        say([f"weak or not excited, too: {listed(others)} (reasons in the report)"])
    warnings = [finding for finding in by_priority(result) if not finding.note]
    say(f"warning: {finding.line}" for finding in warnings[:FIRST])
    if later := [finding.check for finding in warnings[FIRST:]]:
        what = "more warning" if len(later) == 1 else "more warnings"
        say([f"{len(later)} {what} in the report: {listed(later)} (stribeck explain CHECK)"])


def _lines_of_joints(result: Result, *, all_speeds: bool) -> TextTable:
    from stribeck.core.result.tables import MAIN, advice, main_parameters, point_text

    numbers = {name: main_parameters(joint) for name, joint in result.all_friction.items()}
    column_units = {title: sorted({row[k][1] for row in numbers.values()} - {""}) for k, title in enumerate(MAIN)}
    if not column_units["rotor"]:
        del column_units["rotor"]
    units = {joint.units() for joint in result.all_friction.values() if joint.curve} or {("rad/s", "N m")}
    speeds = {"slow": 0, "middle": 1, "fast": 2} if all_speeds else {"friction": 1}
    mixed = len(units) > 1
    unit = "" if mixed else "{1}, at {0}".format(*min(units))
    headings = [f"{name}\n[{', '.join(symbols)}]" for name, symbols in column_units.items()]
    headings += [f"{speed}\n[{unit}]" if unit else speed for speed in speeds]
    rows = []
    for name, joint in result.all_friction.items():
        speed_unit, unit = (f" {symbol}" if mixed else "" for symbol in joint.units())
        cells = [f"{value} {own}" if value and mixed else value for value, own in numbers[name][: len(column_units)]]
        for k in speeds.values():
            point = joint.curve[k] if len(joint.curve) > k else None
            cells.append(f"{point_text(point)}{unit} at {point.velocity:.2g}{speed_unit}" if point else "")
        cells.append("" if joint.friction_r2 is None else f"{joint.friction_r2:.3f}")
        rows += [[name, *cells, joint.verdict, advice(joint)]] * (joint.verdict != "no friction")
    return TextTable(
        title=f"Friction of {result.robot} (95 % intervals, law {result.law})",
        left=["joint"],
        right=[*headings, "friction\nR²"],
        last=["verdict", "next step"],
        rows=rows,
    )


def _columns_of_parameters(result: Result) -> TextTable:
    from stribeck.core.result.tables import with_error

    units: dict[str, set[str]] = {}
    for joint in result.all_friction.values():
        for parameter, estimate in joint.parameters.items():
            units.setdefault(parameter, set()).add(estimate.unit)
    headings = [f"{parameter}\n[{', '.join(sorted(symbols))}]" for parameter, symbols in units.items()]
    rows = []
    for name, joint in result.all_friction.items():
        texts = {
            key: with_error(p.value, p.half_width) + "?" * (p.verdict == "weak") for key, p in joint.parameters.items()
        }
        rms = number(joint.validation.rms) if joint.validation else ""
        rows += [[name, *(texts.get(key, "") for key in units), rms]] * bool(texts)
    title = "Parameters (95 % intervals; ? marks weak ones)"
    return TextTable(title=title, left=["joint"], right=[*headings, "RMS held out\n[N m]"], rows=rows)


def print_inspection(inspection: Inspection) -> None:
    """Print the sampling of a log, one line per joint, and the findings."""
    modes: dict[str, list[float]] = {}
    for start, end, name, _ in inspection.phases:
        modes.setdefault(name, []).append(end - start)
    shares = (f"{name} {len(spans)} phase{'s' * (len(spans) > 1)}, {sum(spans):.2f} s" for name, spans in modes.items())
    support = f"support: {', '.join(shares)} (from {inspection.support_source})"
    lines = [
        f"{inspection.path}: {inspection.samples} samples, {inspection.duration:.2f} s at {inspection.rate:.6g} Hz, "
        f"jitter {1e3 * inspection.jitter:.3g} ms",
        f"channels: {', '.join(inspection.channels)}; torque source: {inspection.torque_source}",
        f"gaps: {len(inspection.gaps)}, repeated stamps: {inspection.duplicates}, "
        f"rows with missing values: {sum(inspection.missing.values())}",
        *([] if inspection.support_source == "fixed" else [support]),
        f"filter: {inspection.filter}",
    ]
    say(lines)
    print_table(inspection.table())


def print_comparison(comparison: Comparison) -> None:
    """Print the conclusion of a comparison, then one line per parameter."""
    say([comparison.conclusion])
    print_table(comparison.table())


def print_plan(plan: Plan) -> None:
    """Print the compared motions of each joint, best first, then one sentence per joint."""
    from stribeck.design import within

    if plan.joints:
        print_table(plan.table())
    elif not plan.trajectory:
        print("nothing to plan: no joint is weak or not excited")
    if motion := plan.trajectory:
        widths = ", ".join(f"{name} {within(promise.relative_width)}" for name, promise in motion.promise.items())
        used = ", ".join(f"{100 * share:.0f} % of the {name} limits" for name, share in motion.used.items() if share)
        duration = f"{motion.duration:.0f} s"
        expected = [f"expected intervals after the trajectory ({duration}): {widths}"]
        say(expected if widths else [f"trajectory before the first log, {duration}:", *motion.lines])
        near = "" if motion.clearance is None else f"; bodies keep {1000 * motion.clearance:.0f} mm apart"
        say([f"the trajectory uses {used}{near}"])
    say(f"note: {note}" for note in plan.notes)


def print_replay(replay: Replay) -> None:
    """Print the torque errors and the rollout errors of each model, and their medians over the joints."""
    names = _model_names(replay)
    headings = [f"{name}\n{1e3 * horizon:.0f} ms" for name in names for horizon in replay.horizons]
    horizons = range(len(replay.horizons))
    torque, rollouts = [], []
    for joint in replay.joints:
        errors = [model.torque.get(joint) for model in replay.models]
        torque.append([joint, *(f"{error.r2:.3f} ({number(error.rms)})" if error else "" for error in errors)])
        runs = [run for model in replay.models for run in model.rollouts.get(joint, [None] * len(horizons))]
        rollouts.append([joint, *(_relative(run.relative if run else None) for run in runs)])
    torque.append(["median", *("" if (r2 := model.median_r2()) is None else f"{r2:.3f}" for model in replay.models)])
    rollouts.append(["median", *(_relative(model.median_relative(k)) for model in replay.models for k in horizons)])
    file, *others = dict.fromkeys(model.model for model in replay.models)
    say([replay.headline(), f"model: {file}", *(f"new model: {other}" for other in others)])
    title = f"Torques of {replay.robot}: R² (RMS error [N m])"
    print_table(TextTable(title=title, left=["joint"], right=names, rows=torque))
    title = "Velocity error of simulations divided by the change of velocity (RMS)"
    notes = ["Values above 1 are worse than a constant velocity.", *(f"note: {note}" for note in replay.notes)]
    print_table(TextTable(title=title, left=["joint"], right=headings, rows=rollouts, notes=notes))


def _model_names(replay: Replay) -> list[str]:
    """Label the robot's own model "model" and the other "new model", without and with friction where both exist."""
    files = [model.model for model in replay.models]
    return [
        ("model" if model.model == files[0] else "new model")
        + ("\n+ friction" if model.friction else "\nno friction" if files.count(model.model) > 1 else "")
        for model in replay.models
    ]


def _relative(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def show(result: Any, printer: Callable[[Any], None], paths: list[Path], *, json: bool, quiet: bool) -> None:
    """Print a result as JSON, or as tables followed by the paths of the written files."""
    if json:
        print(result.to_json(), end="")
    elif not quiet:
        printer(result)
        print_paths(paths)

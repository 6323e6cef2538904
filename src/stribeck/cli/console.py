"""What the command line prints: tables on stdout, errors on stderr."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.cells import cell_len
from rich.console import Console
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from stribeck.audit.inspection import Inspection
    from stribeck.plan.plan import Plan
    from stribeck.replay.replay import Replay
    from stribeck.result import ParameterEstimate, Result
    from stribeck.result.compare import Comparison, Difference

ERRORS = Console(stderr=True, emoji=False)
STYLES = {"identified": "green", "weak": "yellow", "no friction": "cyan", "not excited": "dim"}
WIDE = 110
"""Columns from which a line has friction at all speeds, not at the middle one alone."""
PLAIN_WIDTH = 160
"""Columns of a table that does not go to a terminal."""


def _console() -> Console:
    console = Console(highlight=False, emoji=False)
    return console if console.is_terminal else Console(highlight=False, emoji=False, width=PLAIN_WIDTH)


def _say(lines: Iterable[str]) -> None:
    """Print lines as they are."""
    console = _console()
    for line in lines:
        console.print(line, markup=False)


def print_error(message: str) -> None:
    """Print one sentence on stderr, as it is."""
    ERRORS.print(f"stribeck: {message}", markup=False, highlight=False, soft_wrap=True)


def print_paths(paths: Sequence[Path]) -> None:
    """Print the files that were written."""
    for path in paths:
        print(path)


def number(value: float) -> str:
    """Return a number with four significant digits."""
    return f"{value:.4g}"


def _table(title: str, left: Sequence[str], right: Sequence[str] = (), last: Sequence[str] = ()) -> Table:
    """Return an empty table: columns of text, of numbers, and of text again; what is too long is broken, never cut."""
    table = Table(title=Text(title, style="table.title"))
    for headings, justify in ((left, "left"), (right, "right"), (last, "left")):
        for heading in headings:
            table.add_column(Text(heading), justify=justify, overflow="fold")  # type: ignore[arg-type]
    return table


def _show(table: Table, names: Iterable[str]) -> None:
    """Print a table whose first column has joints, their names in one line unless they take half of the width."""
    console, longest = _console(), max(map(cell_len, names), default=0)
    if longest <= console.width // 2:
        table.columns[0].no_wrap, table.columns[0].min_width = True, longest
    console.print(table)


def print_result(result: Result) -> None:
    """Print a line a joint: friction, verdict, what to do; of a law that was chosen, its parameters; then warnings."""
    from stribeck.friction import AUTO
    from stribeck.result.joint import verdict_place

    _show(_lines_of_joints(result, all_speeds=_console().width >= WIDE), result.all_friction)
    without = {name: joint for name, joint in result.all_friction.items() if joint.verdict == "no friction"}
    if without:
        bounds = ", ".join(f"{name} ({joint.reason.rpartition(', ')[2]})" for name, joint in without.items())
        _say([f"no friction that the log resolves: {bounds} ({verdict_place('no friction')})"])
    if result.law != AUTO:
        _show(_columns_of_parameters(result), result.all_friction)
    for log in result.held_out:
        print(f"{log.path or 'log'}, {number(log.duration)} s that no fit has seen:")
        table = _table("what is left of the torques", ["joint"], ["RMS\nwith friction", "RMS\nwithout", "R²"])
        for joint, error in log.joints.items():
            table.add_row(Text(joint), number(error.rms), number(error.rms_zero_friction), f"{error.torque_r2:.3f}")
        _show(table, log.joints)
    poor = {name: joint for name, joint in result.all_friction.items() if joint.verdict in ("weak", "not excited")}
    _say([result.log.usage])
    _say(f"{name}: {joint.verdict}: {joint.reason} ({verdict_place(joint.verdict)})" for name, joint in poor.items())
    _say(f"warning: {warning}" for warning in result.warning_lines)


def _lines_of_joints(result: Result, *, all_speeds: bool) -> Table:
    from stribeck.result.tables import advice, point_text

    units = {joint.curve[0].unit for joint in result.all_friction.values() if joint.curve} or {"N m"}
    speeds = {"slow": 0, "middle": 1, "top speed": 2} if all_speeds else {"middle speed": 1}
    mixed = len(units) > 1
    headings = [speed if mixed else f"{speed}\n[{min(units)}]" for speed in speeds]
    title = f"{result.robot}: friction, law '{result.law}', ± half of 95 % intervals"
    table = _table(title, ["joint"], [*headings, "R²\nheld out"], ["verdict", "what to do"])
    for joint, found in result.all_friction.items():
        if found.verdict == "no friction":
            continue
        points = [found.curve[k] if len(found.curve) > k else None for k in speeds.values()]
        friction = [point_text(point) + f" {point.unit}" * mixed if point else "" for point in points]
        r2 = f"{found.torque_r2.best:.3f}" if found.torque_r2 else ""
        verdict = f"[{STYLES[found.verdict]}]{found.verdict}[/]"
        table.add_row(Text(joint), *friction, r2, verdict, Text(advice(found)))
    return table


def _columns_of_parameters(result: Result) -> Table:
    units: dict[str, set[str]] = {}
    for joint in result.all_friction.values():
        for parameter, estimate in joint.parameters.items():
            units.setdefault(parameter, set()).add(estimate.unit)
    headings = [f"{parameter}\n[{', '.join(sorted(own))}]" for parameter, own in units.items()]
    table = _table("parameters, 95 % intervals; ? is weak", ["joint"], [*headings, "RMS held out\n[N m]"])
    for name, found in result.all_friction.items():
        cells = [_with_error(found.parameters[key]) if key in found.parameters else "" for key in units]
        if found.parameters:
            table.add_row(Text(name), *cells, number(found.validation.rms) if found.validation else "")
    return table


def _with_error(found: ParameterEstimate) -> str:
    low, high = found.interval_95
    text = f"{number(found.value)} ± {(high - low) / 2:.2g}"
    return f"[yellow]{text}?[/]" if found.verdict == "weak" else text


def print_truth(result: Result, truth: Mapping[str, Mapping[str, float]]) -> None:
    """Print the truth beside what was found, joint by joint and parameter by parameter, then how many agree."""
    title, numbers = f"{result.robot}: truth and found, law '{result.law}'", ("truth", "found", "95 % interval")
    table = _table(title, ["joint", "parameter"], numbers, ["verdict"])
    parameters = identified = covered = 0
    for joint, found in result.joints.items():
        true = truth.get(joint, {})
        compared = {name: value for name, value in found.parameters.items() if name in true}
        if not compared:
            verdict = found.verdict if found.parameters else f"{found.verdict}: {found.reason}"
            table.add_row(Text(joint), "", "" if true else "none", "", "", Text(verdict, style="dim"), end_section=True)
        for k, (name, value) in enumerate(compared.items()):
            low, high = value.interval_95
            parameters += 1
            identified += value.verdict == "identified"
            covered += low <= true[name] <= high
            table.add_row(
                Text(joint) if k == 0 else "",
                Text(f"{name} [{value.unit}]"),
                number(true[name]),
                number(value.value),
                f"{number(low)} ... {number(high)}",
                f"[{STYLES[value.verdict]}]{value.verdict}[/]",
                end_section=k == len(compared) - 1,
            )
    _show(table, result.joints)
    _say([f"{parameters} parameters: {identified} identified, {covered} covered by their 95 % interval"])


def print_inspection(found: Inspection) -> None:
    """Print what a log holds: a few lines, then a line a joint, then what to act on."""
    lines = [
        f"{found.path}: {found.samples} samples, {found.duration:.2f} s at {found.rate:.6g} Hz, "
        f"jitter {1e3 * found.jitter:.3g} ms",
        f"channels: {', '.join(found.channels)}; torques are those of a {found.torque_source}",
        f"gaps: {len(found.gaps)}, repeated stamps: {found.duplicates}, "
        f"rows with missing values: {sum(found.missing.values())}",
        f"contact modes from {found.support_source}: {_support_shares(found)}",
        f"motion: {found.filter}",
    ]
    _say(lines)
    numbers = ("position [rad]", "velocity [rad/s]", "torque [N m]", "correlation with model", "torque delay [ms]")
    table = _table(f"{found.robot}: joints", ["joint"], numbers, ["sign"])
    for name, joint in found.joints.items():
        ranges = (joint.position_range, joint.velocity_range, joint.torque_range)
        table.add_row(
            Text(name),
            *(f"{number(low)} ... {number(high)}" for low, high in ranges),
            "" if joint.correlation is None else f"{joint.correlation:.2f}",
            "" if joint.delay is None else f"{1e3 * joint.delay:+.2f}",
            f"[red]{joint.sign}[/]" if joint.sign == "opposite" else joint.sign,
        )
    _show(table, found.joints)
    _say(f"finding: {finding.line}" for finding in found.audit)
    _say(f"note: {text}" for text in found.notes)


def _support_shares(found: Inspection) -> str:
    """Return how often and how long each set of feet stands, e.g. "left_foot 12 x, 9.6 s"."""
    modes: dict[str, list[float]] = {}
    for start, end, name, _ in found.phases:
        modes.setdefault(name, []).append(end - start)
    return ", ".join(f"{name} {len(spans)} x, {sum(spans):.2f} s" for name, spans in modes.items())


def print_comparison(found: Comparison) -> None:
    """Print the differences of two results: a line a parameter."""
    numbers = ("first", "second", "difference", "95 % interval", "change")
    table = _table(f"{found.a} and {found.b}", ["joint", "parameter"], numbers, ["agrees"])
    for row in found.rows:
        low, high = row.interval_95
        table.add_row(
            Text(row.joint),
            Text(f"{row.parameter} [{row.unit}]"),
            number(row.a),
            number(row.b),
            number(row.difference),
            f"{number(low)} ... {number(high)}",
            _percent(row),
            ("yes" if row.agrees else "[red]no[/]") + ", significant" * row.significant + " (weak)" * row.weak,
        )
    _show(table, [row.joint for row in found.rows])
    _say(f"{joint}: {reason}" for joint, reason in found.missing.items())


def _percent(row: Difference) -> str:
    return "" if row.percent is None else f"{row.percent:+.{0 if abs(row.percent) > 10 else 1}f} %"


def print_plan(found: Plan) -> None:
    """Print a sentence a joint, then a line for each motion that was tried, the best first."""
    if not found.joints:
        print("nothing to plan: no joint is weak or not excited")
        return
    numbers = ("speed\n[rad/s]", "reversals", "length\n[s]", "friction\nto within", "enough\nfrom [s]")
    table = _table(f"{found.robot}: what a log of each motion would say", ["joint", "motion"], numbers)
    for name, joint in found.joints.items():
        for k, one in enumerate(joint.candidates):
            spans = one.slowest not in (0.0, one.fastest)
            speed = f"{one.slowest:.2g} to {one.fastest:.2g}" if spans else f"{one.fastest:.2g}"
            table.add_row(
                Text(name if k == 0 else ""),
                Text(one.motion),
                speed + " m/s" * (joint.unit == "m/s"),
                str(one.reversals),
                f"{one.duration:.0f}",
                _within(one.relative_width),
                "" if one.needed is None else f"{one.needed:.0f}",
                end_section=k == len(joint.candidates) - 1,
            )
    _show(table, found.joints)
    _say(f"{name}: {joint.verdict}: {joint.advice}" for name, joint in found.joints.items())
    if found.trajectory:
        said = ", ".join(f"{name} {_within(one.relative_width)}" for name, one in found.trajectory.promise.items())
        used = ", ".join(f"{share:.0%} of the {name} limits" for name, share in found.trajectory.used.items() if share)
        _say([f"a log of the trajectory, {found.trajectory.duration:.0f} s, promises: {said}", f"it uses {used}"])
    _say(f"note: {note}" for note in found.notes)


def _within(width: float) -> str:
    return f"± {100 * width:.2g} %" if width < 1 else "unknown"  # half of an interval over the value


def print_replay(found: Replay) -> None:
    """Print a table of the torque's errors and one of the rollouts', a column a model, medians of the joints last."""
    names = [model.name.replace(", ", "\n") for model in found.models]
    times = ", ".join(f"{1e3 * horizon:.0f}" for horizon in found.horizons)
    torque = _table(f"{found.robot}: R² of the torque (RMS error [N m])", ["joint"], names)
    rollouts = _table(f"RMS velocity error after {times} ms over the RMS change of velocity", ["joint"], names)
    for joint in found.joints:
        errors = [model.torque.get(joint) for model in found.models]
        torque.add_row(Text(joint), *(f"{error.r2:.3f} ({number(error.rms)})" if error else "" for error in errors))
        runs = [model.rollouts.get(joint, []) for model in found.models]
        rollouts.add_row(Text(joint), *(_relative(each.relative if each else None for each in run) for run in runs))
    for table in (torque, rollouts):
        table.add_section()
    torque.add_row("median", *("" if (r2 := model.median_r2()) is None else f"{r2:.3f}" for model in found.models))
    horizons = range(len(found.horizons))
    rollouts.add_row("median", *(_relative(model.median_relative(k) for k in horizons) for model in found.models))
    _show(torque, found.joints)
    _show(rollouts, found.joints)
    _say(f"note: {note}" for note in found.notes)


def _relative(values: Iterable[float | None]) -> str:
    return "  ".join("-" if value is None else f"{value:.3g}" for value in values)

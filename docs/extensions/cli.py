"""Write docs/cli.md from the commands: `python docs/extensions/cli.py`."""

import re
from collections import Counter
from pathlib import Path
from typing import Any

import typer

from stribeck.app.cli.app import app

PAGE = Path(__file__).parents[1] / "cli.md"

COMMON = 3
"""Number of commands from which an argument or option is explained once for all of them [1]."""

HEAD = """# Command line

This page lists all commands, as `stribeck COMMAND -h` prints them. Results go to stdout, errors and progress to stderr.
Outputs are written completely or not at all. `stribeck --install-completion` enables completion in your shell.

| exit code | meaning |
|---|---|
| 0 | done |
| 2 | wrong input or settings, explained in one sentence |
| 3 | no joint is identified or without friction; the results are written unless all joints are at rest |
| 130 | interrupted |
"""


def page() -> str:
    """Format the whole page."""
    commands = typer.main.get_group(app).commands
    counts = Counter(_row(one) for command in commands.values() for one in _shown(command))
    common = [row for row, count in counts.items() if count >= COMMON]
    parts = [HEAD, "## Arguments and options of several commands\n", _table("argument or option", common)]
    for name, command in commands.items():
        arguments = [one for one in command.params if not _is_option(one)]
        usage = " ".join(["stribeck", name, *map(_place, arguments), "[OPTIONS]"])
        also = ", ".join(_row(one).split("`")[1].split()[0] for one in _options(command) if _row(one) in common)
        own = [row for row in map(_row, _shown(command)) if row not in common]
        parts += [f"## {name}\n", f"`{usage}`\n", f"{_text(command.help)}\n", _table("argument or option", own)]
        if also:
            parts.append(f"Also {', '.join(f'`{one}`' for one in also.split(', '))}.\n")
    return "\n".join(parts)


def _is_option(parameter: Any) -> bool:
    return str(parameter.opts[0]).startswith("-")


def _options(command: Any) -> list[Any]:
    return [one for one in _shown(command) if _is_option(one)]


def _shown(command: Any) -> list[Any]:
    """Return the arguments of a command, then its options that are not hidden."""
    return sorted((one for one in command.params if not getattr(one, "hidden", False)), key=_is_option)


def _place(argument: Any) -> str:
    """Format an argument as a usage line has it."""
    name = (argument.metavar or argument.name.upper()).strip("[]")
    return name + "..." * (argument.nargs == -1) if argument.required else f"[{name}]"


def _row(parameter: Any) -> str:
    """Format a row of a table: names and value, then help, whether required, and default; the usage has the dots."""
    if not _is_option(parameter):
        return f"| `{_place(parameter).replace('...', '')}` | {_text(parameter.help)} |"
    value = "" if parameter.is_flag else f" {parameter.metavar or _kind(parameter)}"
    names = ", ".join(f"`{name}{value}`" for name in sorted(parameter.opts, key=len, reverse=True))
    default = parameter.default
    shown = parameter.show_default if isinstance(parameter.show_default, str) else default
    hidden = shown in (None, False, True, []) or "[default:" in (parameter.help or "")  # the help describes it
    note = "Required." if parameter.required else "" if hidden else f"Default: `{shown}`."
    return f"| {names} | {_text(parameter.help)} {note}".rstrip() + " |"


def _kind(parameter: Any) -> str:
    annotation = str(parameter.type_descriptor.annotation)
    return "PATH" if "Path" in annotation else "TEXT" if "str" in annotation else "NUMBER"


def _text(help_text: str | None) -> str:
    """Format a help text for a cell; options are code, because Sphinx joins two hyphens to a dash."""
    text = " ".join((help_text or "").split()).replace("|", r"\|")
    return re.sub(r"(--[a-z][\w-]*(?: [\w.]+=\w+)?)", r"`\1`", text)


def _table(heading: str, rows: list[str]) -> str:
    return "\n".join([f"| {heading} | meaning |", "|---|---|", *rows, ""])


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")

"""Remedies of messages: their settings and options, applied to a robot file as they are printed."""

import re
import tomllib
from collections.abc import Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any

import tomlkit


def parsed(text: str) -> Any:
    """Read a value of TOML; None if it is none."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return None


def settings_in(message: str) -> Iterator[tuple[str, str, Any]]:
    """Yield table, key and value of `key = value in [table]` and `[table] key = value` in a message."""
    for found in re.finditer(r"(?:\[([\w.]+)\] )?(\w+) = ", message):
        rest = message[found.end() :]
        if found[1]:
            values = ((found[1], parsed(rest[:end])) for end in range(len(rest), 0, -1))
        else:
            values = ((each[1], parsed(rest[: each.start()])) for each in re.finditer(r" in \[([\w.]+)\]", rest))
        yield from ((table, found[2], value) for table, value in islice((v for v in values if v[1] is not None), 1))


def apply(message: str, robot: Path) -> list[str]:
    """Write the settings of the first alternative that has any to the robot file, or list its options."""
    message = next(
        (part for part in message.split(", or ") if re.search(r" = |--exclude| the (law|method) ", part)), message
    )
    answer(robot, {f"{table}.{key}": value for table, key, value in settings_in(message)})
    options = [word for option in re.findall(r"--exclude \S+", message) for word in option.split()]
    for name in ("law", "method"):
        options += [f"--{name}={found}" for found in re.findall(rf"(?:[Uu]se|choose) the {name} ([\w-]+)", message)]
    return options


def answer(robot: Path, values: Mapping[str, Any]) -> None:
    """Write values by dotted key to a robot file."""
    document = tomlkit.parse(robot.read_text())
    for key, value in values.items():
        *tables, last = key.split(".")
        place: Any = document
        for part in tables:
            place = place.setdefault(part, {})
        place[last] = value
    robot.write_text(tomlkit.dumps(document))

"""Remedies of messages, applied to a robot file as they are printed, and identification before and after."""

import re
import sys
import tomllib
import traceback
from collections.abc import Iterator, Mapping
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from itertools import islice
from pathlib import Path
from typing import Any
from unittest.mock import patch

import tomlkit

from stribeck import read_result
from stribeck.app.cli import main

ROUNDS = 3
"""Largest number of remedies that are followed [1]."""
WRONG = 0.15
"""Relative error [1] from which an identified point outside its interval counts as wrong."""


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


def typed(*words: object) -> tuple[int, str]:
    """Run the command line in this process; return its exit code (1 with a traceback for a bug), and its messages."""
    said, code = StringIO(), 0
    given = patch.object(sys, "argv", ["stribeck", *map(str, words)])
    with given, redirect_stderr(said), redirect_stdout(StringIO()):
        try:
            main()
        except SystemExit as stop:
            code = stop.code if isinstance(stop.code, int) else int(stop.code is not None)
        except Exception:
            code = 1
            traceback.print_exc()
    return code, said.getvalue()


def last_error(said: str) -> str:
    """Select the last error in the messages of the command line."""
    return said.rpartition("stribeck: ")[2].strip()


Truth = Mapping[str, Any]
"""Friction torque at positive velocities by joint: a function of velocity."""


@dataclass(frozen=True)
class Run:
    """Findings by check with their joints and words, largest relative error [1] by joint, joints that are wrong."""

    findings: dict[str, tuple[tuple[str, ...], str]]
    error: dict[str, float]
    wrong: list[str]
    refused: str = ""


def identify(log: Path, robot: Path, truth: Truth, options: list[str]) -> Run:
    """Identify a log, and compare the friction curves with the truth."""
    out = robot.parent / "out"
    code, said = typed("identify", log, "-r", robot, "-o", out, "--overwrite", *options)
    if code:
        words = last_error(said)
        check = re.search(r"stribeck explain ([\w-]+)", words)
        return Run({check[1] if check else "refused": ((), words)}, {}, [], words)
    result = read_result(out / "result.json")
    error, wrong = dict[str, float](), list[str]()
    for name, joint in result.joints.items():
        if name not in truth:
            continue
        far = [(abs(point.value - truth[name](point.velocity)), point) for point in joint.curve]
        error[name] = max((off / truth[name](point.velocity) for off, point in far), default=0.0)
        beyond = any(off > max(point.half_width, WRONG * truth[name](point.velocity)) for off, point in far)
        wrong += [name] * (joint.verdict == "identified" and beyond)
    return Run({each.check: (each.joints, str(each)) for each in result.findings}, error, wrong)


def follow(log: Path, robot: Path, truth: Truth) -> tuple[Run, Run]:
    """Identify, and follow the remedies; return the first and the last run."""
    options: list[str] = []
    first = last = identify(log, robot, truth, options)
    for _ in range(ROUNDS):
        before, given = robot.read_text(), list(options)
        for _, words in last.findings.values():
            if "before you" not in words:  # a question
                options += [option for option in apply(words, robot) if option not in options or option == "--exclude"]
        if robot.read_text() == before and options == given:
            break
        last = identify(log, robot, truth, options)
    return first, last

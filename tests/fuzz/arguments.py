"""Command lines with wrong words: values of options, options of other commands, words lost or given twice."""

from pathlib import Path

import typer
from tests.fuzz.damage import NUMBERS, WORDS, pick

from stribeck.cli.app import app

COMMANDS = getattr(typer.main.get_command(app), "commands")  # noqa: B009 - of a group
SAFE = tuple(word for word in WORDS if "/" not in word and "\0" not in word and word.isprintable())
"""Words that name no place outside the folder of the input."""


def arguments(generator, folder, seeds):  # noqa: ARG001 - its files are sound
    """Change one or two words of a sound command line, or add an option of any command."""
    log, robot, result = (str(seeds / name) for name in ("log.npz", "robot.toml", "result.json"))
    words = list(
        pick(
            generator,
            (
                ["inspect", log, "-r", robot, "--from", "0.1", "--to", "0.9"],
                ["inspect", log, "-r", robot, "--exclude", "0.1:0.2", "-o", "out.html"],
                ["identify", log, "-r", robot, "-o", "out", "--method", "curve-fit", "--law", "stribeck"],
                ["export", result, "-r", robot, "--to", "urdf", "-o", "out", "--joints", "elbow"],
                ["export", result, "-r", robot, "--to", "mjcf", "-o", "out", "--samples", "2"],
                ["compare", result, result, "--names", "a,b", "-o", "out.html"],
                ["plan", result, "-r", robot, "--held", "x", "--joints", "elbow"],
                ["replay", log, "-r", robot, "-m", str(seeds / "arm.xml"), "-o", "out"],
                ["convert", log, "out.csv"],
                ["trends", str(seeds / "store"), "-o", "out", "--logs-per-false-alarm", "100"],
                ["fleet", "none.npz", "-r", robot, "-o", "out", "--jobs", "1", "--timeout", "5", "--memory", "2"],
                ["fleet", "--compact", "store"],
                ["simulate", "scenario.toml", "-o", "out.npz"],
                ["init", str(seeds / "arm.urdf"), log, "-o", "out.toml"],
                ["explain", "weak"],
            ),
        )
    )
    for _ in range(pick(generator, (1, 1, 2))):
        place = int(generator.integers(1, len(words) + 1))
        options = [each for each in COMMANDS[words[0]].params if each.param_type_name == "option"]
        if generator.random() < 0.1:
            options = COMMANDS[pick(generator, tuple(COMMANDS))].params
        value = str(
            pick(generator, (*NUMBERS, *SAFE, "1:2", "log:1:2", "a=b", "elbow,elbow", ",", str(Path("none.npz"))))
        )
        match int(generator.integers(5)):
            case 0 if place < len(words):
                del words[place]
            case 1 if place < len(words) and words[place - 1] not in ("-o", "convert"):
                words[place] = value
            case 2:
                words.insert(place, value if place < len(words) and words[place - 1] != "-o" else "--json")
            case _ if options and (option := pick(generator, options)).opts[0] != "--output":
                words += [option.opts[0], *[value] * (not getattr(option, "is_flag", False))]
    return [word.encode(errors="replace").decode() for word in words]

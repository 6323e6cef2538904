"""Run every command on every published log of real robots, as a user would, and print one table.

    STRIBECK_REAL_LOGS=DATA_FOLDER python -m studies.real

Each log individually, and all logs of a robot together, go through `inspect`, `convert`, `init`, `identify` with the
robot file's settings, with every law, and with every method and correction for one law, `export`, `compare` and `plan`.
A refusal in one sentence (exit codes 2 and 3) is accepted. Any other nonzero exit code and any traceback is a failure;
this command then ends with exit code 1.
"""

import argparse
import os
import re
import runpy
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from joblib import Parallel, delayed

from stribeck.friction import AUTO, LAWS, LAWS_WITH_STATE
from stribeck.methods import METHODS
from stribeck.robot import Robot
from studies.command import ROOT
from studies.remedies import last_error, typed

EXAMPLES = ROOT / "examples" / "real_robots"
DATA = Path(os.environ.get("STRIBECK_REAL_LOGS", ROOT.parent / "shared" / "real-logs"))
WORKERS = 2
ANSWERS = (0, 2, 3)
"""Exit codes that a user can act on."""
CORRECTIONS = ("none", "inertia", "calibration")
FIRST = "coulomb-viscous"
THIN = ("double-pendulum", "so101", "cassie-landings", "icub-walk")
"""Robots whose first log passes a few commands within seconds."""
FORMATS = {".urdf": "urdf", ".xml": "mjcf"}


class Ran(NamedTuple):
    """A completed command: its log, exit code, duration and messages."""

    log: str
    command: str
    code: int
    seconds: float
    said: str

    @property
    def failed(self) -> bool:
        """Whether the command ended without a success or a refusal in one sentence."""
        return self.code not in ANSWERS or "Traceback" in self.said

    def cells(self) -> list[str]:
        """Format the row of the table, with the last message."""
        said = " ".join(re.sub(r"/\S*/", "", last_error(self.said)).split())[:110]  # file names without folders
        return [self.log, self.command, str(self.code), f"{self.seconds:.1f}", said.replace("|", "/")]


def log_sets(folder: Path) -> dict[str, list[Path]]:
    """List a robot's logs: each log individually, and all together."""
    logs = sorted(folder.glob("log*.npz"))
    alone = {f"{folder.name} {log.stem}": [log] for log in logs}
    return alone if len(logs) == 1 else {f"{folder.name} all": logs, **alone}


def choices(law: str) -> Iterator[dict[str, str]]:
    """Yield the methods and corrections to fit a law with: all with the first law, the usual ones with the others."""
    if law in LAWS_WITH_STATE:
        yield {"method": "curve-fit"}
    elif law != FIRST:
        yield {"method": "whole-log"}
    else:
        yield from ({"method": method} for method in METHODS if method != "whole-log")
        yield from ({"method": "whole-log", "corrections": corrections} for corrections in CORRECTIONS)


def model_of(robot: Path) -> Path:
    """Find the model of a robot file."""
    return Robot.from_file(robot).model_file


def looks(logs: Sequence[Path], out: Path) -> dict[str, list[object]]:
    """List the commands that look at a log and its model, by label."""
    log, robot = logs[0], logs[0].parent / "robot.toml"
    return {
        "inspect": ["inspect", log, "-r", robot],
        "convert": ["convert", log, "-r", robot, "-o", out / "log.parquet"],
        "init": ["init", model_of(robot), log, "-o", out / "robot.toml"],
    }


def fits(logs: Sequence[Path], out: Path, law: str | None, thin: bool) -> dict[str, list[object]]:
    """List the commands that fit one law by all methods, or the robot file's own settings, and use the results."""
    robot, found = logs[0].parent / "robot.toml", dict[str, list[object]]()
    model, first = model_of(robot), None
    for choice in choices(law) if law else [{}]:
        if thin and choice.get("corrections", "inertia") != "inertia":
            continue
        shown = " ".join([*choice.values(), law or "default"])
        place, words = out / shown.replace(" ", "-"), [f"--law={law}"] if law else []
        words += [word for key, value in choice.items() for word in ("--set", f"{key}={value}")]
        found[f"identify {shown}"] = ["identify", *logs, "-r", robot, "-o", place, *words]
        to, copy = FORMATS[model.suffix], place / f"model{model.suffix}"
        found[f"export {to} {shown}"] = ["export", place, "-r", robot, "--to", to, "-o", copy]
        found[f"compare {shown}"] = ["compare", *dict.fromkeys((first or place, place))]
        first = first or place
    if not law:
        found["plan"] = ["plan", first, "-r", robot, "-o", out / "plan"]
    return found


def run(log: str, commands: dict[str, list[object]]) -> list[Ran]:
    """Run command lines in this process; without a result, the commands that need it are refused."""
    ran = []
    for shown, words in commands.items():
        start = time.monotonic()
        code, said = typed(*words)
        ran.append(Ran(log, shown, code, time.monotonic() - start, said))
    return ran


def all_runs(data: Path, scratch: Path, only: str | None, thin: bool) -> Iterator[Ran]:
    """Convert the logs, run the commands on a few workers, and yield them robot by robot."""
    script = runpy.run_path(str(EXAMPLES / "convert.py"))
    robots = [robot for robot in script["CONVERTERS"] if only in (None, robot) and (not thin or robot in THIN)]
    jobs = []
    for robot in robots:
        sets = log_sets(script["convert"](robot, data, scratch / "logs"))
        for name, logs in list(sets.items())[-1 if thin else 0 :]:
            out = scratch / name.replace(" ", "-")
            out.mkdir(parents=True)
            if len(logs) == 1:
                jobs.append((name, looks(logs, out)))
            if robot == "cassie-landings" and len(logs) == 1 and not thin:
                continue  # logs of fifty milliseconds are inspected, and fitted only together
            for law in (None, FIRST) if thin else (None, *LAWS, *LAWS_WITH_STATE, AUTO):
                jobs.append((name, fits(logs, out, law, thin)))
    yield from chain.from_iterable(Parallel(WORKERS, return_as="generator")(delayed(run)(*job) for job in jobs))


def main(words: Sequence[str] | None = None) -> int:
    """Print the table; return 1 if a command failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", metavar="ROBOT", help="this robot's logs alone")
    parser.add_argument("--thin", action="store_true", help="one log of the quick robots, a few commands")
    chosen = parser.parse_args(words)
    if not DATA.is_dir():
        parser.error(f"{DATA} is no folder; set STRIBECK_REAL_LOGS to the folder of the published logs")
    ran = []
    with tempfile.TemporaryDirectory() as scratch:
        for each in all_runs(DATA, Path(scratch), chosen.only, chosen.thin):
            print(*each.cells(), sep=" | ", flush=True)
            ran.append(each)
    failures = [each for each in ran if each.failed]
    for each in failures:
        print(f"\n{each.log}: {each.command}: exit code {each.code}\n{each.said}")
    codes = Counter(each.code for each in ran)
    print(f"\n{len(ran)} commands; {', '.join(f'{count} ended with {code}' for code, count in sorted(codes.items()))}")
    return 1 if failures or not ran else 0


if __name__ == "__main__":
    sys.exit(main())

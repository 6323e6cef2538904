"""Run every command on every published log of real robots, as a user would, and print one table.

    STRIBECK_REAL_LOGS=DATA_FOLDER python -m studies.real

Each log individually, and all logs of a robot together, go through `inspect`, `convert`, `init`, `identify` with the
robot file's settings, with every law, and with every method and correction for one law, `export`, `compare` and `plan`.
A refusal in one sentence (exit codes 2 and 3) is accepted. Any other nonzero exit code and any traceback is a failure;
this command then ends with exit code 1.
"""

import argparse
import io
import json
import os
import re
import runpy
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from unittest.mock import patch

from stribeck import cli
from stribeck.friction import AUTO, LAWS, LAWS_WITH_STATE
from stribeck.methods import METHODS

ROOT = Path(__file__).parents[1]
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


@dataclass(frozen=True)
class Ran:
    """A completed command: its log, exit code, duration, messages and result file."""

    log: str
    command: str
    code: int
    seconds: float
    said: str
    result: Path | None = None

    @property
    def failed(self) -> bool:
        """Whether the command ended without a success or a refusal in one sentence."""
        return self.code not in ANSWERS or "Traceback" in self.said

    def cells(self) -> list[str]:
        """Format the row of the table: the verdicts of a result, or the sentence of a refusal."""
        said = self.said.strip().split("stribeck: ")[-1]  # the sentence comes after the notes
        said = " ".join(re.sub(r"/\S*/", "", said).split())[:110].replace("|", "/")  # file names without folders
        counts: Counter[str] = Counter()
        if self.result and not self.code:
            joints = json.loads(self.result.read_text(encoding="utf-8"))["joints"].values()
            counts = Counter(joint["verdict"] for joint in joints)
        verdicts = ", ".join(f"{count} {verdict}" for verdict, count in counts.items())
        return [self.log, self.command, str(self.code), f"{self.seconds:.1f}", verdicts, said]


def run(log: str, words: Sequence[str], shown: str, result: Path | None = None) -> Ran:
    """Run a command line in this process, without starting another interpreter."""
    start, said = time.monotonic(), io.StringIO()
    with redirect_stdout(io.StringIO()), redirect_stderr(said), patch.object(sys, "argv", ["stribeck", *words]):
        try:
            cli.main()
            code = 0
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
        except Exception:
            code = 1
            traceback.print_exc()
    return Ran(log, shown, code, time.monotonic() - start, said.getvalue(), result)


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


def chain(name: str, logs: Sequence[Path], scratch: Path, law: str | None, only: Sequence[str] = ()) -> list[Ran]:
    """Run `identify`, `export` and `compare` for every method and correction that can fit one law.

    Parameters
    ----------
    name, logs
        Label of the logs, and their paths.
    scratch
        Folder for outputs.
    law
        Name of a law, or None for the robot file's own settings.
    only
        Corrections to try; all if empty.
    """
    robot = logs[0].parent / "robot.toml"
    model = model_of(robot)
    ran: list[Ran] = []
    first: Path | None = None
    for choice in choices(law) if law else [{}]:
        if only and choice.get("corrections", only[0]) not in only:
            continue
        words = [word for key, value in choice.items() for word in ("--set", f"{key}={value}")]
        words += ["--law", law] if law else []
        shown = " ".join([*(value for key, value in choice.items() if key != "holdout"), law or "default"])
        out = scratch / name.replace(" ", "-") / shown.replace(" ", "-")
        command = ["identify", *map(str, logs), "-r", str(robot), "-o", str(out), *words]
        found = run(name, command, f"identify {shown}", out / "result.json")
        ran.append(found)
        if found.code:
            continue
        target = FORMATS.get(model.suffix, "urdf")
        exported = ["export", str(out), "-r", str(robot), "--to", target, "-o", str(out / f"model{model.suffix}")]
        ran.append(run(name, exported, f"export {target} {shown}"))
        first = first or out
        others = [str(out)] if first != out else []
        ran.append(run(name, ["compare", str(first), *others], f"compare {'' if others else 'sides '}{shown}"))
        if not law:
            ran.append(run(name, ["plan", str(out), "-r", str(robot), "-o", str(out / "plan")], "plan"))
    return ran


def looked_at(name: str, log: Path, scratch: Path) -> list[Ran]:
    """Run `inspect` and `convert` on a log, and `init` on it and its model."""
    robot = log.parent / "robot.toml"
    out = scratch / name.replace(" ", "-")
    out.mkdir(parents=True, exist_ok=True)
    return [
        run(name, ["inspect", str(log), "-r", str(robot)], "inspect"),
        run(name, ["convert", str(log), "-r", str(robot), "-o", str(out / "log.parquet")], "convert"),
        run(name, ["init", str(model_of(robot)), str(log), "-o", str(out / "robot.toml")], "init"),
    ]


def model_of(robot: Path) -> Path:
    """Find the model next to a robot file."""
    return next(path for path in sorted(robot.parent.iterdir()) if path.suffix in FORMATS)


def all_runs(data: Path, scratch: Path, only: str | None, thin: bool) -> Iterator[Ran]:
    """Convert the logs, run the commands on a few workers, and yield them robot by robot."""
    script = runpy.run_path(str(EXAMPLES / "convert.py"))
    robots = [robot for robot in script["CONVERTERS"] if only in (None, robot) and (not thin or robot in THIN)]
    # a forked process with threads, such as the tests' process, may wait for a lock forever
    with ProcessPoolExecutor(WORKERS, mp_context=get_context("spawn")) as pool:
        jobs = []
        for robot in robots:
            sets = log_sets(script["convert"](robot, data, scratch / "logs"))
            for name, logs in list(sets.items())[-1 if thin else 0 :]:
                if len(logs) == 1:
                    jobs.append(pool.submit(looked_at, name, logs[0], scratch / "looked-at"))
                if robot == "cassie-landings" and len(logs) == 1 and not thin:
                    continue  # logs of fifty milliseconds are inspected, and fitted only together
                for law in (None, FIRST) if thin else (None, *LAWS, *LAWS_WITH_STATE, AUTO):
                    jobs.append(pool.submit(chain, name, logs, scratch / "found", law, ("inertia",) if thin else ()))
        for job in jobs:
            yield from job.result()


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

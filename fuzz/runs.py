"""Runs that are stopped at any moment, and two that write to one place: outputs are whole, of one run or another."""

import os
import shutil
import signal
import sys
import time
from pathlib import Path

import numpy as np

from fuzz.damage import pick

LAWS = ("coulomb-viscous", "stribeck")
"""Of the runs, each of which has outputs of its own."""
STOPS = (signal.SIGKILL, signal.SIGTERM, signal.SIGHUP, signal.SIGINT)
LONGEST = 1.5
"""[s] until a run is stopped; most have ended by then."""
INPUTS = ("arm.urdf", "robot.toml", "long/log.npz")


def identify(law: str, *options: str) -> list[str]:
    """Return the words of a run."""
    return ["identify", "log.npz", "-r", "robot.toml", "--method", "curve-fit", "--law", law, "-o", "out", *options]


def make_outputs(folder: Path, seeds: Path) -> None:
    """Write what each of the runs leaves when nothing disturbs it."""
    for law in LAWS:
        (folder / law).mkdir(parents=True)
        _copy_inputs(seeds, folder / law)
        if os.waitstatus_to_exitcode(os.waitpid(start(identify(law), folder / law), 0)[1]):
            raise SystemExit(f"fuzz: the law {law} finds nothing in a sound log")


def make_stopped(generator: np.random.Generator, folder: Path, seeds: Path) -> list[str]:
    """Stop a run that replaces the outputs of another one; the next run cleans up."""
    old, new = generator.permutation(LAWS).tolist()
    _copy_inputs(seeds, folder)
    shutil.copytree(seeds / "runs" / old / "out", folder / "out")
    run = start(identify(new, "--overwrite"), folder)
    time.sleep(generator.uniform(0, LONGEST))
    os.kill(run, pick(generator, STOPS))
    os.waitpid(run, 0)
    _note_torn(folder, seeds)
    return identify(old, "--overwrite")


def make_two(generator: np.random.Generator, folder: Path, seeds: Path) -> list[str]:
    """Let two runs write to one place at about the same time."""
    _copy_inputs(seeds, folder)
    runs = []
    for law in generator.permutation(LAWS).tolist():
        runs.append(start(identify(law, "--overwrite"), folder))
        time.sleep(generator.exponential(0.05))
    for run in runs:
        os.waitpid(run, 0)
    _note_torn(folder, seeds)
    return identify(pick(generator, LAWS), "--overwrite")


def torn(_: list[str], folder: Path, seeds: Path) -> bool:
    """Return whether outputs were ever not whole, or something was left beside them."""
    _note_torn(folder, seeds)
    left = [path for path in (*folder.iterdir(), *(folder / "out").iterdir()) if path.name.endswith(".part")]
    return (folder / "torn").exists() or bool(left)


def start(command: list[str], folder: Path) -> int:
    """Start the command line in a folder and return its process."""
    child = os.fork()
    if not child:
        code = 1
        try:
            from stribeck.cli import main

            os.chdir(folder)
            nowhere = os.open("/dev/null", os.O_WRONLY)
            os.dup2(nowhere, 1)
            os.dup2(nowhere, 2)
            sys.argv = ["stribeck", *command]
            main()
            code = 0
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 1
        finally:
            os._exit(code)
    return child


def _copy_inputs(seeds: Path, folder: Path) -> None:
    for name in INPUTS:
        shutil.copy(seeds / name, folder)


def _note_torn(folder: Path, seeds: Path) -> None:
    """Leave a file if the outputs there are not those of one run."""
    if _files(folder / "out") not in [_files(seeds / "runs" / law / "out") for law in LAWS]:
        (folder / "torn").touch()


def _files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()} if folder.is_dir() else {}

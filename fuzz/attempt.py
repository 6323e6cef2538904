"""One input: made in a folder of its own, and read by the command line in a child process that may die of it."""

import os
import re
import resource
import shutil
import signal
import sys
import tempfile
import traceback
import warnings
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from zlib import crc32

import numpy as np

from fuzz.apart import apart
from fuzz.kinds import KINDS
from stribeck.cli import main

TIMEOUT = 20.0
"""Of one input [s]; none of them is large enough to keep a command that long."""
MEMORY = 4 << 30
"""What a child may take beside what it was forked with [bytes]."""
REFUSALS = (2, 3)
OUTCOMES = ("accepted", "refused", "untidy", "misread", "traceback", "hang", "crash")


@dataclass(frozen=True)
class Attempt:
    """What became of an input.

    `outcome` is one of `OUTCOMES`: a refusal is untidy if it is not one sentence, or leaves an output, whole or not; an
    input is misread if it is accepted and `differs`, although its format lets one tell.
    `memory` is the child's largest resident size [bytes]; `said` the end of what it printed on stderr.
    """

    kind: str
    number: int
    command: list[str]
    outcome: str
    memory: int
    said: str
    differs: bool


def attempt(kind: str, seed: int, number: int, seeds: Path, keep: Path | None = None) -> Attempt:
    """Make an input and give it to the command line.

    Parameters
    ----------
    kind, seed, number
        Which input; the same ones make the same input.
    seeds
        Folder of sound inputs.
    keep
        Folder in which an input that is neither accepted nor refused is kept.
    """
    folder = Path(tempfile.mkdtemp(prefix="fuzz."))
    try:
        work = folder / "input"
        work.mkdir()
        generator = np.random.default_rng([seed, crc32(kind.encode()), number])
        command = apart(partial(KINDS[kind].make, generator, work, seeds))
        status, memory = _read(command, work, folder / "stderr")
        said = (folder / "stderr").read_text(encoding="utf-8", errors="replace")
        outcome = _outcome(status, said, [path.name for path in work.iterdir()])
        differs = False
        if outcome == "accepted" and (differs_by := KINDS[kind].differs):
            differs = apart(partial(differs_by, command, work, seeds))
            outcome = "misread" if differs and not KINDS[kind].unseen else outcome
        if keep and outcome not in ("accepted", "refused"):
            shutil.copytree(work, keep / f"{kind}-{number}", dirs_exist_ok=True, copy_function=_copy_file)
        last = said.strip().splitlines()[-1] if said.strip() else ""
        return Attempt(kind, number, command, outcome, memory, last, differs)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _copy_file(source: str, target: str) -> None:
    if Path(source).is_file():  # pipes stay behind
        shutil.copy(source, target)


def _read(command: list[str], folder: Path, errors: Path) -> tuple[int, int]:
    """Return the wait status and the peak memory [bytes] of a command line in a child process."""
    child = os.fork()
    if not child:
        _become(command, folder, errors)
    _, status, usage = os.wait4(child, 0)
    return status, usage.ru_maxrss << 10


def _become(command: list[str], folder: Path, errors: Path) -> None:
    """Be the command line, in a folder, until the end; its exit code is the process's."""
    code = 1
    try:
        os.chdir(folder)
        for name, stream in (("/dev/null", 1), (str(errors), 2)):
            os.dup2(os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), stream)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_AS, (_size() + MEMORY,) * 2)
        signal.setitimer(signal.ITIMER_REAL, TIMEOUT)  # nothing catches SIGALRM: it ends the process
        warnings.simplefilter("error", RuntimeWarning)  # of numbers that overflow, or are none
        sys.argv = ["stribeck", *command]
        main()
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _size() -> int:
    """Return the size of this process's address space [bytes]."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def _outcome(status: int, said: str, left: list[str]) -> str:
    if os.WIFSIGNALED(status):
        return "hang" if os.WTERMSIG(status) == signal.SIGALRM else "crash"
    code = os.WEXITSTATUS(status)
    if "Traceback (most recent call last)" in said or code not in (0, *REFUSALS):
        return "traceback"
    if code == 0:
        return "accepted"
    one_sentence = re.fullmatch(r"(stribeck: note: .*\n)*stribeck: .+\n", said) or said.startswith("Usage: ")
    return "refused" if one_sentence and not any(_is_output(name) for name in left) else "untidy"


def _is_output(name: str) -> bool:
    return name == "out" or name.startswith("out.") or name.endswith(".part")

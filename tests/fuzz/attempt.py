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
from pathlib import Path
from zlib import crc32

import numpy as np
from tests.fuzz.kinds import KINDS

from stribeck.cli import main

TIMEOUT = 20.0  # [s] of processor time of one input; none is large enough to keep a command that long
WAITING = 300.0  # [s] of one input on a busy machine
MEMORY = 4 << 30  # [bytes] of a child, in addition to what it was forked with
MISREAD = 99  # exit code
OUTCOMES = ("accepted", "refused", "untidy", "misread", "traceback", "hang", "crash")


@dataclass(frozen=True)
class Attempt:
    """What became of an input.

    `outcome` is one of `OUTCOMES`: a refusal is untidy if it is not one sentence, or leaves an output, whole or not; an
    input is misread if it is accepted and wrong, although its format lets one tell.
    `memory` is the child's largest resident size [bytes]; `said` the end of what it printed on stderr.
    """

    kind: str
    number: int
    outcome: str
    memory: int
    said: str


def attempt(kind, seed, number, seeds, keep=None):
    """Make an input from a folder of sound ones and give it to the command line; keep it if it breaks something."""
    folder = Path(tempfile.mkdtemp(prefix="fuzz.", dir=keep))
    try:
        work = folder / "input"
        work.mkdir()
        child = os.fork()
        if not child:
            generator = np.random.default_rng([seed, crc32(kind.encode()), number])
            _become(KINDS[kind], generator, work, seeds, folder / "stderr")
        _, status, usage = os.wait4(child, 0)
        said = (folder / "stderr").read_text(encoding="utf-8", errors="replace")
        outcome = _outcome(status, said, [path.name for path in work.iterdir()])
        if keep and outcome not in ("accepted", "refused"):
            work.rename(keep / f"{kind}-{number}")  # a copy would fill the holes of files with zeros
        last = said.strip().splitlines()[-1] if said.strip() else ""
        return Attempt(kind, number, outcome, usage.ru_maxrss << 10, last)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _become(kind, generator, folder, seeds, errors):
    """Make the input and be the command line, in a folder, until the end; its exit code is that of the process."""
    code = 1
    try:
        for name, stream in (("/dev/null", 1), (str(errors), 2)):
            os.dup2(os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), stream)
        with np.errstate(all="ignore"):
            command = kind.make(generator, folder, seeds)
        os.chdir(folder)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY,) * 2)
        signal.setitimer(signal.ITIMER_PROF, TIMEOUT)  # nothing catches these signals: they end the process
        signal.setitimer(signal.ITIMER_REAL, WAITING)
        warnings.simplefilter("error", RuntimeWarning)  # numbers that overflow, or are none
        sys.argv = ["stribeck", *command]
        try:
            (kind.main or main)()
            code = 0
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
        if code == 0 and kind.wrong and kind.wrong(command, folder, seeds):
            code = MISREAD
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _outcome(status, said, left):
    if os.WIFSIGNALED(status):
        return "hang" if os.WTERMSIG(status) in (signal.SIGPROF, signal.SIGALRM) else "crash"
    code = os.WEXITSTATUS(status)
    if "Traceback (most recent call last)" in said or code not in (0, 2, 3, MISREAD):
        return "traceback"
    if code in (0, MISREAD):
        return "misread" if code else "accepted"
    one_sentence = re.fullmatch(r"(stribeck: note: .*\n)*stribeck: .+\n", said) or said.startswith(
        ("Usage: ", "Error: ")
    )
    outputs = [name for name in left if name == "out" or name.startswith(("out.", ".stribeck-"))]
    if code == 3 and not said and outputs:  # of a fleet, whose store has a row for each log without a result
        return "accepted"
    return "refused" if one_sentence and not outputs else "untidy"

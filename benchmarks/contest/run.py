"""Run contestants on cases, each in a separate process, and score their answers."""

import json
import os
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from benchmarks.contest.schema import ANSWER, CASE, Case, read
from benchmarks.contest.score import Score, score
from stribeck.core.base.outputs import whole_or_not_at_all
from stribeck.core.errors import SettingsError
from stribeck.core.identify import METHODS
from stribeck.core.settings import Settings

ROOT = Path(__file__).parents[2]
ENVIRONMENTS = ROOT / "benchmarks/contest/environments"
INSTALLED = ROOT / "build" / "contest"
"""Folder of the environments for other packages."""
LONGEST = 900.0
"""Time limit of a run [s]."""
OTHERS = {"FIGAROH": "figaroh", "mujoco.sysid": "mujoco_sysid", "CMA-ES": "cma_es"}
"""Other packages: name -> stem of environments/<stem>.txt and contestants/with_<stem>.py."""
BLANKS = {
    "BAM": "identifies one actuator on a pendulum bench, from the set points of its servo: it takes neither the model "
    "of a robot nor its torques, and is not on the package index"
}
"""Packages that cannot take part, with the reason."""

Command = Sequence[str]


def contestants() -> dict[str, Command | str]:
    """List the command of every contestant, or the reason why it cannot take part."""
    names = sorted(METHODS, key=lambda name: (name != Settings().method, name))  # the default first
    own = {name: [sys.executable, "-m", "benchmarks.contest.contestants.stribeck_method", name] for name in names}
    plain = [sys.executable, "-m", "benchmarks.contest.contestants.least_squares"]
    found: dict[str, Command | str] = {**own, "least squares": plain}
    for name, label in OTHERS.items():
        python = INSTALLED / label / "bin" / "python"
        program = ROOT / "benchmarks/contest/contestants" / f"with_{label}.py"
        missing = f"its environment is not installed: {INSTALLED.relative_to(ROOT) / label}"
        found[name] = [str(python), str(program)] if python.exists() else missing
    return found | BLANKS


def install() -> None:
    """Install the environments of other packages; if pip fails, print its error and skip the environment."""
    for name, label in OTHERS.items():
        folder = INSTALLED / label
        if (folder / "bin" / "python").exists():
            continue
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
        pip = [str(folder / "bin" / "python"), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        ended = subprocess.run(
            [*pip, "-r", str(ENVIRONMENTS / f"{label}.txt")], capture_output=True, text=True, check=False
        )
        if ended.returncode:
            (folder / "bin" / "python").unlink()
            print(f"{name} is left out: {ended.stderr.strip().splitlines()[-1:]}")


def run(contestant: str, command: Command | str, folder: Path, case: str) -> Score:
    """Run a contestant on one case, named `robot/condition`, of a benchmark's folder, and score its answer."""
    case_folder, truth_folder = folder / "cases" / case, folder / "truth" / case
    asked = read(Case, case_folder / CASE)
    nothing = Score(contestant=contestant, robot=asked.robot, condition=asked.condition, asked=len(asked.joints))
    if isinstance(command, str):
        return nothing.model_copy(update={"blank": command})
    with tempfile.TemporaryDirectory() as out:
        ended, seconds, memory = timed([*command, str(case_folder.resolve()), out])
        used = {"seconds": float(f"{seconds / asked.seconds:.3g}"), "memory": float(f"{memory:.4g}")}
        if ended or not (Path(out) / ANSWER).exists():
            return nothing.model_copy(update={**used, "blank": ended or f"wrote no {ANSWER}"})
        try:
            found = score(contestant, case_folder, truth_folder, Path(out))
        except SettingsError as error:
            return nothing.model_copy(update={**used, "blank": str(error)})
    return found.model_copy(update=used)


def timed(command: Command) -> tuple[str, float, float]:
    """Run a program; return its error (empty if none), processor time [s] and peak memory [MB] of all threads."""
    one = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    paths = os.pathsep.join([str(ROOT), str(ROOT / "src")])
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen(
            command, stdout=said, stderr=said, cwd=ROOT, env={**os.environ, **one, "PYTHONPATH": paths}
        )
        begin = time.monotonic()
        while True:
            ended, status, used = os.wait4(process.pid, os.WNOHANG)  # includes the memory of this process only
            if ended:
                break
            if time.monotonic() - begin > LONGEST:
                process.kill()
                os.wait4(process.pid, 0)
                return f"took longer than {LONGEST:.0f} s", LONGEST, 0.0
            time.sleep(0.02)
        process.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        last = said.read().decode(errors="replace").strip().splitlines()[-1:]
    failed = f"ended with exit code {process.returncode}: {''.join(last)[:200]}" if process.returncode else ""
    return failed, used.ru_utime + used.ru_stime, used.ru_maxrss / 1e3


def chosen(names: Sequence[str] | None, entries: Mapping[str, str]) -> dict[str, Command | str]:
    """Select contestants by name (default: all), and add entries as `name: command`."""
    known = contestants() | {name: shlex.split(command) for name, command in entries.items()}
    if unknown := [name for name in names or () if name not in known]:
        raise SettingsError(f"contestant '{unknown[0]}' is not known; expected one of {', '.join(known)}")
    return {name: known[name] for name in names or known}


def read_scores(path: Path) -> list[Score]:
    """Read saved scores; an empty list if the file does not exist."""
    return [Score(**each) for each in json.loads(path.read_text(encoding="utf-8"))["scores"]] if path.exists() else []


def write_scores(scores: Sequence[Score], path: Path, sums: str) -> None:
    """Write scores, one per line, with the digest of the benchmark's checksums."""
    lines = [json.dumps(each.model_dump(exclude_defaults=True)) for each in scores]
    with whole_or_not_at_all(path) as temporary:
        head = f'{{\n"checksums": {json.dumps(sums)},\n"scores": [\n'
        temporary.write_text(head + ",\n".join(lines) + "\n]\n}\n", encoding="utf-8")

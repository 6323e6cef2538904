"""`stribeck identify --method whole-log` on a 30-joint, 1 kHz log: time per second of the log, and peak memory.

    python -m benchmarks.whole_log

Every joint of TALOS swings to and fro all the time, on one foot and then on the other, so that all of them are fitted
and nearly every window counts: more work a second than a walk is, whose feet stand together now and then. The log goes
to a Parquet file first; each job runs in a process of its own, as a user would start it, and writes the table of all
samples and the report too. The floor is one `rneaInParallel` over the samples: the method has one more pass over them
than that, before it weighs anything.
"""

import multiprocessing
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.friction_torque import best, floor_of
from benchmarks.humanoid import talos
from benchmarks.identify import peak_memory, write_log
from benchmarks.report import arguments, report

CORRECTIONS = ("none", "inertia", "calibration")
SEVERAL = 5
"""Logs, each as long as the one, of the jobs that show what grows with their number: a start costs the same for all."""


def main() -> None:
    """Print the figures."""
    options = arguments(__doc__ or "", samples=180_000)
    seconds = options.samples / 1000
    figures: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        # In a process of its own too: a child's peak memory counts what its parent holds when it starts.
        for seed in range(SEVERAL):
            writer = multiprocessing.get_context("spawn").Process(target=write_log, args=(path, options.samples, seed))
            writer.start()
            writer.join()
        floor = best(floor_of(talos(path), options.samples), 3, 1) * 1e-6
        figures["floor: one rneaInParallel [s per s of log]"] = floor / seconds
        for corrections in CORRECTIONS:
            wall, busy, peak = run(path, corrections, 1)
            figures[f"{corrections} [s per s of log]"] = wall / seconds
            figures[f"{corrections}, processor time [s per s of log]"] = busy / seconds
            figures[f"{corrections}, over the floor"] = wall / floor
            figures[f"{corrections}, peak memory [GB]"] = peak
        for corrections in CORRECTIONS[:2]:
            alone = figures[f"{corrections} [s per s of log]"] * seconds
            wall, _, peak = run(path, corrections, SEVERAL)
            figures[f"{corrections}, {SEVERAL} logs [s per s of log]"] = wall / seconds / SEVERAL
            further = (wall - alone) / (SEVERAL - 1)
            figures[f"{corrections}, each further log [s per s of log]"] = further / seconds
            figures[f"{corrections}, each further log, over the floor"] = further / floor
            figures[f"{corrections}, {SEVERAL} logs, peak memory [GB]"] = peak
        figures["processors"] = float(os.cpu_count() or 1)
    report(figures, options.save, options.compare)


def run(folder: Path, corrections: str, logs: int) -> tuple[float, float, float]:
    """Return wall and processor time [s] and peak memory [GB] of a job on as many logs.

    Memory is what the system cannot take back: long channels lie on a file, whose pages come and go.
    """
    command = [sys.executable, "-m", "stribeck", "identify", *[f"log_{seed}.parquet" for seed in range(logs)]]
    command += ["-r", "robot.toml", "-o", "out", "--overwrite", "--force"]  # its feet step without touching the ground
    command += ["--method", "whole-log", "--set", f"corrections={corrections}"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begin = time.perf_counter()
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL) as job:
        peak = peak_memory(job, "RssAnon")
    wall = time.perf_counter() - begin
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, used.ru_utime + used.ru_stime - before.ru_utime - before.ru_stime, peak


if __name__ == "__main__":
    main()

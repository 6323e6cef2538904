"""Processor time and peak memory of `stribeck identify` on five kinds of logs.

    python -m benchmarks.identify

Three walks of TALOS, 45 s each, are identified with exact sensors, with noise, and with torques 2 ms late; then 40 s of
an arm and ten minutes of a 30-joint humanoid, all at 1 kHz. Each job runs in its own process, from the log to the
report. Ratios are relative to a fixed amount of work in the same run: one `rneaInParallel` over 600,000 samples of the
humanoid. Times are processor times of all threads, so that other programs on the machine matter little.
"""

import multiprocessing
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from statistics import median

import numpy as np
import pinocchio as pin
from studies.accuracy_cases import CASES, exact_walks, measured
from studies.compensation import arm, noisy_log
from studies.kept_walks import FOLDER

from benchmarks.humanoid import FEET, stepping_log, talos
from benchmarks.report import report
from stribeck.core.dynamics.rooted import THREADS
from stribeck.io.writers import write_log
from stribeck.simulation.robots import MODELS

LATE = 2
"""Delay of the torques [samples], [ms]."""
BATCH, BATCHES = 50_000, 12
"""Samples per call [1] and calls [1] in the unit of work; small batches keep this process small."""


def main() -> None:
    """Print the figures."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # A process inherits the peak memory of its parent, so the logs are made in a process that ends here.
        writer = multiprocessing.get_context("spawn").Process(target=write_logs, args=(folder, 600_000))
        writer.start()
        writer.join()
        walkers = FOLDER / "TALOS.toml"
        jobs = {
            "walks, exact sensors": ("exact", walkers),
            "walks, noise": ("noisy", walkers),
            f"walks, torques {LATE} ms late": ("late", walkers),
            "arm": ("arm", MODELS / "arm.toml"),
            "humanoid": ("humanoid", folder / "robot.toml"),
        }
        units, used = [], {}
        for kind, (logs, robot_file) in jobs.items():
            units.append(unit_of_work(folder))
            used[kind] = run(sorted(folder.glob(f"{logs}-*")), robot_file)
    unit = median(units)
    figures = {"unit of work: one rneaInParallel over 600,000 samples [s]": unit}
    for kind, (seconds, peak) in used.items():
        figures[f"{kind} [s]"] = seconds
        figures[f"{kind}, over the unit of work"] = seconds / unit
        figures[f"{kind}, peak memory [GB]"] = peak
    report(figures)


def write_logs(folder: Path, samples: int) -> None:
    """Write all logs and the humanoid's robot file to a folder."""
    walks = [measured(walk.log, CASES["clean"], 0, k) for k, walk in enumerate(exact_walks("TALOS"))]
    earlier = [np.maximum(np.arange(len(log.time)) - LATE, 0) for log in walks]
    logs = {
        "exact": walks,
        "noisy": [measured(log, CASES["B"], 0, k) for k, log in enumerate(walks)],
        "late": [replace(log, torque=log.torque[rows]) for log, rows in zip(walks, earlier, strict=True)],
        "arm": [noisy_log(arm())],
        "humanoid": [stepping_log(talos(folder), samples)],
    }
    for name, each in logs.items():
        for k, log in enumerate(each):
            write_log(log, folder / f"{name}-{k}.parquet")


def unit_of_work(folder: Path) -> float:
    """Time `rneaInParallel` over `BATCH * BATCHES` samples of the humanoid [s]."""
    model = talos(folder).rooted_at(FEET[0]).model
    generator, joints = np.random.default_rng(0), model.nv - 6
    root = np.tile(pin.neutral(model)[:7], (BATCH, 1))
    position = np.hstack([root, generator.normal(size=(BATCH, joints))])
    velocity, acceleration = generator.normal(size=(2, BATCH, model.nv))
    pool, effort = pin.ModelPool(model, THREADS), np.empty((BATCH, model.nv))
    begin = time.process_time()
    for _ in range(BATCHES):
        pin.rneaInParallel(THREADS, pool, position.T, velocity.T, acceleration.T, effort.T)
    return time.process_time() - begin


def run(logs: list[Path], robot_file: Path) -> tuple[float, float]:
    """Identify logs and measure processor time [s] and peak memory [GB] (Linux)."""
    command = [sys.executable, "-m", "stribeck", "identify", *map(str, logs), "-r", str(robot_file)]
    command += ["-o", str(logs[0].parent / "out"), "--overwrite", "--force"]  # the humanoid's feet touch no ground
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as job:
        _, status, used = os.wait4(job.pid, 0)
        job.returncode = os.waitstatus_to_exitcode(status)
    if job.returncode:
        raise SystemExit(f"identify ended with exit code {job.returncode}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss * 1024 / 1e9


if __name__ == "__main__":
    main()

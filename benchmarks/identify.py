"""The whole main job on a 10-minute, 1 kHz log of a 30-joint humanoid: time, peak memory and size of the report.

    python -m benchmarks.identify

The log goes to a Parquet file first; the job runs in a process of its own, as a user would start it.
"""

import multiprocessing
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from benchmarks.friction_torque import best, floor_of
from benchmarks.humanoid import FEET, stepping_log, talos
from benchmarks.report import arguments, report


def write_log(folder: Path, samples: int, seed: int = 0) -> None:
    """Write the robot file and the Parquet log `log_<seed>` to a folder."""
    log = stepping_log(talos(folder), samples, seed=seed)
    assert log.contact is not None
    columns: dict[str, object] = {"time": log.time}
    for k, joint in enumerate(log.joint_names):
        columns[f"position.{joint}"] = log.position[:, k]
        columns[f"torque.{joint}"] = log.torque[:, k]
    for k, foot in enumerate(FEET):
        columns[f"contact.{foot}"] = log.contact[:, k]
    pq.write_table(pa.table(columns), folder / f"log_{seed}.parquet")


def main() -> None:
    """Print the figures."""
    options = arguments(__doc__ or "", samples=600_000)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        # In a process of its own too: a child's peak memory counts what its parent holds when it starts.
        writer = multiprocessing.get_context("spawn").Process(target=write_log, args=(path, options.samples))
        writer.start()
        writer.join()
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        command = [sys.executable, "-m", "stribeck", "identify", "log_0.parquet", "-r", "robot.toml"]
        command += ["-o", "out", "--force"]  # its feet step without touching the ground
        begin = time.perf_counter()
        with subprocess.Popen(command, cwd=path, stdout=subprocess.DEVNULL) as job:
            peak = peak_memory(job)
        wall = time.perf_counter() - begin
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        floor = best(floor_of(talos(path), options.samples), 3, 1) * 1e-6
        figures = {
            "identify, wall time [s]": wall,
            "identify, processor time [s]": used.ru_utime + used.ru_stime - before.ru_utime - before.ru_stime,
            "floor: one rneaInParallel over all samples [s]": floor,
            "identify over the floor": wall / floor,
            "peak memory [GB]": peak,
            "report [MB]": (path / "out/report.html").stat().st_size / 1e6,
            "friction_torque.parquet [MB]": (path / "out/friction_torque.parquet").stat().st_size / 1e6,
            "processors": float(os.cpu_count() or 1),
        }
    report(figures, options.save, options.compare)


def peak_memory(job: subprocess.Popen[bytes], kind: str = "VmHWM") -> float:
    """Wait for a process and return the most memory of a kind it had at any time [GB] (Linux; nan elsewhere)."""
    peak = float("nan")
    status = Path(f"/proc/{job.pid}/status")
    while job.poll() is None:
        if status.exists():
            lines = [line for line in status.read_text().splitlines() if line.startswith(kind)]
            peak = float(np.fmax(peak, float(lines[0].split()[1]) * 1024 / 1e9)) if lines else peak
        time.sleep(0.02)
    if job.returncode:
        raise SystemExit(f"identify ended with exit code {job.returncode}")
    return peak


if __name__ == "__main__":
    main()

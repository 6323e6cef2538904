"""The whole main job on a 10-minute, 1 kHz log of a 30-joint humanoid: time, peak memory and size of the report.

    python -m benchmarks.identify

The log goes to a Parquet file first; the job runs in a process of its own, as a user would start it.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from benchmarks.friction_torque import best, floor_of
from benchmarks.humanoid import FEET, stepping_log, talos
from benchmarks.report import arguments, report


def main() -> None:
    """Print the figures."""
    options = arguments(__doc__ or "", samples=600_000)
    with tempfile.TemporaryDirectory() as folder:
        path, robot = Path(folder), talos(Path(folder))
        log = stepping_log(robot, options.samples)
        columns: dict[str, object] = {"time": log.time}
        for k, joint in enumerate(log.joint_names):
            columns[f"position.{joint}"] = log.position[:, k]
            columns[f"torque.{joint}"] = log.torque[:, k]
        assert log.contact is not None
        for k, foot in enumerate(FEET):
            columns[f"contact.{foot}"] = log.contact[:, k]
        pq.write_table(pa.table(columns), path / "log.parquet")
        del log, columns
        command = [sys.executable, "-m", "stribeck", "identify", "log.parquet", "-r", "robot.toml", "-o", "out"]
        begin = time.perf_counter()
        subprocess.run(command, cwd=path, check=True, stdout=subprocess.DEVNULL)
        wall = time.perf_counter() - begin
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        floor = best(floor_of(robot, options.samples), 3, 1) * 1e-6
        figures = {
            "identify, wall time [s]": wall,
            "identify, processor time [s]": used.ru_utime + used.ru_stime,
            "floor: one rneaInParallel over all samples [s]": floor,
            "identify over the floor": wall / floor,
            "peak memory [GB]": used.ru_maxrss * 1024 / 1e9,
            "report [MB]": (path / "out/report.html").stat().st_size / 1e6,
            "friction_torque.parquet [MB]": (path / "out/friction_torque.parquet").stat().st_size / 1e6,
            "processors": float(os.cpu_count() or 1),
        }
    report(figures, options.save, options.compare)


if __name__ == "__main__":
    main()

"""Throughput of `stribeck fleet`, and time and memory of `stribeck trends`, for the page on fleets.

    python -m benchmarks.fleet

Logs of an arm with three joints, 20 s at 200 Hz each, are identified by the default method. The throughput is that of
the processor time of `identify`, and the overhead the median time from the end of a log to the start of the next. The
store of `trends` is synthetic and compacted: robots with 200 logs each, and curves at four speeds per joint.
"""

import resource
import tempfile
import time
from pathlib import Path

import numpy as np
from tests.arm import arm_log, save_npz, write_arm
from tests.fleet.synthetic import write_store

from stribeck import Robot, identify
from stribeck.service.fleet import compact, connect, find_trends, run_fleet
from stribeck.service.fleet.jobs import jobs_of_logs

CLUSTER = 100 * 32
"""Cores of the cluster that a million logs are estimated for [1]."""


def main() -> None:
    """Print the figures."""
    with tempfile.TemporaryDirectory() as folder:
        throughput(Path(folder), logs=12)
        trends(Path(folder) / "synthetic", robots=500, joints=29)


def throughput(folder: Path, logs: int) -> None:
    """Print logs per hour, the overhead, and the size of the store."""
    robot_file = write_arm(folder)
    (folder / "R1").mkdir()
    for seed in range(logs):
        save_npz(arm_log(Robot.from_file(robot_file), 20.0, 200.0, seed), folder / f"R1/log_{seed:02d}.npz")
    jobs = jobs_of_logs([str(folder / "R1")], robot_file)
    run_fleet(jobs, folder / "store", workers=1, backend="loky")
    cpu = -time.process_time()
    for job in jobs[:4]:
        identify(job.log, job.robot_file)
    cpu = (cpu + time.process_time()) / 4
    with connect(folder / "store") as store:
        run = store.execute("SELECT epoch(finished) AS ends, seconds FROM logs ORDER BY finished").fetchnumpy()
    overhead = float(np.median(np.diff(run["ends"]) - run["seconds"][1:]))
    compact(folder / "store")
    size = sum(path.stat().st_size for path in (folder / "store").glob("robot=*/*.parquet")) / logs
    hourly = 3600 / (cpu + overhead)
    print(f"{cpu:.2f} s of processor time and {overhead:.3f} s of overhead per log: {hourly:,.0f} per hour and core")
    hours = 1e6 / hourly / CLUSTER
    print(f"a million such logs on {CLUSTER:,} cores: {hours:.2f} h, {size / 1e3:.1f} GB")


def trends(store: Path, robots: int, joints: int) -> None:
    """Print time and memory, and the ratio to reading the curves once with DuckDB."""
    write_store(store, robots=robots, logs=200, joints=joints)
    before = time.perf_counter()
    with connect(store) as connection:
        connection.execute("SELECT joint, velocity, avg(friction) FROM curves GROUP BY ALL").fetchall()
    floor, before = time.perf_counter() - before, time.perf_counter()
    found = find_trends(store)
    seconds = time.perf_counter() - before
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    size = f"{len(found.fleet.log):,} logs of {joints} joints"
    print(f"trends of {size}: {seconds:.1f} s, {seconds / floor:.1f} times reading, {peak:.2f} GB")


if __name__ == "__main__":
    main()

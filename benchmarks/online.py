"""Time `OnlineFriction` on a 30-joint humanoid: latency of single samples, mean in batches, and growth of memory.

python -m benchmarks.online

Latencies are times of the thread, which exclude waiting for a core; "waiting included" is the time of the clock.
"""

import resource
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.humanoid import stepping_log, talos
from benchmarks.report import report
from stribeck import RobotLog, identify
from stribeck.core.base.threads import one_blas_thread
from stribeck.service.online import OnlineFriction

LEVEL = np.array([0, 0, 0, 1.0])
"""Orientation of a level base."""
LONG = 1_000_000
"""Number of samples over which memory must not grow."""


def times(online: OnlineFriction, log: RobotLog, length: int) -> Iterator[tuple[float, float]]:
    """Yield the times of the thread and of the clock of each batch [s]."""
    assert log.velocity is not None
    for start in range(0, len(log.time), length):
        rows = slice(start, start + length)
        base = np.tile(LEVEL, (len(log.time[rows]), 1)), np.zeros((len(log.time[rows]), 3))
        contact = None if log.contact is None else log.contact[rows]
        begin, clock = time.thread_time(), time.perf_counter()
        online.update(log.time[rows], log.position[rows], log.velocity[rows], log.torque[rows], base, contact)
        yield time.thread_time() - begin, time.perf_counter() - clock


def growth(online: OnlineFriction, log: RobotLog) -> float:
    """Repeat a log for `LONG` samples, and return the growth of the peak memory after its first pass [MB]."""
    length, peaks = log.time[-1] - log.time[0] + 0.001, list[int]()
    for turn in range(LONG // len(log.time) + 1):
        list(times(online, replace(log, time=log.time + turn * length), 1000))
        peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    return (peaks[-1] - peaks[0]) / 1e3


def main() -> None:
    """Print the figures."""
    with tempfile.TemporaryDirectory() as folder, one_blas_thread():
        robot = talos(Path(folder))
        log = stepping_log(robot, 40_000)
        log = replace(log, velocity=np.gradient(log.position, log.time, axis=0))
        result = identify(log.take(slice(20_000)), robot, method="curve-fit", force=True)
        single = 1e6 * np.array(list(times(OnlineFriction(result, robot, 1000.0), log, 1)))
        batch = 1e6 * np.array(list(times(OnlineFriction(result, robot, 1000.0), log, 10)))
        grown = growth(OnlineFriction(result, robot, 1000.0), log)
    own, clock = single.T
    report(
        {
            "mean of single samples [us]": float(own.mean()),
            "median of single samples [us]": float(np.median(own)),
            "99.9 % of single samples are below [us]": float(np.percentile(own, 99.9)),
            "99.9 % of single samples are below, waiting included [us]": float(np.percentile(clock, 99.9)),
            "mean per sample in batches of 10 ms [us]": float(batch[:, 0].mean() / 10),
            f"growth of memory over {LONG:,} samples [MB]": grown,
        }
    )


if __name__ == "__main__":
    main()

"""Time `OnlineFriction` on a 30-joint humanoid: latency of single samples, and mean in batches of 10 ms.

python -m benchmarks.online

Latencies are times of the thread, which exclude waiting for a core; "waiting included" is the time of the clock.
"""

import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.humanoid import stepping_log, talos
from benchmarks.report import arguments, report
from stribeck import Result, Robot, RobotLog
from stribeck.core.base.threads import one_blas_thread
from stribeck.core.result import CurvePoint, JointResult, LogSummary, ParameterEstimate
from stribeck.service.online import OnlineFriction

FRICTION = {"viscous": 0.2, "coulomb": 1.0, "stribeck_gain": 0.2, "stribeck_velocity": 0.2, "offset": 0.5, "slope": 40}
LEVEL = np.array([0, 0, 0, 1.0])
"""Orientation of a level base."""


def identified(robot: Robot) -> Result:
    """Make a result with friction in all joints."""
    parameters = {
        name: ParameterEstimate(
            value=value, standard_error=0.01, interval_95=(value, value), unit="N m", verdict="identified"
        )
        for name, value in FRICTION.items()
    }
    point = partial(CurvePoint, value=1.1, standard_error=0.01, interval_95=(1.0, 1.2), unit="N m")
    joint = JointResult(
        parameters=parameters,
        verdict="identified",
        reason="",
        samples=1000,
        velocity_range=(-1.0, 1.0),
        reversals=10,
        curve=tuple(point(velocity=v) for v in (0.1, 0.5, 1.0)),
        residual_rms=0.1,
    )
    summary = LogSummary(path="log", sha256="", duration=60.0, rate=1000.0, samples_used=1000)
    joints = dict.fromkeys(robot.joint_names, joint)
    return Result(robot=robot.name, log=summary, law="auto", method="whole-log", joints=joints, stribeck="0")


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


def main() -> None:
    """Print the figures."""
    options = arguments(__doc__ or "", samples=40_000)
    with tempfile.TemporaryDirectory() as folder, one_blas_thread():
        robot = talos(Path(folder))
        log = stepping_log(robot, options.samples)
        log = replace(log, velocity=np.gradient(log.position, log.time, axis=0))
        result = identified(robot)
        single = 1e6 * np.array(list(times(OnlineFriction(result, robot, 1000.0), log, 1)))
        batch = 1e6 * np.array(list(times(OnlineFriction(result, robot, 1000.0), log, 10)))
    own, clock = single.T
    report(
        {
            "mean of single samples [us]": float(own.mean()),
            "median of single samples [us]": float(np.median(own)),
            "99.9 % of single samples are below [us]": float(np.percentile(own, 99.9)),
            "99.9 % of single samples are below, waiting included [us]": float(np.percentile(clock, 99.9)),
            "mean per sample in batches of 10 ms [us]": float(batch[:, 0].mean() / 10),
        },
        options,
    )


if __name__ == "__main__":
    main()

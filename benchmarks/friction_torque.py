"""Time the friction torque of a long log, against a lower bound.

    python -m benchmarks.friction_torque

The lower bound is one `rneaInParallel` over the same samples. All times are per sample, from one run on one machine.
"""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin

from benchmarks.humanoid import FEET, stepping_log, talos
from benchmarks.report import arguments, report
from stribeck.dynamics.root_motion import standing_root
from stribeck.dynamics.rooted import THREADS, rooted_inverse_dynamics
from stribeck.dynamics.state import State
from stribeck.friction_torque.inverse_dynamics import torque_chunks
from stribeck.friction_torque.preparation import prepare
from stribeck.log import RobotLog
from stribeck.robot import Robot
from stribeck.settings import FilterSettings, Settings

REPETITIONS = 5


def main() -> None:
    """Print times per sample and ratios."""
    options = arguments(__doc__ or "", samples=600_000)
    with tempfile.TemporaryDirectory() as folder:
        robot = talos(Path(folder))
    log = stepping_log(robot, options.samples)
    own, floor = interleaved(
        [lambda: from_motion(robot, log), floor_of(robot, len(log.time))], REPETITIONS, len(log.time)
    )
    figures = {
        "floor: rneaInParallel [us]": floor,
        "friction torque from a known motion [us]": own,
        "friction torque from positions, chunk by chunk [us]": best(
            lambda: from_positions(robot, log), 2, options.samples
        ),
    }
    figures["friction torque over the floor"] = own / floor
    name = "friction torque from positions, chunk by chunk"
    figures[f"{name}, over the floor"] = figures[f"{name} [us]"] / floor
    report(figures, options.save, options.compare)


def interleaved(jobs: list[Callable[[], None]], repetitions: int, samples: int) -> list[float]:
    """Measure the median time of each job per sample [us]; jobs take turns, so that noise affects them equally."""
    times = np.empty((repetitions, len(jobs)))
    for job in jobs:
        job()
    for k in range(repetitions):
        for j, job in enumerate(jobs):
            begin = time.perf_counter()
            job()
            times[k, j] = time.perf_counter() - begin
    return [float(value) for value in np.median(times, axis=0) / samples * 1e6]


def best(job: Callable[[], None], repetitions: int, samples: int) -> float:
    """Measure the median time per sample [us]."""
    return interleaved([job], repetitions, samples)[0]


def floor_of(robot: Robot, samples: int) -> Callable[[], None]:
    """Prepare one batched inverse dynamics call over existing arrays."""
    model = robot.rooted_at(FEET[0]).model
    generator = np.random.default_rng(0)
    configuration = np.zeros((samples, model.nq))
    configuration[:, 6] = 1
    configuration[:, 7:] = generator.normal(size=(samples, model.nv - 6))
    velocity, acceleration = generator.normal(size=(2, samples, model.nv))
    effort = np.empty((samples, model.nv))
    pool = pin.ModelPool(model, THREADS)
    return lambda: pin.rneaInParallel(THREADS, pool, configuration.T, velocity.T, acceleration.T, effort.T)


def from_motion(robot: Robot, log: RobotLog) -> None:
    """Compute the friction torque of a known motion in chunks, with all samples on one foot."""
    assert log.position is not None
    for start in range(0, len(log.time), 16_384):
        rows = slice(start, start + 16_384)
        state = State(log.position[rows], log.position[rows], log.position[rows])
        root = standing_root(robot, FEET[0], state)
        _ = (
            log.torque[rows]
            - rooted_inverse_dynamics(
                robot.rooted_at(FEET[0]), state.position, state.velocity, state.acceleration, root
            )[1]
        )


def from_positions(robot: Robot, log: RobotLog) -> None:
    """Repeat the steps of `identify`: find the support, differentiate, compute friction torque."""
    settings = Settings(filter=FilterSettings(kind="savitzky-golay", window=31))
    for _ in torque_chunks(prepare(log, robot, settings), robot, settings):
        pass


if __name__ == "__main__":
    main()

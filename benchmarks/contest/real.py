"""Cases from logs of real robots, with held-out torques instead of the unknown true friction.

The logs are published elsewhere; `STRIBECK_REAL_LOGS` names their folder. The last of several logs is held out, or the
third quarter of an only log. All contestants get the filtered motion of the held-out part, and predict its torques.
Torques of position commands are computed with the delay that stribeck finds in the contestants' logs.
"""

import runpy
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from studies.held_out import BANDS, PARTS, smoothed, with_torques

from benchmarks.contest.make import asked_joints, publish_robot
from benchmarks.contest.model_errors import publish_model
from benchmarks.contest.schema import CASE, PREDICT, SUMS, TORQUE, TRUTH, Case, Truth, checksums, folders_of, write
from stribeck import Robot, read_log
from stribeck.core.dynamics.rooted import rooted_inverse_dynamics
from stribeck.core.log import RobotLog
from stribeck.core.log.sampling import regularise
from stribeck.io.writers import write_log

CONDITION = "held-out"
HELD_OUT = 2
"""Index of the held-out quarter of an only log, from 0; one robot is at rest in its last quarter."""
SHORTEST = 1.0
"""Minimum duration of a segment between gaps [s]; shorter segments are excluded."""
NO_LOGS = "no logs of real robots: set STRIBECK_REAL_LOGS to their folder"
ROOT = Path(__file__).parents[2]


def make_real(folder: Path, data: Path, progress: Callable[[str], None] = print) -> None:
    """Write the cases of real robots, and the checksums of all files in the folder."""
    convert = runpy.run_path(str(ROOT / "examples/real_robots/convert.py"))["convert"]
    with tempfile.TemporaryDirectory() as scratch:
        for name, band in BANDS.items():
            publish_real(name, convert(name, data, Path(scratch)), band, folder)
            progress(f"{name}: 1 case")
    (folder / SUMS).write_text(checksums(folder), encoding="utf-8")


def publish_real(name: str, converted: Path, band: float, folder: Path) -> None:
    """Write the case of a real robot from a folder with its logs and robot file."""
    case_folder, truth_folder = folders_of(folder, name, CONDITION)
    robot = Robot.from_file(converted / "robot.toml")
    publish_model(Path(robot.model_path), case_folder / publish_robot(robot, case_folder), None)
    parts = [even for path in sorted(converted.glob("log*.npz")) for even in evenly(read_log(path, robot), robot)]
    train, held = with_torques(*apart(parts), robot)
    names = [f"log_{number}.npz" for number in range(1, len(train) + 1)]
    for log, label in zip(train, names, strict=True):
        write_log(log, case_folder / label)
    rate = 1 / float(np.median(np.diff(held.time)))
    motion = smoothed(held.position, rate, band)
    rigid = rooted_inverse_dynamics(robot.tree, *motion, None)[1]
    channels = {"joint_names": np.array(held.joint_names), "time": held.time}
    channels |= dict(zip(("position", "velocity", "acceleration"), motion, strict=True))
    np.savez(case_folder / PREDICT, allow_pickle=False, **channels)
    np.savez(truth_folder / TORQUE, allow_pickle=False, torque=held.torque, rigid=rigid)
    case = Case(
        robot=name,
        condition=CONDITION,
        base=robot.base,
        seconds=sum(float(np.ptp(log.time)) for log in train),
        rate=rate,
        logs=names,
        joints=asked_joints(train[0], train[0].joint_names),
        predict=PREDICT,
        band=band,
    )
    write(case, case_folder / CASE)
    write(Truth(says="torque that was held out"), truth_folder / TRUTH)


def evenly(log: RobotLog, robot: Robot) -> list[RobotLog]:
    """Split a log at gaps into parts with a constant sampling period."""
    even, sampling = regularise(log, robot.log_table)
    parts = [even.take(rows) for rows in sampling.segments]
    return [replace(part, notes=()) for part in parts if np.ptp(part.time) >= SHORTEST]


def apart(parts: Sequence[RobotLog]) -> tuple[list[RobotLog], RobotLog]:
    """Split the parts into the contestants' logs and the held-out log."""
    if len(parts) > 1:
        return list(parts[:-1]), parts[-1]
    edges = np.linspace(0, len(parts[0].time), PARTS + 1).astype(int)
    before, held, after = (
        parts[0].take(slice(start, stop))
        for start, stop in ((0, edges[HELD_OUT]), (edges[HELD_OUT], edges[HELD_OUT + 1]), (edges[HELD_OUT + 1], None))
    )
    return [before, after], held

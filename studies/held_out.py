"""Compare the held-out torque error on logs of real robots: no friction, curve fit and whole log.

    STRIBECK_REAL_LOGS=DATA_FOLDER python -m studies.held_out --save studies/held_out.json

Each part of a robot's logs is held out in turn. Every method is fitted to the other parts, and its error on the
held-out part is

    W[torque - inverse dynamics(q, v, a; the method's own model) - friction(v, a)]

as a root mean square per joint while the joint moves. If a method estimates a torque delay, the torque is shifted by
it. Torques of position commands are computed with the delay that the other parts show. The filter W and the filter of
the motion are the same for all methods. If a method gives no friction for a joint, the joint counts as no error.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from stribeck import Robot, identify, read_log
from stribeck.check.drives.command_delay import command_delays
from stribeck.core.base.typing import Array
from stribeck.core.dynamics.rooted import rooted_inverse_dynamics
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.log import RobotLog
from stribeck.core.log.interpolation import linear, with_command_delay
from stribeck.core.log.sampling import regularise
from stribeck.core.result import Result
from stribeck.core.result.bodies import with_bodies
from studies.command import Row, command, of_estimates, real_robot, rounded
from studies.markdown import markdown_table

BANDS = {"tx40": 20.0, "kinova-gen3": 10.0, "go2": 12.0, "double-pendulum": 6.0}
"""Frequency up to which torques are compared [Hz]: the bandwidth of the robot's motion."""
WIDER = 2.0
"""Cutoff of the motion's filter divided by the cutoff of the torque's filter [1]."""
ORDER = 4
"""Order of both Butterworth filters, which run forwards and backwards."""
PARTS = 4
"""Number of parts of a robot's only log; several logs are held out one by one."""
REST = 0.01
"""Share of a joint's top speed below which it is at rest [1]."""
ENDS = 0.25
"""Duration excluded at both ends of a part, where its filters settle [s]."""
METHODS: dict[str, dict[str, object]] = {"default, model trusted": {"corrections": "none"}, "default": {}}
"""Settings of the whole log's columns."""


def parts_of(logs: Sequence[RobotLog]) -> list[RobotLog]:
    """Split logs into the parts that are held out one by one: the logs, or segments of the only log."""
    if len(logs) > 1:
        return list(logs)
    edges = np.linspace(0, len(logs[0].time), PARTS + 1).astype(int)
    return [logs[0].take(slice(start, stop)) for start, stop in pairwise(edges)]


def with_torques(logs: Sequence[RobotLog], unseen: RobotLog, robot: Robot) -> tuple[list[RobotLog], RobotLog]:
    """Replace position commands by torques, with the delay that the logs show; the unseen log gets the same delay."""
    if robot.command_gains is None:
        return list(logs), unseen
    delay, _ = command_delays([prepare(log, robot, robot.settings) for log in logs], robot, robot.settings)
    late = [with_command_delay(log, delay) for log in (*logs, unseen)]
    *found, last = [replace(log, command=None, feedback=None, desired_position=None) for log in late]
    return found, last


def predicted_torque(
    robot: Robot,
    result: Result | None,
    position: Array,
    velocity: Array,
    acceleration: Array,
    lowpass: Array | None = None,
    period: float | None = None,
) -> tuple[Array, NDArray[np.bool_]]:
    """Predict a motion's torques from a result [N m], shape (T, n), and list the joints that have friction, shape (n,).

    Without a result, the model determines the torques. A lowpass, given as second-order sections, filters the load that
    friction depends on. With a sampling period [s], friction builds up after reversals.
    """
    believed = with_bodies(robot, result.corrections) if result else robot
    needed = rooted_inverse_dynamics(believed.tree, position, velocity, acceleration, None)[1]
    load = needed if lowpass is None else sosfiltfilt(lowpass, needed, axis=0)
    found, said = needed.copy(), np.ones(needed.shape[1], dtype=bool)
    if result is None:
        return found, said
    for column, name in enumerate(robot.joint_names):
        joint = result.joints.get(name)
        said[column] = bool(joint and joint.curve)
        if joint and joint.curve:
            found[:, column] += joint.friction(
                velocity[:, column], load=load[:, column], position=position[:, column], period=period, offset=True
            )
            if rotor := joint.parameters.get("armature"):
                found[:, column] += (rotor.value - float(robot.armature[column])) * acceleration[:, column]
    for coupling in result.couplings.values():
        if coupling.parameters:
            acting = np.array([coupling.joints.get(name, 0.0) for name in robot.joint_names])
            torque = coupling.friction(velocity @ acting, offset=True)
            if rotor := coupling.parameters.get("armature"):
                torque = torque + rotor.value * (acceleration @ acting)
            found += np.outer(torque, acting)
    return found, said


def smoothed(position: Array, rate: float, band: float) -> tuple[Array, Array, Array]:
    """Filter positions up to `WIDER` times the band [Hz]; return them with velocities and accelerations, (T, n)."""
    position = sosfiltfilt(butter(ORDER, 2 * WIDER * band / rate, output="sos"), position, axis=0)
    velocity = np.gradient(position, 1 / rate, axis=0)
    return position, velocity, np.gradient(velocity, 1 / rate, axis=0)


def torque_errors(part: RobotLog, robot: Robot, result: Result | None, band: float, slowest: Array) -> Array:
    """Compute the unexplained torques of a part [N m], shape (T, n); NaN at rest and for joints without friction."""
    log, sampling = regularise(part, robot.log_table)
    late = result.corrections.torque_delay if result and result.corrections else None
    torque = linear(log.time + late[0], log.time, log.torque) if late else log.torque
    narrow = butter(ORDER, 2 * band * sampling.period, output="sos")
    cut, found = round(ENDS / sampling.period), []
    for rows in (rows for rows in sampling.segments if rows.stop - rows.start > 4 * cut):
        motion = smoothed(log.position[rows], sampling.rate, band)
        predicted, said = predicted_torque(robot, result, *motion, narrow, sampling.period)
        left = sosfiltfilt(narrow, torque[rows] - predicted, axis=0)
        found.append(np.where(said & (np.abs(motion[1]) > slowest), left, np.nan)[cut:-cut])
    return np.concatenate(found)


def held_out(folder: Path, band: float, methods: Mapping[str, Mapping[str, object]] = METHODS) -> dict[str, Array]:
    """Compute the root mean square of the held-out torque errors of all methods per joint [N m], shape (n,).

    Parameters
    ----------
    folder
        Folder with robot.toml, curve-fit.toml and the logs.
    band
        Frequency up to which torques are compared [Hz].
    methods
        Settings of the whole log, by column.
    """
    robot, for_curves = (Robot.from_file(folder / name) for name in ("robot.toml", "curve-fit.toml"))
    parts = parts_of([read_log(path, robot) for path in sorted(folder.glob("log*.npz"))])
    slowest = slowest_speeds(parts)
    errors: dict[str, list[Array]] = {}
    for part in parts:
        others, held = with_torques([other for other in parts if other is not part], part, robot)
        found: dict[str, Result | None] = {"no friction": None, "curve-fit": identify(others, for_curves)}
        found |= {name: identify(others, robot, robot.settings.model_copy(update=own)) for name, own in methods.items()}
        for name, result in found.items():
            errors.setdefault(name, []).append(torque_errors(held, robot, result, band, slowest))
    together = np.stack([np.concatenate(each) for each in errors.values()])
    together[:, np.isnan(together).any(axis=0)] = np.nan
    return dict(zip(errors, np.sqrt(np.nanmean(together**2, axis=1)), strict=True))


def slowest_speeds(parts: Sequence[RobotLog]) -> Array:
    """Compute the speed below which each joint is at rest [rad/s], shape (n,)."""
    speeds = np.concatenate([np.gradient(part.position, part.time, axis=0) for part in parts])
    return np.asarray(REST * np.percentile(np.abs(speeds), 99, axis=0))


def run(robot: str) -> Row:
    """Compute the errors of all joints of a robot by all methods."""
    folder = real_robot(robot)
    machine, errors = Robot.from_file(folder / "robot.toml"), held_out(folder, BANDS[robot])
    joints = {
        joint: {method: rounded(float(each[column])) for method, each in errors.items()}
        for column, joint in enumerate(machine.joint_names)
    }
    return {"name": machine.name, "joints": joints}


def tables(rows: list[Row]) -> list[str]:
    """Format the errors of all joints; docs/accuracy.md summarizes them."""
    head = ("robot", "joint", "no friction", "curve-fit", *METHODS)
    cells = [
        (row["name"], joint, *(f"{errors[method]:.3g}" for method in head[2:]))
        for row in rows
        for joint, errors in row["joints"].items()
    ]
    return [markdown_table(head, cells, 2)]


if __name__ == "__main__":
    command(__doc__, [{"robot": robot} for robot in BANDS], run, tables, of_estimates)

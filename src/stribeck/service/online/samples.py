"""Samples of logs and of MCAP streams, as `OnlineFriction` takes them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from stribeck.core.base.typing import BoolArray
from stribeck.core.dynamics.contact.phases import HUNG
from stribeck.core.equations.friction_torque.inverse_dynamics import differentiate
from stribeck.core.equations.friction_torque.preparation import PreparedLog, prepare
from stribeck.core.errors import SettingsError
from stribeck.core.filters import make_filter
from stribeck.core.log import LogLike, RobotLog
from stribeck.core.log.interpolation import with_command_delay
from stribeck.core.result import Result
from stribeck.core.robot import Robot
from stribeck.core.robot.rooting import BASE_FRAME
from stribeck.core.settings import FilterSettings
from stribeck.io import read_stream
from stribeck.service.online.alarms import Alarm
from stribeck.service.online.estimator import OnlineFriction


def estimator_for(result: Result, robot: Robot, rate: float, hours: float) -> OnlineFriction:
    """Make the estimator of samples, whose base orientation is that of the root link."""
    return OnlineFriction(result, replace(robot, base_frame=BASE_FRAME), rate, hours_per_false_alarm=hours)


def feed(online: OnlineFriction, part: RobotLog) -> list[Alarm]:
    """Add samples to an estimator; returns alarms."""
    assert part.velocity is not None
    turn = part.base_orientation
    base = None if turn is None else (turn, part.angular_velocity)
    contact = HUNG if part.contact is None else part.contact
    return online.update(part.time, part.position, part.velocity, part.torque, base, contact, part.temperature)


def stream_of(log: Path | None, mcap: Path | None, robot: Robot, result: Result) -> Iterator[tuple[RobotLog, float]]:
    """Yield the samples of a log, or of an MCAP as its messages arrive, and their rate [Hz]."""
    chunk = 2.0  # duration of the parts of a stream that are prepared together [s]
    for part in [log] if log is not None else read_stream(mcap or Path("-"), robot, chunk):
        yield from samples_of(part, robot, result)


def samples_of(log: LogLike, robot: Robot, result: Result) -> Iterator[tuple[RobotLog, float]]:
    """Prepare a log and differentiate its positions; yields its segments without gaps, and their rate [Hz].

    Raises
    ------
    LogError
        If the log cannot be used.
    SettingsError
        If the torque of a joint is not in N m or N.
    """
    prepared = prepare(log, robot, robot.settings)
    record, period = prepared.log, prepared.sampling.period
    if record.unscaled:
        joints = ", ".join(record.unscaled)
        raise SettingsError(f"{record.path or 'log'}: torques of {joints} are not in N m; set torque constants or kp")
    if record.command is not None:
        known = result.corrections.command_delay if result.corrections else {}
        given = np.zeros(len(robot.joint_names)) if robot.command_delay is None else robot.command_delay
        pairs = zip(robot.joint_names, given.tolist(), strict=True)
        record = with_command_delay(record, np.array([known.get(name, (delay, 0.0))[0] for name, delay in pairs]))
    smoothed = 0.03  # length of the filter [s]: shorter than motion, long compared with encoder noise
    window = max(5, 2 * round(smoothed / period / 2) + 1)
    smoother = make_filter(FilterSettings(kind="savitzky-golay", window=window, order=2), period)
    settings = robot.settings.model_copy(update={"filter_torque": False, "averaged_law": False})
    contact = _contacts(prepared, robot)
    for part in prepared.sampling.segments:
        rows = slice(part.start + smoother.half_width, part.stop - smoother.half_width)
        if rows.stop > rows.start:
            state, torque = differentiate(robot, record, rows, smoother, smoother, settings)
            turn, warm = state.orientation, record.temperature
            samples = RobotLog(
                time=record.time[rows],
                joint_names=record.joint_names,
                position=state.position,
                velocity=state.velocity,
                torque=torque,
                base_orientation=None if turn is None else turn.quaternion,
                angular_velocity=None if turn is None else turn.angular_velocity,
                foot_names=tuple(robot.contacts),
                contact=None if contact is None else contact[rows],
                temperature=None if warm is None else warm[rows],
            )
            yield samples, 1 / period


def _contacts(prepared: PreparedLog, robot: Robot) -> BoolArray | None:
    """Convert support phases to flags, shape (T, feet), all false where feet touch; None for a held base."""
    phases = prepared.support.phases
    if any(phase.kind in ("fixed", "hung") for phase in phases):
        return None
    flags = np.zeros((len(prepared.log.time), len(robot.contacts)), dtype=bool)
    for phase in phases:
        if phase.kind != "touching":
            flags[phase.start : phase.stop] = np.isin(list(robot.contacts), phase.feet)
    return flags

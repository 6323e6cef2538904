"""Torques of logs with the gains and delays of the drives, which are known or found."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from stribeck.check.drives.command_delay import SPREAD, command_delays
from stribeck.check.drives.gains import Gain, find_gains, gain_findings, with_gains
from stribeck.core.base.finding import Finding, Setting
from stribeck.core.base.typing import Array
from stribeck.core.equations.friction_torque.preparation import Logs, PreparedLog
from stribeck.core.log import RobotLog
from stribeck.core.log.interpolation import with_command_delay
from stribeck.core.result import JointResult
from stribeck.core.robot import Robot
from stribeck.core.settings import Settings


def find_torques(
    prepared: Logs, robot: Robot, settings: Settings, unseen: Logs = ()
) -> tuple[list[PreparedLog], list[Finding], dict[str, float], Robot]:
    """Find unknown torque constants, kp and delays of commands, and compute the torques with them.

    They are found only in the prepared logs, and also apply to the logs that no fit may see. Torques of joints in
    `RobotLog.unscaled` have a rough factor.

    Returns
    -------
    logs, findings, gain_errors, robot
        All logs, unseen logs last; logs with measured torques are unchanged. Gain errors are relative standard errors
        [1] by joint. The robot has kp of every joint.

    Raises
    ------
    LogError
        If the torque of a joint has the wrong sign.
    """
    every, count, of_delays = [*prepared, *unseen], len(prepared), list[Finding]()
    unknown, commanded = bool(every[0].log.unscaled), every[0].log.command is not None
    for rough in (True, False):  # kp is needed to find the delays, and without the delays it is 10 % off
        if unknown and (commanded or not rough):
            gains = find_gains(every[:count], robot, settings)
            every, robot = [with_gains(part, gains, rough=rough) for part in every], _with_kp(robot, gains)
        if rough:
            every, of_delays = with_found_delays(every[:count], robot, settings, every[count:])
    if not unknown:
        return every, of_delays, {}, robot
    errors = {name: gain.half_width / gain.value / 2 for name, gain in gains.items()}
    findings = [*gain_findings(gains, every[0].log.channel_unit(prismatic=False)), *of_delays]
    return every, findings, errors, robot


def _with_kp(robot: Robot, gains: dict[str, Gain]) -> Robot:
    """Complete kp of the drives if commands are the torque source."""
    if robot.command_gains is None:
        return robot
    kp, kd = robot.command_gains
    values = [gains[name].value if name in gains else gain for name, gain in zip(robot.joint_names, kp, strict=True)]
    return replace(robot, command_gains=(np.array(values), kd))


def with_found_delays(
    prepared: Logs, robot: Robot, settings: Settings, unseen: Logs = ()
) -> tuple[list[PreparedLog], list[Finding]]:
    """Find the delay of the commands, one per joint for all logs, and compute the torques with it.

    Delays from the robot file are used unchanged. Logs that no fit may see get the delays of the others.

    Returns
    -------
    logs, findings
        All logs, the unseen ones last. Logs of measured torques are returned unchanged. `RobotLog.command_delays` has
        the delays.
    """
    commanded = [part for part in prepared if part.log.command is not None]
    if not commanded:
        return [*prepared, *unseen], []
    delay, error = robot.command_delay, np.full(len(robot.joint_names), SPREAD)
    if delay is None:
        delay, error = command_delays(commanded, robot, settings)
    logs = []
    for part in (*prepared, *unseen):
        log = part.log
        if log.command is not None:
            log = with_command_delay(log, delay) if robot.command_delay is None else log
            log = replace(log, command_delays=tuple(zip(delay.tolist(), error.tolist(), strict=True)))
        logs.append(replace(part, log=log))
    return logs, _report(robot, delay[robot.torque_controlled], error[robot.torque_controlled])


def _report(robot: Robot, value: Array, error: Array) -> list[Finding]:
    """Report the delay that was found and its standard error [s], shape (n,), and unknown drive damping."""
    columns, notes = robot.torque_controlled, []
    assert robot.command_gains is not None
    if not robot.command_gains[1][columns].any():
        notes.append(Finding.of("drive-damping"))
    if robot.command_delay is not None:
        return notes
    if np.all(np.abs(value - value.mean()) < np.maximum(2 * error, 1e-3)):
        evidence = _text(value.mean(), error.mean())
        delay: float | dict[str, float] = round(float(value.mean()), 4)
    else:
        estimates = list(zip([robot.joint_names[k] for k in columns], value, error, strict=True))
        evidence = ", ".join(f"{_text(seconds, off)} ({name})" for name, seconds, off in estimates)
        delay = {name: round(float(seconds), 4) for name, seconds, _ in estimates}
    return [Finding.of("command-delay", evidence=evidence, settings=[Setting("robot", "command_delay", delay)]), *notes]


def _text(value: float, error: float) -> str:
    return f"{1e3 * value:.1f} ± {2e3 * error:.1f} ms"


def inseparable_delays(joints: Mapping[str, JointResult], log: RobotLog, robot: Robot) -> list[Finding]:
    """Report joints whose viscous friction depends on the delay of their commands more than the log determines it.

    A command that acts d later adds kp d to the viscous friction that a log without delays seems to show.
    """
    if not log.command_delays or robot.command_gains is None:
        return []
    reported = 0.25  # share of the viscous friction that the 95 % interval of the delay changes [1]
    example = 0.02  # delay whose effect on the viscous friction the message states [s]
    texts = {}
    for name, kp, (delay, error) in zip(robot.joint_names, robot.command_gains[0], log.command_delays, strict=True):
        kp /= log.unscaled.get(name, 1.0)
        viscous = joints[name].parameters.get("viscous") if name in joints else None
        if viscous is not None and 2 * kp * error > reported * viscous.value:
            at_once = viscous.value + kp * delay
            texts[name] = f" ({at_once:.2g} {viscous.unit} if commands act at once, {kp * example:.2g} less per 20 ms)"
    return [Finding.of("command-delay.inseparable", texts)] if texts else []

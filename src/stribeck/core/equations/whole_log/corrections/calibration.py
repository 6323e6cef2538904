"""Calibration of sensors: gains, zeros, mounting and delays."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stribeck.core.base.finding import Finding, Setting
from stribeck.core.base.typing import Array, IntArray
from stribeck.core.equations.whole_log.corrections.correction import Correction, Layout, Signals
from stribeck.core.log import RobotLog
from stribeck.core.log.interpolation import slerp
from stribeck.core.log.storage import allocate
from stribeck.core.robot import Robot
from stribeck.core.robot.rooting import BASE_FRAME
from stribeck.core.settings import Priors

CONSIDERED = 1e-2
"""Prior of an error that is considered but not estimated, relative to its standard error [1] (Schmidt 1966).

The prior is so small that the log does not change the error; `covariance_budget` restores its effect.
"""

WRENCH = (3, 3, 1)
"""Numbers of corrections of a wrench sensor: zeros of forces, of moments, and gain."""


def _scaled(log: RobotLog, _: Robot, joints: IntArray, gains: Array) -> RobotLog:
    factors, scaled = np.ones(log.torque.shape[1]), allocate(log.torque.shape)
    factors[joints] -= gains
    np.multiply(log.torque, factors, out=scaled)
    return replace(log, torque=scaled)


def _moved(log: RobotLog, _: Robot, __: IntArray, zeros: Array) -> RobotLog:
    position = allocate(log.position.shape)
    np.subtract(log.position, zeros, out=position)
    return replace(log, position=position)


def _zero_finding(places: Sequence[int], values: Array, errors: Array, robot: Robot) -> Finding:
    joint, angle = robot.joint_names[places[0]], float(values[0])
    degrees, error = np.rad2deg([angle, 2 * float(errors[0])])
    return Finding.of("encoder-zero", [joint], angle=degrees, error=error, offset=f"{{ {joint} = {-angle:.4f} }}")


def _turned(log: RobotLog, robot: Robot, _: IntArray, tilt: Array) -> RobotLog:
    from scipy.spatial.transform import Rotation

    if log.base_orientation is None or robot.base_frame != BASE_FRAME:
        return log
    turned = Rotation.from_quat(log.base_orientation) * Rotation.from_rotvec(-tilt)
    return replace(log, base_orientation=turned.as_quat())


def _tilt_finding(_: Sequence[int], values: Array, errors: Array, __: Robot) -> Finding:
    angles = zip(np.rad2deg(values), 2 * np.rad2deg(errors), "xyz", strict=True)
    sure = (f"{angle:.2g} ± {error:.1g}° about {axis}" for angle, error, axis in angles if abs(angle) > 2 * error)
    return Finding.of("imu-tilt", angles=", ".join(sure))


def _turning(signals: Signals) -> Array:
    turn = signals.state.orientation
    rate = np.zeros((len(signals.state.position), 3)) if turn is None else turn.angular_velocity
    return -(signals.by_angles[:, :, -3:] @ rate[:, :, None])


def _shifted(log: RobotLog, robot: Robot, _: IntArray, delay: Array) -> RobotLog:
    if log.base_orientation is None or robot.base_frame != BASE_FRAME:
        return log
    return replace(log, base_orientation=slerp(log.time + delay.sum(), log.time, log.base_orientation))


def delay_finding(check: str, channel: str, delay: float, robot: Robot) -> Finding:
    """Report the delay of a channel [s] with the setting that corrects it."""
    before = getattr(robot.log_table, channel).delay
    size = f"{1e3 * abs(delay):.2g} ms {'late' if delay > 0 else 'early'}"
    return Finding.of(check, size=size, settings=[Setting(f"log.{channel}", "delay", round(before + delay, 4))])


def _base_delay_finding(_: Sequence[int], values: Array, __: Array, robot: Robot) -> Finding:
    return delay_finding("base-orientation-delay", "base_orientation", float(values[0]), robot)


def _wrench_scales(priors: Priors, layout: Layout) -> Array:
    scales = np.repeat([priors.wrench_force, priors.wrench_moment, priors.wrench_gain], WRENCH)
    return np.tile(scales, layout.sizes["wrenches"] // len(scales))


def _wrench_columns(signals: Signals) -> Array:
    sensors, size = signals.layout.sizes["wrenches"] // sum(WRENCH), sum(WRENCH)
    columns = np.zeros((len(signals.state.position), len(signals.acting), sensors, size))
    if signals.wrench is not None:
        columns[:, :6, signals.mode.sensor, :6], columns[:, :6, signals.mode.sensor, 6] = np.eye(6), signals.wrench
    return columns.reshape(*columns.shape[:2], -1)


CALIBRATION: tuple[Correction, ...] = (
    # Gains of torque sensors [1]. Their mean is one, because a common gain scales all friction.
    Correction(
        name="gains",
        columns=lambda signals: signals.torque[:, None] * signals.torque_effects,
        scales=lambda priors, _: priors.torque_gain,
        count=lambda robot, names: sum(name in robot.joint_names for name in names),
        apply=_scaled,
        grouped=True,
        describe=lambda fit: {"torque_gain": {k: v for k, v in zip(fit.joints, fit.pairs, strict=False) if v[1]}},
    ),
    # Zeros of encoders [rad].
    Correction(
        name="zeros",
        columns=lambda signals: signals.by_angles[:, :, :-3],
        scales=lambda priors, _: priors.encoder_zero,
        count=lambda robot, _: len(robot.joint_names),
        apply=_moved,
        grouped=True,
        kind="zero",
        apart=True,
        finding=_zero_finding,
        describe=lambda fit: {"encoder_zero": dict(zip(fit.encoders, fit.pairs, strict=False))},
    ),
    # Tilt of the base's orientation about the axes of the root link [rad].
    Correction(
        name="tilts",
        columns=lambda signals: signals.by_angles[:, :, -3:],
        scales=lambda priors, _: priors.imu_tilt,
        count=lambda *_: 3,
        apply=_turned,
        grouped=True,
        kind="tilt",
        finding=_tilt_finding,
    ),
    # Delay of all torques relative to the encoders [s]; a log is corrected by the total delay of the fit.
    Correction(
        name="torque_delay",
        columns=lambda signals: -(signals.torque_effects @ signals.torque_rate[:, :, None]),
        scales=lambda priors, _: priors.torque_delay,
        describe=lambda fit: {"torque_delay": next(iter(fit.pairs), None)},
    ),
    # Delay of the base's orientation relative to the encoders [s].
    Correction(
        name="base_delay",
        columns=_turning,
        scales=lambda priors, _: priors.base_delay,
        count=lambda robot, _: int(robot.base == "floating"),
        apply=_shifted,
        kind="base delay",
        finding=_base_delay_finding,
        describe=lambda fit: {"base_delay": next(iter(fit.pairs), None)},
    ),
    # Delays of commands [s]. They were found before the fit, and only their errors matter.
    Correction(
        name="command_delays",
        columns=lambda signals: signals.torque_rate[:, None] * signals.torque_effects,
        scales=lambda _, layout: CONSIDERED * np.array(layout.command_delays),
        size=lambda layout: len(layout.command_delays),
    ),
    # Wrench sensors in feet: six zeros [N], [N m], and one gain [1] each.
    Correction(name="wrenches", columns=_wrench_columns, scales=_wrench_scales),
)
"""Corrections of sensors, from gains to wrench sensors."""

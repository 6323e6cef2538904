"""Motion and sensor noise of a log, or of the first trajectory, to rehearse an identification with."""

from dataclasses import dataclass, replace

import numpy as np

from stribeck.core.base.parts import SERVICES
from stribeck.core.base.typing import Array
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.equations.whole_log.noise import white_noise
from stribeck.core.filters.filters import make_filter, resolve_auto
from stribeck.core.log import LogLike
from stribeck.core.result import Result
from stribeck.core.robot import Robot
from stribeck.core.settings import FilterSettings, LogTable
from stribeck.design.planning.first import NOISE, RATE, assumed_noise
from stribeck.design.planning.information import noise_of, present_motions
from stribeck.design.planning.plan import plan
from stribeck.design.planning.selection import planned_joint, posture_of


@dataclass(frozen=True, eq=False, kw_only=True)
class Rehearsed:
    """Motion to rehearse, and standard deviations of its white noise.

    Attributes
    ----------
    time, position
        Time [s], shape (T,), and positions [rad], [m], shape (T, n).
    position_noise, torque_noise
        Noise of positions [rad], [m] and torques [N m], [N], shape (n,).
    friction
        Coulomb and viscous friction of the joints for which they are known.
    notes
        Sentences on where motion and noise come from.
    """

    time: Array
    position: Array
    position_noise: Array
    torque_noise: Array
    friction: dict[str, tuple[float, float]]
    notes: list[str]


def measured_robot(robot: Robot) -> Robot:
    """Replace the source of the robot's torques by sensors, without settings for logs."""
    settings = robot.settings
    if settings.filter.kind == "log":  # a rehearsal has no velocities
        settings = settings.model_copy(update={"filter": FilterSettings()})
    return replace(
        robot,
        torque_source="link_side_sensor",
        settings=settings,
        log_table=LogTable(),
        motors={},
        command_gains=None,
        command_delay=None,
        payloads=(),
    )


def first_motion(robot: Robot, duration: float) -> Rehearsed:
    """Take the motion of `stribeck plan` without a log, and torque noise of a share of the limits."""
    planned = plan(None, robot, duration=duration)
    assert planned.trajectory is not None  # before the first log
    trajectory = planned.trajectory
    time = np.arange(round(trajectory.duration * RATE)) / RATE
    encoder = 1e-5  # noise of the encoders before the first log [rad], [m]
    said = f"motion planned by `stribeck plan`, {trajectory.duration:.0f} s at {RATE:.0f} Hz"
    assumed = f"assumed: torque noise of {NOISE:.0%} of the limits, encoder noise of {encoder:g} rad"
    return Rehearsed(
        time=time,
        position=trajectory.at(time).position,
        position_noise=np.full(len(robot.joint_names), encoder),
        torque_noise=assumed_noise(robot),
        friction={},
        notes=[said, assumed, *planned.notes],
    )


def motion_of_log(robot: Robot, log: LogLike, result: Result | None) -> Rehearsed:
    """Take the smoothed motion of the longest unbroken part of a log, and friction and noise of its result.

    The torque noise explains the intervals of the result; without one it is the white noise of the log.

    Raises
    ------
    LogError, SettingsError
        If the log cannot be used.
    """
    prepared = prepare(log, robot, robot.settings)
    period, segments = prepared.sampling.period, prepared.sampling.segments
    settings = robot.settings.filter
    if settings.kind == "auto":
        settings = resolve_auto(settings, SERVICES["cutoff"](prepared, robot, robot.settings))
    rows = max(segments, key=lambda part: part.stop - part.start)
    position = prepared.log.position[rows]
    smooth = position if settings.kind == "log" else make_filter(settings, period).smooth(position)
    length = f"{len(smooth) * period:.1f} s at {1 / period:.0f} Hz"
    torque_noise, friction = white_noise(prepared.log.torque, segments), dict[str, tuple[float, float]]()
    if result:
        planned = {name: planned_joint(name, result.joints, robot, posture_of(robot, result)) for name in result.joints}
        for name, density in noise_of(planned, present_motions(result, planned)).items():
            torque_noise[planned[name].column] = np.sqrt(density / period)
    for name, joint in result.joints.items() if result else ():
        if joint.curve and (top := joint.curve[-1]).interval_95[1] > 0:
            level = top.interval_95[1] if joint.verdict == "no friction" else top.value  # the upper bound
            coulomb = min(joint.values.get("coulomb", level), level)
            friction[name] = coulomb, (level - coulomb) / top.velocity
    said = "friction and torque noise from its result" if result else "its white noise"
    return Rehearsed(
        time=period * np.arange(len(smooth), dtype=np.float64),
        position=smooth,
        position_noise=white_noise(prepared.log.position, segments),
        torque_noise=torque_noise,
        friction=friction,
        notes=[f"{'random walk' if robot.base == 'floating' else 'motion of the log'}, {length}; {said}"],
    )

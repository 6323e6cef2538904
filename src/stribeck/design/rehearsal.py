"""A rehearsal: the log that a robot with known friction would record during a planned or recorded motion."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import make_interp_spline

from stribeck.core.base.parts import SERVICES
from stribeck.core.base.typing import Array
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.equations.whole_log.noise import white_noise
from stribeck.core.filters.filters import make_filter, resolve_auto
from stribeck.core.friction import FrictionLaw, get_law
from stribeck.core.log import LogLike, RobotLog
from stribeck.core.result import Result
from stribeck.core.robot import Robot
from stribeck.core.settings import FilterSettings, LogTable
from stribeck.design.planning.information import noise_of, present_motions
from stribeck.design.planning.plan import plan
from stribeck.design.planning.selection import NOISE, RATE, assumed_noise, planned_joint, posture_of
from stribeck.simulation import Parameters, exact_log, inverse_dynamics, with_noise

SHARE_OF_LIMIT, SHARE_OF_TORQUE = 0.03, 0.1
"""Coulomb friction relative to the torque limit of the joint, or without one to the RMS torque of the motion [1]."""
LEAST = 0.01
"""Least Coulomb friction [N m], [N]."""


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


def rehearse(robot: Robot, motion: Rehearsed, seed: int = 0) -> tuple[RobotLog, FrictionLaw, Parameters]:
    """Simulate the log of a robot that follows a motion exactly, and state its Coulomb and viscous friction.

    Where `motion.friction` has no joint, friction at top speed is twice the Coulomb friction. A floating robot walks at
    random about its median posture instead, as in `exact_log`, for the same time and at the same rate.

    Parameters
    ----------
    robot
        Robot whose model is taken as exact.
    motion
        Smooth positions at even times, noise, and known friction.
    seed
        Seed of the noise.
    """
    law, names, time, position = get_law("coulomb-viscous"), robot.joint_names, motion.time, motion.position
    if robot.base == "floating":
        rate = 1 / float(np.diff(time).mean())
        posture = dict(zip(names, np.median(position, axis=0).tolist(), strict=True))
        bare, _ = exact_log(robot, law, {}, duration=float(time[-1] - time[0]), rate=rate, posture=posture)
    else:
        spline = make_interp_spline(time, position, k=5)
        followed = np.array([spline(time, order) for order in range(3)])
        torque = inverse_dynamics(robot, followed, None)[1]
        bare = RobotLog(time=time, joint_names=names, position=followed[0], velocity=followed[1], torque=torque)
    assert bare.velocity is not None
    rms, top = np.sqrt(np.mean(bare.torque**2, axis=0)), np.abs(bare.velocity).max(axis=0)
    limited = np.isfinite(robot.effort_limits)
    level = np.where(limited, SHARE_OF_LIMIT * np.where(limited, robot.effort_limits, 0.0), SHARE_OF_TORQUE * rms)
    level = np.maximum(level, LEAST)
    usual = {name: (float(level[k]), float(level[k] / max(top[k], 1e-3))) for k, name in enumerate(names)}
    parameters = {
        name: {"viscous": viscous, "coulomb": coulomb, "offset": 0.0}
        for name, (coulomb, viscous) in {**usual, **motion.friction}.items()
    }
    values = np.array([[parameters[name][parameter.name] for parameter in law.parameters] for name in names]).T
    resisting = np.column_stack([law.torque(velocity, values[:, k]) for k, velocity in enumerate(bare.velocity.T)])
    exact = replace(bare, torque=bare.torque + resisting)
    log = with_noise(exact, position=motion.position_noise, torque=motion.torque_noise, seed=seed)
    return log, law, parameters

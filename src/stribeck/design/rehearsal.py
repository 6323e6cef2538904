"""A rehearsal: the log that a robot with known friction would record during a given motion."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import make_interp_spline

from stribeck.core.base.typing import Array
from stribeck.core.friction import FrictionLaw, get_law
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.simulation import Parameters, exact_log, inverse_dynamics, with_noise

SHARE_OF_LIMIT, SHARE_OF_TORQUE = 0.03, 0.1
"""Coulomb friction relative to the torque limit of the joint, or without one to the RMS torque of the motion [1]."""
LEAST = 0.01
"""Least Coulomb friction [N m], [N]."""


@dataclass(frozen=True, eq=False)
class Rehearsal:
    """Log of a rehearsal, and the friction in it."""

    log: RobotLog
    law: FrictionLaw
    parameters: Parameters


def rehearse(
    robot: Robot,
    time: Array,
    position: Array,
    noise: tuple[Array, Array],
    friction: Mapping[str, tuple[float, float]],
    seed: int = 0,
) -> Rehearsal:
    """Simulate the log of a robot with Coulomb and viscous friction that follows a motion exactly.

    Where `friction` has no joint, friction at top speed is twice the Coulomb friction. A floating robot walks at random
    about its median posture instead, as in `exact_log`, for the same time and at the same rate.

    Parameters
    ----------
    robot
        Robot whose model is taken as exact.
    time, position
        Even times [s], shape (T,), and smooth positions [rad], [m], shape (T, n).
    noise
        Standard deviations of white noise of positions [rad], [m] and torques [N m], [N], shape (n,) each.
    friction
        Coulomb and viscous friction by joint.
    seed
        Seed of the noise.
    """
    law, names = get_law("coulomb-viscous"), robot.joint_names
    if robot.base == "floating":
        rate = 1 / float(np.diff(time).mean())
        posture = dict(zip(names, np.median(position, axis=0).tolist(), strict=True))
        bare, _ = exact_log(robot, law, {}, duration=float(time[-1] - time[0]), rate=rate, posture=posture)
    else:
        spline = make_interp_spline(time, position, k=5)
        motion = np.array([spline(time, order) for order in range(3)])
        torque = inverse_dynamics(robot, motion, None)[1]
        bare = RobotLog(time=time, joint_names=names, position=motion[0], velocity=motion[1], torque=torque)
    assert bare.velocity is not None
    rms, top = np.sqrt(np.mean(bare.torque**2, axis=0)), np.abs(bare.velocity).max(axis=0)
    limited = np.isfinite(robot.effort_limits)
    level = np.where(limited, SHARE_OF_LIMIT * np.where(limited, robot.effort_limits, 0.0), SHARE_OF_TORQUE * rms)
    level = np.maximum(level, LEAST)
    usual = {name: (float(level[k]), float(level[k] / max(top[k], 1e-3))) for k, name in enumerate(names)}
    parameters = {
        name: {"viscous": viscous, "coulomb": coulomb, "offset": 0.0}
        for name, (coulomb, viscous) in {**usual, **friction}.items()
    }
    values = np.array([[parameters[name][parameter.name] for parameter in law.parameters] for name in names]).T
    resisting = np.column_stack([law.torque(velocity, values[:, k]) for k, velocity in enumerate(bare.velocity.T)])
    exact = replace(bare, torque=bare.torque + resisting)
    return Rehearsal(with_noise(exact, position=noise[0], torque=noise[1], seed=seed), law, parameters)

"""Tasks of the center of mass, the base and the swing foot, as accelerations and velocities.

If the acceleration `k e - 2 sqrt(k) e'` corrects an error e, the desired velocity is the planned velocity plus
`sqrt(k) e`: an error with this velocity decays with critical damping.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import cos, sin, sqrt

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array
from stribeck.simulation.walking.balance.qp import BASE, Task
from stribeck.simulation.walking.balance.swing import Swing
from stribeck.simulation.walking.balance.terms import FootState, Terms


def desired_velocity(standing: Sequence[FootState], tasks: Sequence[Task]) -> Array:
    """Compute the desired joint velocities of the tasks, with standing feet at rest [rad/s], shape (n,).

    `J_k v = velocity_k` and `J_c v = 0` are solved by damped least squares; the rest of the first standing foot
    eliminates the base's velocity.

    Parameters
    ----------
    standing
        One or two standing feet.
    tasks
        Tasks with desired velocities.
    """
    root, others = standing[0], standing[1:]
    jacobian = np.concatenate([*(task.jacobian for task in tasks), *(foot.jacobian for foot in others)])
    wanted = np.concatenate([*(task.velocity for task in tasks), np.zeros(BASE * len(others))])
    reduced = jacobian[:, BASE:] - jacobian[:, :BASE] @ root.to_base @ root.jacobian[:, BASE:]
    # weight of joint velocities relative to the tasks [m^2]: it keeps arms at rest and stretched knees slow
    return np.linalg.solve(reduced.T @ reduced + 1e-3**2 * np.eye(reduced.shape[1]), reduced.T @ wanted)


@dataclass(frozen=True, kw_only=True)
class Gains:
    """Feedback gains and weights: stiffness in 1/s^2 with critical damping; weights of squared accelerations."""

    dcm: float = 3.0  # decay rate of DCM errors [1/s]
    height: float = 100.0
    base: float = 400.0
    foot: float = 1600.0
    foot_tilt: float = 10000.0
    foot_time: float = 0.1  # time constant of the swing foot's integral, which compensates for friction [s]
    foot_tilt_time: float = 0.05  # time constant of the integral of its tilt [s]
    posture: float = 100.0
    held: float = 400.0  # stiffness of position-controlled joints
    com_weight: float = 1000.0  # with the foot's weight, joint friction causes falls in sideways walks
    foot_weight: float = 10.0
    base_weight: float = 30.0
    posture_weight: float = 1e-2
    leg_weight: float = 1e-3  # low weight of the legs' posture, so that the upper body does not compensate for the legs
    held_weight: float = 1.0
    force_weight: float = 1e-6  # [1/N^2], for the planned distribution of the weight
    moment_weight: float = 1e-4  # [1/(N m)^2], keeps the pressure near the middle of the sole
    friction: float = 0.6  # assumed friction coefficient of the feet


def com_task(terms: Terms, dcm: Array, zmp: Array, height: float, pulsation: float, gains: Gains) -> Task:
    """Control the DCM by the ZMP: `p = p_ref + (1 + k / w) (xi - xi_ref)` and `c'' = w^2 (c - p)`; keep the height.

    As a result, `(xi - xi_ref)' = -k (xi - xi_ref)`. The desired velocity moves the DCM to its reference.

    Parameters
    ----------
    terms
        Terms at the robot's current state.
    dcm, zmp
        Planned DCM and ZMP, shape (2,) [m].
    height
        Height of the center of mass [m].
    pulsation
        w = sqrt(g / z) [1/s].
    gains
        Feedback gains and weights.
    """
    rate = gains.dcm / pulsation
    x, y, z = terms.com.tolist()
    vx, vy, vz = terms.com_velocity.tolist()
    (dcm_x, dcm_y), (zmp_x, zmp_y) = dcm.tolist(), zmp.tolist()
    pressure_x = zmp_x + (1 + rate) * (x + vx / pulsation - dcm_x)
    pressure_y = zmp_y + (1 + rate) * (y + vy / pulsation - dcm_y)
    wanted = np.array(
        [
            pulsation**2 * (x - pressure_x),
            pulsation**2 * (y - pressure_y),
            gains.height * (height - z) - 2 * sqrt(gains.height) * vz,
        ]
    )
    velocity = np.array([pulsation * (dcm_x - x), pulsation * (dcm_y - y), sqrt(gains.height) * (height - z)])
    return Task(terms.com_jacobian, wanted - terms.com_drift, velocity)


def base_task(terms: Terms, spin: Array, yaw: float, yaw_rate: float, gains: Gains) -> Task:
    """Keep the base upright at a heading [rad] and yaw rate [rad/s]; `spin` is its angular velocity in its axes."""
    error = pin.log3(terms.base_rotation.T @ upright(yaw))
    rate = terms.base_rotation[2] * yaw_rate
    wanted = gains.base * error + 2 * sqrt(gains.base) * (rate - spin)
    return Task(_turn_of_base(len(terms.bias)), wanted, rate + sqrt(gains.base) * error)


@cache
def _turn_of_base(nv: int) -> Array:
    return np.eye(3, nv, 3)


def swing_error(foot: FootState, swing: Swing) -> Array:
    """Compute the pose error of the sole: translation [m] in the world, rotation [rad] in the sole, shape (6,)."""
    return np.concatenate([swing.place - foot.place, pin.log3(foot.rotation.T @ upright(swing.yaw))])


def swing_task(foot: FootState, swing: Swing, error: Array, missed: Array, gains: Gains) -> Task:
    """Move the level swing foot to its desired pose, in the sole's coordinates.

    The sole's spatial acceleration (from its Jacobian) is the acceleration of its center minus w x v.

    Parameters
    ----------
    foot, swing
        Current and desired pose of the sole.
    error, missed
        Pose error from `swing_error`, and its integral since the foot left the ground, shape (6,). Light feet require
        the integral, because friction in the ankle is large relative to their inertial torque.
    gains
        Feedback gains.
    """
    turn, linear, spin = foot.rotation, foot.velocity[:3], foot.velocity[3:]
    way, tilt = error[:3] + missed[:3] / gains.foot_time, error[3:] + missed[3:] / gains.foot_tilt_time
    move = swing.acceleration + gains.foot * way + 2 * sqrt(gains.foot) * swing.velocity
    wanted = np.empty(6)
    wanted[:3] = move @ turn - 2 * sqrt(gains.foot) * linear - pin.skew(spin) @ linear
    wanted[3:] = gains.foot_tilt * tilt + 2 * sqrt(gains.foot_tilt) * (turn[2] * swing.yaw_rate - spin)
    velocity = np.empty(6)
    velocity[:3] = (swing.velocity + sqrt(gains.foot) * way) @ turn
    velocity[3:] = turn[2] * swing.yaw_rate + sqrt(gains.foot_tilt) * tilt
    return Task(foot.jacobian, wanted - foot.drift, velocity)


def upright(yaw: float) -> Array:
    """Compute the rotation about the vertical by a heading [rad]."""
    cosine, sine = cos(yaw), sin(yaw)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])

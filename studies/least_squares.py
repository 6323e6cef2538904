"""What a user would write instead: least squares, joint by joint, of what inverse dynamics leave of the torques.

Positions and torques are filtered, velocity and acceleration are central differences, the inverse dynamics those of the
model, samples at rest are left out, and Coulomb and viscous friction, an offset and, where the torque is the motor's, a
rotor inertia come from `numpy.linalg.lstsq`.
"""

from collections.abc import Sequence

import numpy as np
from scipy.signal import butter, sosfiltfilt

from stribeck import Robot
from stribeck.dynamics.rooted import rooted_inverse_dynamics
from stribeck.log import RobotLog
from stribeck.log.sampling import regularise
from stribeck.result import JointResult, LogSummary, ParameterEstimate, Result
from stribeck.typing import Array

NAMES = {"coulomb": "N m", "viscous": "N m s/rad", "offset": "N m", "armature": "kg m^2"}
MOVES = 0.02
"""Share of the top speed [1] below which a joint is at rest."""
ENDS = 0.25
"""Left out at both ends, where filters swing in [s]."""


def least_squares(logs: Sequence[RobotLog], robot: Robot, cutoff: float) -> Result:
    """Return the friction of all joints of a robot with a fixed base; the filters' cutoff is in Hz."""
    parts = []
    for log, sampling in (regularise(log, robot.log_table) for log in logs):
        filters = butter(4, 2 * cutoff * sampling.period, output="sos")
        for rows in sampling.segments:
            q, torque = (sosfiltfilt(filters, each[rows], axis=0) for each in (log.position, log.torque))
            v = np.gradient(q, sampling.period, axis=0)
            a = np.gradient(v, sampling.period, axis=0)
            left = torque - rooted_inverse_dynamics(robot.tree, q, v, a, None)[1]
            parts.append(np.stack([left, v, a])[:, (cut := round(ENDS / sampling.period)) : -cut])
    left, v, a = np.concatenate(parts, axis=1)
    moving = np.abs(v) > MOVES * np.percentile(np.abs(v), 99, axis=0)
    rotors = robot.torque_source != "link_side_sensor"
    columns = np.stack([np.sign(v), v, np.ones_like(v), a][: 3 + rotors], axis=2)
    found = [np.linalg.lstsq(columns[own, k], left[own, k])[0] for k, own in enumerate(moving.T)]
    return _result(robot, logs, np.array(found) + np.outer(robot.armature, np.arange(3 + rotors) == 3))


def _result(robot: Robot, logs: Sequence[RobotLog], found: Array) -> Result:
    """Return the numbers in the form that every method's have."""
    nothing = (np.nan, np.nan)
    return Result(
        robot=robot.name,
        log=LogSummary(
            path="", sha256="", duration=sum(float(np.ptp(log.time)) for log in logs), rate=0.0, samples_used=0
        ),
        law="coulomb-viscous",
        method="least squares",
        joints={
            joint: JointResult(
                parameters={
                    name: ParameterEstimate(
                        value=float(value), standard_error=np.nan, interval_95=nothing, unit=unit, verdict="weak"
                    )
                    for (name, unit), value in zip(NAMES.items(), row, strict=False)
                },
                verdict="weak",
                reason="",
                samples=0,
                velocity_range=(0.0, 0.0),
                reversals=0,
                law="coulomb-viscous",
            )
            for joint, row in zip(robot.joint_names, found, strict=True)
        },
        warnings=[],
        stribeck="",
    )

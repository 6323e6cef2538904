"""What sensors add to an exact log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stribeck.log import RobotLog


def with_noise(log: RobotLog, *, position: float, torque: float, seed: int = 0) -> RobotLog:
    """Return the log as encoders and torque sensors would give it, without velocity and acceleration.

    Parameters
    ----------
    log
        An exact log.
    position, torque
        Standard deviation of white noise on positions [rad or m] and torques [N m or N].
    seed
        Of the noise.
    """
    generator = np.random.default_rng(seed)
    return replace(
        log,
        position=log.position + position * generator.standard_normal(log.position.shape),
        torque=log.torque + torque * generator.standard_normal(log.torque.shape),
        velocity=None,
        acceleration=None,
    )

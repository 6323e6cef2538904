"""Motion at a segment's rows, each derivative from a Savitzky-Golay window of its own (Savitzky and Golay 1964)."""

from dataclasses import dataclass

import numpy as np

from stribeck.base.typing import Array
from stribeck.differentiation.savitzky_golay import correlate_valid, savgol_kernels
from stribeck.dynamics.state import Orientation, State, orientation_from_derivatives, root_quaternions
from stribeck.log import RobotLog
from stribeck.robot import Robot
from stribeck.whole_log.equations.constants import ACCELERATION_LENGTH, POLYNOMIAL, VELOCITY_LENGTHS, VELOCITY_REFERENCE

SHRINK = 2 / 11
"""Power [1] of the noise with which that window grows: bias grows with its fourth power, noise falls with its 1.5th."""


@dataclass(frozen=True, eq=False)
class Differentiator:
    """Kernels of position, velocity and acceleration, shape (3, L) each.

    `smooth` is for positions and velocities, `sharp` for accelerations.
    """

    smooth: Array
    sharp: Array

    @property
    def margin(self) -> int:
        """Rows that are needed on either side."""
        return int(max(self.smooth.shape[1], self.sharp.shape[1])) // 2

    def state(self, robot: Robot, log: RobotLog, first: int, last: int, tilted: bool) -> State:
        """Return the motion of rows [first, last), which have the margin on both sides."""
        wide = self._wide(first, last, self.smooth)
        position, velocity = correlate_valid(log.position[wide], np.ascontiguousarray(self.smooth[:2]), (0, 1))
        sharp = log.position[self._wide(first, last, self.sharp)]
        acceleration = correlate_valid(sharp, np.ascontiguousarray(self.sharp[2:]), (2,))[0]
        return State(position, velocity, acceleration, self._turn(robot, log, wide) if tilted else None)

    def velocity(self, log: RobotLog, first: int, last: int) -> Array:
        """Return the velocities of rows [first, last), which have the margin on both sides, shape (T, joints)."""
        rows = log.position[self._wide(first, last, self.smooth)]
        return correlate_valid(rows, np.ascontiguousarray(self.smooth[1:2]), (1,))[0]

    def _turn(self, robot: Robot, log: RobotLog, wide: slice) -> Orientation:
        assert log.base_orientation is not None
        quaternions = root_quaternions(robot, log.position[wide], log.base_orientation[wide])
        return orientation_from_derivatives(*correlate_valid(quaternions, self.smooth, (0, 1, 2)))

    @staticmethod
    def _wide(first: int, last: int, kernels: Array) -> slice:
        half = kernels.shape[1] // 2
        return slice(first - half, last + half)


def differentiator(encoder_noise: float, period: float) -> Differentiator:
    """Return the kernels for an encoder's noise [rad] and a sampling period [s]."""
    length, noise, reference_period = VELOCITY_REFERENCE
    noisier = encoder_noise / noise * np.sqrt(period / reference_period)
    smooth = float(np.clip(length * noisier**SHRINK, VELOCITY_LENGTHS[0], VELOCITY_LENGTHS[1]))
    return Differentiator(savgol(smooth, period), savgol(ACCELERATION_LENGTH, period))


def savgol(length: float, period: float) -> Array:
    """Return the kernels of position, velocity and acceleration of a window [s], shape (3, L)."""
    half = max(POLYNOMIAL // 2 + 1, round((length / period - 1) / 2))
    return savgol_kernels(2 * half + 1, POLYNOMIAL, period)

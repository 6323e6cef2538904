"""Joint accelerations of the regressors, with hardly any noise in them (docs/estimator.md, equation 5).

Noise would be taken for motion without torque, and inertias would come out too small (errors in variables, Fuller
1987); a window that is longer than necessary loses motion, and they come out too large. So every joint has a window of
its own:

    L_i = L_0 (sigma_a^2 / (share (p_i - sigma_a^2)))^(1/5)
"""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from stribeck.base.typing import Array
from stribeck.whole_log.equations.constants import LONGEST_ACCELERATION, NOISE_SHARE, SHORTEST_ACCELERATION
from stribeck.whole_log.equations.motion import savgol
from stribeck.whole_log.equations.noise import leading_rows
from stribeck.whole_log.equations.window import Window

DECAY = 5
"""Power [1] of the window's length with which the noise of a second derivative falls."""


@dataclass(frozen=True, eq=False)
class JointAcceleration:
    """Kernels of each joint, shape (n, L), convolved with the weak form's `window`."""

    kernels: Array
    window: Window

    @property
    def margin(self) -> int:
        """Rows that are needed on either side of a segment."""
        return int(self.kernels.shape[1] - len(self.window.taps)) // 2

    def windows(self, position: Array, first: int, last: int) -> Array:
        """Return the accelerations at the windows of rows [first, last), which have the margin, shape (K, n)."""
        rows = np.ascontiguousarray(position[first - self.margin : last + self.margin].T)
        own = sliding_window_view(rows, self.kernels.shape[1], axis=1)[:, :: self.window.step]  # (n, K, L)
        middle = own[:, :, self.kernels.shape[1] // 2, None]  # a derivative of nearly equal numbers loses digits
        return np.ascontiguousarray(((own - middle) @ self.kernels[:, :, None])[:, :, 0].T)


def joint_acceleration(
    position: Array, noise: Array, unbroken: tuple[slice, ...], period: float, window: Window, kernel: Array
) -> JointAcceleration:
    """Return every joint's kernel for a log, of the length of equation (5).

    Parameters
    ----------
    position, noise
        Of its joints [rad], shape (T, n), and the noise's standard deviation, shape (n,).
    unbroken
        Rows that no filter may cross the ends of.
    period
        [s].
    window
        The weak form's.
    kernel
        Savitzky-Golay's of an acceleration, shape (L,), by which the power of noise and of motion are estimated.
    """
    plain = JointAcceleration(np.tile(kernel, (len(noise), 1)), Window(np.ones(1), window.step))
    parts = [part for part in leading_rows(position, unbroken) if len(part) > 2 * plain.margin]
    noise_power = noise**2 * float(np.sum(kernel**2))
    found = [plain.windows(part, plain.margin, len(part) - plain.margin) for part in parts]
    power = np.mean(np.concatenate(found) ** 2, axis=0) if found else noise_power
    lengths = (
        len(kernel)
        * period
        * (noise_power / (NOISE_SHARE * np.maximum(power - noise_power, 1e-9 * noise_power))) ** (1 / DECAY)
    )
    own = [
        np.convolve(window.taps, savgol(each, period)[2])
        for each in np.clip(lengths, SHORTEST_ACCELERATION, LONGEST_ACCELERATION)
    ]
    kernels = np.zeros((len(own), max(len(each) for each in own)))
    for row, each in zip(kernels, own, strict=True):
        row[(kernels.shape[1] - len(each)) // 2 :][: len(each)] = each
    return JointAcceleration(kernels, window)

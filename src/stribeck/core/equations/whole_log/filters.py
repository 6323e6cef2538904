"""Filters of the weak form: smooth windows, derivatives, and accelerations for the regressors.

Equations 2, 5 and 7 of docs/estimator.md; derivatives: Savitzky and Golay 1964.
"""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.equations.weak_equations import through_windows
from stribeck.core.equations.whole_log.noise import SMALLEST, leading_rows, white_noise
from stribeck.core.filters.savitzky_golay import correlate_valid, savgol_kernels

WINDOW_LENGTH = 0.041
"""Length of a window [s]: long enough to average encoder noise, short compared with the motion."""

BOXES = 4
"""Number of boxes whose convolution is a window [1]: the spectrum falls with the fourth power of frequency."""

ACCELERATION_LENGTHS = (0.03, 0.2)
"""Shortest and longest window of the regressors' accelerations [s]; longer ones lose motion. No other is longer."""

NOISE_SHARE = 5e-4
"""Power of noise relative to motion in accelerations of the regressors, and in velocities [1]; chosen for accelerations
on exact models in strong noise."""

INSTANTS = 4
"""Instants per row at which slow logs average friction [1]: it jumps between samples where a joint reverses."""


@dataclass(frozen=True, eq=False)
class Window:
    """Weights of a window, shape (L,), summing to one, rows from one window to the next, and instants per row."""

    taps: Array
    step: int
    fineness: int = 1

    @property
    def edge(self) -> int:
        """Rows on either side of a segment that instants between rows need."""
        return int(self.fineness > 1)

    @property
    def fine_taps(self) -> Array:
        """Weights of the instants: linear between the rows' weights, shape (any,), summing to one."""
        ends = len(self.taps) + 1
        return np.interp(self._places(ends), np.arange(ends + 1), np.pad(self.taps, 1)) / self.fineness

    def refine(self, signal: Array) -> Array:
        """Interpolate a signal, shape (T, n) with `edge` additional rows at both ends, at the instants by a cubic."""
        from scipy.interpolate import make_interp_spline

        if not self.edge:
            return signal
        return np.asarray(make_interp_spline(np.arange(len(signal)), signal)(self._places(len(signal) - 1)))

    def _places(self, ends: int) -> Array:
        """Compute the instants between row 0 and row `ends` [rows]."""
        return np.arange(1, ends * self.fineness) / self.fineness

    def apply(self, signal: Array) -> Array:
        """Return the windows of a signal, shape (T, n) -> (K, n)."""
        return through_windows(signal, self.taps, self.step)

    def overlaps(self, *kernels: Array) -> Array:
        """Compute the autocovariance of windows of white noise of unit variance for some filters, equation (7).

        The result has shape (filters, lags + 1). It ends with the last lag that is not negligible for a filter, and
        has one lag or more.
        """
        longest = max(len(kernel) for kernel in kernels) + len(self.taps) - 1
        overlaps = np.zeros((len(kernels), longest // self.step + 2))
        for overlap, kernel in zip(overlaps, kernels, strict=True):
            response = np.convolve(self.taps, kernel)
            lags = np.correlate(response, response, mode="full")[len(response) - 1 :: self.step]
            overlap[: len(lags)] = lags
        reached = np.abs(overlaps) > 1e-4 * overlaps[:, :1]  # smaller correlations are negligible
        return overlaps[:, : max(1, int(np.flatnonzero(reached.any(axis=0))[-1])) + 1]


def smooth_window(period: float) -> Window:
    """Build the window for a sampling period [s]: a single sample if the period is longer than the window."""
    box = np.ones(max(1, round((WINDOW_LENGTH / period + BOXES - 1) / BOXES)))
    taps = np.ones(1)
    for _ in range(BOXES):
        taps = np.convolve(taps, box / len(box))
    step = max(1, round(0.012 / period))  # [s]; closer windows reduce no errors of walks
    return Window(taps, step, INSTANTS if period > 1.1e-3 else 1)  # [s]


def derivative_kernels(encoder_noise: float, period: float) -> tuple[Array, Array]:
    """Build Savitzky-Golay kernels for positions and velocities, and for accelerations, shape (3, L) each.

    The first window grows with the encoder noise [rad]: its bias with the fourth power of its length, while noise falls
    with the power 1.5. The second is as short as possible, because the window of the weak form averages its noise.
    """
    noisier = encoder_noise / 2e-5 * np.sqrt(period / 1e-3)  # [rad], [s] for which 31 ms are good
    return savgol(float(np.clip(0.031 * noisier ** (2 / 11), 0.015, 0.061)), period), savgol(0.011, period)


def lengthened(kernels: Array, position: Array, noise: Array, unbroken: tuple[slice, ...], period: float) -> Array:
    """Lengthen the window of Savitzky-Golay kernels, shape (3, L), for noisy velocities.

    Noise makes friction rise too slowly near zero (errors in variables, Fuller 1987). The window grows while noise
    exceeds `NOISE_SHARE` of the motion's power, and the sum of noise and bias falls. Bias is the change of the
    velocities beyond that of noise.

    Parameters
    ----------
    kernels
        Kernels, shape (3, L).
    position, noise
        Joint positions [rad], shape (T, n), and the standard deviations of their noise, shape (n,).
    unbroken
        Rows between which no filter may reach.
    period
        Sampling period [s].
    """

    def windows(kernel: Array) -> Array:
        parts = [part for part in leading_rows(position, unbroken) if len(part) > len(kernel)]
        velocities = [correlate_valid(part, kernel[None], (1,))[0] for part in parts]
        return np.concatenate(velocities) if velocities else np.full((1, 1), np.inf)  # too few rows: nothing grows

    motion = np.mean(windows(kernels[1]) ** 2, axis=0) / noise**2
    best, least = kernels, len(noise) * np.sum(kernels[1] ** 2)
    while np.median(np.sum(best[1] ** 2) / motion) > NOISE_SHARE:
        longer = savgol(1.3 * best.shape[1] * period, period)
        change = longer[1] - np.pad(kernels[1], (longer.shape[1] - kernels.shape[1]) // 2)
        bias = np.mean(windows(change) ** 2, axis=0) / noise**2 - np.sum(change**2)
        error = np.sum(np.maximum(bias, 0.0) + np.sum(longer[1] ** 2))
        if error >= least or longer.shape[1] * period > ACCELERATION_LENGTHS[1]:
            break
        best, least = longer, error
    return best


def savgol(length: float, period: float) -> Array:
    """Build the kernels of position, velocity and acceleration of a window [s], shape (3, L)."""
    order = 4
    half = max(order // 2 + 1, round((length / period - 1) / 2))
    return savgol_kernels(2 * half + 1, order, period)


def derivatives(signal: Array, first: int, last: int, kernels: Array, orders: tuple[int, ...]) -> tuple[Array, ...]:
    """Compute derivatives of a signal at rows [first, last) by kernels, shape (3, L), which reach beyond these rows."""
    half = kernels.shape[1] // 2
    return correlate_valid(signal[first - half : last + half], kernels[list(orders)], orders)


@dataclass(frozen=True, eq=False)
class Acceleration:
    """Acceleration kernel per signal, shape (n, L), convolved with the weak form's `window`.

    Noise looks like motion without torque and biases inertias downward (errors in variables, Fuller 1987); a window
    that is longer than necessary removes motion and biases them upward.
    """

    kernels: Array
    window: Window

    @property
    def margin(self) -> int:
        """Rows that are needed on either side of a segment."""
        return int(self.kernels.shape[1] - len(self.window.taps)) // 2

    def windows(self, signal: Array, first: int, last: int) -> Array:
        """Compute the accelerations at the windows of rows [first, last), which have the margin, shape (K, n)."""
        rows = np.ascontiguousarray(signal[first - self.margin : last + self.margin].T)
        windows = sliding_window_view(rows, self.kernels.shape[1], axis=1)[:, :: self.window.step]  # (n, K, L)
        middle = windows[:, :, self.kernels.shape[1] // 2, None]  # a derivative of nearly equal numbers loses digits
        return np.ascontiguousarray(((windows - middle) @ self.kernels[:, :, None])[:, :, 0].T)


def acceleration_filter(
    signal: Array, noise: Array, unbroken: tuple[slice, ...], period: float, window: Window, kernel: Array
) -> Acceleration:
    """Build the kernel of each signal, whose length brings noise down to a share of the motion, equation (5).

        L_i = L_0 (sigma_a^2 / (share (p_i - sigma_a^2)))^(1/5)

    Parameters
    ----------
    signal, noise
        Positions of joints [rad] or quaternions, shape (T, n), and the standard deviations of their noise, shape (n,).
    unbroken
        Rows between which no filter may reach.
    period
        Sampling period [s].
    window
        Window of the weak form.
    kernel
        Savitzky-Golay kernel of an acceleration, shape (L,), which measures the power of noise and motion.
    """
    plain = Acceleration(np.tile(kernel, (len(noise), 1)), Window(np.ones(1), window.step))
    parts = [part for part in leading_rows(signal, unbroken) if len(part) > 2 * plain.margin]
    noise_power = noise**2 * float(np.sum(kernel**2))
    accelerations = [plain.windows(part, plain.margin, len(part) - plain.margin) for part in parts]
    power = np.mean(np.concatenate(accelerations) ** 2, axis=0) if accelerations else noise_power
    share = NOISE_SHARE * np.maximum(power - noise_power, 1e-9 * noise_power)
    lengths = np.clip(len(kernel) * period * (noise_power / share) ** (1 / 5), *ACCELERATION_LENGTHS)
    responses = [np.convolve(window.taps, savgol(length, period)[2]) for length in lengths.tolist()]
    longest = max(len(response) for response in responses)
    return Acceleration(np.stack([np.pad(response, (longest - len(response)) // 2) for response in responses]), window)


def turn_filter(
    quaternions: list[Array], rate_noise: float, period: float, window: Window, kernel: Array
) -> Acceleration:
    """Build the kernels of the root link's quaternion.

    Parameters
    ----------
    quaternions
        Quaternions of the root link in segments of the log, shape (t, 4) each.
    rate_noise
        Standard deviation of a gyroscope's noise [rad/s], whose integral the quaternions may be.
    period, window, kernel
        As for `acceleration_filter`.
    """
    ends = np.cumsum([len(segment) for segment in quaternions]).tolist()
    parts = tuple(slice(end - len(segment), end) for end, segment in zip(ends, quaternions, strict=True))
    signal = np.concatenate(quaternions) if quaternions else np.zeros((0, 4))
    white = np.linalg.norm(white_noise(signal, parts)) / np.sqrt(3)
    integrated = rate_noise / 2 * period * np.linalg.norm(np.cumsum(kernel)) / np.linalg.norm(kernel)
    noise = np.full(4, max(float(white), float(integrated), float(SMALLEST.position[0])))
    return acceleration_filter(signal, noise, parts, period, window, kernel)


@dataclass(frozen=True, eq=False)
class Filters:
    """Filters of a log.

    Attributes
    ----------
    window
        Window of the weak form.
    smooth, sharp
        Kernels of position, velocity and acceleration, shape (3, L): for positions and velocities, for accelerations.
    joints, turn
        Filters of accelerations in the regressors: of the joints and of the root link's orientation, if it is used.
    """

    window: Window
    smooth: Array
    sharp: Array
    joints: Acceleration
    turn: Acceleration | None = None

    @property
    def margin(self) -> int:
        """Rows that filters need on either side of a segment."""
        smooth, sharp = (kernels.shape[1] // 2 for kernels in (self.smooth, self.sharp))
        turn = 0 if self.turn is None else self.turn.margin
        return max(int(smooth) + self.window.edge, int(sharp), self.joints.margin, turn)

    @property
    def shortest(self) -> int:
        """Smallest number of rows of a segment."""
        return shortest(self.window)


def shortest(window: Window) -> int:
    """Return the smallest number of rows of a segment."""
    return len(window.taps) + window.step


def find_filters(
    position: Array,
    noise: Array,
    columns: IntArray,
    unbroken: tuple[slice, ...],
    used: tuple[slice, ...],
    period: float,
) -> Filters:
    """Choose the filters of a log by the noise of its positions [rad].

    `columns` are the joints whose friction is identified; no filter reaches across the gaps between `unbroken` rows,
    and `used` rows show how much the joints move.
    """
    window = smooth_window(period)
    smooth, sharp = derivative_kernels(float(np.median(noise[columns])), period)
    smooth = lengthened(smooth, position[:, columns], noise[columns], unbroken, period)
    return Filters(window, smooth, sharp, acceleration_filter(position, noise, used, period, window, smooth[2]))

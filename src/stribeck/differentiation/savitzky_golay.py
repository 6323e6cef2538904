"""Savitzky-Golay filters: a polynomial fitted to every window, (7.1)-(7.8) of the paper."""

from math import factorial

import numpy as np
from scipy.optimize import brentq

from stribeck.base.typing import Array
from stribeck.errors import SettingsError


def savgol_kernels(window: int, order: int, period: float) -> Array:
    """Compute the kernels of position, velocity and acceleration, shape (3, window), for `y[t] = sum_m k[m] x[t + m]`.

    The polynomial p(n) of (7.1) is fitted to the window by least squares (7.4), so its coefficients are
    `a = (T^T T)^-1 T^T x` (7.5); position is a_0 (7.7), velocity a_1 / dt, acceleration 2 a_2 / dt^2.
    The kernels are even or odd: no phase shift, and an even order's position and acceleration equal those of the next
    odd order, an even order's velocity that of the odd order below.

    Parameters
    ----------
    window
        Samples in a window, odd. With `window = order + 1` the polynomial goes through all: nothing is smoothed.
    order
        Order of the polynomial, from 2 (less has no acceleration) to `window - 1`.
    period
        Sampling period [s].

    Raises
    ------
    SettingsError
        If window and order do not go together.
    """
    if window % 2 == 0:
        raise SettingsError(f"[identify.filter] window is {window}; it must be odd to have a middle, e.g. {window + 1}")
    if order < 2:
        raise SettingsError(f"[identify.filter] order is {order}; a polynomial needs 2 to have an acceleration")
    if order >= window:
        raise SettingsError(
            f"[identify.filter] order is {order}; it must be smaller than the window of {window} samples"
        )
    # n from -1 to 1 instead of -N to N keeps the powers apart in double precision.
    T = np.linspace(-1.0, 1.0, window)[:, None] ** np.arange(order + 1)
    coefficients = np.linalg.pinv(T)[:3]
    parity = np.array([[1.0], [-1.0], [1.0]])
    even_or_odd = 0.5 * (coefficients + parity * coefficients[:, ::-1])
    scale = np.array([[factorial(d) / (window // 2 * period) ** d] for d in range(3)])
    return np.asarray(scale * even_or_odd)


def savgol_cutoff(window: int, order: int, rate: float) -> float:
    """Compute the frequency [Hz] at which the position kernel's gain falls below -3 dB; Nyquist if it never does.

    Raises
    ------
    SettingsError
        If window and order do not go together.
    """
    kernel = savgol_kernels(window, order, 1.0)[0]
    half_power = float(np.sqrt(0.5))
    below = np.flatnonzero(np.abs(np.fft.rfft(kernel, 16 * window)) < half_power)
    if len(below) == 0:
        return float(rate / 2)
    offsets = np.arange(window) - window // 2

    def excess(cycles_per_sample: float) -> float:
        return float(kernel @ np.cos(2 * np.pi * cycles_per_sample * offsets)) - half_power

    upper = float(below[0]) / (16 * window)
    return float(rate * float(brentq(excess, upper - 1 / (16 * window), upper, xtol=1e-12)))


def savgol_window(cutoff: float, order: int, rate: float) -> int:
    """Find the longest odd window [samples] whose -3 dB cutoff is not below `cutoff` [Hz].

    Where even the shortest window of this order cuts lower, it is that shortest window.

    Raises
    ------
    SettingsError
        If the cutoff is not below the Nyquist frequency.
    """
    if cutoff >= rate / 2:
        raise SettingsError(
            f"[identify.filter] cutoff is {cutoff:g} Hz; it must be below half the log's rate of {rate:g} Hz"
        )
    wanted = cutoff * (1 - 1e-9)  # so that the cutoff of a window gives that window back
    low = order // 2 + order % 2  # half widths: `low` is long enough for the order, `high` too long for the cutoff
    high = 2 * low
    while savgol_cutoff(2 * high + 1, order, rate) >= wanted:
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        if savgol_cutoff(2 * middle + 1, order, rate) >= wanted:
            low = middle
        else:
            high = middle
    return 2 * low + 1


def correlate_valid(signal: Array, kernels: Array, orders: tuple[int, ...]) -> tuple[Array, ...]:
    """Slide kernels over a signal where they lie inside it: `y[t] = sum_m k[m] x[t + m]`, (7.8) reversed.

    A block of outputs is one product of a banded matrix, which has all kernels, with a block of inputs: faster than
    convolutions. The middle row of a block is subtracted first, because a derivative of nearly equal numbers loses
    digits; a joint at rest has a velocity of exactly zero.

    Parameters
    ----------
    signal
        Shape (T, n), without NaN.
    kernels
        One kernel per row, shape (k, L).
    orders
        Order of the derivative that each kernel computes: its taps sum to 1 for order 0 and to 0 for the others.

    Returns
    -------
    tuple of Array
        One array per kernel, shape (T - L + 1, n); empty where the signal is shorter than the kernel.
    """
    count, length = kernels.shape
    samples = max(len(signal) - length + 1, 0)
    outputs = tuple(np.empty((samples, signal.shape[1])) for _ in range(count))
    block = max(64, length // 3)  # shorter blocks pay more for the call than for the arithmetic
    shifts = min(block, samples)
    inputs = shifts + length - 1
    padded = np.hstack(
        [kernels, np.zeros((count, shifts))]
    )  # one entry longer than a row: repeated, each row starts one later
    band = np.tile(padded, shifts)[:, : shifts * inputs].reshape(count, shifts, inputs)
    for start in range(0, samples, block):
        rows = min(block, samples - start)
        window = signal[start : start + rows + length - 1]
        middle = window[len(window) // 2]
        product = band[:, :rows, : len(window)] @ (window - middle)
        for output, order, result in zip(outputs, orders, product, strict=True):
            output[start : start + rows] = result + middle if order == 0 else result
    return outputs

"""Savitzky-Golay filters: a polynomial is fitted to each window, (7.1)-(7.8) of the paper."""

from bisect import bisect_left
from math import factorial

import numpy as np
import scipy  # its optimize is slow to import: loaded at its first use

from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError


def savgol_kernels(window: int, order: int, period: float) -> Array:
    """Compute the kernels of position, velocity and acceleration, shape (3, window), for `y[t] = sum_m k[m] x[t + m]`.

    The polynomial p(n) of (7.1) is fitted to the window by least squares (7.4), so its coefficients are
    `a = (T^T T)^-1 T^T x` (7.5); position is a_0 (7.7), velocity a_1 / dt, acceleration 2 a_2 / dt^2.
    The kernels are even or odd, so they have no phase shift. An even order has the position and acceleration of the
    next odd order, and the velocity of the odd order below.

    Parameters
    ----------
    window
        Odd number of samples. With `window = order + 1` the polynomial passes through all samples, without smoothing.
    order
        Order of the polynomial, from 2 (lower orders have no acceleration) to `window - 1`.
    period
        Sampling period [s].

    Raises
    ------
    SettingsError
        If window and order contradict each other.
    """
    if window % 2 == 0:
        raise SettingsError(f"[identify.filter] window is {window}; expected an odd number, e.g. {window + 1}")
    if order < 2:
        raise SettingsError(f"[identify.filter] order is {order}; an acceleration requires at least 2")
    if order >= window:
        raise SettingsError(f"[identify.filter] order is {order}; expected less than the window of {window} samples")
    # n from -1 to 1 instead of -N to N keeps the powers independent in double precision.
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
        If window and order contradict each other.
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
    return float(rate * float(scipy.optimize.brentq(excess, upper - 1 / (16 * window), upper, xtol=1e-12)))


def savgol_window(cutoff: float, order: int, rate: float) -> int:
    """Find the longest odd window [samples] whose -3 dB cutoff is not below `cutoff` [Hz].

    If the shortest window of this order has a lower cutoff, the shortest window is returned.

    Raises
    ------
    SettingsError
        If the cutoff is not below the Nyquist frequency.
    """
    require_below_nyquist(cutoff, rate)
    wanted = cutoff * (1 - 1e-9)  # the cutoff of a window must give the same window
    low = order // 2 + order % 2  # half widths: `low` is long enough for the order, `high` too long for the cutoff
    high = 2 * low

    def too_long(half: int) -> bool:
        return savgol_cutoff(2 * half + 1, order, rate) < wanted

    while not too_long(high):
        low, high = high, 2 * high
    return 2 * (low + bisect_left(range(low + 1, high), True, key=too_long)) + 1


def require_below_nyquist(cutoff: float, rate: float) -> None:
    """Raise a SettingsError if a cutoff [Hz] is not below the Nyquist frequency."""
    if cutoff >= rate / 2:
        raise SettingsError(f"[identify.filter] cutoff is {cutoff:g} Hz; expected below half of the log's {rate:g} Hz")


def correlate_valid(signal: Array, kernels: Array, orders: tuple[int, ...]) -> tuple[Array, ...]:
    """Correlate a signal with kernels, without padding: `y[t] = sum_m k[m] x[t + m]`, (7.8) reversed.

    A block of outputs is the product of a banded matrix, which contains all kernels, and a block of inputs: faster than
    convolutions. The middle row of a block is subtracted first, because derivatives of nearly equal numbers lose
    digits; a joint at rest has a velocity of exactly zero.

    Parameters
    ----------
    signal
        Signal without NaN, shape (T, n).
    kernels
        One kernel per row, shape (k, L).
    orders
        Order of each kernel's derivative: its taps sum to 1 for order 0 and to 0 for the others.

    Returns
    -------
    tuple of Array
        One array per kernel, shape (T - L + 1, n); empty if the signal is shorter than the kernel.
    """
    count, length = kernels.shape
    samples = max(len(signal) - length + 1, 0)
    outputs = tuple(np.empty((samples, signal.shape[1])) for _ in range(count))
    block = max(64, length // 3)  # shorter blocks cost more for the call than for the arithmetic
    shifts = min(block, samples)
    inputs = shifts + length - 1
    # one entry longer than a row, so that each repetition starts one column later
    padded = np.hstack([kernels, np.zeros((count, shifts))])
    band = np.tile(padded, shifts)[:, : shifts * inputs].reshape(count, shifts, inputs)
    for start in range(0, samples, block):
        rows = min(block, samples - start)
        window = signal[start : start + rows + length - 1]
        middle = window[len(window) // 2]
        product = band[:, :rows, : len(window)] @ (window - middle)
        for output, order, result in zip(outputs, orders, product, strict=True):
            output[start : start + rows] = result + middle if order == 0 else result
    return outputs

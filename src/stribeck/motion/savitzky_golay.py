"""Savitzky-Golay filters: a polynomial fitted to every window, (7.1)-(7.8) of the paper."""

from math import factorial

import numpy as np
from scipy.optimize import brentq

from stribeck.errors import SettingsError
from stribeck.typing import Array

Weights = str | list[float]
HALF_POWER = 0.5**0.5
"""Gain at the cutoff frequency, -3 dB."""


def savgol_kernels(window: int, order: int, weights: Weights, period: float) -> Array:
    """Return the kernels of position, velocity and acceleration, shape (3, window), for `y[t] = sum_m k[m] x[t + m]`.

    The polynomial p(n) of (7.1) is fitted to the window by W-weighted least squares (7.4), so its coefficients are
    `a = (T^T W T)^-1 T^T W x` (7.5); position is a_0 (7.7), velocity a_1 / dt, acceleration 2 a_2 / dt^2.
    Since the weights are symmetric, the kernels are even or odd: no phase shift, and an even order's position and
    acceleration are those of the next odd order, an even order's velocity that of the odd order below.

    Parameters
    ----------
    window
        Samples in a window, odd. With `window = order + 1` the polynomial goes through all: nothing is smoothed.
    order
        Of the polynomial, from 2 (less has no acceleration) to `window - 1`.
    weights
        "uniform", "hann", "gaussian", or `window` positive numbers that are the same in both directions.
    period
        Sampling period [s].

    Raises
    ------
    SettingsError
        If window, order and weights do not go together.
    """
    _check(window, order)
    half_width = window // 2
    # n from -1 to 1 instead of -N to N keeps the powers apart in double precision.
    T = np.linspace(-1.0, 1.0, window)[:, None] ** np.arange(order + 1)
    root = np.sqrt(_weights(weights, window))
    coefficients = np.linalg.pinv(root[:, None] * T)[:3] * root
    parity = np.array([[1.0], [-1.0], [1.0]])
    even_or_odd = 0.5 * (coefficients + parity * coefficients[:, ::-1])
    derivative = np.arange(3)[:, None]
    scale = np.array([[factorial(d)] for d in range(3)]) / (half_width * period) ** derivative
    return np.asarray(scale * even_or_odd)


def savgol_cutoff(window: int, order: int, weights: Weights, rate: float) -> float:
    """Return the frequency [Hz] at which the position kernel's gain falls below -3 dB; Nyquist if it never does.

    Raises
    ------
    SettingsError
        If window, order and weights do not go together.
    """
    kernel = savgol_kernels(window, order, weights, 1.0)[0]
    gain = np.abs(np.fft.rfft(kernel, 16 * window))
    below = np.flatnonzero(gain < HALF_POWER)
    if len(below) == 0:
        return float(rate / 2)
    offsets = np.arange(window) - window // 2

    def excess(cycles_per_sample: float) -> float:
        return float(kernel @ np.cos(2 * np.pi * cycles_per_sample * offsets)) - HALF_POWER

    upper = float(below[0]) / (16 * window)
    return float(rate * float(brentq(excess, upper - 1 / (16 * window), upper, xtol=1e-12)))


def savgol_window(cutoff: float, order: int, weights: Weights, rate: float) -> int:
    """Return the longest odd window [samples] whose -3 dB cutoff is not below `cutoff` [Hz].

    Where even the shortest window of this order cuts lower, it is that shortest window.

    Raises
    ------
    SettingsError
        If the cutoff is not below the Nyquist frequency, or the weights are a list, which has a length of its own.
    """
    if cutoff >= rate / 2:
        raise SettingsError(
            f"[identify.filter] cutoff is {cutoff:g} Hz; it must be below half the log's rate of {rate:g} Hz"
        )
    if not isinstance(weights, str):
        raise SettingsError(
            f"[identify.filter] weights is a list of {len(weights)} numbers, which fixes the window; leave out cutoff"
        )
    wanted = cutoff * (1 - 1e-9)  # so that the cutoff of a window gives that window back
    low = order // 2 + order % 2  # half widths: `low` is long enough for the order, `high` too long for the cutoff
    high = 2 * low
    while savgol_cutoff(2 * high + 1, order, weights, rate) >= wanted:
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        if savgol_cutoff(2 * middle + 1, order, weights, rate) >= wanted:
            low = middle
        else:
            high = middle
    return 2 * low + 1


def _check(window: int, order: int) -> None:
    if window % 2 == 0:
        raise SettingsError(f"[identify.filter] window is {window}; it must be odd to have a middle, e.g. {window + 1}")
    if order < 2:
        raise SettingsError(f"[identify.filter] order is {order}; a polynomial needs 2 to have an acceleration")
    if order >= window:
        raise SettingsError(
            f"[identify.filter] order is {order}; it must be smaller than the window of {window} samples"
        )


def _weights(weights: Weights, window: int) -> Array:
    """Return the diagonal of W in (7.4), shape (window,)."""
    if weights == "uniform":
        return np.ones(window)
    if weights == "hann":
        return np.hanning(window + 2)[1:-1]  # its outermost samples are zero
    if weights == "gaussian":
        return np.asarray(np.exp(-0.5 * ((np.arange(window) - (window - 1) / 2) / (window / 4)) ** 2))
    values = np.asarray(weights, dtype=np.float64)
    if values.shape != (window,):
        raise SettingsError(
            f"[identify.filter] weights has {values.size} numbers; the window of {window} samples needs {window}"
        )
    if not np.allclose(values, values[::-1], rtol=1e-9, atol=0.0):
        raise SettingsError(
            "[identify.filter] weights is not the same read backwards; only symmetric weights keep the phase"
        )
    return 0.5 * (values + values[::-1])

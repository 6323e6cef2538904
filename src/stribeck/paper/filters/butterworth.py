"""Central differences, then a Butterworth low-pass forward and backward (7.1.2 of the paper)."""

from functools import partial

import numpy as np
import scipy  # its signal is slow to import: loaded at its first use

from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError
from stribeck.core.filters.filters import Filter
from stribeck.core.filters.savitzky_golay import correlate_valid, require_below_nyquist
from stribeck.core.settings import FilterSettings

SETTLED = 1e-6
"""Share of the impulse response that may remain beyond the dropped edges."""

HALF_WIDTH = 2
"""Number of samples that central differences need on each side."""


def butterworth_sections(cutoff: float, order: int, rate: float) -> Array:
    """Design second-order sections whose forward-backward gain is -3 dB at `cutoff` [Hz].

    One pass has half of that attenuation in decibels, so it is designed for a slightly higher frequency: a paper's "10
    Hz, run by filtfilt" has -6 dB at 10 Hz, and is the filter of cutoff `10 (sqrt 2 - 1)^(1 / 2 order)` Hz.

    Raises
    ------
    SettingsError
        If the cutoff is not below the Nyquist frequency.
    """
    require_below_nyquist(cutoff, rate)
    # |H|^2 = 1 / (1 + (w / w_c)^(2 order)) = 1 / sqrt 2, with w = tan(pi f / rate) of the bilinear transform
    warped = np.tan(np.pi * cutoff / rate) / (np.sqrt(2) - 1) ** (1 / (2 * order))
    return np.asarray(scipy.signal.butter(order, np.arctan(warped) * rate / np.pi, fs=rate, output="sos"))


def settling_length(sections: Array) -> int:
    """Find the number of samples after which at most `SETTLED` of a pass's impulse response remains."""
    slowest = max(float(np.abs(np.roots(section[3:])).max()) for section in sections)
    horizon = 2 * int(np.ceil(np.log(SETTLED) / np.log(slowest))) + 8
    impulse = np.zeros(horizon)
    impulse[0] = 1.0
    response = np.abs(scipy.signal.sosfilt(sections, impulse))
    tail = np.cumsum(response[::-1])[::-1]
    return int(np.argmax(tail <= SETTLED * tail[0]))


def central_kernels(period: float) -> Array:
    """Compute the kernels of position, velocity and acceleration, shape (3, 5), by applying (6.2) once and twice.

    The velocity is exact for polynomials up to second degree, the acceleration up to third; neither has a delay.
    """
    present = np.array([0.0, 0.0, 1.0, 0.0, 0.0])
    velocity = np.array([0.0, -1.0, 0.0, 1.0, 0.0]) / (2 * period)
    acceleration = np.array([1.0, 0.0, -2.0, 0.0, 1.0]) / (2 * period) ** 2
    return np.array([present, velocity, acceleration])


def filter_derivatives(
    signal: Array, orders: tuple[int, ...], sections: Array, period: float, half_width: int
) -> tuple[Array, ...]:
    """Compute filtered derivatives of a signal of shape (T, n), each of shape (T - 2 half_width, n)."""
    if len(signal) <= 2 * half_width:
        return tuple(np.empty((0, signal.shape[1])) for _ in orders)
    kernels = central_kernels(period)[list(orders)]
    edge = half_width - HALF_WIDTH
    derivatives = []
    for raw in correlate_valid(signal, kernels, orders):
        # Without the first sample's value, whose step at the start would dominate the transient.
        twice = scipy.signal.sosfiltfilt(sections, raw - raw[0], axis=0, padtype=None) + raw[0]
        derivatives.append(np.asarray(twice[edge : len(raw) - edge]))
    return tuple(derivatives)


def butterworth_filter(settings: FilterSettings, period: float) -> Filter:
    """Make the filter of the settings, which filters forward and backward."""
    if settings.cutoff is None:
        raise SettingsError("[identify.filter] kind is 'butterworth', which needs a cutoff [Hz]")
    sections = butterworth_sections(settings.cutoff, settings.order, 1 / period)
    half_width = settling_length(sections) + HALF_WIDTH
    run = partial(filter_derivatives, sections=sections, period=period, half_width=half_width)
    name = f"Butterworth, order {settings.order}, forward and backward, -3 dB at {settings.cutoff:.3g} Hz"
    return Filter(name=name, half_width=half_width, run=run, weights=None)

"""How much to smooth: the cutoff that a log's own spectrum asks for (7.1.2, Fig. 7.1 of the paper)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.differentiation.savitzky_golay import savgol_cutoff, savgol_kernels, savgol_window
from stribeck.errors import LogError

ORDER = 4
"""Of the Savitzky-Golay filter that "auto" stands for."""
MIN_SAMPLES = 64
"""Shortest segment that has a spectrum."""
CLEAR = 4.0
"""A spectrum stands clearly above its noise floor when it is this many times larger."""
UPPER_BAND = (0.6, 0.95)
"""Shares of the Nyquist frequency between which a spectrum is taken for noise."""


@dataclass(frozen=True, eq=False)
class Spectra:
    """Averaged spectra of two signals.

    Attributes
    ----------
    frequency
        [Hz], shape (F,), without 0.
    first, second
        Power spectral densities of the two signals, one-sided, shape (F, n).
    cross
        Magnitude of their cross spectral density, shape (F, n).
    parts
        Independent parts averaged, shape (n,); 0 for a signal that was never there.
    """

    frequency: Array
    first: Array
    second: Array
    cross: Array
    parts: Array

    @property
    def coherence(self) -> Array:
        """Squared coherence of the two signals, from 0 (nothing in common) to 1, shape (F, n)."""
        power = self.first * self.second
        return np.asarray(np.divide(self.cross**2, power, out=np.zeros_like(power), where=power > 0))


@dataclass(frozen=True, eq=False, kw_only=True)
class CutoffChoice:
    """A cutoff frequency and why it was chosen.

    Attributes
    ----------
    cutoff
        -3 dB frequency of the position kernel [Hz].
    window
        Of the Savitzky-Golay filter of order 4 that has this cutoff [samples].
    reason
        One sentence with numbers, for the user.
    """

    cutoff: float
    window: int
    reason: str


def choose_cutoff(accelerations: Sequence[Array], rate: float, positions: Sequence[Array]) -> CutoffChoice:
    """Choose the cutoff that distorts the acceleration least in total, by smoothing and by noise.

    The model's own acceleration shows where the motion ends and the noise begins, as it needs no second derivative of
    a measured position. With S the spectrum of the motion, N that of the noise, and G the gain of a window's
    acceleration kernel, the expected square error is `sum (1 - G)^2 S + G^2 N`. The joint that needs the shortest
    window decides for all, and no more than 0.1 % of its S is given up. Where there is no noise, the shortest window
    wins.

    Parameters
    ----------
    accelerations
        By the model from the measured torque [rad/s^2], a segment without gaps each, shape (t, n); a joint that a
        segment says nothing about is NaN.
    rate
        [Hz].
    positions
        Measured over the same segmentes [rad], shape (t, n). S is the part of the model's acceleration that is
        coherent with the position and clear of N, and N the noise of the position's second derivative, which is what
        the filter meets.

    Raises
    ------
    LogError
        If no segment has 64 samples.
    """
    windows = _candidate_windows(rate, max((len(segment) for segment in accelerations), default=0))
    measured = [np.diff(segment, 2, axis=0) * rate**2 for segment in positions]
    spectra = average_spectra([segment[1:-1] for segment in accelerations], measured, rate)
    signal, noise = _common(spectra, rate)
    power = signal.sum(axis=0)
    moving = power > 1e-3 * power.max()  # joints with less of the liveliest joint's power have no say
    if not moving.any():
        reason = "no joint's acceleration stands above its noise, so the lowest cutoff is taken"
        return _choice(windows[-1], rate, reason)
    signal, noise, power = signal[:, moving], noise[:, moving], power[moving]
    best, kept = _least_error_windows(windows, rate, spectra.frequency, signal, noise)
    joint = int(np.argmin(best))
    highest = float(spectra.frequency[signal[:, joint] > 0].max())
    reason = (
        f"the joint that needs the highest moves at up to {highest:.3g} Hz and keeps {100 * kept[joint]:.4g} % of the "
        f"power of its acceleration, in which unfiltered noise has {noise[:, joint].sum() / power[joint]:.2g} times "
        f"the power of motion"
    )
    return _choice(windows[best[joint]], rate, reason)


def _choice(window: int, rate: float, reason: str) -> CutoffChoice:
    cutoff = savgol_cutoff(window, ORDER, rate)
    sentence = f"cutoff {cutoff:.3g} Hz, a window of {window} samples: {reason}"
    return CutoffChoice(cutoff=cutoff, window=window, reason=sentence)


def _least_error_windows(
    windows: list[int], rate: float, frequency: Array, signal: Array, noise: Array
) -> tuple[NDArray[np.int64], Array]:
    """Return, per joint, the index of the window of least expected error, and the share of the signal that it keeps."""
    gain = np.stack([_acceleration_gain(window, rate, frequency) for window in windows])
    lost = (1 - gain) ** 2 @ signal / signal.sum(axis=0)  # (windows, joints)
    error = lost + gain**2 @ noise / signal.sum(axis=0)
    # smoothing may cost a thousandth of the motion's power: noise averages out in a fit, distortion does not
    error[1:][lost[1:] > 1e-3] = np.inf  # the shortest window is always allowed
    best = np.argmin(error, axis=0)
    return best, 1 - lost[best, np.arange(len(best))]


def _common(spectra: Spectra, rate: float) -> tuple[Array, Array]:
    """Return what torque and position agree on, and the noise of the position's second derivative, each (F, n).

    The noise of a position is white, and read off the upper band of its second difference, whose gain is known.
    """
    frequency = spectra.frequency
    low, high = UPPER_BAND
    band = (frequency >= low * rate / 2) & (frequency <= high * rate / 2)
    gain = (2 * rate * np.sin(np.pi * frequency[band] / rate)) ** 4
    white = np.median(spectra.second[band] / gain[:, None], axis=0)
    noise = (2 * np.pi * frequency[:, None]) ** 4 * white
    # Of K parts, unrelated noises are coherent by more than c with probability (1 - c)^(K - 1), here 1e-4.
    by_chance = 1 - 1e-4 ** (1 / np.maximum(spectra.parts - 1, 1))
    common = spectra.coherence * spectra.first
    clear = (spectra.coherence > by_chance) & (common > (CLEAR - 1) * noise)
    clear &= frequency[:, None] <= _end_of_motion(frequency, spectra.second, rate)
    return np.where(clear, common, 0.0), noise


def _end_of_motion(frequency: Array, density: Array, rate: float) -> Array:
    """Return the frequency [Hz] of each joint at which noise takes over in its measured acceleration, shape (n,).

    Going down from the noise at the top, the density falls to a valley and rises again where the motion begins. A
    controller answers the noise of its encoder with torque, so that both are coherent beyond the valley too, and
    current ripple looks like violent motion of a light link. Where there is no valley there is no end: infinity.
    """
    band = np.floor(3 * np.log2(frequency / frequency[0])).astype(int)  # three per octave
    used, band = np.unique(band, return_inverse=True)
    sums = np.zeros((len(used), density.shape[1]))
    np.add.at(sums, band, density)
    counts = np.bincount(band)
    means, highest = sums / counts[:, None], frequency[np.cumsum(counts) - 1]
    top = int(np.searchsorted(highest, UPPER_BAND[0] * rate / 2))
    end = np.full(density.shape[1], np.inf)
    for joint, levels in enumerate(means.T):
        start = top + int(np.argmax(levels[top:]))
        down = levels[start::-1]
        risen = down > CLEAR * np.minimum.accumulate(down)
        valley = int(np.argmin(down[: int(np.argmax(risen)) if risen.any() else len(down)]))
        if CLEAR * down[valley] < down[0]:
            end[joint] = highest[start - valley]
    return end


def _acceleration_gain(window: int, rate: float, frequency: Array) -> Array:
    """Return the gain of the acceleration kernel against the true second derivative, shape (F,).

    The frequencies are those of a transform without 0, onto whose length a longer kernel folds.
    """
    length = round(rate / frequency[0])
    places = (np.arange(window) - window // 2) % length
    response = np.fft.rfft(np.bincount(places, savgol_kernels(window, ORDER, 1 / rate)[2], length))
    return np.asarray(-response.real[1:] / (2 * np.pi * frequency) ** 2)


def _candidate_windows(rate: float, samples: int) -> list[int]:
    """Return odd windows in order of length, from the highest cutoff allowed to the lowest."""
    highest = 0.2 * rate  # a window of 9 samples, over which a polynomial still averages
    lowest = 5.0  # [Hz]; limbs may move slower, but friction changes within the moment of a reversal
    shortest = savgol_window(highest, ORDER, rate)
    longest = savgol_window(min(lowest, highest), ORDER, rate)
    longest = max(shortest, min(longest, samples // 4))
    half_widths = np.geomspace(shortest // 2, longest // 2, 40).round().astype(int)
    return [int(2 * half_width + 1) for half_width in np.unique(half_widths)]


def average_spectra(first: Sequence[Array], second: Sequence[Array], rate: float) -> Spectra:
    """Average the spectra of two signals over half-overlapping parts of all segments, under a Hann window.

    Parameters
    ----------
    first, second
        The signals of each segment, shape (t, n); a column with NaN is left out of the average of its part.
    rate
        [Hz].

    Raises
    ------
    LogError
        If no segment has 64 samples.
    """
    length = _part_length(np.array([np.isfinite(segment).sum(axis=0) for segment in first]), rate)
    joints = first[0].shape[1]
    first_power, second_power = np.zeros((2, length // 2 + 1, joints))
    cross_power = np.zeros((length // 2 + 1, joints), dtype=np.complex128)
    count = np.zeros(joints)
    for x, y in zip(first, second, strict=True):
        if len(x) < length:
            continue
        x_parts, y_parts = _transform(x, length, rate), _transform(y, length, rate)
        there = np.isfinite(x_parts[0] + y_parts[0])
        count += there.sum(axis=1)
        x_parts, y_parts = np.where(there, x_parts, 0.0), np.where(there, y_parts, 0.0)
        first_power += np.sum(np.abs(x_parts) ** 2, axis=2)
        second_power += np.sum(np.abs(y_parts) ** 2, axis=2)
        cross_power += np.sum(x_parts * y_parts.conj(), axis=2)
    scale = 2 / np.maximum(count, 1)  # one-sided: half of the power is at negative frequencies
    return Spectra(
        np.asarray(np.fft.rfftfreq(length, 1 / rate)[1:], dtype=np.float64),
        (scale * first_power)[1:],
        (scale * second_power)[1:],
        (scale * np.abs(cross_power))[1:],
        count,
    )


def _part_length(samples: NDArray[np.int64], rate: float) -> int:
    """Find a length that most samples of every signal fill and that gives several parts of each.

    `samples` counts the samples of each signal in each segment, shape (segments, n).
    """
    longest = samples.max(axis=0)
    if longest.max() < MIN_SAMPLES:
        raise LogError(
            f"log: the longest usable segment has {longest.max()} samples; choosing a filter from the "
            f"spectrum takes {MIN_SAMPLES}, so set [identify.filter] kind = 'savitzky-golay' and a window"
        )
    ordered = -np.sort(-samples[:, longest >= MIN_SAMPLES], axis=0)
    filled = ordered.cumsum(axis=0)
    half = np.argmax(2 * filled >= filled[-1], axis=0)  # half of a signal's samples are in segments this long
    typical = int(np.take_along_axis(ordered, half[None], axis=0).min())
    # eight parts or more where the log is long enough, of 4 s or less: a resolution of 0.25 Hz
    return max(MIN_SAMPLES, min(typical, int(filled[-1].min()) // 8, int(4.0 * rate)))


def _transform(signal: Array, length: int, rate: float) -> NDArray[np.complex128]:
    """Compute the Fourier transforms of a segment's half-overlapping parts under a Hann window, shape (F, n, parts).

    NaN where a part has a NaN. The mean square is the two-sided power spectral density.
    """
    parts = sliding_window_view(signal, length, axis=0)[:: length // 2]
    window = np.sin(np.pi * np.arange(length) / length) ** 2
    centered = (parts - parts.mean(axis=2, keepdims=True)) * (window / np.sqrt(rate * np.sum(window**2)))
    return np.fft.rfft(centered, axis=2).transpose(2, 1, 0)

"""Choice of the cutoff frequency from the spectrum of a log (7.1.2, Fig. 7.1 of the paper)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.errors import LogError
from stribeck.core.filters.filters import CutoffChoice
from stribeck.core.filters.savitzky_golay import savgol_cutoff, savgol_kernels, savgol_window

ORDER = 4
"""Order of the Savitzky-Golay filter that "auto" selects."""
MIN_SAMPLES = 64
"""Shortest segment that has a spectrum."""
CLEAR = 4.0
"""Ratio to the noise floor above which a spectrum is clearly above it."""
UPPER_BAND = (0.6, 0.95)
"""Band that contains only noise, as shares of the Nyquist frequency."""


@dataclass(frozen=True, eq=False)
class Spectra:
    """Averaged spectra of two signals.

    Attributes
    ----------
    frequency
        Frequencies [Hz], shape (F,), without 0.
    first, second
        One-sided power spectral densities of the two signals, shape (F, n).
    coherence
        Squared coherence of the two signals, from 0 (unrelated) to 1, shape (F, n).
    parts
        Number of independent parts in the average, shape (n,); 0 for a signal without data.
    """

    frequency: Array
    first: Array
    second: Array
    coherence: Array
    parts: Array


def choose_cutoff(accelerations: Sequence[Array], rate: float, positions: Sequence[Array]) -> CutoffChoice:
    """Choose the cutoff with the least total error of the acceleration from smoothing and noise.

    The model's acceleration shows where motion ends and noise starts, because it needs no second derivative of a
    measured position. With S the spectrum of the motion, N the spectrum of the noise, and G the gain of a window's
    acceleration kernel, the expected square error is `sum (1 - G)^2 S + G^2 N`. The joint that needs the shortest
    window decides for all, and loses at most 0.1 % of its S. Without noise, the shortest window wins.

    Parameters
    ----------
    accelerations
        Model accelerations from the measured torque [rad/s^2], one array of shape (t, n) per segment without gaps; NaN
        for joints without data in a segment.
    rate
        Sampling rate [Hz].
    positions
        Measured positions in the same segments [rad], shape (t, n). S is the part of the model's acceleration that is
        coherent with the position and clearly above N. N is the noise of the position's second derivative, which the
        filter has to remove.

    Raises
    ------
    LogError
        If no segment has 64 samples.
    """
    windows = _list_windows(rate, max((len(segment) for segment in accelerations), default=0))
    spectra = acceleration_spectra(accelerations, positions, rate)
    signal, noise = _compare_spectra(spectra, rate)
    power = signal.sum(axis=0)
    moving = power > 1e-3 * power.max()  # joints with less power are ignored
    if not moving.any():
        reason = "no joint's acceleration exceeds its noise, so the lowest cutoff is used"
        return _make_choice(windows[-1], rate, reason)
    signal, noise, power = signal[:, moving], noise[:, moving], power[moving]
    best, kept = _find_windows(windows, rate, spectra.frequency, signal, noise)
    joint = int(np.argmin(best))
    highest = float(spectra.frequency[signal[:, joint] > 0].max())
    reason = (
        f"the joint with the highest cutoff moves at up to {highest:.3g} Hz and keeps {100 * kept[joint]:.4g} % of "
        f"the power of its acceleration; unfiltered noise has {noise[:, joint].sum() / power[joint]:.2g} times "
        f"the power of motion"
    )
    return _make_choice(windows[best[joint]], rate, reason)


def acceleration_spectra(accelerations: Sequence[Array], positions: Sequence[Array], rate: float) -> Spectra:
    """Average the spectra of model acceleration and second difference of the position; see `choose_cutoff`."""
    measured = [np.diff(segment, 2, axis=0) * rate**2 for segment in positions]
    return average_spectra([segment[1:-1] for segment in accelerations], measured, rate)


def _make_choice(window: int, rate: float, reason: str) -> CutoffChoice:
    cutoff = savgol_cutoff(window, ORDER, rate)
    sentence = f"cutoff {cutoff:.3g} Hz, a window of {window} samples: {reason}"
    return CutoffChoice(cutoff=cutoff, window=window, reason=sentence)


def _find_windows(
    windows: list[int], rate: float, frequency: Array, signal: Array, noise: Array
) -> tuple[IntArray, Array]:
    """Find, per joint, the index of the window with the least expected error, and the share of the signal it keeps."""
    gain = np.stack([_compute_gain(window, rate, frequency) for window in windows])
    lost = (1 - gain) ** 2 @ signal / signal.sum(axis=0)  # (windows, joints)
    error = lost + gain**2 @ noise / signal.sum(axis=0)
    # smoothing may remove 0.1 % of the motion's power: noise averages out in a fit, distortion does not
    error[1:][lost[1:] > 1e-3] = np.inf  # the shortest window is always allowed
    best = np.argmin(error, axis=0)
    return best, 1 - lost[best, np.arange(len(best))]


def _compare_spectra(spectra: Spectra, rate: float) -> tuple[Array, Array]:
    """Compute the common spectrum of torque and position, and the noise of the position's second derivative, (F, n).

    The noise of a position is white. Its level is measured in the upper band of the second difference, whose gain is
    known.
    """
    frequency = spectra.frequency
    low, high = UPPER_BAND
    band = (frequency >= low * rate / 2) & (frequency <= high * rate / 2)
    gain = (2 * rate * np.sin(np.pi * frequency[band] / rate)) ** 4
    white = np.median(spectra.second[band] / gain[:, None], axis=0)
    noise = (2 * np.pi * frequency[:, None]) ** 4 * white
    # With K parts, unrelated noises have a coherence above c with probability (1 - c)^(K - 1), here 1e-4.
    by_chance = 1 - 1e-4 ** (1 / np.maximum(spectra.parts - 1, 1))
    common = spectra.coherence * spectra.first
    clear = (spectra.coherence > by_chance) & (common > (CLEAR - 1) * noise)
    clear &= frequency[:, None] <= _find_end_of_motion(frequency, spectra.second, rate)
    return np.where(clear, common, 0.0), noise


def _find_end_of_motion(frequency: Array, density: Array, rate: float) -> Array:
    """Find the frequency [Hz] above which noise dominates each joint's measured acceleration, shape (n,).

    Downward from the noise at the top, the density falls to a valley and rises again where the motion starts. Above the
    valley, torque and position can be coherent too, because a controller responds to encoder noise with torque, and
    current ripple looks like violent motion of a light link. Without a valley the result is infinite.
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


def _compute_gain(window: int, rate: float, frequency: Array) -> Array:
    """Compute the gain of the acceleration kernel relative to the true second derivative, shape (F,).

    The frequencies belong to a discrete transform, without 0; a kernel longer than the transform is folded.
    """
    length = round(rate / frequency[0])
    places = (np.arange(window) - window // 2) % length
    response = np.fft.rfft(np.bincount(places, savgol_kernels(window, ORDER, 1 / rate)[2], length))
    return np.asarray(-response.real[1:] / (2 * np.pi * frequency) ** 2)


def _list_windows(rate: float, samples: int) -> list[int]:
    """List odd windows in order of length, from the highest allowed cutoff to the lowest."""
    highest = 0.2 * rate  # a window of 9 samples, over which a polynomial still averages
    lowest = 5.0  # [Hz]; limbs may move slower, but friction changes quickly at reversals
    shortest = savgol_window(highest, ORDER, rate)
    longest = savgol_window(min(lowest, highest), ORDER, rate)
    longest = max(shortest, min(longest, samples // 4))
    half_widths = np.geomspace(shortest // 2, longest // 2, 40).round().astype(int)
    return [int(2 * half_width + 1) for half_width in np.unique(half_widths)]


def average_spectra(first: Sequence[Array], second: Sequence[Array], rate: float) -> Spectra:
    """Average the spectra of two signals over half-overlapping parts of all segments, with a Hann window.

    Parameters
    ----------
    first, second
        Signals of each segment, shape (t, n); parts with NaN are excluded per column.
    rate
        Sampling rate [Hz].

    Raises
    ------
    LogError
        If no segment has 64 samples.
    """
    length = _find_part_length(np.array([np.isfinite(segment).sum(axis=0) for segment in first]), rate)
    joints = first[0].shape[1]
    first_power, second_power = np.zeros((2, length // 2 + 1, joints))
    cross_power = np.zeros((length // 2 + 1, joints), dtype=np.complex128)
    count = np.zeros(joints)
    for x, y in zip(first, second, strict=True):
        if len(x) < length:
            continue
        x_parts, y_parts = _transform(x, length, rate), _transform(y, length, rate)
        mask = np.isfinite(x_parts[0] + y_parts[0])
        count += mask.sum(axis=1)
        x_parts, y_parts = np.where(mask, x_parts, 0.0), np.where(mask, y_parts, 0.0)
        first_power += np.sum(np.abs(x_parts) ** 2, axis=2)
        second_power += np.sum(np.abs(y_parts) ** 2, axis=2)
        cross_power += np.sum(x_parts * y_parts.conj(), axis=2)
    scale = 2 / np.maximum(count, 1)  # one-sided: half of the power is at negative frequencies
    x_power, y_power, cross = ((scale * power)[1:] for power in (first_power, second_power, np.abs(cross_power)))
    coherence = np.divide(cross**2, x_power * y_power, out=np.zeros_like(cross), where=x_power * y_power > 0)
    frequency = np.asarray(np.fft.rfftfreq(length, 1 / rate)[1:], dtype=np.float64)
    return Spectra(frequency, x_power, y_power, coherence, count)


def _find_part_length(samples: IntArray, rate: float) -> int:
    """Find a length that fits most samples of every signal and gives several parts of each.

    `samples` counts the samples of each signal in each segment, shape (segments, n).
    """
    longest = samples.max(axis=0)
    if longest.max() < MIN_SAMPLES:
        raise LogError(
            f"log: the longest usable segment has {longest.max()} samples; choosing a filter from the "
            f"spectrum requires {MIN_SAMPLES}; set [identify.filter] kind = 'savitzky-golay' and a window"
        )
    ordered = -np.sort(-samples[:, longest >= MIN_SAMPLES], axis=0)
    filled = ordered.cumsum(axis=0)
    half = np.argmax(2 * filled >= filled[-1], axis=0)  # half of a signal's samples are in segments this long
    typical = int(np.take_along_axis(ordered, half[None], axis=0).min())
    # at least eight parts if the log is long enough, of at most 4 s: a resolution of 0.25 Hz
    return max(MIN_SAMPLES, min(typical, int(filled[-1].min()) // 8, int(4.0 * rate)))


def _transform(signal: Array, length: int, rate: float) -> NDArray[np.complex128]:
    """Compute Fourier transforms of half-overlapping parts of a segment with a Hann window, shape (F, n, parts).

    Parts with a NaN become NaN. The mean square is the two-sided power spectral density.
    """
    parts = sliding_window_view(signal, length, axis=0)[:: length // 2]
    window = np.sin(np.pi * np.arange(length) / length) ** 2
    centered = (parts - parts.mean(axis=2, keepdims=True)) * (window / np.sqrt(rate * np.sum(window**2)))
    return np.fft.rfft(centered, axis=2).transpose(2, 1, 0)

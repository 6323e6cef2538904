"""Power and cross spectra averaged over many segments of a log (Welch's method)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy  # its signal is slow to import: loaded at its first use
from numpy.typing import NDArray

from stribeck.errors import LogError
from stribeck.typing import Array

MIN_SAMPLES = 64
"""Shortest segment that has a spectrum."""


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
    """Return a length that most samples of every signal can fill and that gives several parts of each.

    Parameters
    ----------
    samples
        Of each signal in each segment, shape (segments, n).
    rate
        [Hz]
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
    """Return the Fourier transforms of a segment's parts, shape (F, n, parts), NaN where a part has a NaN."""
    _, _, parts = scipy.signal.stft(
        signal,
        rate,
        nperseg=length,
        noverlap=length - length // 2,
        detrend="constant",
        boundary=None,
        padded=False,
        axis=0,
        scaling="psd",
    )
    return np.asarray(parts)

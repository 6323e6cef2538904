"""Smooth signals with velocity and acceleration: sums of sines, and smooth steps.

A trajectory is one array: position, velocity and acceleration of n signals at T times, shape (3, T, n).
"""

from dataclasses import dataclass

import numpy as np

from stribeck.core.base.typing import Array


def product(first: Array, second: Array) -> Array:
    """Multiply two trajectories, with derivatives by the product rule."""
    return np.array(
        [
            first[0] * second[0],
            first[1] * second[0] + first[0] * second[1],
            first[2] * second[0] + 2 * first[1] * second[1] + first[0] * second[2],
        ]
    )


@dataclass(frozen=True, eq=False)
class Sines:
    """Sums of sines around the centers of n signals.

    Attributes
    ----------
    centre
        Centers [rad] or [m], shape (n,).
    amplitude, pulsation, phase
        Amplitudes [rad] or [m], angular frequencies [rad/s] and phases [rad], shape (components, n).
    """

    centre: Array
    amplitude: Array
    pulsation: Array
    phase: Array

    def at(self, time: Array) -> Array:
        """Compute the signals at these times [s], shape (3, T, n)."""
        signals = np.zeros((3, len(time), len(self.centre)))
        signals[0] = self.centre
        for amplitude, pulsation, phase in zip(self.amplitude, self.pulsation, self.phase, strict=True):
            angle = np.outer(time, pulsation) + phase
            sine, cosine = amplitude * np.sin(angle), amplitude * np.cos(angle)
            signals[0] += sine
            signals[1] += pulsation * cosine
            signals[2] -= pulsation**2 * sine
        return signals


def random_sines(
    centre: Array, reach: Array, speed: Array, frequencies: tuple[float, float], generator: np.random.Generator
) -> Sines:
    """Draw sums of sines within limits of distance and speed; all components have similar speeds.

    Parameters
    ----------
    centre, reach, speed
        Centers [rad] or [m], largest distance from them, and largest speed, shape (n,).
    frequencies
        Lowest and highest frequency [Hz]; signals with a small reach use only the higher ones, to reach their speed.
    generator
        Generator of random numbers.
    """
    shape = (4, len(centre))  # sines in each random signal
    low, high = frequencies
    lowest = np.clip(0.5 * speed / (2 * np.pi * reach), low, 0.7 * high)
    pulsation = 2 * np.pi * np.exp(generator.uniform(np.log(lowest), np.log(high), shape))
    amplitude = generator.uniform(0.5, 1.0, shape) / pulsation
    scale = np.minimum(reach / amplitude.sum(axis=0), speed / (amplitude * pulsation).sum(axis=0))
    return Sines(centre, scale * amplitude, pulsation, generator.uniform(0, 2 * np.pi, shape))


def smooth_step(time: Array, start: float, end: float) -> Array:
    """Compute a step from 0 before `start` to 1 after `end`, with two vanishing derivatives at both, shape (T,)."""
    s = np.clip((time - start) / (end - start), 0.0, 1.0)
    return np.asarray(s**3 * (10 + s * (6 * s - 15)))


def bell(time: Array, start: float, end: float) -> Array:
    """Compute a bump from 0 at `start` to 1 and back to 0 at `end`; its first three derivatives vanish at both.

    x = (4 s (1 - s))^4 over s = (t - start) / (end - start), shape (3, T).
    """
    span = end - start
    s = np.clip((time - start) / span, 0.0, 1.0)
    arch, slope = 4 * s * (1 - s), 4 * (1 - 2 * s) / span
    return np.array([arch**4, 4 * arch**3 * slope, 12 * arch**2 * slope**2 - 32 * arch**3 / span**2])

"""Smooth signals that know their own velocity and acceleration: sums of sines, and steps between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stribeck.typing import Array


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Position and its first two time derivatives, three arrays of one shape, (T, n) or (T,)."""

    position: Array
    velocity: Array
    acceleration: Array

    def __add__(self, other: Trajectory) -> Trajectory:
        """Return the sum of two trajectories."""
        return Trajectory(
            self.position + other.position, self.velocity + other.velocity, self.acceleration + other.acceleration
        )

    def __mul__(self, other: Trajectory) -> Trajectory:
        """Return the product of two trajectories, derivatives by the product rule."""
        return Trajectory(
            self.position * other.position,
            self.velocity * other.position + self.position * other.velocity,
            self.acceleration * other.position
            + 2 * self.velocity * other.velocity
            + self.position * other.acceleration,
        )

    def at_pace(self, pace: float) -> Trajectory:
        """Return the same path, so many times as fast."""
        return Trajectory(self.position, pace * self.velocity, pace**2 * self.acceleration)

    def columns(self, index: NDArray[np.int64]) -> Trajectory:
        """Return these columns alone."""
        return Trajectory(self.position[:, index], self.velocity[:, index], self.acceleration[:, index])


@dataclass(frozen=True, eq=False)
class Sines:
    """n sums of sines about n centres.

    Attributes
    ----------
    centre
        [rad] or [m], shape (n,).
    amplitude, pulsation, phase
        [rad] or [m], [rad/s], [rad], shape (components, n).
    """

    centre: Array
    amplitude: Array
    pulsation: Array
    phase: Array

    def at(self, time: Array) -> Trajectory:
        """Return the signals at these times [s], shape (T, n)."""
        position = np.tile(self.centre, (len(time), 1))
        velocity, acceleration = np.zeros((2, *position.shape))
        for amplitude, pulsation, phase in zip(self.amplitude, self.pulsation, self.phase, strict=True):
            angle = np.outer(time, pulsation) + phase
            sine, cosine = amplitude * np.sin(angle), amplitude * np.cos(angle)
            position += sine
            velocity += pulsation * cosine
            acceleration -= pulsation**2 * sine
        return Trajectory(position, velocity, acceleration)


def random_sines(
    centre: Array, reach: Array, speed: Array, frequencies: tuple[float, float], generator: np.random.Generator
) -> Sines:
    """Draw sums of sines that stay within reach and speed; their components share the speed about equally.

    Parameters
    ----------
    centre, reach, speed
        [rad] or [m], largest distance from the centre, and largest speed, shape (n,).
    frequencies
        Lowest and highest [Hz]; signals with little reach leave out the lower ones, to come near their speed.
    generator
        Of random numbers.
    """
    shape = (4, len(centre))  # sines in each random signal
    low, high = frequencies
    lowest = np.clip(0.5 * speed / (2 * np.pi * reach), low, 0.7 * high)
    pulsation = 2 * np.pi * np.exp(generator.uniform(np.log(lowest), np.log(high), shape))
    amplitude = generator.uniform(0.5, 1.0, shape) / pulsation
    scale = np.minimum(reach / amplitude.sum(axis=0), speed / (amplitude * pulsation).sum(axis=0))
    return Sines(centre, scale * amplitude, pulsation, generator.uniform(0, 2 * np.pi, shape))


def smooth_step(time: Array, start: float, end: float) -> Array:
    """Return a step from 0 before `start` to 1 after `end`, with two vanishing derivatives at both, shape (T,)."""
    s = np.clip((time - start) / (end - start), 0.0, 1.0)
    return np.asarray(s**3 * (10 + s * (6 * s - 15)))


def bell(time: Array, start: float, end: float) -> Trajectory:
    """Return a bump from 0 at `start` to 1 and back to 0 at `end`; its first three derivatives vanish at both.

    x = (4 s (1 - s))^4 over s = (t - start) / (end - start); each array is (T,).
    """
    span = end - start
    s = np.clip((time - start) / span, 0.0, 1.0)
    arch, slope = 4 * s * (1 - s), 4 * (1 - 2 * s) / span
    return Trajectory(arch**4, 4 * arch**3 * slope, 12 * arch**2 * slope**2 - 32 * arch**3 / span**2)

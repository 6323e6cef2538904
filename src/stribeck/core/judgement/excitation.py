"""Excitation: checks that a joint moves enough for its friction to be identified."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.judgement.reason import Reason
from stribeck.core.judgement.speed import TOP_SPEED_PERCENTILE, robust_scale, top_speed

MIN_BLOCKS = 6
"""Minimum number of blocks (steps or seconds) [1]; intervals are computed from the differences between blocks."""

MIN_SAMPLES_PER_PARAMETER = 20
"""Minimum number of usable samples per parameter [1]."""

MIN_SPEED = {False: 0.05, True: 0.005}
"""Minimum speed in both directions of a revolute joint [rad/s] and of a prismatic joint [m/s].

At lower speeds gear teeth and seals deform instead of sliding, and tanh of the smooth law (slope 40 s/rad) still rises.
"""

MIN_REVERSALS = 4
"""Minimum number of reversals of an identified joint [1]; they distinguish friction from an offset or a slow drift."""

NOISE_FACTOR = 4.0
"""Noise threshold of motion [standard deviations of the velocity's noise]; noise exceeds it once in 16,000 samples."""


@dataclass(frozen=True, kw_only=True)
class Excitation:
    """Motion of one joint: counts, speeds [rad/s] or [m/s], and why it is not excited (None if it is)."""

    samples: int
    blocks: int
    velocity_range: tuple[float, float]
    reversals: int
    reason: Reason | None


def excitation(velocity: Array, block: IntArray, parameters: int, prismatic: bool) -> Excitation:
    """Judge the motion of a joint by its usable samples, held-out blocks included.

    Parameters
    ----------
    velocity, block
        Velocity [rad/s] or [m/s], and number of the block (step or second) of each sample, shape (N,).
    parameters
        Number of parameters to fit.
    """
    blocks, noise = len(np.unique(block)), velocity_noise(velocity)
    return Excitation(
        samples=len(velocity),
        blocks=blocks,
        velocity_range=(float(velocity.min()), float(velocity.max())) if len(velocity) else (0.0, 0.0),
        reversals=_reversals(velocity),
        reason=_too_few(len(velocity), parameters, blocks) or _too_slow(velocity, noise, prismatic),
    )


def velocity_noise(velocity: Array) -> float:
    """Estimate the standard deviation of white noise in a velocity [rad/s] from its second differences.

    It is a lower bound if a filter has already smoothed the noise.
    """
    if len(velocity) < 3:
        return 0.0
    return robust_scale(np.diff(velocity, n=2)) / float(np.sqrt(6.0))


def few_reversals(velocity: Array) -> Reason | None:
    """Explain that a joint reverses fewer times than `MIN_REVERSALS`; its velocity [rad/s] may have gaps of NaN."""
    turns = _reversals(velocity[np.isfinite(velocity)])
    remedy = f"reverse the direction at least {MIN_REVERSALS} times"
    return Reason(f"only {turns} reversals", remedy=remedy) if turns < MIN_REVERSALS else None


def _reversals(velocity: Array) -> int:
    return count_reversals(velocity, max(NOISE_FACTOR * velocity_noise(velocity), 0.02 * top_speed(velocity)))


def count_reversals(velocity: Array, threshold: float) -> int:
    """Count the reversals from beyond a threshold [rad/s] in one direction to beyond it in the other."""
    side = np.sign(velocity[np.abs(velocity) > threshold])
    return int(np.count_nonzero(np.diff(side)))


def _too_few(samples: int, parameters: int, blocks: int) -> Reason | None:
    needed = MIN_SAMPLES_PER_PARAMETER * parameters
    if samples < needed:
        few = f"{samples} usable samples, but {parameters} parameters need at least {needed}"
        return Reason(few, remedy="record a longer motion")
    if blocks < MIN_BLOCKS:
        remedy = f"record at least {MIN_BLOCKS}"
        return Reason(f"the motion is too short: {blocks} blocks", " (steps or seconds)", remedy)
    return None


def _too_slow(velocity: Array, noise: float, prismatic: bool) -> Reason | None:
    unit = "m/s" if prismatic else "rad/s"
    least = MIN_SPEED[prismatic]
    backward, forward = np.percentile(velocity, [100 - TOP_SPEED_PERCENTILE, TOP_SPEED_PERCENTILE])
    span = f"between {backward:.3g} and {forward:.3g} {unit}"
    if max(forward, -backward) < least:
        return Reason(f"moves only {span}", remedy=f"move the joint faster than {least} {unit} in both directions")
    if max(forward, -backward) < NOISE_FACTOR * noise:
        remedy = f"move the joint faster than {NOISE_FACTOR * noise:.3g} {unit}"
        return Reason(f"moves {span}, hardly more than the velocity's noise", remedy=remedy)
    if min(forward, -backward) < least:
        remedy = f"move the joint faster than {least} {unit} in the other direction, too"
        return Reason(f"moves in only one direction, {span}", remedy=remedy)
    return None


def why_none(reasons: Mapping[str, object]) -> str:
    """Explain why no joint can be identified, given the reason of each joint; at most three joints are named."""
    listed = dict(list(reasons.items())[:3])
    if len(set(reasons.values())) == 1:
        return f"no joint can be identified from this log: {next(iter(listed.values()))}"
    return "no joint can be identified from this log: " + ". ".join(f"{name}: {why}" for name, why in listed.items())

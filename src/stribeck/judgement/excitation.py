"""Whether a joint moves enough for its friction to be found."""

from dataclasses import dataclass

import numpy as np

from stribeck.base.typing import Array
from stribeck.judgement.curve_fit.problem import FitProblem
from stribeck.judgement.curve_fit.robust import robust_scale
from stribeck.judgement.speed import TOP_SPEED_PERCENTILE, top_speed

MIN_BLOCKS = 6
"""Steps or seconds [1]: intervals come from how blocks differ, and one in `holdout` is not fitted at all."""

MIN_SAMPLES_PER_PARAMETER = 20
"""Usable samples [1] a parameter: fewer cannot show that the law's shape is right."""

MIN_SPEED = {False: 0.05, True: 0.005}
"""Speed [rad/s], [m/s] of a prismatic joint, that a joint must exceed in both directions.

Below it teeth and seals still bend instead of sliding, and the smooth law's tanh (slope 40 s/rad) is still rising.
"""

MIN_REVERSALS = 4
"""Changes of direction [1]: friction is what changes sign with them, an offset or a slow drift is what does not."""

NOISE_FACTOR = 4.0
"""Velocity noise [standard deviations] that does not count as motion: one sample in 16,000 exceeds it by chance."""


@dataclass(frozen=True, kw_only=True)
class Excitation:
    """How one joint moved: counts, speeds [rad/s] or [m/s], and why it cannot be identified ("" if it can)."""

    samples: int
    blocks: int
    velocity_range: tuple[float, float]
    reversals: int
    reason: str


def excitation(problem: FitProblem, prismatic: bool) -> Excitation:
    """Judge the motion of a joint by its usable samples, held-out blocks included."""
    velocity = problem.velocity
    blocks = len(np.unique(problem.block))
    noise = velocity_noise(velocity)
    threshold = max(NOISE_FACTOR * noise, 0.02 * top_speed(velocity))  # hysteresis
    reversals = count_reversals(velocity, threshold)
    return Excitation(
        samples=len(velocity),
        blocks=blocks,
        velocity_range=(float(velocity.min()), float(velocity.max())) if len(velocity) else (0.0, 0.0),
        reversals=reversals,
        reason=_too_few(problem, blocks) or _too_slow(velocity, noise, reversals, prismatic),
    )


def velocity_noise(velocity: Array) -> float:
    """Return the standard deviation of white noise in a velocity [rad/s], from its second differences.

    Motion hardly shows in them. Noise that a filter has already smoothed does not either: then this is a lower bound.
    """
    if len(velocity) < 3:
        return 0.0
    return robust_scale(np.diff(velocity, n=2)) / float(np.sqrt(6.0))


def count_reversals(velocity: Array, threshold: float) -> int:
    """Return how often a joint turned round, from beyond the threshold on one side to beyond it on the other."""
    side = np.sign(velocity[np.abs(velocity) > threshold])
    return int(np.count_nonzero(np.diff(side)))


def _too_few(problem: FitProblem, blocks: int) -> str:
    samples, needed = len(problem.velocity), MIN_SAMPLES_PER_PARAMETER * len(problem.parameters)
    if samples < needed:
        return f"{samples} usable samples; {len(problem.parameters)} parameters need at least {needed}: move it longer"
    if blocks < MIN_BLOCKS:
        return f"it moves in {blocks} blocks (steps, or seconds of longer ones); move it in at least {MIN_BLOCKS}"
    return ""


def _too_slow(velocity: Array, noise: float, reversals: int, prismatic: bool) -> str:
    unit = "m/s" if prismatic else "rad/s"
    least = MIN_SPEED[prismatic]
    backward, forward = np.percentile(velocity, [100 - TOP_SPEED_PERCENTILE, TOP_SPEED_PERCENTILE])
    span = f"between {backward:.3g} and {forward:.3g} {unit}"
    if max(forward, -backward) < least:
        return f"it moves only {span}; move it faster than {least} {unit} in both directions"
    if max(forward, -backward) < NOISE_FACTOR * noise:
        least = NOISE_FACTOR * noise
        return f"it moves {span}, hardly more than its velocity's noise; move it faster than {least:.3g} {unit}"
    if min(forward, -backward) < least:
        return f"it moves in one direction only, {span}; move it faster than {least} {unit} in the other one too"
    if reversals < MIN_REVERSALS:
        return f"it turns round {reversals} times; let it turn round at least {MIN_REVERSALS} times"
    return ""

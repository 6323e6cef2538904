"""Advice per joint: sufficient duration of the present motion, and expected intervals of other motions."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.dynamics.state import State
from stribeck.core.judgement.curve import WIDEST, relative_width
from stribeck.core.judgement.excitation import MIN_BLOCKS, MIN_REVERSALS, MIN_SPEED
from stribeck.core.judgement.weakness import CLEARED
from stribeck.core.result import CurvePoint
from stribeck.core.result.estimates import Verdict
from stribeck.core.result.tables import main_reason
from stribeck.design.planning.information import covariances, expected_curve
from stribeck.design.planning.joint import PlannedJoint, PresentMotion, moving
from stribeck.design.planning.selection import how_to_move
from stribeck.design.planning.series import Task

LONGEST = 3600.0
"""Longest duration that is recommended [s]."""

PERIOD, DURATION = 0.005, 30.0
"""Sampling period and duration of the motions that are compared [s]."""

Curve: TypeAlias = tuple[CurvePoint, ...]


@dataclass(frozen=True)
class PlannedMotion:
    """A motion and the friction interval expected from a log of it.

    `relative_width` is half of the 95 % interval of the friction curve divided by its value [1]; `needed` is the
    duration that is sufficient for the verdict "identified" [s], None if no duration is.
    """

    motion: str
    slowest: float
    fastest: float
    reversals: int
    duration: float
    curve: Curve
    relative_width: float
    needed: float | None


@dataclass(frozen=True, kw_only=True)
class JointAdvice:
    """Recommended motion for one joint.

    Attributes
    ----------
    verdict
        Verdict of the present log.
    advice
        Sentences.
    unit
        Unit of the joint's speed.
    noise
        Spectral density of the torque noise [N² m² s].
    guessed
        Whether the friction is assumed from other joints; the expected intervals depend on this assumption.
    longer
        Sufficient duration of the present motion [s]; None if no duration is.
    candidates
        Motions from the best to the worst.
    """

    verdict: Verdict
    advice: str
    unit: str
    noise: float
    guessed: bool
    longer: float | None
    candidates: tuple[PlannedMotion, ...]


def advise(task: Task, joint: PlannedJoint, motion: PresentMotion, duration: float) -> JointAdvice:
    """Advise on one joint.

    Parameters
    ----------
    task
        Dynamics of the robot, and positions of the other joints at rest.
    joint
        The joint.
    motion, duration
        Motion of the joint in the log, and duration of the log [s].
    """
    unit, verdict = "m/s" if joint.prismatic else "rad/s", joint.result.verdict
    still = verdict == "not excited"
    top = joint.reach.speed if still else max(motion.top_speed, 0.0)
    longer = None if still else present_length(joint, duration)
    candidates = []
    for name, (slow, fast, turns) in motions_of(joint).items():
        reversals, state = sweep(slow, fast, joint, task.posture, turns)
        curve = expected_curve(joint, covariances(task.dynamics, state, [joint], PERIOD)[0], top, DURATION)
        candidates.append(_candidate(name, (slow, fast), reversals, DURATION, curve))
    if not still:
        candidates.append(of_pace("the present motion twice as fast", 2.0, joint, motion, top))
        candidates.append(of_pace("the present motion half as fast", 0.5, joint, motion, top))
    candidates.sort(key=lambda trial: (math.inf if trial.needed is None else trial.needed, trial.relative_width))
    said = [_of_longer(joint, duration, longer)]
    if still or relative_width(joint.result.curve) > WIDEST:
        how = how_to_move(task.dynamics.robot, joint.column)
        said.append(_of_best(candidates, unit, how, alternative=bool(longer and longer <= LONGEST)))
    if not still:
        said.append(_of_speed(joint, motion.top_speed, unit))
    return JointAdvice(
        verdict=verdict,
        advice=". ".join(text for text in said if text),
        unit=unit,
        noise=joint.noise,
        guessed=joint.guessed,
        longer=longer,
        candidates=tuple(candidates),
    )


def motions_of(joint: PlannedJoint) -> dict[str, tuple[float, float, float]]:
    """Choose lowest speed, highest speed and minimum number of reversals for four kinds of swings, by name.

    No swing is above 1 Hz. "Slow" is half the Stribeck velocity, or close to the minimum speed that counts as motion.
    """
    least, stribeck = MIN_SPEED[joint.prismatic], joint.result.parameters.get("stribeck_velocity")
    fast = min(joint.reach.speed, 2 * np.pi * joint.reach.amplitude)
    slow = float(np.clip(stribeck.value / 2 if stribeck else 2 * least, least, fast / 2))
    often, turns = min(fast, np.sqrt(slow * fast)), 1.5 * MIN_REVERSALS
    return {
        "slow": (slow, slow, turns),
        "fast": (fast, fast, turns),
        "slow to fast": (slow, fast, turns),
        "frequent reversals": (often, often, 2 * DURATION),
    }


def sweep(slow: float, fast: float, joint: PlannedJoint, posture: Array, turns: float) -> tuple[int, State]:
    """Build a swing about the middle position whose speed grows from slow to fast, with at least `turns` reversals.

    Returns the number of reversals and the motion.
    """
    time = np.arange(0, DURATION, PERIOD)
    speed = slow * (fast / slow) ** (time / DURATION)
    amplitude = min(joint.reach.amplitude, float(speed.sum()) * PERIOD / (np.pi * turns))
    angle = np.cumsum(speed) * PERIOD / amplitude
    position, velocity = joint.reach.middle - amplitude * np.cos(angle), speed * np.sin(angle)
    swing = State(position, velocity, np.gradient(velocity, PERIOD))
    return int(angle[-1] / np.pi), moving(posture, joint.column, swing)


def of_pace(name: str, factor: float, joint: PlannedJoint, motion: PresentMotion, top: float) -> PlannedMotion:
    """Predict the result of an equally long log of the present motion, faster or slower by a factor.

    The share of the variance that decreases with the duration of the log scales like noise; the rest stays constant.
    """
    before, after = (
        expected_curve(
            joint,
            np.asarray(np.linalg.inv(joint.information(motion, pace) / joint.noise + np.diag(joint.precision))),
            top,
            motion.duration,
        )
        for pace in (1.0, factor)
    )
    share = joint.shrinking_share
    falls = [share * (new.standard_error / old.standard_error) ** 2 for old, new in zip(before, after, strict=True)]
    factors = [math.sqrt(1 - share + fall) for fall in falls]
    curve = tuple(_widened(point, factor) for point, factor in zip(joint.result.curve, factors, strict=True))
    turns = int(np.count_nonzero(np.diff(np.sign(motion.velocity[motion.usable]))))
    fixed = max((1 - share) / (1 - share + fall) for fall in falls)
    return _candidate(name, (0.0, factor * motion.top_speed), turns, motion.duration, curve, fixed)


def _widened(point: CurvePoint, factor: float) -> CurvePoint:
    """Widen the interval of a point of a friction curve by a factor."""
    half = factor * point.half_width
    interval = (max(point.value - half, 0.0), point.value + half)
    return replace(point, standard_error=factor * point.standard_error, interval_95=interval)


def _candidate(
    name: str, speeds: tuple[float, float], reversals: int, duration: float, curve: Curve, fixed: float = 0.0
) -> PlannedMotion:
    """Build a candidate; a share `fixed` of its variance does not decrease with the duration."""
    width = width_of(curve)
    turning = duration * MIN_REVERSALS / max(reversals, 1)
    needed = max(_length(width, fixed, duration), float(MIN_BLOCKS), turning)
    return PlannedMotion(name, *speeds, reversals, duration, curve, width, needed if needed <= LONGEST else None)


def width_of(curve: Curve) -> float:
    """Compute half of the 95 % interval divided by the value [1], as the verdicts do; 1e6 where the value is zero."""
    return min(relative_width(curve), 1e6)


def present_length(joint: PlannedJoint, duration: float) -> float | None:
    """Compute the duration of the present motion that is sufficient for "identified" [s]; None if no duration is.

    The interval decreases with the square root of the duration, except for the constant share of the variance.
    """
    needed = _length(relative_width(joint.result.curve), 1 - joint.shrinking_share, duration)
    return max(needed, duration) if needed < math.inf else None


def _length(width: float, fixed: float, duration: float) -> float:
    """Compute the duration of a log [s] for the widest interval allowed, given the constant share of the variance."""
    room = (WIDEST / width) ** 2 - fixed if width > 0 else math.inf
    return duration * (1 - fixed) / room if room > 0 else math.inf


def _of_longer(joint: PlannedJoint, duration: float, longer: float | None) -> str:
    if joint.result.verdict == "not excited":
        return f"the present motion is not sufficient: {main_reason(joint.result)}"
    if joint.result.verdict == "identified":
        return "no further motion is needed"
    if relative_width(joint.result.curve) <= WIDEST:
        return f"more motion does not help: {joint.result.reason}"
    if longer is None:
        known = {
            "model": " because errors of model and calibration remain",
            "repeated errors": " because errors that repeat with every step remain",
            "common gain": " because the error of the torques' gain remains",
        }
        return "recording the present motion longer does not help" + known.get(joint.fixed_part, "")
    if longer > LONGEST:
        return "the present motion is sufficient only after more than an hour"
    times = longer / duration
    times_as_long = f"{times:.{1 if times < 10 else 0}f} times as long ({longer:.0f} s)"
    return f"the present motion is sufficient if recorded {times_as_long}"


def _of_best(candidates: list[PlannedMotion], unit: str, how: Mapping[str, str], *, alternative: bool) -> str:
    best = candidates[0]
    spans = best.slowest not in (0.0, best.fastest)
    speed = f"at {best.slowest:.2g} to {best.fastest:.2g} {unit}" if spans else f"up to {best.fastest:.2g} {unit}"
    if best.needed is None and best.relative_width >= 1:
        return "None of the compared motions is sufficient: friction is small relative to the torque noise"
    motion = f"{best.motion}{how.get(best.motion, '')}"
    if best.needed is None:
        width = f"± {100 * best.relative_width:.2g} % after {best.duration:.0f} s"
        return f"None of the compared motions is sufficient; the best is {motion}, {speed}: {width}"
    turns = max(1, round(best.reversals * best.needed / best.duration))
    reversals = f"{turns} reversal{'s' * (turns > 1)}"
    move = "Alternatively, move" if alternative else "Move"
    return f"{move} the joint {speed} for {best.needed:.0f} s, with {reversals} ({motion})"


def _of_speed(joint: PlannedJoint, top: float, unit: str) -> str:
    """Recommend the speed that the Stribeck velocity requires, if the joint does not reach it."""
    stribeck = joint.result.parameters.get("stribeck_velocity")
    if stribeck is None or stribeck.verdict == "weak" or top >= CLEARED * stribeck.value:
        return ""
    return f"Single parameters require speeds above {CLEARED * stribeck.value:.2g} {unit}"

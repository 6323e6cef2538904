"""How long the present motion of a joint would have to last, and what each other motion would bring."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from stribeck.identification.judgement.curve import WIDEST, relative_width
from stribeck.identification.judgement.excitation import MIN_BLOCKS, MIN_REVERSALS
from stribeck.identification.judgement.weakness import CLEARED
from stribeck.planning.assumed import AssumedFriction
from stribeck.planning.information import Dynamics, covariances, expected_curve, width_of
from stribeck.planning.motions import DURATION, PERIOD, Motion, Reach, motions_of
from stribeck.planning.present import PresentMotion, fixed_part, shrinking_share, unit_information
from stribeck.result import CurvePoint
from stribeck.result.joint import Verdict
from stribeck.typing import Array

LONGEST = 3600.0
"""Of a log that is worth advising [s]."""

PARTS = {
    "model": "what is not known of model and calibration",
    "repeated errors": "what comes back with every step",
    "common gain": "what is not known of the torques' gain",
}
"""Parts of a variance that no length takes away, in words."""

PACES = {"the present motion twice as fast": 2.0, "the present motion half as fast": 0.5}
"""Changes of the present motion, and their factors of speed [1]."""


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A motion, and what a log of it would say.

    `relative_width` is half of the 95 % interval of the friction curve over its value [1], `needed` the time until that
    is narrow enough for the verdict "identified" [s]; None if no length is.
    """

    motion: str
    slowest: float
    fastest: float
    reversals: int
    duration: float
    curve: tuple[CurvePoint, ...]
    relative_width: float
    needed: float | None


@dataclass(frozen=True, kw_only=True)
class JointAdvice:
    """What would make the friction of one joint known.

    Attributes
    ----------
    verdict
        Of the present log.
    advice
        Sentences.
    unit
        Of its speed.
    noise
        Spectral density of its torque [N^2 m^2 s].
    guessed
        Whether its friction is a guess from other joints: then widths are as uncertain as that.
    longer
        Length of a log of the present motion that would do [s]; None if no length does.
    candidates
        From the best to the worst.
    """

    verdict: Verdict
    advice: str
    unit: str
    noise: float
    guessed: bool
    longer: float | None
    candidates: tuple[Candidate, ...]


def advise(
    column: int,
    assumed: AssumedFriction,
    verdict: Verdict,
    motion: PresentMotion,
    duration: float,
    noise: float,
    reach: Reach,
    dynamics: Dynamics,
    posture: Array,
    how: Mapping[str, str],
) -> JointAdvice:
    """Return the advice on one joint.

    Parameters
    ----------
    column
        Of the joint.
    assumed, verdict, motion, duration, noise
        What is known of it, and the length of the log [s].
    reach
        How it may move.
    dynamics, posture
        Of the robot, and where its other joints rest, shape (n,).
    how
        What to say of a motion by its name: how a walker does it.
    """
    unit = "m/s" if assumed.prismatic else "rad/s"
    top = reach.speed if verdict == "not excited" else max(motion.top_speed, 0.0)
    found = [
        _of_motion(each, column, assumed, top, noise, dynamics, posture)
        for each in motions_of(assumed.joint, assumed.prismatic, reach)
    ]
    longer = None
    if verdict != "not excited":
        longer = present_length(assumed, duration)
        found += [of_pace(pace, factor, assumed, motion, top, noise) for pace, factor in PACES.items()]
    found.sort(key=lambda one: (math.inf if one.needed is None else one.needed, one.relative_width))
    said = [_of_longer(verdict, assumed, duration, longer)]
    if verdict == "not excited" or relative_width(assumed.joint.curve) > WIDEST:
        said.append(_of_best(found, unit, how))
    if verdict != "not excited":
        said.append(_of_speed(assumed, motion.top_speed, unit))
    return JointAdvice(
        verdict=verdict,
        advice="; ".join(text for text in said if text),
        unit=unit,
        noise=noise,
        guessed=assumed.guessed,
        longer=longer,
        candidates=tuple(found),
    )


def _of_motion(
    motion: Motion,
    column: int,
    assumed: AssumedFriction,
    top: float,
    noise: float,
    dynamics: Dynamics,
    posture: Array,
) -> Candidate:
    own = covariances(dynamics, motion.state(column, posture), {column: assumed}, {column: noise}, PERIOD)[0]
    curve = expected_curve(assumed, own, top, DURATION)
    return _candidate(motion.name, motion.slowest, motion.fastest, motion.reversals, DURATION, curve)


def of_pace(
    name: str, factor: float, assumed: AssumedFriction, motion: PresentMotion, top: float, noise: float
) -> Candidate:
    """Return what the present motion would bring, faster or slower by a factor, in a log as long.

    The part of the present variance that falls with the length of a log changes as noise's would; the other stays.
    """
    before, after = (
        expected_curve(
            assumed,
            np.asarray(np.linalg.inv(unit_information(motion, assumed, pace) / noise + np.diag(assumed.precision))),
            top,
            motion.duration,
        )
        for pace in (1.0, factor)
    )
    share = shrinking_share(assumed)
    falls = [share * (new.standard_error / old.standard_error) ** 2 for old, new in zip(before, after, strict=True)]
    curve = tuple(
        _widened(point, math.sqrt(1 - share + own)) for point, own in zip(assumed.joint.curve, falls, strict=True)
    )
    speed = factor * motion.top_speed
    turns = int(np.count_nonzero(np.diff(np.sign(motion.velocity[motion.usable]))))
    fixed = max((1 - share) / (1 - share + own) for own in falls)
    return _candidate(name, 0.0, speed, turns, motion.duration, curve, fixed)


def _widened(point: CurvePoint, factor: float) -> CurvePoint:
    """Return a point of a friction curve whose interval is wider by a factor."""
    half = factor * point.half_width
    interval = (max(point.value - half, 0.0), point.value + half)
    return replace(point, standard_error=factor * point.standard_error, interval_95=interval)


def _candidate(
    name: str,
    slowest: float,
    fastest: float,
    reversals: int,
    duration: float,
    curve: tuple[CurvePoint, ...],
    fixed: float = 0.0,
) -> Candidate:
    """Return a candidate, of whose variance a share stays whatever the length."""
    width = width_of(curve)
    turning = duration * MIN_REVERSALS / max(reversals, 1)
    needed = max(_length(width, fixed, duration), float(MIN_BLOCKS), turning)
    return Candidate(
        motion=name,
        slowest=slowest,
        fastest=fastest,
        reversals=reversals,
        duration=duration,
        curve=curve,
        relative_width=width,
        needed=needed if needed <= LONGEST else None,
    )


def present_length(assumed: AssumedFriction, duration: float) -> float | None:
    """Return how long the present motion would have to last for the verdict "identified" [s]; None if no length does.

    Half of the interval falls with the root of the length, but for the parts of the variance that stay.
    """
    needed = _length(relative_width(assumed.joint.curve), 1 - shrinking_share(assumed), duration)
    return max(needed, duration) if needed < math.inf else None


def _length(width: float, fixed: float, duration: float) -> float:
    """Return how long a log has to be for the widest interval allowed [s], of whose variance a share is fixed."""
    room = (WIDEST / width) ** 2 - fixed if width > 0 else math.inf
    return duration * (1 - fixed) / room if room > 0 else math.inf


def _of_longer(verdict: Verdict, assumed: AssumedFriction, duration: float, longer: float | None) -> str:
    if verdict == "not excited":
        return f"its present motion is not enough: {assumed.joint.reason}"
    if verdict == "identified":
        return "its friction is known"
    if relative_width(assumed.joint.curve) <= WIDEST:
        return f"no motion is missing: {assumed.joint.reason}"
    if longer is None:
        part = PARTS.get(fixed_part(assumed), "")
        return "no length of the present motion helps" + (f", as {part} stays" if part else "")
    if longer > LONGEST:
        return "the present motion would take more than an hour"
    times = longer / duration
    return f"the present motion would do if it lasted {times:.{1 if times < 10 else 0}f} times as long, {longer:.0f} s"


def _of_best(found: list[Candidate], unit: str, how: Mapping[str, str]) -> str:
    best = found[0]
    spans = best.slowest not in (0.0, best.fastest)
    speed = f"{best.slowest:.2g} to {best.fastest:.2g} {unit}" if spans else f"up to {best.fastest:.2g} {unit}"
    what = f"{best.motion}{how.get(best.motion, '')} ({speed}"
    if best.needed is None and best.relative_width >= 1:
        return "no motion tried is enough: its friction, if it has any, is small against its torque's noise"
    if best.needed is None:
        width = f"± {100 * best.relative_width:.2g} % after {best.duration:.0f} s"
        return f"no motion tried is enough; the best is {what}), which leaves {width}"
    turns = max(1, round(best.reversals * best.needed / best.duration))
    return f"{best.needed:.0f} s of {what}, {turns} reversals) would do"


def _of_speed(assumed: AssumedFriction, top: float, unit: str) -> str:
    """Return what a Stribeck velocity asks for that the joint does not clear."""
    found = assumed.joint.parameters.get("stribeck_velocity")
    if found is None or found.verdict == "weak" or top >= CLEARED * found.value:
        return ""
    return f"for its parameters by themselves, move it faster than {CLEARED * found.value:.2g} {unit}"

"""Estimates of one joint: parameters, points of the friction curve, held-out errors and decisions on terms."""

import math
from dataclasses import dataclass
from typing import Literal

from stribeck.core.result.parts import Interval, Size

Verdict = Literal["identified", "weak", "no friction", "not excited"]


def verdict_place(verdict: str) -> str:
    """Name the command that explains a verdict."""
    return f"stribeck explain {verdict.replace(' ', '-')}"


TermDecision = Literal["kept", "refused", "open"]


@dataclass(frozen=True, kw_only=True)
class ParameterEstimate:
    """A fitted parameter: value, standard error, 95 % interval, unit and verdict.

    `variance_shares` are the contributions to the squared standard error by name, with sum one; None if unknown.
    """

    value: float
    standard_error: Size
    interval_95: Interval
    unit: str
    verdict: Verdict
    variance_shares: dict[str, float] | None = None

    @property
    def half_width(self) -> float:
        """Half of the 95 % interval, measured on the side that is not clipped."""
        return max(self.interval_95[1] - self.value, self.value - self.interval_95[0])


@dataclass(frozen=True, kw_only=True)
class CurvePoint:
    """Torque that resists motion [N m], [N] at one speed [rad/s], [m/s]: mean of both directions, without the offset.

    Includes standard error, 95 % interval (clipped at zero) and unit. `interval_95` is about the friction in this log,
    `interval_next_log` about another log of the same robot, because temperature, load and wear change friction; None in
    files of earlier versions.
    """

    velocity: Size
    value: float
    standard_error: Size
    interval_95: Interval
    unit: str
    interval_next_log: Interval | None = None

    @property
    def half_width(self) -> float:
        """Half of the 95 % interval, measured upwards, where it is not clipped."""
        return self.interval_95[1] - self.value

    @property
    def between_logs(self) -> float:
        """Standard deviation of friction from log to log relative to the value [1]; zero if unknown."""
        if self.interval_next_log is None or self.value <= 0:
            return 0.0
        other, half = self.interval_next_log[1] - self.value, self.half_width
        return min(math.sqrt(max((other - half) * (other + half), 0.0)) / (1.96 * self.value), 1e3)


@dataclass(frozen=True, kw_only=True)
class Validation:
    """Root mean square of the unexplained friction torque on held-out blocks [N m]."""

    rms: Size
    rms_zero_friction: Size
    rms_coulomb_only: Size

    @property
    def unexplained(self) -> float:
        """Residual relative to the residual without friction [1]."""
        return self.rms / max(self.rms_zero_friction, 1e-300)


@dataclass(frozen=True, kw_only=True)
class TorqueR2:
    """Share of the variance of a joint's held-out torque that model and friction explain [1].

    `nominal` uses model and log as given; `corrected` includes the estimated corrections, None without any.
    1 - sum e^2 / sum (tau - mean tau)^2, with e = tau - inverse dynamics - R(v), at the bandwidth of the filter,
    over held-out samples of free and swinging limbs.
    """

    nominal: float
    corrected: float | None = None

    @property
    def best(self) -> float:
        """R² of the model for which the friction was estimated."""
        return self.nominal if self.corrected is None else self.corrected


@dataclass(frozen=True, kw_only=True)
class TermVerdict:
    """Decision on one term of a joint's friction, with its reason.

    A term is open if the log contains an effect that the term explains, but other terms explain it, too. `gain` is the
    reduction of χ² on held-out data and `gain_error` its standard error; None where the term could not be tried.
    """

    verdict: TermDecision
    reason: str
    gain: float | None = None
    gain_error: float | None = None

    def __post_init__(self) -> None:
        """Check that a gain has its error."""
        if (self.gain is None) != (self.gain_error is None):
            raise ValueError("a gain needs a gain_error, and the other way round")

    @property
    def kept(self) -> bool:
        """Whether the joint's friction includes the term."""
        return self.verdict == "kept"

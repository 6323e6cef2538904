"""Covariates that friction may be proportional to: load, temperature or time, position, presliding (docs/estimator.md).

Load: Hamon, Gautier and Garrec 2010; temperature: Bittencourt and Gunnarsson 2012.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stribeck.base.typing import Array
from stribeck.whole_log.constants import LEAST_LOAD_VARIATION, LEAST_TURN, LEAST_WARMING, SHORTEST_DRIFT
from stribeck.whole_log.model.basis import Basis
from stribeck.whole_log.solver.normal_equations import curve_windows, times_covariates
from stribeck.whole_log.weak_equations import WeakEquations


@dataclass(frozen=True, eq=False)
class WithCovariates(Sequence[WeakEquations]):
    """Equations with their covariates, computed when they are asked for.

    The load is the torque that reaches the link: inverse dynamics where a joint has an equation of its own, as what is
    left of the measured torque would be taken for its own cause there, least of all with a gain that is free. Where
    contact forces are unknown, it is the measured torque without friction.

    Attributes
    ----------
    equations
        Without covariates.
    basis
        Those of `VaryingCurves`.
    friction
        Coefficients of a first, simple fit, shape (n, r).
    slow
        What friction changes slowly with: "temperature" or "drift".
    middle
        Mean temperatures [deg C], shape (n,), or half the length of the longest log [s].
    direction
        Mean cosine and sine of each joint's position, shape (n, 2).
    per_turn
        Periods of each joint's torque ripple a turn, shape (n,); NaN where none is asked for.
    travel, top_speed
        Of each joint's presliding [rad], likewise, and scales of velocity [rad/s], shape (n,).
    refined
        Coefficients of a fit with all terms, shape (n, R), whose friction then gives the load; None before.
    """

    equations: Sequence[WeakEquations]
    basis: Basis
    friction: Array
    slow: str
    middle: Array
    direction: Array
    per_turn: Array
    travel: Array
    top_speed: Array
    refined: Array | None = None

    def __len__(self) -> int:
        return len(self.equations)

    def __getitem__(self, k: int) -> WeakEquations:  # type: ignore[override]
        return self.of(self.equations[k])

    def of(self, part: WeakEquations) -> WeakEquations:
        """Return equations with their covariates."""
        turned = np.nan_to_num([part.direction() - self.direction, part.direction(self.per_turn)])
        lag = np.nan_to_num(part.presliding(self.top_speed, self.travel[None])[0])
        others = np.concatenate([self._slow(part)[:, :, None], *turned, lag[:, :, None]], axis=2)
        if part.projection is None:
            return replace(part, covariates=_beside(np.abs(part.torque - part.residual), others))
        windows = curve_windows(replace(part, covariates=None), self.basis)
        load = _carried(part, windows, self.friction)
        if self.refined is not None:
            load = _carried(part, times_covariates(windows, _beside(load, others), self.basis), self.refined)
        return replace(part, covariates=_beside(load, others))

    @property
    def mean_temperature(self) -> Array:
        """Mean temperature of each joint [deg C], NaN where none is logged, shape (n,)."""
        return self.middle if self.slow == "temperature" else np.full(len(self.direction), np.nan)

    def _slow(self, part: WeakEquations) -> Array:
        if self.slow == "temperature" and part.temperature is not None:
            return np.asarray(np.nan_to_num(part.temperature - self.middle))
        since = 0.5 * (part.elapsed - self.middle) / self.middle
        return np.broadcast_to(since[:, None], part.torque.shape)


def _beside(load: Array, others: Array) -> Array:
    return np.concatenate([load[:, :, None], others], axis=2)


def _carried(part: WeakEquations, windows: Array, friction: Array) -> Array:
    """Return the size of the torque that joints carry [N m], shape (K, n), from windows of the basis.

    Of a coupling it is zero.
    """
    own = np.einsum("kjr,jr->kj", windows, friction)
    if part.couplings is not None:
        own[:, : part.joints] += own[:, part.joints :] @ part.couplings.T
        own[:, part.joints :] = 0.0
    return np.asarray(np.abs(part.torque - own))


def with_covariates(
    equations: Sequence[WeakEquations],
    pilot: Sequence[WeakEquations],
    basis: Basis,
    friction: Array,
    per_turn: Array,
    travel: Array,
    top_speed: Array,
) -> WithCovariates:
    """Return equations with covariates, scaled by the `pilot` equations; arguments as in `WithCovariates`."""
    temperature = [part.temperature for part in pilot if part.temperature is not None]
    logged = len(temperature) == len(pilot) and bool(np.isfinite(np.concatenate(temperature)).any())
    direction = _directions(pilot).mean(axis=0)
    slow = "temperature" if logged else "drift"
    middle = _mean(np.concatenate(temperature)) if logged else np.full(1, max(0.5 * _last(pilot), 1e-9))
    return WithCovariates(equations, basis, friction, slow, middle, direction, per_turn, travel, top_speed)


def unsupported(
    pilot: Sequence[WeakEquations], slow: str, per_turn: Array, travel: Array, loads: Array | None = None
) -> list[dict[str, str]]:
    """Return for each joint the terms that are out of the question, and why.

    Parameters
    ----------
    pilot
        Equations from the beginning to the end of a log.
    slow
        What friction changes slowly with: "temperature" or "drift".
    per_turn
        Periods of each joint's torque ripple a turn, shape (n,); NaN where none can be told.
    travel
        Of each joint's presliding [rad], likewise.
    loads
        Number of windows, sums of loads and of their squares, shape (3, n); not looked at if they are not known yet.
    """
    turns = np.sqrt(_directions(pilot).var(axis=0).sum(axis=1))
    reasons = []
    for column, turned in enumerate(turns):
        temperature = [part.temperature[:, column] for part in pilot if part.temperature is not None]
        reasons.append(_slow_reasons(slow, _last(pilot), temperature))
        if loads is not None:
            reasons[-1] |= _load_reasons(*loads[:, column])
        if not turned >= LEAST_TURN:
            said = "it is prismatic" if np.isnan(turned) else f"+- {turned:.2g} rad"
            reasons[-1]["coulomb_position"] = f"its position hardly turns: {said}"
        if np.isnan(per_turn[column]):
            reasons[-1]["ripple"] = "its motion spans too little of a turn, or is none"
        if np.isnan(travel[column]):
            reasons[-1]["presliding"] = "no travel explains more of its torque than shorter and longer ones do"
    return reasons


def _load_reasons(count: float, total: float, square: float) -> dict[str, str]:
    """Return why a joint's friction does not change with its load, from windows, sum of loads and of squares."""
    mean = total / count
    deviation = float(np.sqrt(max(square / count - mean**2, 0.0)))
    if deviation > LEAST_LOAD_VARIATION * mean:
        return {}
    return {"load": f"its load hardly changes: {mean:.3g} N m +- {deviation:.2g}"}


def _directions(pilot: Sequence[WeakEquations]) -> Array:
    """Return cosine and sine of the joints' positions, shape (K, n, 2)."""
    return np.concatenate([part.direction() for part in pilot])


def _last(pilot: Sequence[WeakEquations]) -> float:
    """Return how long a log lasts [s]."""
    return max(float(part.elapsed[-1]) for part in pilot)


def _mean(temperature: Array) -> Array:
    """Return the mean of what is finite, shape (K, n) -> (n,); 0 where nothing is."""
    known = np.isfinite(temperature)
    total, count = np.where(known, temperature, 0.0).sum(axis=0), known.sum(axis=0)
    return np.asarray(np.where(count, total / np.maximum(count, 1), np.nan))


def _slow_reasons(slow: str, last: float, temperature: list[Array]) -> dict[str, str]:
    """Return why a joint's friction does not change with temperature, or with time, by the terms' names."""
    warming, drifting = "", "the log has temperatures, which say more than time"
    if slow == "drift":
        warming = "no temperature in the log"
        drifting = f"the log lasts {last:.3g} s; {SHORTEST_DRIFT:.0f} s are needed" if last < SHORTEST_DRIFT else ""
    else:
        own = np.concatenate(temperature)
        if not np.isfinite(own).all():
            warming = "the log has no temperature of this joint throughout"
        elif np.ptp(own) < LEAST_WARMING:
            warming = f"its temperature changes by {np.ptp(own):.2g} K; {LEAST_WARMING:.0f} K are needed"
    reasons = {"temperature": warming, "drift": drifting}
    return {f"{part}_{kind}": why for kind, why in reasons.items() if why for part in ("viscous", "coulomb")}

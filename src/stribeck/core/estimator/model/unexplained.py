"""What the pilot's part of a log shows of each joint's terms, before the whole log is read."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.equations.weak_equations import WeakEquations
from stribeck.core.estimator.model.terms import Terms
from stribeck.core.friction.terms import LADDER
from stribeck.core.friction.terms.term import Seen, evaluate


@dataclass(frozen=True, eq=False)
class Unexplained:
    """Residual torque of n joints in the pilot's fit, in K windows, from which terms find their settings.

    Attributes
    ----------
    parts
        Equations, and windows of the basis, shape (K, n, R), for each part.
    torques
        Residual torque times its information, and the information, for each part, shape (K, n) each.
    terms
        Terms without their settings.
    score, information, position
        Residual torque times its information, the information, and position [rad], shape (all K, n) each.
    """

    parts: Sequence[tuple[WeakEquations, Array]]
    torques: list[tuple[Array, Array]]
    terms: Terms
    score: Array
    information: Array
    position: Array

    @classmethod
    def of(
        cls, parts: Sequence[tuple[WeakEquations, Array]], left: Sequence[tuple[Array, Array]], terms: Terms
    ) -> Self:
        """Compute the residual torques from what a fit leaves, and its expected variances, shape (K, m) each."""
        torques = []
        for (part, _), (residual, variance) in zip(parts, left, strict=True):
            shares = part.weights / variance[:, :, None] * part.used[:, None, None]
            torques.append((np.einsum("kmj,km->kj", shares, residual), np.einsum("kmj,kmj->kj", shares, part.weights)))
        score, information = map(np.concatenate, zip(*torques, strict=True))
        position = np.concatenate([part.windows(part.position) for part, _ in parts])
        return cls(parts, torques, terms, score, information, position)

    @property
    def rms(self) -> Array:
        """Root mean square of the residual torque, weighted by its information [N m], shape (n,)."""
        squares = (self.score**2 / np.maximum(self.information, 1e-300)).sum(axis=0)
        return np.asarray(np.sqrt(squares / np.maximum(self.information.sum(axis=0), 1e-300)))

    @property
    def speed(self) -> Array:
        """Root mean square of the velocity [rad/s], shape (n,)."""
        return np.asarray(np.sqrt(np.mean(np.concatenate([part.velocity for part, _ in self.parts]) ** 2, axis=0)))

    @property
    def resolution(self) -> Array:
        """Step of the encoders from their noise [rad], shape (n,)."""
        steps = [np.sqrt(12) * part.position_noise for part, _ in self.parts if part.position_noise is not None]
        return np.asarray(np.max([np.zeros_like(self.terms.top_speed), *steps], axis=0))

    @property
    def settings(self) -> dict[str, Array]:
        """Settings of all terms by name, shape (n,) each."""
        settings = [(term.settings, term.find(self)) for term in LADDER if term.find]
        return {name: setting for names, values in settings for name, setting in zip(names, values, strict=True)}

    def falls(self, column: str, candidates: Sequence[Mapping[str, Array]]) -> Array:
        """Compute the decrease of chi^2 by a column (`Term.columns`) in addition to the curve, shape (n, c).

        `candidates` are c sets of the column's settings, shape (n,) each. The coefficient is positive.
        """
        information, right = 0.0, 0.0
        for (part, windows), (score, known) in zip(self.parts, self.torques, strict=True):
            signals = self.terms.signals(part, windows)
            columns = [np.nan_to_num(evaluate(column, {**signals, **settings})) for settings in candidates]
            whole = np.concatenate([windows, np.stack(columns, axis=2)], axis=2)
            information = information + np.einsum("kj,kjr,kjs->jrs", known, whole, whole, optimize=True)
            right = right + np.einsum("kj,kjr->jr", score, whole)
        r = windows.shape[2]
        return np.array([_falls(*system, r) for system in zip(np.asarray(information), np.asarray(right), strict=True)])


def _falls(information: Array, right: Array, r: int) -> Array:
    """Compute the decrease of chi^2 by each column after the first r, with a positive coefficient."""
    ridge = 1e-9 * np.trace(information[:r, :r]) * np.eye(r)
    solution = np.linalg.solve(information[:r, :r] + ridge, np.column_stack([information[:r, r:], right[:r]]))
    remainder = np.diag(information[r:, r:] - information[r:, :r] @ solution[:, :-1])
    score = right[r:] - information[r:, :r] @ solution[:, -1]
    return np.asarray(np.where(remainder > 1e-6, np.maximum(score, 0.0) ** 2 / np.maximum(remainder, 1e-6), 0.0))


def find_terms(pilot: Sequence[WeakEquations], **known: Any) -> Terms:
    """Compute the means of a log from equations over all of it; `known` are the other attributes of `Terms`."""
    temperature = [part.temperature for part in pilot if part.temperature is not None]
    logged = len(temperature) == len(pilot) and bool(np.isfinite(np.concatenate(temperature)).any())
    mean = None
    if logged:
        whole = np.concatenate(temperature)
        mask = np.isfinite(whole)
        sums, count = np.where(mask, whole, 0.0).sum(axis=0), mask.sum(axis=0)
        mean = np.where(count, sums / np.maximum(count, 1), np.nan)
    direction = np.concatenate([direction_of(part) for part in pilot]).mean(axis=0)
    duration = max(2e-9, *(float(part.elapsed[-1]) for part in pilot))
    return Terms(mean_temperature=mean, duration=duration, direction=direction, **known)


def direction_of(part: WeakEquations) -> Array:
    """Compute windowed cosine and sine of the joints' positions, shape (K, n, 2)."""
    return np.stack([part.windows(np.cos(part.position)), part.windows(np.sin(part.position))], axis=2)


def unsupported(pilot: Sequence[WeakEquations], terms: Terms, mean: Array, deviation: Array) -> list[dict[str, str]]:
    """List each joint's excluded terms with the reason.

    Parameters
    ----------
    pilot
        Equations from the beginning to the end of a log.
    terms
        Settings of the log's terms.
    mean, deviation
        Mean and standard deviation of each joint's load [N m], shape (n,).
    """
    turned = np.sqrt(np.concatenate([direction_of(part) for part in pilot]).var(axis=0).sum(axis=1)).tolist()
    warm = None
    if terms.mean_temperature is not None:
        warm = np.concatenate([part.temperature for part in pilot if part.temperature is not None])
    chirps, reasons = _time_from_speed(pilot).tolist(), []
    for joint, turns in enumerate(turned):
        out = {
            term.name: term.refuse(
                Seen(
                    mean_load=mean[joint],
                    load_deviation=deviation[joint],
                    temperature=None if warm is None else warm[:, joint],
                    duration=terms.duration,
                    chirps=chirps[joint],
                    turned=turns,
                    settings=[float(terms.settings[name][joint]) for name in term.settings],
                )
            )
            for term in LADDER
        }
        reasons.append({name: why for name, why in out.items() if why})
    return reasons


def _time_from_speed(pilot: Sequence[WeakEquations]) -> Array:
    """Compute the share of the variance of time that a joint's speed explains [1], shape (n,).

    It is the variance of the mean times of ten classes of speed, divided by the variance of time.
    """
    speed = np.concatenate([part.windows(np.abs(part.velocity)) for part in pilot])
    time = np.concatenate([part.elapsed for part in pilot])
    classes = np.array_split(time[np.argsort(speed, axis=0)], min(10, len(time)))
    squares = [len(times) * (times.mean(axis=0) - time.mean()) ** 2 for times in classes]
    return np.asarray(np.sum(squares, axis=0) / max(len(time) * time.var(), 1e-300))

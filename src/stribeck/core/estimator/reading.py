"""Reading of a whole log: pilot, accumulation and the first fit of the laws (docs/estimator-fit.md)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from stribeck.core.base.spans import Span, runs_of
from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.equations import constants
from stribeck.core.equations.weak_equations import WeakEquations
from stribeck.core.equations.whole_log.equation_sequence import EquationSequence
from stribeck.core.equations.whole_log.filters import WINDOW_LENGTH
from stribeck.core.equations.whole_log.segments import Segment
from stribeck.core.errors import NothingIdentifiedError
from stribeck.core.estimator.model.basis import Basis, make_basis
from stribeck.core.estimator.model.laws import Laws
from stribeck.core.estimator.model.terms import NO_TERM, Columns, Terms
from stribeck.core.estimator.model.unexplained import Unexplained, find_terms
from stribeck.core.estimator.solver.elimination import best_of_linear, blocks, eliminate, solve
from stribeck.core.estimator.solver.fit import Fit
from stribeck.core.estimator.solver.linear_fit import LinearFit
from stribeck.core.estimator.solver.pilot import fit_pilot, with_terms
from stribeck.core.estimator.solver.positive_definite import inverse_of
from stribeck.core.estimator.solver.statistics import Statistics, accumulate, total
from stribeck.core.friction import AUTO, FrictionLaw
from stribeck.core.friction.presliding import SMOOTH_SIGN
from stribeck.core.settings import Priors

REST = 1.0
"""Longest pause of a disturbance [s]: joints that rest between two moves hide a hand or a payload."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Reading:
    """Whole logs after they have been read.

    Attributes
    ----------
    equations, pilot
        Equations of all segments, and the pilot.
    columns, terms
        Columns of friction, and the terms among them.
    fit
        First fit of the laws to the segments that are not held out.
    folds, known, sample, whole
        Statistics of these segments by folds, of all of them, of the folds with random effects, and of all segments.
    held_out, unseen
        Log and segment of each held-out part, and their equations.
    windows
        Log, centers [s] and flags of the used windows of each segment read.
    """

    equations: EquationSequence
    pilot: LinearFit
    columns: Columns
    terms: Terms
    fit: Fit
    folds: list[Statistics]
    known: Statistics
    sample: Statistics
    whole: Statistics
    held_out: tuple[tuple[int, Segment], ...]
    unseen: list[WeakEquations]
    windows: tuple[tuple[int, Array, BoolArray], ...]

    @property
    def set_aside(self) -> float:
        """Share of the windows that are set aside [1]."""
        return 1 - float(np.mean(np.concatenate([used for _, _, used in self.windows])))

    def spans(self, *, used: bool) -> list[list[Span]]:
        """Find the spans of each log whose windows are used, or set aside.

        Used windows count as set aside if a joint rests there between two disturbances, so that none is visible.
        """
        logs = [form.log for form in self.equations.forms]
        names = [Path(log.path).name if len(logs) > 1 else "" for log in logs]
        return [
            [Span(start - log.start, end - log.start, name) for start, end in self._stamps(k, used)]
            for k, (log, name) in enumerate(zip(logs, names, strict=True))
        ]

    def _stamps(self, log: int, used: bool) -> list[tuple[float, float]]:
        """Find first and last stamp [s] of the spans of one log."""
        windows = [(time, kept) for number, time, kept in self.windows if number == log]
        if not windows:
            return []
        time, kept = (np.concatenate(arrays) for arrays in zip(*windows, strict=True))
        for first, last in runs_of(kept):
            if first > 0 and last < len(kept) and time[last] - time[first] < REST:
                kept[first:last] = False
        half = WINDOW_LENGTH / 2
        return [(float(time[a]) - half, float(time[b - 1]) + half) for a, b in runs_of(kept == used)]


def read_with_pilot(
    equations: EquationSequence, law: FrictionLaw, rest: Array, priors: Priors, progress: Callable[[float], None]
) -> Reading:
    """Fit the pilot, and read the log once."""
    basis = make_basis(law, equations.top_speed)
    pilot = fit_pilot(equations, basis, rest, priors, lambda share: progress(0.2 * share))
    laws, terms, pilot = _with_terms(pilot, law, basis, equations.top_speed, priors)
    sequence = replace(equations, effects=pilot.model.layout.log_effects[1])
    return _read(sequence, pilot, terms, laws, progress)


def _read(
    equations: EquationSequence, pilot: LinearFit, terms: Terms, laws: Laws, progress: Callable[[float], None]
) -> Reading:
    """Compute the statistics of a log, of some segments in folds and of others that are held out, and fit the laws."""
    columns, prediction = Columns(laws.basis, terms), pilot.prediction
    pilot, sequence = replace(pilot), equations.delayed(pilot.delay)  # without large products
    size = np.mean([part.residual.size for part in pilot.parts])  # equations of a segment
    needed = (_friction_error(pilot, prediction.covariance) / constants.ENOUGH) ** 2 * pilot.counts.sum() / size
    enough = max(constants.LEAST_SEGMENTS, int(min(constants.MOST_SEGMENTS, float(needed))))
    most = min(constants.MOST_SEGMENTS, enough, max(constants.FOLDS, int(constants.MOST_EQUATIONS / size)))
    folds, held_out = sequence.folds(most)
    count = len(folds)
    sampled = min(count, 2 * max(1, round(15 * count / sum(map(len, folds)))))  # about 30; left and right alternate
    statistics, unseen, windows = accumulate(
        sequence, [*folds, held_out], sampled, columns, prediction, lambda share: progress(0.2 + 0.6 * share)
    )
    known = total(statistics[:count])
    if not known.count:
        raise NothingIdentifiedError(
            "no joint can be identified from this log: its torques differ too much from every model; check units, "
            "signs, joint names and gears (stribeck inspect)"
        )
    return Reading(
        equations=equations,
        pilot=pilot,
        columns=columns,
        terms=terms,
        fit=_first_fit(known, laws, pilot),
        folds=statistics[:count],
        known=known,
        sample=total(statistics[:sampled]),
        whole=total([known, *statistics[count:]]),
        held_out=tuple(sequence.parts[place][:2] for place in held_out),
        unseen=[unseen[place] for place in held_out],
        windows=tuple((sequence.parts[place][0], *windows[place]) for place in sorted(windows)),
    )


def _friction_error(pilot: LinearFit, covariance: Array) -> float:
    """Compute the standard error of the friction torque relative to the joint's torque [1], median over joints."""
    by_joint = np.concatenate(pilot.by_joint)
    joints, q = by_joint.shape[1:]
    of_joints = blocks(covariance[: joints * q, : joints * q], joints)
    variance = np.einsum("kja,jab,kjb->j", by_joint, of_joints, by_joint, optimize=True)
    torque = (np.concatenate([part.torque for part in pilot.parts]) ** 2).sum(axis=0)
    return float(np.sqrt(np.median(variance / np.maximum(torque, 1e-300))))


def _with_terms(
    pilot: LinearFit, law: FrictionLaw, basis: Basis, speed: Array, priors: Priors
) -> tuple[Laws, Terms, LinearFit]:
    """Build the laws with all terms, the scales of the terms, and the pilot with their columns."""
    joints, functions = basis.velocity.shape[0], basis.functions.shape[1]
    parts, prediction, size = pilot.parts, pilot.prediction, len(pilot.precision)
    friction = prediction.values[:size].reshape(joints, -1)[:, :functions]
    windows = [by_joint[:, :, :functions] for by_joint in pilot.by_joint]
    left = []
    for part, each in zip(parts, windows, strict=True):
        fitted = np.einsum("kmj,kjr,jr->km", part.weights, each, friction, optimize=True)
        if part.regressors is not None:
            fitted += part.regressors @ prediction.values[size:]
        left.append((part.residual - fitted, pilot.components.marginal(part)))
    offsets = np.array([parameter.name != "offset" for parameter in law.parameters])
    free = offsets | (np.arange(joints) < parts[0].joints)[:, None]  # couplings have none: the joints have
    laws = Laws(law, basis, (), speed, np.full(joints, pilot.model.torque), priors, free)
    slope = 1 / (SMOOTH_SIGN * speed)
    if law.name == AUTO:  # choose the shape of the pilot's curves
        covariance = blocks(prediction.covariance[:size, :size], joints)[:, :functions, :functions]
        internal = best_of_linear(laws, friction, covariance)
        slope = laws.external(internal)[:, [parameter.name for parameter in law.parameters].index("slope")]
    nothing, delay = np.zeros(joints), priors.torque_delay
    terms = find_terms(parts, slope=slope, friction=friction, top_speed=speed, unexplained=nothing, delay=delay)
    unexplained = Unexplained.of(list(zip(parts, windows, strict=True)), left, terms)
    terms = replace(terms, unexplained=unexplained.rms, settings=unexplained.settings)
    own_terms = [parameter.name not in NO_TERM and law.name == AUTO for parameter in terms.parameters]
    free = np.hstack([free, np.tile(own_terms, (joints, 1))])
    return replace(laws, terms=terms.parameters, free=free), terms, with_terms(pilot, Columns(basis, terms))


def _first_fit(known: Statistics, laws: Laws, pilot: LinearFit) -> Fit:
    """Fit laws with all terms, starting from a linear fit of friction and corrections."""
    joints, size = len(laws.top_speed), pilot.model.layout.size
    system = eliminate(known, pilot.model, np.zeros(size))
    covariance = inverse_of(system.information + np.diag(pilot.precision))
    theta = (covariance @ system.right).reshape(joints, -1)
    internal = best_of_linear(laws, theta, blocks(covariance, joints))
    start = Fit(
        laws=laws,
        model=pilot.model,
        internal=internal,
        corrections=np.zeros(size),
        covariance=np.zeros((internal.size + size,) * 2),
        at_bound=np.zeros(internal.shape, dtype=bool),
        chi_square=0.0,
        converged=False,
    )
    return solve(known, start)

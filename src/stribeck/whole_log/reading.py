"""Reading of a whole log: pilot, accumulation and the first fit of the laws (docs/estimator-fit.md)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from stribeck.base.typing import Array, BoolArray
from stribeck.errors import NothingIdentifiedError
from stribeck.friction import AUTO, FrictionLaw
from stribeck.friction.presliding import SMOOTH_SIGN
from stribeck.settings import Priors
from stribeck.whole_log import constants
from stribeck.whole_log.equations.equation_sequence import EquationSequence
from stribeck.whole_log.equations.segments import Segment
from stribeck.whole_log.model.basis import Basis, make_basis
from stribeck.whole_log.model.corrections import Layout
from stribeck.whole_log.model.laws import Laws
from stribeck.whole_log.model.terms import NO_TERM, Columns, Terms
from stribeck.whole_log.model.unexplained import Unexplained, find_terms
from stribeck.whole_log.solver.elimination import Fit, eliminate, inverse_of, solve
from stribeck.whole_log.solver.empirical_bayes import best_of_linear, blocks, with_other_starts
from stribeck.whole_log.solver.pilot import (
    LINEAR,
    Pilot,
    fit_pilot,
    friction_error,
    pilot_places,
    secant_step,
    with_terms,
)
from stribeck.whole_log.solver.statistics import Statistics, accumulate, total
from stribeck.whole_log.terms.term_selection import overdispersion
from stribeck.whole_log.weak_equations import WeakEquations


@dataclass(frozen=True, eq=False)
class Read:
    """Pilot and laws, statistics of a log by folds, some of them `sampled`, held-out segments, and the first fit."""

    pilot: Pilot
    terms: Terms
    columns: Columns
    fit: Fit
    folds: list[Statistics]
    sampled: int
    held: list[Statistics]
    held_out: tuple[tuple[int, Segment], ...]
    unseen: list[WeakEquations]
    windows: tuple[tuple[int, Array, BoolArray], ...]


def read_with_pilot(
    equations: EquationSequence,
    law: FrictionLaw,
    speed: Array,
    rest: Array,
    priors: Priors,
    progress: Callable[[float], None],
) -> Read:
    """Fit the pilot and read the log; repeat both if the whole log contradicts the pilot's variances or delay."""
    basis, layout = make_basis(law, speed), Layout(equations.corrections)

    def segments(delay: float, count: int) -> list[WeakEquations]:
        late = equations.delayed(delay)
        return [late[place] for place in pilot_places(late.feet, count)]

    size = max(constants.PILOT_SEGMENTS, 240 // len(speed))  # few joints need more segments, and take less time

    def start(delay: float = 0.0) -> tuple[Laws, Terms, Pilot]:
        pilot = fit_pilot(segments, size, layout, basis, speed, rest, priors, delay)
        return _with_terms(pilot, law, basis, speed, priors)

    tried: list[tuple[float, float]] = []
    laws, terms, pilot = start()
    while True:
        read = _read(equations.delayed(pilot.delay), pilot, basis, terms, laws, progress)
        known, late = total(read.folds), remaining_delay(read.fit)
        own = read.fit.layout.places("torque_delay")
        error = np.sqrt(read.fit.covariance[own, own].sum() * overdispersion(known, read.fit)) * priors.torque_delay
        tried.append((pilot.delay, late))
        if not pilot.delay and len(tried) == 1 and abs(late) > 3 * priors.torque_delay:  # less may be presliding
            laws, terms, pilot = start(late)
        elif not pilot.delay or len(tried) > constants.ROUNDS or abs(late) < max(LINEAR, 3 * error):
            return read
        else:
            pilot = pilot.later(secant_step(tried))


def _read(
    late: EquationSequence, pilot: Pilot, basis: Basis, terms: Terms, laws: Laws, progress: Callable[[float], None]
) -> Read:
    """Compute the statistics of a log, of some segments in `FOLDS` and the held-out ones, and fit the laws to them."""
    columns = Columns(basis, terms)
    held_out = pilot_places(late.feet)[: len(late) // 4]
    equations = np.mean([each.part.residual.size for each in pilot.groups])  # of a segment
    needed = (
        (friction_error(pilot, columns) / constants.ENOUGH) ** 2 * sum(each.count for each in pilot.groups) / equations
    )
    enough = max(constants.LEAST_SEGMENTS, int(min(constants.MOST_SEGMENTS, float(needed))))
    most = min(constants.MOST_SEGMENTS, enough, max(constants.FOLDS, int(constants.MOST_EQUATIONS / equations)))
    training = _spread([k for k in range(len(late)) if k not in held_out], most)
    count = min(constants.FOLDS, len(training))
    sampled = min(count, 2 * max(1, round(15 * count / len(training))))  # about 30 segments; left and right alternate
    folds = [*(training[k::count] for k in range(count)), held_out]
    found, unseen, windows = accumulate(
        late, folds, sampled, columns, pilot.prediction, lambda share: progress(0.2 + 0.6 * share)
    )
    if not sum(each.count for each in found[:count]):
        raise NothingIdentifiedError(
            "no joint can be identified from this log: its torques differ too much from every model; check units, "
            "signs, joint names and gears (stribeck inspect)"
        )
    return Read(
        pilot=pilot,
        terms=terms,
        columns=columns,
        fit=_first_fit(total(found[:count]), laws, pilot),
        folds=found[:count],
        sampled=sampled,
        held=found[count:],
        held_out=tuple(late.parts[place][:2] for place in held_out),
        unseen=[unseen[place] for place in held_out],
        windows=tuple((late.parts[place][0], *windows[place]) for place in sorted(windows)),
    )


def remaining_delay(fit: Fit) -> float:
    """Find the torques' delay in addition to the one that the equations assume [s]."""
    return float(fit.model.values(fit.corrections)[fit.model.layout.part("torque_delay")].sum())


def _spread(places: list[int], most: int) -> list[int]:
    """Select at most `most` places, evenly spread."""
    every = np.linspace(0, len(places) - 1, min(most, len(places))).round().astype(int)
    return [places[k] for k in every]


def _with_terms(
    pilot: Pilot, law: FrictionLaw, basis: Basis, speed: Array, priors: Priors
) -> tuple[Laws, Terms, Pilot]:
    """Build the laws with all terms, the scales of the terms, and the pilot with their columns."""
    joints, functions = basis.velocity.shape[0], basis.functions.shape[1]
    parts = [each.part for each in pilot.groups]
    size = len(pilot.prediction.values) - pilot.model.layout.size
    friction = pilot.prediction.values[:size].reshape(joints, -1)[:, :functions]
    left = []
    for part in parts:
        windows = basis.windows(part.velocity, part.taps, part.step, len(part.residual))
        fitted = np.einsum("kmj,kjr,jr->km", part.weights, windows, friction, optimize=True)
        if part.regressors is not None:
            fitted += part.regressors @ pilot.prediction.values[size:]
        left.append((part, part.residual - fitted, pilot.components.marginal(part)))
    offsets = np.array([parameter.name != "offset" for parameter in law.parameters])
    free = offsets | (np.arange(joints) < parts[0].joints)[:, None]  # couplings have none: the joints have
    laws = Laws(law, basis, (), speed, np.full(joints, pilot.torque), priors, free)
    slope = 1 / (SMOOTH_SIGN * speed)
    if law.name == AUTO:  # choose the shape of the pilot's curves
        own = blocks(pilot.prediction.covariance[:size, :size], joints)[:, :functions, :functions]
        internal = best_of_linear(laws, friction, own)
        slope = laws.external(internal)[:, [parameter.name for parameter in law.parameters].index("slope")]
    nothing, delay = np.zeros(joints), priors.torque_delay
    terms = find_terms(parts, slope=slope, friction=friction, top_speed=speed, unexplained=nothing, delay=delay)
    unexplained = Unexplained.of(left, basis, terms)
    terms = replace(terms, unexplained=unexplained.rms, settings=unexplained.settings)
    own_terms = [parameter.name not in NO_TERM and law.name == AUTO for parameter in terms.parameters]
    free = np.hstack([free, np.tile(own_terms, (joints, 1))])
    return replace(laws, terms=terms.parameters, free=free), terms, with_terms(pilot, Columns(basis, terms))


def _first_fit(known: Statistics, laws: Laws, pilot: Pilot) -> Fit:
    """Fit laws with all terms, starting from a linear fit of friction and corrections."""
    joints, size = len(laws.top_speed), pilot.model.layout.size
    left = eliminate(known, pilot.model, np.zeros(size))
    covariance = inverse_of(left.information + np.diag(pilot.precision))
    theta = (covariance @ left.right).reshape(joints, -1)
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
    return with_other_starts(known, solve(known, start))

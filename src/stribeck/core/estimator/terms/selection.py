"""Stepwise selection of a joint's terms by held-out scores (docs/estimator-fit.md, equation 22).

Cross-validation: Stone 1974; stepwise: Efroymson 1960; the simplest within a standard error: Breiman et al. 1984.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.equations.constants import LEAST_GAIN
from stribeck.core.friction.terms import BASE, LADDER
from stribeck.core.friction.terms.term import Term
from stribeck.core.judgement.reason import Reason
from stribeck.core.result import JointResult, TermDecision, TermVerdict

Kept = frozenset[str]
Objection = tuple[TermDecision, str]
"""Status of a term that is not kept, and the reason."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A joint with some terms: chi^2 of each held-out fold, shape (F,), and an objection, if any."""

    scores: Array
    objection: Objection | None = None


def select_stepwise(
    try_terms: Callable[[Kept], Candidate], refused: Mapping[str, str], usual: Kept = BASE
) -> dict[str, TermVerdict]:
    """Decide on each term of the ladder.

    The search starts from the usual terms and adds or removes one term at a time. A set is a candidate if no term of it
    is refused and no other set lowers the held-out chi^2 by more than the standard error over the folds and by more
    than `LEAST_GAIN`. The candidate nearest to the usual terms is chosen, until all its neighbors have been tried.

    Parameters
    ----------
    try_terms
        Fits a joint with some terms, by name, to the training folds, and scores it on the held-out one.
    refused
        Excluded terms, with the reason.
    usual
        Terms that a joint has unless the log contradicts them.
    """
    tried: dict[Kept, Candidate] = {}
    kept = usual - set(refused)
    while new := [terms for terms in (kept, *_neighbours(kept, refused)) if terms not in tried]:
        tried |= {terms: try_terms(terms) for terms in new}
        kept = _simplest_unbeaten({terms: fit for terms, fit in tried.items() if not fit.objection} or tried, usual)
    return {term.name: _verdict(term, kept, tried, refused, usual) for term in LADDER}


def _neighbours(kept: Kept, refused: Mapping[str, str]) -> list[Kept]:
    """List the sets with one term more or less; a part replaces its whole, and vice versa."""
    neighbours = []
    for term in LADDER:
        if term.name in BASE & kept:
            continue
        if term.name in kept:
            less = frozenset(other.name for other in LADDER if other.name in kept and other.needs != term.name)
            neighbours += [
                less - {term.name},
                *(less - {term.name} | {part} for part in _parts(term) if part not in refused),
            ]
        elif term.name not in refused and term.part_of not in kept and (not term.needs or term.needs in kept):
            neighbours.append(kept - _parts(term) | {term.name})
    return neighbours


def _parts(term: Term) -> Kept:
    return frozenset(part.name for part in LADDER if part.part_of == term.name)


def _simplest_unbeaten(tried: Mapping[Kept, Candidate], usual: Kept) -> Kept:
    """Find the terms nearest to the usual ones, in number of parameters, that no other terms clearly improve."""
    scores = np.stack([fit.scores for fit in tried.values()])
    falls = scores[:, None] - scores
    beaten = np.any(_pays(falls.sum(axis=2), _errors(falls)), axis=1)
    costs = [sum(len(term.parameters) for term in LADDER if term.name in terms ^ usual) for terms in tried]
    order = np.lexsort((scores.sum(axis=1), costs, beaten))
    return list(tried)[int(order[0])]


def _verdict(
    term: Term, kept: Kept, tried: Mapping[Kept, Candidate], refused: Mapping[str, str], usual: Kept
) -> TermVerdict:
    """Decide whether a joint with these terms has this one, and describe the alternative."""
    if term.name in refused:
        return TermVerdict(verdict="refused", reason=refused[term.name])
    if term.needs and term.needs not in kept:
        return TermVerdict(verdict="refused", reason=f"it means nothing without the term {term.needs}")
    if term.part_of in kept:
        return TermVerdict(verdict="refused", reason=f"the term {term.part_of} has it")
    if term.name in BASE:
        return TermVerdict(verdict="kept", reason="every joint has it")
    more = kept - _parts(term) | {term.name}
    less = (key for key in tried if key in _neighbours(more, refused) and key <= (more | _parts(term)) - {term.name})
    without = min((tried[key] for key in less), key=lambda candidate: candidate.scores.sum())
    gain, error = held_out_gain(without.scores, tried[more].scores)
    objection = tried[more].objection if _pays(gain, error) else None
    verdict: TermDecision = "kept" if term.name in kept else "refused"
    reason = _in_words(gain, error)
    if term.name not in kept and objection:
        verdict, reason = objection[0], f"{reason}, but {objection[1]}"
    if term.name in kept & usual and not _pays(gain, error):
        reason = f"most joints with friction have it, and {reason} here"
    return TermVerdict(verdict=verdict, reason=reason, gain=gain, gain_error=error)


def _in_words(gain: float, error: float) -> str:
    """Describe how a term changes the held-out chi^2."""
    if abs(gain) < 0.05:
        return "held-out chi^2 does not change"
    digits = 0 if abs(gain) >= 10 else 1
    return f"held-out chi^2 {'falls' if gain > 0 else 'rises'} by {abs(gain):.{digits}f} ± {1.96 * error:.{digits}f}"


def held_out_gain(without: Array, with_it: Array) -> tuple[float, float]:
    """Compute the decrease of chi^2 over all folds, and its standard error."""
    falls = without - with_it
    return float(falls.sum()), float(_errors(falls))


def _errors(falls: Array) -> Array:
    """Compute standard errors of sums over independent folds, shape (..., F) -> (...)."""
    return np.asarray(np.std(falls, axis=-1, ddof=1) * np.sqrt(falls.shape[-1]))


def _pays(gain: ArrayLike, error: ArrayLike) -> BoolArray:
    return np.asarray(gain) > np.maximum(error, LEAST_GAIN)


@dataclass(frozen=True, kw_only=True)
class JointTerms:
    """Terms of one joint's law, and the quantities that scale them.

    Attributes
    ----------
    verdicts
        Verdict of each term.
    mean_load, load_deviation
        Mean and standard deviation of the torque that the joint carries [N m].
    mean_direction
        Means of cosine and sine of the position [1]; None for a prismatic joint.
    mean_temperature
        Mean temperature [deg C]; None where none is logged.
    settings
        Settings of the terms by name.
    """

    verdicts: dict[str, TermVerdict]
    mean_load: float
    load_deviation: float
    mean_direction: tuple[float, ...] | None
    mean_temperature: float | None
    settings: Mapping[str, float]


def with_terms(joint: JointResult, terms: JointTerms, noise: float = 0.0) -> JointResult:
    """Add the terms to a joint's result; if one is undecided, mark Coulomb and viscous friction as weak.

    The parameters then describe friction only at the speeds of this log, and another law would divide it differently.
    The verdict stays the curve's, because the curve is the same. A joint whose torques the model does not explain is
    weak instead of without friction, unless its residual is sensor noise: at most twice `noise`, the smallest residual
    of the joints whose load the model explains [N m].
    """
    parameters, result = joint.parameters, joint
    open_terms = [verdict.reason for verdict in terms.verdicts.values() if verdict.verdict == "open"]
    divided = [name for name in ("viscous", "coulomb") if name in parameters and open_terms]
    shared = {name: replace(parameters[name], verdict="weak") for name in divided}
    if shared:
        reason = f"{' and '.join(shared)} hold only for these speeds: {open_terms[0]}"
        reason = joint.reason if joint.verdict == "weak" else f"{joint.reason}; {reason}"
        result = replace(joint, parameters=parameters | shared, reason=reason)
    if joint.verdict == "no friction" and (joint.residual_rms or 0.0) > max(2 * noise, 0.5 * terms.mean_load):
        unit = joint.torque_unit or "N m"
        sizes = f"residual torque {joint.residual_rms:.2g} {unit} and mean load {terms.mean_load:.2g} {unit}"
        cause = "check for noise, a dead sensor, a wrong sign or a wrong model"
        result = replace(result, verdict="weak", **Reason(f"{sizes} are similar", remedy=cause).fields)
    kept = (term for term in LADDER if terms.verdicts[term.name].kept)
    settings: dict[str, Any] = {name: terms.settings[name] for term in kept for name in term.settings}
    return replace(
        result,
        terms=terms.verdicts,
        mean_load=terms.mean_load,
        load_deviation=terms.load_deviation,
        mean_direction=terms.mean_direction,
        mean_temperature=terms.mean_temperature,
        **settings,
    )

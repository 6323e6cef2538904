"""Stepwise selection of a joint's terms by held-out scores (docs/estimator.md, equation 22).

Cross-validation: Stone 1974; stepwise: Efroymson 1960.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from stribeck.friction.terms import LADDER, Term
from stribeck.identification.whole_log.constants import LEAST_GAIN, ROUNDS
from stribeck.result import JointResult, TermDecision, TermVerdict
from stribeck.typing import Array

SHARED = ("viscous", "coulomb")
"""Parameters that a term which is open would change."""

Kept = frozenset[str]
Objection = tuple[TermDecision, str]
"""What a term is instead of kept, and why."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A joint with some terms: chi^2 of each held-out fold, shape (F,), and an objection, if any."""

    scores: Array
    objection: Objection | None = None


def select_stepwise(try_terms: Callable[[Kept], Candidate], refused: Mapping[str, str]) -> dict[str, TermVerdict]:
    """Return the verdict on each term of the ladder.

    A term is kept if held-out chi^2 falls by more than the standard error of that over the folds, and by more than
    `LEAST_GAIN`. Terms are tried from the simplest up, then each kept term has to show that the others cannot do
    without it, until nothing changes.

    Parameters
    ----------
    try_terms
        Fits a joint with some terms, by name, to the training folds, and scores it on the held-out one.
    refused
        Terms that are out of the question, and why.
    """
    tried = cache(try_terms)
    kept: Kept = frozenset()
    for _ in range(ROUNDS):
        before = kept
        for term in LADDER:
            if _verdict(term, kept, tried, refused).kept:
                kept |= {term.name}
        for term in LADDER:
            if not _verdict(term, kept, tried, refused).kept:
                kept -= {term.name}
        if kept == before:
            break
    verdicts = {term.name: _verdict(term, kept, tried, refused) for term in LADDER}
    for name, verdict in verdicts.items():
        if verdict.kept and name not in kept:  # two terms that took each other's place to the end
            verdicts[name] = replace(verdict, verdict="refused", reason=f"{verdict.reason}, as other terms make it")
    return verdicts


def _verdict(term: Term, kept: Kept, tried: Callable[[Kept], Candidate], refused: Mapping[str, str]) -> TermVerdict:
    """Return whether a joint with these other terms should have this one."""
    others = kept - {term.name}
    if term.name in refused:
        return TermVerdict(verdict="refused", reason=refused[term.name])
    if term.needs and term.needs not in others:
        return TermVerdict(verdict="refused", reason=meaningless(term))
    if term.part_of and term.part_of in others:
        return TermVerdict(verdict="refused", reason=f"the term {term.part_of} has it")
    parts = others | {part.name for part in LADDER if part.part_of == term.name}
    without = min((tried(others), tried(parts)), key=lambda candidate: candidate.scores.sum())
    with_it = tried(others | {term.name})
    gain, error = held_out_gain(without.scores, with_it.scores)
    verdict: TermDecision = "kept" if gain > max(error, LEAST_GAIN) else "refused"
    reason = _in_words(gain, error)
    if verdict == "kept" and with_it.objection:
        verdict, why = with_it.objection
        reason = f"{reason}, but {why}"
    return TermVerdict(verdict=verdict, reason=reason, gain=gain, gain_error=error)


def meaningless(term: Term) -> str:
    """Return why a term is refused whose `needs` is."""
    return f"it means nothing without the term {term.needs}"


def _in_words(gain: float, error: float) -> str:
    """Return a sentence on how a term changes the held-out chi^2."""
    if abs(gain) < 0.05:
        return "held-out chi^2 stays as it is"
    digits = 0 if abs(gain) >= 10 else 1
    return f"held-out chi^2 {'falls' if gain > 0 else 'rises'} by {abs(gain):.{digits}f} ± {error:.{digits}f}"


def held_out_gain(without: Array, with_it: Array) -> tuple[float, float]:
    """Return by how much chi^2 falls over all folds, and the standard error of that."""
    falls = without - with_it
    return float(falls.sum()), float(np.std(falls, ddof=1) * np.sqrt(len(falls)))


def with_terms(joint: JointResult, terms: dict[str, TermVerdict], mean_load: float) -> JointResult:
    """Return a joint's result with its terms; where one is open, Coulomb and viscous friction are weak.

    They are then friction at the speeds of this log, which another law would share out otherwise; its verdict is that
    of the curve, which is the same.
    """
    parameters, found = joint.parameters, joint
    open_terms = [verdict.reason for verdict in terms.values() if verdict.verdict == "open"]
    shared = {name: replace(parameters[name], verdict="weak") for name in SHARED if name in parameters and open_terms}
    if shared:
        reason = f"{' and '.join(shared)} hold for these speeds alone: {open_terms[0]}"
        reason = joint.reason if joint.verdict == "weak" else f"{joint.reason}; {reason}"
        found = replace(joint, parameters=parameters | shared, reason=reason)
    return replace(found, terms=terms, mean_load=mean_load)

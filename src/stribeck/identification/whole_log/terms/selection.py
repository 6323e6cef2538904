"""Which terms a joint's friction has: chosen by held-out scores, from the simplest up."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from stribeck.friction.terms import LADDER, Term
from stribeck.result import JointResult, TermDecision, TermVerdict
from stribeck.typing import Array

LEAST = 9.0
"""By how much a term must lower the held-out chi^2 [1]: what a value of three standard errors does."""

ROUNDS = 3
"""How often the ladder is climbed [1]: what a later term explains better, an earlier one gives up."""

SHARED = ("viscous", "coulomb")
"""Parameters that a term which is open would change."""

Kept = frozenset[str]
Objection = tuple[TermDecision, str]
"""What a term is instead of kept, and why."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A joint with some terms: chi^2 on each fold that was held out, shape (K,), and what speaks against them."""

    scores: Array
    objection: Objection | None = None


def climb(try_terms: Callable[[Kept], Candidate], refused: Mapping[str, str]) -> dict[str, TermVerdict]:
    """Return what is said of each term of the ladder, those that are kept and those that are refused.

    A term is kept if held-out chi^2 falls by more than the standard error of that over the folds, and by more than
    `LEAST`. Terms are tried from the simplest up, and once all have had their turn, those that are kept have to show
    that the others cannot do without them.

    Parameters
    ----------
    try_terms
        Fits a joint with some terms, by name, to each training part, and scores it on what was held out.
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
    verdict: TermDecision = "kept" if gain > max(error, LEAST) else "refused"
    reason = _in_words(gain, error)
    if verdict == "kept" and with_it.objection:
        verdict, why = with_it.objection
        reason = f"{reason}, but {why}"
    return TermVerdict(verdict=verdict, reason=reason, gain=gain, gain_error=error)


def meaningless(term: Term) -> str:
    """Return why a term is refused whose `needs` is."""
    return f"it means nothing without the term {term.needs}"


def _in_words(gain: float, error: float) -> str:
    """Return a sentence on what a term does to the held-out chi^2."""
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

    They are then friction at the speeds of this log, which another law would share out otherwise.
    """
    parameters, found = joint.parameters, joint
    open_terms = [verdict.reason for verdict in terms.values() if verdict.verdict == "open"]
    if open_terms:
        shared = {name: replace(parameters[name], verdict="weak") for name in SHARED if name in parameters}
        reason = f"{' and '.join(shared)} hold for these speeds alone: {open_terms[0]}"
        reason = joint.reason if joint.verdict == "weak" else reason
        found = replace(joint, parameters=parameters | shared, verdict="weak", reason=reason)
    return replace(found, terms=terms, mean_load=mean_load)

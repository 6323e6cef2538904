"""Selection of every joint's friction terms on held-out folds (docs/estimator-fit.md, equation 22)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.equations.constants import LEAST_GAIN, ROUNDS
from stribeck.core.estimator.solver.elimination import solve
from stribeck.core.estimator.solver.empirical_bayes import learn_group_prior
from stribeck.core.estimator.solver.fit import Fit
from stribeck.core.estimator.solver.statistics import Statistics
from stribeck.core.estimator.terms.selection import Candidate, Kept, Objection, select_stepwise
from stribeck.core.estimator.terms.trials import PARAMETERS, Trials, Tried
from stribeck.core.friction.terms import BASE, LADDER
from stribeck.core.judgement.weakness import CLEARED, RISING
from stribeck.core.result import TermVerdict

Refused = Sequence[dict[str, str]]
"""Excluded terms of each joint, with the reason."""

Verdicts = Sequence[dict[str, TermVerdict]]
"""Verdicts of each joint, by term."""


@dataclass(frozen=True, eq=False)
class Choice:
    """Verdicts on the terms of each joint, their trials, and a start for the fit."""

    verdicts: Verdicts
    trials: Trials
    start: Fit

    @property
    def kept(self) -> list[Kept]:
        """Terms of each joint."""
        return [frozenset(name for name, said in verdicts.items() if said.kept) for verdicts in self.verdicts]

    @property
    def decided(self) -> list[frozenset[str]]:
        """Parameters of each joint's terms that have a held-out score."""
        tried = [[name for name, said in verdicts.items() if said.gain is not None] for verdicts in self.verdicts]
        return [frozenset(parameter for name in names for parameter in PARAMETERS[name]) for names in tried]


def select_terms(
    trials: Trials, whole: Statistics, fit: Fit, refused: Refused, effects: Callable[[Fit], Array]
) -> Choice:
    """Select each joint's terms by held-out scores, except terms that a random effect explains as well.

    Parameters
    ----------
    trials, whole
        Trials of all terms, and the statistics of the log.
    fit
        Fit with all terms, which the other joints keep during the trials of a joint.
    refused
        Excluded terms of each joint, with the reason.
    effects
        Function that computes the covariance of a fit due to random effects, shape (m, m).
    """
    least, folds = 4, trials.held_right.shape[1]  # fewer folds do not show how much their scores differ
    if folds < least:
        few = f"{folds} parts of the log can be held out; at least {least} are needed"
        said = {term: TermVerdict(verdict="kept" if term in BASE else "refused", reason=few) for term in PARAMETERS}
        return _chosen([said for _ in refused], trials, fit)
    joints = range(len(refused))
    verdicts = [_select(trials, joint, refused[joint], BASE) for joint in joints]
    refit = solve(whole, _chosen(verdicts, trials, fit).start)
    usual = _shared_by_most(verdicts, refit)
    if usual:
        trials = replace(trials, laws=replace(trials.laws, group_prior=learn_group_prior(refit).group_prior))
        for joint, by_term in enumerate(verdicts):
            if any(not by_term[name].kept for name in usual - refused[joint].keys()):
                verdicts[joint] = _select(trials, joint, refused[joint], BASE | usual)
    for _ in range(ROUNDS):
        choice = _chosen(verdicts, trials, fit)
        refit = solve(whole, choice.start)
        if not any(dropped := unproven(choice, refit, refit.covariance + effects(refit), BASE | usual)):
            break
        refused = [
            dict(out) | {name: said.reason for name, said in drops.items()}
            for out, drops in zip(refused, dropped, strict=True)
        ]
        for joint in (joint for joint in joints if dropped[joint]):  # a refusal may make another term acceptable
            verdicts[joint] = _select(trials, joint, refused[joint], BASE | usual) | dropped[joint]
    return _chosen(verdicts, trials, fit)


def _select(trials: Trials, joint: int, refused: dict[str, str], usual: Kept) -> dict[str, TermVerdict]:
    def candidate(kept: Kept) -> Candidate:
        tried = trials.try_terms(joint, kept)
        return Candidate(tried.scores, _objection(trials, joint, kept, tried))

    return select_stepwise(candidate, refused, usual)


def _objection(trials: Trials, joint: int, kept: Kept, tried: Tried) -> Objection | None:
    """Find an objection to the shape of the curve: the log does not cover it, or it is implausible."""
    values = dict(zip(trials.names, trials.laws.external(tried.internal[None])[0].tolist(), strict=True))
    top, rise = float(trials.laws.top_speed[joint]), RISING / values["slope"]
    stribeck_velocity = values["stribeck_velocity"]
    if doubt := next((doubt for term in LADDER if (doubt := term.doubt(values, kept))), ""):
        return "refused", doubt
    if "stribeck" in kept and rise > CLEARED * stribeck_velocity:
        gone = f"its Stribeck effect would be gone at {CLEARED * stribeck_velocity:.2g} rad/s"
        return "refused", f"{gone}, where it still rises, up to {rise:.2g} rad/s"
    for term, speed, what in (
        ("stribeck", stribeck_velocity, "the Stribeck velocity"),
        ("rounding", rise, "what it rises up to"),
    ):
        if term in kept and top < CLEARED * speed:
            return "open", f"its top speed, {top:.2g} rad/s, is not {CLEARED:.0f} times {what}, {speed:.2g} rad/s"
    return None


def _shared_by_most(verdicts: Verdicts, fit: Fit) -> Kept:
    """Find terms that most joints with Coulomb friction have and whose parameters have a group prior.

    If the log cannot decide on such a term, the joint follows the other joints, as its parameters do.
    """
    column = [parameter.name for parameter in fit.laws.parameters].index("coulomb")
    has_friction = fit.internal[:, column] ** 2 > LEAST_GAIN * fit.variance[:, column]
    with_friction = [by_term for by_term, has in zip(verdicts, has_friction, strict=True) if has]
    counts = {name: sum(by_term[name].kept for by_term in with_friction) for name in ("rounding", "stribeck")}
    return frozenset(name for name, count in counts.items() if count > len(with_friction) / 2)


def unproven(choice: Choice, fit: Fit, covariance: Array, usual: Kept = BASE) -> list[dict[str, TermVerdict]]:
    """Find the terms of each joint that are refused because random effects of the gait phase may explain them.

    Random effects recur in held-out steps, therefore a term that explains them also has a good score. Its gain is
    multiplied by the ratio of its variance in the fit to its variance in `covariance`, which includes random effects.
    """
    names = choice.trials.names
    share = fit.variance / replace(fit, covariance=covariance).variance
    low = np.broadcast_to(fit.laws.bounds[0], fit.internal.shape)
    dropped: list[dict[str, TermVerdict]] = []
    for joint, by_term in enumerate(choice.verdicts):
        dropped.append({})
        for name, said in by_term.items():
            if not said.kept:
                continue
            first = names.index(PARAMETERS[name][0])
            worth = (said.gain or 0.0) * float(share[joint, first])
            if worth < LEAST_GAIN and name not in usual:
                why = f"{said.reason}, of which all but {worth:.1f} may be errors that every step repeats"
            elif fit.internal[joint, first] <= low[joint, first]:
                none = "in the log as a whole it is none"
                why = none if name in BASE else f"{said.reason}, but {none}"
            else:
                continue
            dropped[-1][name] = replace(said, verdict="refused", reason=why)
    return dropped


def _chosen(verdicts: Verdicts, trials: Trials, fit: Fit) -> Choice:
    """Apply these verdicts; fits start from each joint's values, and from neutral values of absent terms."""
    choice = Choice(verdicts, trials, fit)
    free = np.stack([trials.having(terms) for terms in choice.kept])
    laws = fit.laws.only(free)
    internal = np.stack([trials.try_terms(joint, terms).internal for joint, terms in enumerate(choice.kept)])
    return replace(choice, start=replace(fit, laws=laws, internal=np.clip(internal, *laws.bounds)))

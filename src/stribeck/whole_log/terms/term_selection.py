"""Selects the terms of every joint's friction on held-out folds (docs/estimator.md, equation 22)."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from stribeck.base.typing import Array
from stribeck.friction.terms import BASE, LADDER
from stribeck.judgement.weakness import CLEARED, RISING
from stribeck.result import TermVerdict
from stribeck.whole_log.constants import BEST_STARTS, FEWEST_FOLDS, LARGEST_ASYMMETRY, LEAST_GAIN, ROUNDS
from stribeck.whole_log.model.friction_curves import neutral_value
from stribeck.whole_log.model.model_corrections import ModelCorrections
from stribeck.whole_log.model.varying_curves import VaryingCurves
from stribeck.whole_log.solver.empirical_bayes import learn_group_prior
from stribeck.whole_log.solver.joint_descent import descend_joints
from stribeck.whole_log.solver.normal_equations import NormalEquations
from stribeck.whole_log.solver.solve import Solution, solve
from stribeck.whole_log.terms.profile_likelihood import JointFold, Quadratic, joint_folds
from stribeck.whole_log.terms.selection import Candidate, Kept, Objection, select_stepwise
from stribeck.whole_log.uncertainty.reml import random_effect_covariance

PARAMETERS = {term.name: term.parameters for term in LADDER}
"""Term -> its parameters, first the one that is zero without the term."""

SHARED_TERMS = ("rounding", "stribeck")
"""Terms whose parameters have a group prior."""


@dataclass(frozen=True, eq=False)
class Choice:
    """Verdicts on the terms of each joint, the curves with those that are kept, and a fit to begin with."""

    verdicts: tuple[dict[str, TermVerdict], ...]
    curves: VaryingCurves
    start: Solution


def select_terms(
    total: NormalEquations,
    folds: list[NormalEquations],
    sampled: NormalEquations,
    curves: VaryingCurves,
    model: ModelCorrections,
    solution: Solution,
    root_turns: Array,
    refused: Sequence[dict[str, str]],
) -> Choice:
    """Return the terms of each joint that held-out scores select and that no random effect explains as well.

    Parameters
    ----------
    total, folds, sampled
        The log, its folds, and a sample of it with random effects.
    curves, model, solution
        A fit with all terms, which all else has while a joint is tried.
    root_turns
        Standard deviations of the root's angular acceleration [rad/s^2], shape (3,) or (0,).
    refused
        Of each joint, terms that are out of the question, and why.
    """
    scale = max(1.0, solution.chi_square / max(total.count - solution.internal.size, 1))
    by_joint = joint_folds(total, folds, curves, model, solution)
    trials = [JointTrial(curves.of([k]), own[0].training, tuple(own[1:]), scale) for k, own in enumerate(by_joint)]
    tries = [cache(trial.candidate) for trial in trials]
    if len(folds) < FEWEST_FOLDS:
        few = f"{len(folds)} parts of the log can be held out; at least {FEWEST_FOLDS} are needed"
        said = {term: TermVerdict(verdict="kept" if term in BASE else "refused", reason=few) for term in PARAMETERS}
        verdicts = [said for _ in trials]
    else:
        verdicts = [select_stepwise(tried, own) for tried, own in zip(tries, refused, strict=True)]
    choice = _chosen(verdicts, curves, trials, solution)
    found = solve(total, choice.curves, model, choice.start)
    if usual := _shared_by_most(choice, found):
        group_prior = learn_group_prior(choice.curves, found).group_prior
        for joint, own in enumerate(verdicts):
            if any(not own[name].kept for name in usual - refused[joint].keys()):
                trial = replace(trials[joint], curves=replace(trials[joint].curves, group_prior=group_prior))
                trials[joint], tries[joint] = trial, cache(trial.candidate)
                verdicts[joint] = select_stepwise(tries[joint], refused[joint], BASE | usual)
    for _ in range(ROUNDS):
        choice = _chosen(verdicts, curves, trials, solution)
        found = solve(total, choice.curves, model, choice.start)
        _, effect_covariance = random_effect_covariance(sampled, total.count, choice.curves, model, found, root_turns)
        if not any(dropped := unproven(choice, found, found.covariance + effect_covariance, BASE | usual)):
            break
        for joint, own in enumerate(dropped):
            if own:  # what the joint is refused now may let another term in
                out = dict(refused[joint]) | {name: verdict.reason for name, verdict in own.items()}
                verdicts[joint] = select_stepwise(tries[joint], out, BASE | usual) | own
                refused = [*refused[:joint], out, *refused[joint + 1 :]]
    return _chosen(verdicts, curves, trials, solution)


def _shared_by_most(choice: Choice, solution: Solution) -> Kept:
    """Return the terms that most joints with Coulomb friction have and whose parameters have a group prior.

    A joint that shows too little of such a term to decide is then taken to be like the others, as its parameters are.
    """
    column = [parameter.name for parameter in choice.curves.parameters].index("coulomb")
    has_friction = solution.internal[:, column] ** 2 > LEAST_GAIN * solution.variance[:, column]
    with_friction = [own for own, has in zip(choice.verdicts, has_friction, strict=True) if has]
    counts = {name: sum(own[name].kept for own in with_friction) for name in SHARED_TERMS}
    return frozenset(name for name, count in counts.items() if count > len(with_friction) / 2)


def unproven(choice: Choice, solution: Solution, covariance: Array, usual: Kept = BASE) -> list[dict[str, TermVerdict]]:
    """Return by joint the terms that are refused after all: random effects of the gait phase may explain them.

    Random effects recur in held-out steps, and a term that explains them scores well there too. So its gain counts only
    by the ratio of its variance in the solution to that in `covariance`, which contains random effects.
    """
    curves, names = choice.curves, [parameter.name for parameter in choice.curves.parameters]
    share = solution.variance / replace(solution, covariance=covariance).variance
    low = np.broadcast_to(curves.bounds[0], solution.internal.shape)
    dropped: list[dict[str, TermVerdict]] = []
    for joint, own in enumerate(choice.verdicts):
        dropped.append({})
        for name, said in own.items():
            first = names.index(PARAMETERS[name][0]) if said.kept else 0
            worth = (said.gain or 0.0) * float(share[joint, first])
            if not said.kept:
                continue
            if worth < LEAST_GAIN and name not in usual:
                why = f"{said.reason}, of which all but {worth:.1f} may be errors that every step repeats"
            elif solution.internal[joint, first] <= low[joint, first]:
                none = "in the log as a whole it is none"
                why = none if name in BASE else f"{said.reason}, but {none}"
            else:
                continue
            dropped[-1][name] = replace(said, verdict="refused", reason=why)
    return dropped


def _chosen(
    verdicts: Sequence[dict[str, TermVerdict]], curves: VaryingCurves, trials: Sequence[JointTrial], solution: Solution
) -> Choice:
    """Return the choice of these verdicts; fits start from each joint's own, and neutral values of what it lacks."""
    kept = [frozenset(name for name, verdict in own.items() if verdict.kept) for own in verdicts]
    start = np.concatenate([trial.fit(own) for trial, own in zip(trials, kept, strict=True)])
    free = np.stack([curves.with_terms(own) for own in kept])
    return Choice(
        tuple(verdicts), curves.only(free), replace(solution, x=np.concatenate([start.ravel(), solution.corrections]))
    )


@dataclass(frozen=True, eq=False)
class JointTrial:
    """One joint that is fitted with different terms.

    Attributes
    ----------
    curves
        With all terms.
    whole, folds
        Profile likelihoods of the whole log, and of the training and the held-out folds.
    scale
        Overdispersion [1].
    """

    curves: VaryingCurves
    whole: Quadratic
    folds: tuple[JointFold, ...]
    scale: float

    def fit(self, kept: Kept) -> Array:
        """Return the best fit of these terms to the whole log, of several starts, shape (1, p)."""
        curves = self.curves.only(self.curves.with_terms(kept)[None])
        starts = [
            curves.linear_start([shape], self.whole.information, self.whole.right_hand_side)
            for shape in self._shapes(kept)
        ]
        starts.sort(key=lambda start: self.whole.at(curves.coefficients(start)))
        best = starts[:BEST_STARTS]
        ends, costs = descend_joints([self.whole] * len(best), curves.of([0] * len(best)), np.concatenate(best))
        return ends[[np.argmin(costs)]]

    def candidate(self, kept: Kept) -> Candidate:
        """Return the held-out scores of these terms."""
        whole = self.fit(kept)
        curves = self.curves.only(self.curves.with_terms(kept)[None])
        same = [0] * len(self.folds)
        ends, _ = descend_joints([fold.training for fold in self.folds], curves.of(same), whole[same])
        scores = [fold.held_out.at(curves.coefficients(end[None])) for fold, end in zip(self.folds, ends, strict=True)]
        return Candidate(np.array(scores) / self.scale, self._objection(kept, whole))

    def _shapes(self, kept: Kept) -> Iterator[dict[str, float]]:
        """Yield sets of nonlinear parameters to start from."""
        top = float(self.curves.top_speed[0])
        nonlinear = [parameter for parameter in self.curves.law.parameters if parameter.starts]
        has = dict(zip((p.name for p in self.curves.parameters), self.curves.with_terms(kept), strict=True))
        tried = [
            [start * top**p.start_speed_power for start in p.starts] if has[p.name] else [neutral_value(p)]
            for p in nonlinear
        ]
        for point in itertools.product(*tried):
            yield dict(zip((parameter.name for parameter in nonlinear), point, strict=True))

    def _objection(self, kept: Kept, internal: Array) -> Objection | None:
        """Return an objection to the shape of the curve: the log does not reach all of it, or it makes no sense."""
        names = [parameter.name for parameter in self.curves.parameters]
        values = dict(zip(names, self.curves.external(internal)[0].tolist(), strict=True))
        top, rise = float(self.curves.top_speed[0]), RISING / values["slope"]
        stribeck_velocity = values["stribeck_velocity"]
        if "stribeck" in kept and rise > CLEARED * stribeck_velocity:
            gone = f"its Stribeck effect would be gone at {CLEARED * stribeck_velocity:.2g} rad/s"
            return "refused", f"{gone}, where it still rises, up to {rise:.2g} rad/s"
        for name in ("viscous", "coulomb"):
            if values[name] < abs(values.get(f"{name}_drift", 0.0)) / 2:
                return "refused", f"{name} friction would be negative at the beginning of the log or at its end"
        if "asymmetry" in kept and abs(values["viscous_asymmetry"]) > LARGEST_ASYMMETRY:
            return "refused", f"viscous friction of one direction would be {abs(values['viscous_asymmetry']):.0%} more"
        for term, speed, what in (
            ("stribeck", stribeck_velocity, "the Stribeck velocity"),
            ("rounding", rise, "what it rises up to"),
        ):
            if term in kept and top < CLEARED * speed:
                return "open", f"its top speed, {top:.2g} rad/s, is not {CLEARED:.0f} times {what}, {speed:.2g} rad/s"
        return None

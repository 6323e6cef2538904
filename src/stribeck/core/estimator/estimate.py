"""The spine of the whole-log fit: pilot, accumulation, fits of the laws, terms, empirical Bayes, covariance.

The steps follow docs/estimator.md in the same order.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from stribeck.core.base.typing import Array
from stribeck.core.equations.whole_log.equation_sequence import EquationSequence
from stribeck.core.estimator.fit_checks.misfits import Misfit, find_misfits
from stribeck.core.estimator.fit_checks.validation import friction_residual_rms
from stribeck.core.estimator.model.unexplained import unsupported
from stribeck.core.estimator.reading import Reading, read_with_pilot
from stribeck.core.estimator.solver.empirical_bayes import group_mean_covariance, solve_with_empirical_bayes
from stribeck.core.estimator.solver.fit import Fit
from stribeck.core.estimator.terms.term_selection import Choice, select_terms
from stribeck.core.estimator.terms.trials import make_trials
from stribeck.core.estimator.uncertainty.covariance_budget import CovarianceBudget, covariance_budget
from stribeck.core.estimator.uncertainty.heterogeneity import solve_overdispersed
from stribeck.core.estimator.uncertainty.law_misfit import law_misfits
from stribeck.core.estimator.uncertainty.reml import random_effect_covariance
from stribeck.core.friction import AUTO, FrictionLaw
from stribeck.core.result import TermVerdict
from stribeck.core.robot import Robot
from stribeck.core.robot.inertial_parameters import SIZE
from stribeck.core.settings import Priors


@dataclass(frozen=True, eq=False, kw_only=True)
class WholeLogFit:
    """The fit to whole logs.

    Attributes
    ----------
    read
        The logs as they were read.
    fit, trained
        Fit of all laws and corrections to all segments, and the same without the held-out segments.
    budget
        Parts of the fit's covariance.
    law_misfits
        Standard error of each joint's resisting torque at three speeds due to its law, shape (n, 3) [N m].
    residual_rms
        Root mean square residual of each joint's friction torque in the segments of the pilot [N m], shape (n,).
    delay
        Delay of the torques [s].
    terms
        Terms of each joint with the law "auto".
    misfits
        Effects that the law of each joint does not describe.
    heterogeneity
        D of equation (26) for the model [1].
    """

    read: Reading
    fit: Fit
    trained: Fit
    budget: CovarianceBudget
    law_misfits: Array
    residual_rms: Array
    delay: float
    terms: tuple[dict[str, TermVerdict], ...]
    misfits: tuple[tuple[Misfit, ...], ...]
    heterogeneity: float

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, then of the couplings."""
        return self.read.equations.forms[0].names

    @property
    def robot(self) -> Robot:
        """Robot without the corrections."""
        return self.read.equations.forms[0].robot

    @property
    def corrections(self) -> Array:
        """Corrections in the order of `Layout`, shape (c,)."""
        return self.fit.model.values(self.fit.corrections)

    @property
    def bodies(self) -> Array:
        """Coordinates of the bodies' corrections, shape (L, 10)."""
        return self.fit.corrections[self.fit.model.layout.part("bodies")].reshape(-1, SIZE)

    @property
    def chi_square(self) -> float:
        """Chi^2 per degree of freedom [1]: one if the errors match their covariance."""
        return self.fit.chi_square / max(self.read.whole.count - int(self.fit.laws.free.sum()), 1)


def fit_whole_log(
    equations: EquationSequence,
    law: FrictionLaw,
    rest: Array,
    priors: Priors,
    progress: Callable[[float], None],
) -> WholeLogFit:
    """Fit a law to all joints at once, and the model's corrections with it.

    Parameters
    ----------
    equations
        Equations of all segments; computed on access, so that they are never all in memory.
    law
        Friction law.
    rest
        Speed [rad/s] below which a joint is at rest, for laws that jump there, shape (n,).
    priors
        Priors of friction, model and sensors.
    progress
        Callback `progress(fraction)`.
    """
    read = read_with_pilot(equations, law, rest * law.jumps, priors, progress)
    known, whole, root_turns = read.known, read.whole, read.pilot.components.root[3:]

    def effects(fit: Fit) -> Array:
        return random_effect_covariance(read.sample, known.count, fit, root_turns)[1]

    progress(0.8)
    trials = make_trials(known, read.folds, read.fit)
    if law.name == AUTO:
        refused = unsupported(read.pilot.parts, read.terms, known.mean_load, known.load_deviation)
        choice = select_terms(trials, known, read.fit, refused, effects)
    else:
        choice = Choice([{} for _ in rest], trials, read.fit)
    progress(0.9)
    trained, before, differing = solve_overdispersed(known, read.folds, choice.start)
    fit = solve_with_empirical_bayes(whole, trained) if read.unseen else trained
    (residual_rms,) = friction_residual_rms(read, read.pilot.parts, fit.values, fit.values[None, : whole.friction])
    effect_std, effect_covariance = random_effect_covariance(read.sample, whole.count, fit, root_turns, residual_rms)
    budget = covariance_budget(
        fit, effect_covariance, group_mean_covariance(fit), differing, known.count / max(whole.count, 1)
    )
    wider = replace(fit, covariance=budget.total - budget.heterogeneity)
    remaining_delay = fit.model.values(fit.corrections)[fit.model.layout.part("torque_delay")]
    of_known = fit.covariance * (whole.count / known.count)  # without the held-out segments
    return WholeLogFit(
        read=read,
        fit=replace(fit, covariance=budget.total),
        trained=trained,
        budget=budget,
        law_misfits=law_misfits(fit, choice.trials, budget.total),
        residual_rms=residual_rms,
        delay=read.pilot.delay + float(remaining_delay.sum()),
        terms=tuple(choice.verdicts) if law.name == AUTO else (),
        misfits=find_misfits(choice, wider, of_known, read, effect_std, before.model),
        heterogeneity=before.model,
    )

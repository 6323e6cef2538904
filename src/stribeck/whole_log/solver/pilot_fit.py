"""The pilot fit, to some segments of a log: variance components, and a start for the fit of all.

Two-stage generalised least squares (docs/estimator.md, "Pilot fit and variance components").
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.friction import FrictionLaw
from stribeck.settings import Priors
from stribeck.whole_log.constants import MOST_ROUNDS, PILOT_SEGMENTS, ROUNDS, STILL_GROWING
from stribeck.whole_log.model.basis import make_basis
from stribeck.whole_log.model.covariates import WithCovariates, unsupported, with_covariates
from stribeck.whole_log.model.friction_curves import Curves
from stribeck.whole_log.model.layout import layout_of
from stribeck.whole_log.model.model_corrections import ModelCorrections, model_corrections
from stribeck.whole_log.model.parametrisation import Parametrisation
from stribeck.whole_log.model.varying_curves import rising, varying_curves
from stribeck.whole_log.noise.outliers import Prediction, far_from_most
from stribeck.whole_log.noise.update import update_components
from stribeck.whole_log.noise.variance_components import VarianceComponents, first_components
from stribeck.whole_log.solver.accumulation import accumulate
from stribeck.whole_log.solver.normal_equations import design
from stribeck.whole_log.solver.solve import Solution, solve
from stribeck.whole_log.weak_equations import CorrectionLayout, WeakEquations


@dataclass(frozen=True, eq=False)
class PilotFit:
    """Coordinates of friction and of the model's corrections, variance components, and the solution."""

    curves: Curves
    model: ModelCorrections
    components: VarianceComponents
    solution: Solution

    @property
    def known(self) -> tuple[Array, Array]:
        """Coefficients of the curves [N m], shape (n r,), and corrections, shape (c,), of the solution."""
        return _known(self.curves, self.model, self.solution)

    @property
    def unreduced(self) -> PilotFit:
        """The same with all coefficients of the curves."""
        basis = replace(self.curves.basis, reduced=None)
        return replace(self, curves=replace(self.curves, basis=basis))

    @property
    def prediction(self) -> Prediction:
        """What it says of other segments."""
        parameters = Parametrisation(self.curves, self.model)
        return Prediction(parameters, self.solution.x, self.solution.covariance, self.components)


def pilot_places(supports: Sequence[tuple[str, ...]]) -> list[int]:
    """Return the places of segments of the pilot fit, given the feet that each segment stands on.

    Every contact mode has its share, one at least, spread over its own segments: errors of a standing leg show while it
    stands. Evenly spaced segments of a walk could all stand on the same foot.
    """
    found: set[int] = set()
    for support in set(supports):
        own = [place for place, feet in enumerate(supports) if feet == support]
        share = max(1, round(PILOT_SEGMENTS * len(own) / len(supports)))
        found.update(own[k] for k in np.linspace(0, len(own) - 1, share).astype(int))
    return sorted(found)


def fit_pilot(
    some: list[WeakEquations],
    corrections: CorrectionLayout,
    law: FrictionLaw,
    top_speed: Array,
    rest: Array,
    priors: Priors,
    differ: NDArray[np.bool_] | None,
) -> tuple[PilotFit, list[WeakEquations]]:
    """Return the pilot fit to some segments, and these without outliers; parameters are those of `fit_whole_log`."""
    torque = max(float(np.sqrt(np.mean(np.concatenate([_torques(part) for part in some]) ** 2))), 1e-9)
    model = model_corrections(corrections, _loads(some, corrections), priors, torque)
    model = model.with_log_offsets(np.zeros(corrections.log_offsets[1], dtype=bool) if differ is None else differ)
    speed = np.maximum(top_speed, 1e-9)
    curves = Curves(law, make_basis(law, speed), speed, np.full(len(speed), torque), priors)
    others = np.array([parameter.name != "offset" for parameter in law.parameters])
    curves = curves.only(others | (np.arange(len(speed)) < some[0].joints)[:, None])  # of couplings, joints have it
    jumps = np.full(len(speed), float(law.jumps))
    components = first_components(some[0], rest * jumps, torque * jumps, corrections.wrenches > 0)
    return _alternate(some, curves, model, components)


def with_all_terms(
    equations: Sequence[WeakEquations], some: list[WeakEquations], pilot: PilotFit, per_turn: Array, travel: Array
) -> tuple[WithCovariates, PilotFit, list[WeakEquations]]:
    """Return equations with covariates, the pilot fit with all terms, and its segments without outliers.

    Where the load is the measured torque less friction, that is first of a law of velocity alone, then of all terms.
    The variance components stay those of the law of velocity alone: with all terms, these few segments would be fitted
    too well, and the log would then differ from the fit by more than its errors. `per_turn` are the periods of each
    joint's ripple, `travel` those of their presliding [rad].
    """
    plain = pilot.curves
    joints = len(plain.top_speed)
    friction = plain.coefficients(pilot.solution.internal).reshape(joints, -1)
    first = with_covariates(equations, some, plain.basis, friction, per_turn, travel, plain.top_speed)
    out = set.intersection(*map(set, unsupported(some, first.slow, per_turn, travel)))  # of the question in all joints
    basis = rising(
        plain.basis,
        f"coulomb_{first.slow}" not in out,
        "coulomb_position" not in out,
        "ripple" not in out,
        "presliding" not in out,
    )
    first = replace(first, basis=basis)
    curves = varying_curves(plain, first.basis, first.slow)
    some = [first.of(part) for part in some]
    solution = solve(accumulate(some, pilot.components, curves, pilot.model), curves, pilot.model)
    refined = curves.coefficients(solution.internal).reshape(joints, -1)
    modulated = replace(first, refined=refined)
    return modulated, replace(pilot, curves=curves, solution=solution), [modulated.of(part) for part in some]


def _alternate(
    some: list[WeakEquations], curves: Curves, model: ModelCorrections, components: VarianceComponents
) -> tuple[PilotFit, list[WeakEquations]]:
    """Solve and estimate the variance components, in turn, until the rounds are over and none grows any more.

    If there are outliers after `ROUNDS`, it starts once more without, and looks for them anew in every round.
    """
    solution, first, outliers = None, components, False
    for number in range(1, MOST_ROUNDS + 1):
        solution = solve(accumulate(some, components, curves, model), curves, model, solution)
        residuals = list(_residuals(some, curves, model, solution))
        if number == ROUNDS or outliers:
            some = far_from_most(residuals, components)
            residuals = [(part, residual) for part, (_, residual) in zip(some, residuals, strict=True)]
        if number == ROUNDS:
            outliers = any(part.set_aside is not None for part in some)
            components = first if outliers else components
        before, components = components, update_components(components, residuals)
        grown = float(np.max(components.model / np.maximum(before.model, 1e-12)))
        if number >= (2 if outliers else 1) * ROUNDS and grown < STILL_GROWING:
            break
    assert solution is not None
    return PilotFit(curves, model, components, solution), some


def _known(curves: Curves, model: ModelCorrections, solution: Solution) -> tuple[Array, Array]:
    return curves.coefficients(solution.internal), model.values(solution.corrections)


def _torques(equations: WeakEquations) -> Array:
    """Return the left side where friction acts [N m], of all windows."""
    return equations.residual[:, len(equations.wrench_noise) :].ravel()


def _loads(some: list[WeakEquations], corrections: CorrectionLayout) -> Array:
    """Return the torque of each sensor whose gain is corrected, root mean square [N m]."""
    own = layout_of(corrections).part("gains")
    squares = [(part.regressors[:, :, own] ** 2).sum(axis=1) for part in some if part.regressors is not None]
    return np.sqrt(np.concatenate(squares).mean(axis=0)) if corrections.gains else np.zeros(0)


def _residuals(
    equations: Iterable[WeakEquations], curves: Curves, model: ModelCorrections, solution: Solution
) -> Iterator[tuple[WeakEquations, Array]]:
    """Yield equations and the residuals of a solution, shape (K m,)."""
    values = np.concatenate(_known(curves, model, solution))
    for part in equations:
        yield part, part.residual.ravel() - design(part, curves.basis) @ values

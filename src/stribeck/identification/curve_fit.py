"""Friction law parameters of every joint from its friction torque samples, (6.4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from stribeck.friction import FrictionLaw, Parameter
from stribeck.identification.covariance import block_covariance, intervals_95
from stribeck.identification.excitation import excitation
from stribeck.identification.problem import FitProblem, hold_out, joint_problem
from stribeck.identification.robust import TUNING, Loss, influence, robust_scale
from stribeck.identification.speed import top_speed
from stribeck.identification.starts import grid_starts
from stribeck.log import Array
from stribeck.samples import Samples
from stribeck.settings import Settings

SUBSET = 4000
"""Samples [1] on which starts are tried; the best one is finished on all."""

BEST_STARTS = 3
"""Grid points [1] that are followed to their minimum."""

ROUGH, FINE = 1e-6, 1e-9
"""Relative change of cost and parameters [1] that ends a descent on the subset, and the last one."""

EVALUATIONS = 100
"""Evaluations [1] after which a descent gives up; one that is well determined needs about ten."""

PRIOR_FACTOR = 100.0
"""How many times the joint's own torque or speed a parameter may be, before any sample speaks [1]."""

PRIOR_LOGARITHM = 7.0
"""The same for the logarithm of a scale [1]: a factor of a thousand."""

AT_BOUND = 0.01
"""A value closer to its bound than this many standard errors [1] sits on it."""


@dataclass(frozen=True, eq=False, kw_only=True)
class JointFit:
    """Fitted parameters of one joint.

    Attributes
    ----------
    parameters
        p parameters: the law's, then the armature if it was fitted.
    values, standard_errors
        Shape (p,).
    covariance
        Shape (p, p), block-robust.
    intervals
        95 %, within the bounds, shape (p, 2).
    degrees_of_freedom
        Of each parameter's t quantile, shape (p,).
    at_bound
        Which values sit on a bound, shape (p,).
    rms
        Root mean square of the training residual [N m].
    samples, blocks
        That the fit saw.
    starts
        Grid points tried.
    cost
        Half the sum of squared training residuals [N^2 m^2] (of the loss, if robust).
    settled
        Whether the last descent came to its end; if not, the samples hardly tell its parameters apart.
    """

    parameters: tuple[Parameter, ...]
    values: Array
    standard_errors: Array
    covariance: Array
    intervals: Array
    degrees_of_freedom: Array
    at_bound: NDArray[np.bool_]
    rms: float
    samples: int
    blocks: int
    starts: int
    cost: float
    settled: bool

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(parameter.name for parameter in self.parameters)


def fit_law(samples: Samples, law: FrictionLaw, settings: Settings) -> dict[str, JointFit]:
    """Fit a law to every joint that moves enough; every n-th block is held out.

    Whether the numbers mean anything is for `verdict.judge` to say.
    """
    fits = {}
    for column, joint in enumerate(samples.joint_names):
        problem = joint_problem(samples, joint, law, settings)
        if not excitation(problem, samples.slides(column)).reason:
            training, _ = hold_out(problem, settings.holdout)
            fits[joint] = fit_joint(training, settings.loss)
    return fits


def fit_joint(problem: FitProblem, loss: Loss = "linear") -> JointFit:
    """Fit one joint: many starts and a few descents on a subset, the best one finished on all samples.

    The problem needs samples of at least two blocks: intervals come from how blocks differ.
    """
    # decompositions of tall, narrow Jacobians are several times slower on two BLAS threads than on one
    with threadpool_limits(limits=1, user_api="blas"):
        best, bend, starts = _minimise(problem, loss)
        return _describe(problem, best, loss, bend, starts)


def _minimise(problem: FitProblem, loss: Loss) -> tuple[_Descent, float, int]:
    """Return the best minimum, the residual at which the loss bends [N m], 0 if never, and the number of starts."""
    step = -(-len(problem.velocity) // SUBSET)
    subset = problem.take(slice(None, None, step))
    starts = grid_starts(subset)
    descents = [_descend(subset, values, tolerance=ROUGH) for _, values in starts[:BEST_STARTS]]
    best = min(descents, key=lambda descent: descent.cost)
    bend = 0.0
    if loss != "linear":  # twice: outliers inflate the first scale
        for _ in range(2):
            bend = TUNING[loss] * robust_scale(subset.predict(best.values) - subset.friction_torque)
            best = _descend(subset, best.values, loss, bend, ROUGH)
    return _descend(problem, best.values, loss, bend), bend, len(starts)


@dataclass(frozen=True, eq=False)
class _Descent:
    """Where a descent ended: values, cost, the parameters that bounds hold, and whether it settled."""

    values: Array
    cost: float
    held: NDArray[np.bool_]
    settled: bool


def _descend(
    problem: FitProblem, start: Array, loss: Loss = "linear", bend: float = 0.0, tolerance: float = FINE
) -> _Descent:
    """Minimise (6.4) by SciPy's trust-region-reflective algorithm, scales by their logarithm."""
    logs = problem.logarithmic
    # residuals of order one, whatever the joint's torque: SciPy's gradient tolerance is absolute
    scale = max(float(np.sqrt(np.mean(problem.friction_torque**2))), 1e-30) * np.sqrt(len(problem.velocity))
    bounds = problem.bounds
    lower, upper = _internal(bounds[:, 0], logs), _internal(bounds[:, 1], logs)

    def residual(u: Array) -> Array:
        return np.asarray((problem.predict(_external(u, logs)) - problem.friction_torque) / scale)

    def jacobian(u: Array) -> Array:
        return np.asarray(_internal_jacobian(problem, _external(u, logs)) / scale)

    solution = least_squares(
        residual,
        np.clip(_internal(start, logs), lower, upper),
        jac=jacobian,
        bounds=(lower, upper),
        method="trf",
        x_scale="jac",
        loss=loss,
        f_scale=bend / scale if bend else 1.0,
        ftol=tolerance,
        xtol=tolerance,
        gtol=tolerance**1.5,
        max_nfev=EVALUATIONS,
    )
    held = solution.active_mask != 0
    ended = np.where(held, np.where(solution.active_mask < 0, lower, upper), solution.x)  # SciPy stops just short
    values = np.clip(_external(ended, logs), bounds[:, 0], bounds[:, 1])  # a logarithm's way there and back rounds
    return _Descent(values, float(solution.cost * scale**2), held, solution.status > 0)


def _describe(problem: FitProblem, best: _Descent, loss: Loss, bend: float, starts: int) -> JointFit:
    """Attach covariance, intervals and counts to the minimum that was found."""
    values, logs = best.values, problem.logarithmic
    residual = problem.friction_torque - problem.predict(values)
    jacobian = _internal_jacobian(problem, values)
    psi, slope = influence(residual / bend, loss) if bend else (residual, 1.0)
    score = psi * (bend or 1.0) / max(slope, 0.1)
    found = block_covariance(jacobian, score, problem.block, _prior(problem))
    deviation = np.sqrt(np.diag(found.covariance))
    to_external = np.where(logs, values, 1.0)
    bounds = problem.bounds
    intervals = intervals_95(values, deviation, found.degrees_of_freedom, logs)
    distance = np.min(np.abs(_internal(values, logs)[:, None] - _internal(bounds.T, logs).T), axis=1)
    return JointFit(
        parameters=problem.parameters,
        values=values,
        standard_errors=deviation * to_external,
        covariance=found.covariance * np.outer(to_external, to_external),
        intervals=np.clip(intervals, bounds[:, :1], bounds[:, 1:]),
        degrees_of_freedom=found.degrees_of_freedom,
        at_bound=best.held | (distance < AT_BOUND * deviation),
        rms=float(np.sqrt(np.mean(residual**2))),
        samples=len(residual),
        blocks=len(np.unique(problem.block)),
        starts=starts,
        cost=best.cost,
        settled=best.settled,
    )


def _prior(problem: FitProblem) -> Array:
    """Return the standard deviation of each parameter, or its logarithm, before any sample was seen, shape (p,)."""
    torque = float(np.sqrt(np.mean(problem.friction_torque**2))) or 1.0
    speed = top_speed(problem.velocity) or 1.0
    acceleration = 1.0
    if problem.acceleration is not None:
        acceleration = float(np.sqrt(np.mean(problem.acceleration**2))) or 1.0
    by_unit = {"N m": torque, "N m s/rad": torque / speed, "kg m^2": torque / acceleration, "rad/s": speed}
    widths = [
        PRIOR_LOGARITHM if parameter.logarithmic else PRIOR_FACTOR * by_unit.get(parameter.unit, 1.0)
        for parameter in problem.parameters
    ]
    return np.array(widths)


def _internal(values: Array, logarithmic: NDArray[np.bool_]) -> Array:
    return np.where(logarithmic, np.log(np.where(logarithmic, values, 1.0)), values)


def _external(internal: Array, logarithmic: NDArray[np.bool_]) -> Array:
    return np.where(logarithmic, np.exp(np.where(logarithmic, internal, 0.0)), internal)


def _internal_jacobian(problem: FitProblem, values: Array) -> Array:
    """Return the derivatives by the logarithms, dR/d(ln p) = p dR/dp, of the parameters that are scales."""
    return problem.jacobian(values) * np.where(problem.logarithmic, values, 1.0)

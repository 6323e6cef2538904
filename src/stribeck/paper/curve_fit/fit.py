"""Fit of a friction law to each joint's friction torque (Equation 6.4 of the term paper)."""

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from scipy.optimize import least_squares, lsq_linear

from stribeck.core.base.threads import one_blas_thread
from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.friction import FrictionLaw
from stribeck.core.judgement.curve_fit.problem import FitProblem, joint_problem, to_external, to_internal
from stribeck.core.judgement.joint_fit import PRIOR_FACTOR, JointFit, intervals_95, near_bound, parameter_units
from stribeck.core.judgement.speed import robust_scale, top_speed
from stribeck.core.result import Validation
from stribeck.core.result.samples import FrictionSamples
from stribeck.core.settings import Settings
from stribeck.paper.curve_fit.covariance import block_covariance
from stribeck.paper.curve_fit.prediction import filtered_basis, internal_jacobian, logarithmic, predict
from stribeck.paper.curve_fit.robust import TUNING, Loss, influence


@dataclass(frozen=True, eq=False)
class Descent:
    """End of a descent: values, cost, the parameters at a bound, and whether it converged."""

    values: Array
    cost: float
    at_bound: BoolArray
    converged: bool


def fit_law(samples: FrictionSamples, law: FrictionLaw, settings: Settings) -> dict[str, JointFit]:
    """Fit a law to every joint that moves enough; every n-th block is held out.

    `verdict.judge` judges the fits.
    """
    fits = {}
    for column, joint in enumerate(samples.joint_names):
        problem = joint_problem(samples, joint, law, settings)
        if not problem.excitation(samples.slides(column)).reason:
            training, _ = hold_out(problem, settings.holdout)
            fits[joint] = fit_joint(training, settings.loss)
    return fits


def fit_joint(problem: FitProblem, loss: Loss = "linear") -> JointFit:
    """Fit one joint: many starts and a few descents on a subset; the best one is refined on all samples.

    The problem needs samples of at least two blocks, because intervals are computed from differences between blocks.
    """
    # decompositions of tall Jacobians are several times slower with two BLAS threads than with one
    with one_blas_thread():
        best, loss_scale = _minimise(problem, loss)
        return describe_fit(problem, best, loss, loss_scale)


def _minimise(problem: FitProblem, loss: Loss) -> tuple[Descent, float]:
    """Find the best minimum and the scale of the loss [N m], 0 for a loss without scale."""
    step = -(-len(problem.velocity) // 4000)  # samples are sufficient to compare starts
    subset = part_of(problem, slice(None, None, step))
    starts = grid_starts(subset)
    descents = [descend(subset, values, tolerance=1e-6) for _, values in starts[:3]]
    best = min(descents, key=lambda descent: descent.cost)
    loss_scale = 0.0
    if loss != "linear":  # twice: outliers inflate the first scale
        for _ in range(2):
            loss_scale = TUNING[loss] * robust_scale(predict(subset, best.values) - subset.friction_torque)
            best = descend(subset, best.values, loss, loss_scale, 1e-6)
    return descend(problem, best.values, loss, loss_scale), loss_scale


def grid_starts(problem: FitProblem) -> list[tuple[float, Array]]:
    """Compute (sum of squared residuals, values (p,)) of every grid point, best first."""
    speed = max(top_speed(problem.velocity), 1e-6)
    starts = [eliminate_linear(problem, shape) for shape in shapes_of(problem.law, speed)]
    return sorted(starts, key=lambda start: start[0])


def shapes_of(law: FrictionLaw, speed: float) -> Iterator[dict[str, float]]:
    """Yield all initial sets of nonlinear parameters, for a joint's top speed [rad/s]."""
    nonlinear = [parameter for parameter in law.parameters if parameter.starts]
    axes = [np.clip(np.array(p.starts) * speed**p.start_speed_power, p.lower, p.upper).tolist() for p in nonlinear]
    for point in itertools.product(*axes):
        yield dict(zip((parameter.name for parameter in nonlinear), point, strict=True))


def eliminate_linear(problem: FitProblem, shape: dict[str, float]) -> tuple[float, Array]:
    """Compute (sum of squared residuals, values (p,)) of the best linear parameters for given nonlinear ones.

    Solves bounded linear least squares with the triangular factor; free columns such as the offset can be negative.
    """
    basis = filtered_basis(problem, shape)
    if problem.acceleration is not None:
        basis = np.column_stack([basis, problem.acceleration])
    columns = basis.shape[1]
    # rows of zeros keep the factor square where there are fewer samples than columns
    stacked = np.vstack([np.column_stack([basis, problem.friction_torque]), np.zeros((columns + 1,) * 2)])
    factor = cast("Array", np.linalg.qr(stacked, mode="r"))
    lower = np.where(np.isin(np.arange(columns), problem.law.free_coefficients), -np.inf, 0.0)
    solution = lsq_linear(factor[:-1, :-1], factor[:-1, -1], (lower, np.inf), method="bvls")
    fitted = None if problem.acceleration is None else -1
    values = np.append(problem.law.from_linear(solution.x[:fitted], shape), [] if fitted is None else solution.x[-1])
    return float(2 * solution.cost + factor[-1, -1] ** 2), values


def descend(
    problem: FitProblem, start: Array, loss: Loss = "linear", loss_scale: float = 0.0, tolerance: float = 1e-9
) -> Descent:
    """Minimize the sum of squares by SciPy's trust-region-reflective algorithm, with logarithms of scales.

    It converges when cost and parameters change by less than the relative `tolerance`.
    """
    logs = logarithmic(problem)
    # residuals of order one, because SciPy's gradient tolerance is absolute
    scale = max(float(np.sqrt(np.mean(problem.friction_torque**2))), 1e-30) * np.sqrt(len(problem.velocity))
    bounds = _bounds(problem)
    lower, upper = to_internal(bounds[:, 0], logs), to_internal(bounds[:, 1], logs)

    def residual(u: Array) -> Array:
        return np.asarray((predict(problem, to_external(u, logs)) - problem.friction_torque) / scale)

    def jacobian(u: Array) -> Array:
        return np.asarray(internal_jacobian(problem, to_external(u, logs)) / scale)

    solution = least_squares(
        residual,
        np.clip(to_internal(start, logs), lower, upper),
        jac=jacobian,
        bounds=(lower, upper),
        method="trf",
        x_scale="jac",
        loss=loss,
        f_scale=loss_scale / scale if loss_scale else 1.0,
        ftol=tolerance,
        xtol=tolerance,
        gtol=tolerance**1.5,
        max_nfev=100,
    )
    at_bound = solution.active_mask != 0
    ended = np.where(at_bound, np.where(solution.active_mask < 0, lower, upper), solution.x)  # SciPy stops just short
    values = np.clip(to_external(ended, logs), bounds[:, 0], bounds[:, 1])  # logarithm and exponential round
    return Descent(values, float(solution.cost * scale**2), at_bound, solution.status > 0)


def describe_fit(problem: FitProblem, best: Descent, loss: Loss, loss_scale: float) -> JointFit:
    """Compute covariance, intervals and counts at the minimum."""
    values, logs = best.values, logarithmic(problem)
    residual = problem.friction_torque - predict(problem, values)
    jacobian = internal_jacobian(problem, values)
    psi, slope = influence(residual / loss_scale, loss) if loss_scale else (residual, 1.0)
    score = psi * (loss_scale or 1.0) / max(slope, 0.1)
    estimate = block_covariance(jacobian, score, problem.block, _prior(problem))
    deviation = np.sqrt(np.diag(estimate.covariance))
    factor = np.where(logs, values, 1.0)
    bounds = _bounds(problem)
    intervals = intervals_95(values, deviation, estimate.degrees_of_freedom, logs)
    units = parameter_units(problem.parameters, *_scales(problem))
    return JointFit(
        parameters=problem.parameters,
        values=values,
        standard_errors=deviation * factor,
        covariance=estimate.covariance * np.outer(factor, factor),
        intervals=np.clip(intervals, bounds[:, :1], bounds[:, 1:]),
        degrees_of_freedom=estimate.degrees_of_freedom,
        at_bound=best.at_bound | near_bound(problem.parameters, values, deviation, units),
        rms=float(np.sqrt(np.mean(residual**2))),
        samples=len(residual),
        blocks=len(np.unique(problem.block)),
        converged=best.converged,
    )


def _bounds(problem: FitProblem) -> Array:
    """Collect the lower and upper bound of each parameter, shape (p, 2)."""
    return np.array([(parameter.lower, parameter.upper) for parameter in problem.parameters])


def _scales(problem: FitProblem) -> tuple[float, float, float]:
    """Compute typical torque, speed and acceleration of a joint [N m], [rad/s], [rad/s²]; 1 instead of 0."""
    torque = float(np.sqrt(np.mean(problem.friction_torque**2))) or 1.0
    acceleration = 1.0
    if problem.acceleration is not None:
        acceleration = float(np.sqrt(np.mean(problem.acceleration**2))) or 1.0
    return torque, top_speed(problem.velocity) or 1.0, acceleration


def _prior(problem: FitProblem) -> Array:
    """Compute the prior standard deviation of each parameter, or of its logarithm, shape (p,)."""
    # 7 in a logarithm is a factor of a thousand
    factors = [7.0 if parameter.logarithmic else PRIOR_FACTOR for parameter in problem.parameters]
    return np.array(factors) * parameter_units(problem.parameters, *_scales(problem))


def validate(
    fits: Mapping[str, JointFit], samples: FrictionSamples, law: FrictionLaw, settings: Settings
) -> tuple[dict[str, Validation | None], BoolArray]:
    """Validate each joint's fit on the blocks that `fit_law` held out, None without any; mark these samples, (N, n)."""
    validations: dict[str, Validation | None] = {}
    held_out = np.zeros(samples.usable.shape, dtype=bool)
    for joint, fit in fits.items():
        training, unseen = hold_out(joint_problem(samples, joint, law, settings), settings.holdout)
        validations[joint] = validate_values(fit.values, training, unseen) if len(unseen.velocity) else None
        held_out[:, samples.joint_names.index(joint)] = np.isin(samples.block, unseen.block)
    return validations, held_out


def validate_values(values: Array, training: FitProblem, unseen: FitProblem) -> Validation:
    """Compare the law on held-out blocks with zero friction, and with Coulomb friction and offset of training.

    `values` are the parameter values, shape (p,).
    """
    coefficients, *_ = np.linalg.lstsq(_coulomb_basis(training), training.friction_torque)
    return Validation(
        rms=_rms(unseen.friction_torque - predict(unseen, values)),
        rms_zero_friction=_rms(unseen.friction_torque),
        rms_coulomb_only=_rms(unseen.friction_torque - _coulomb_basis(unseen) @ coefficients),
    )


def _coulomb_basis(problem: FitProblem) -> Array:
    return np.column_stack([np.sign(problem.velocity), np.ones_like(problem.velocity)])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def hold_out(problem: FitProblem, every: int) -> tuple[FitProblem, FitProblem]:
    """Split a problem into training and validation; every n-th of the joint's own blocks is held out."""
    _, number = np.unique(problem.block, return_inverse=True)
    validation = cast("BoolArray", number % every == every // 2)
    return part_of(problem, ~validation), part_of(problem, validation)


def part_of(problem: FitProblem, rows: slice | BoolArray) -> FitProblem:
    """Select samples of a problem."""
    return replace(
        problem,
        velocity=problem.velocity[rows],
        friction_torque=problem.friction_torque[rows],
        acceleration=None if problem.acceleration is None else problem.acceleration[rows],
        block=problem.block[rows],
        around=None if problem.around is None else problem.around[rows],
        along=None if problem.along is None else problem.along.take(rows),
    )

"""The pilot: a linear fit to some windows before the whole log is read.

It estimates the delay of the torques, variance components and outliers (docs/estimator-fit.md, equations 14 to 16), the
first stage of two-stage generalized least squares.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.equations.constants import MOST_ROUNDS, PILOT_SEGMENTS, ROUNDS
from stribeck.core.equations.weak_equations import WeakEquations
from stribeck.core.equations.whole_log.corrections.correction import Layout
from stribeck.core.equations.whole_log.equation_sequence import EFFECTS, EquationSequence
from stribeck.core.estimator.model.basis import Basis
from stribeck.core.estimator.model.corrections import ModelCorrections, model_corrections
from stribeck.core.estimator.model.terms import Columns, Lags
from stribeck.core.estimator.noise.likelihood import make_groups, more_likely
from stribeck.core.estimator.noise.outliers import without_outliers
from stribeck.core.estimator.noise.variance_components import VarianceComponents, first_components
from stribeck.core.estimator.solver.disturbances import consistent, undisturbed
from stribeck.core.estimator.solver.linear_fit import LinearFit, residuals
from stribeck.core.settings import Priors

LONGEST_DELAY, OPERATIONS = 0.1, 3e9
"""Limits that save time: largest delay in the search [s], and operations for a sum of products [1]."""

LINEAR = 1e-3
"""Largest delay in which torques are treated as linear, and which is corrected without a search [s]."""

SLOW = 0.25
"""Share of the top speed [1] up to which friction counts as friction near standstill, chosen by judgment."""

DIFFER = 2.0
"""Factor by which chi^2 must fall for logs to have their own friction [1]: it is 600 for simulated days whose friction
differs by 15 %, and at most 1.11 for logs of seven real robots, where errors of the model dominate."""


def _pilot_fits(
    sequence: EquationSequence, basis: Basis, rest: Array, priors: Priors
) -> Callable[[float | None, float, int], LinearFit]:
    """Make the function that fits the pilot for a delay [s], None to hold it at zero; see `fit_pilot`.

    Its other arguments are operations [1] and rounds [1].
    """
    size = max(PILOT_SEGMENTS, 240 // len(rest))  # few joints need more segments, and take less time
    columns, layout = Columns(basis, Lags(sequence.top_speed)), sequence.corrections
    known: dict[tuple[int, int, int], Array] = {}  # a delay leaves velocities, and with them columns, as they are

    @lru_cache(maxsize=3)  # delays return: zero, and the last one of the search
    def delayed(delay: float) -> tuple[list[WeakEquations], list[Array]]:
        equations = sequence.delayed(delay)
        places = equations.spread(size)
        parts = [equations[place] for place in places]
        rows = [(log, segment.first, segment.last) for log, segment, _ in map(equations.parts.__getitem__, places)]
        for key, part in zip(rows, parts, strict=True):
            known[key] = known[key] if key in known else columns.by_joint(part)
        return parts, [known[key] for key in rows]

    def fit(delay: float | None, operations: float, rounds: int) -> LinearFit:
        parts, by_joint = delayed(delay or 0.0)
        torques = np.concatenate([part.residual[:, len(part.wrench_noise) :].ravel() for part in parts])
        torque = max(float(np.sqrt(np.mean(torques**2))), 1e-9)
        model = model_corrections(layout, _loads(parts, layout), priors, torque).late(delay or 0.0)
        model = model.without_delay if delay is None else model
        components = first_components(parts[0], rest, np.where(rest > 0, torque, 0.0), layout.sizes["wrenches"] > 0)
        first = _linear_fit(parts, by_joint, columns, model, components, delay or 0.0, operations)
        return _alternate(undisturbed(consistent(first)), rounds, basis)

    return fit


def fit_pilot(
    equations: EquationSequence,
    basis: Basis,
    rest: Array,
    priors: Priors,
    progress: Callable[[float], None],
) -> LinearFit:
    """Fit the pilot, with torques shifted until they are linear in their remaining delay.

    Parameters
    ----------
    equations
        Equations of all segments.
    basis
        Basis of the friction curves.
    rest
        Speed [rad/s] below which a joint is at rest, for laws that jump there, shape (n,).
    priors
        Priors of model and sensors.
    progress
        Callback `progress(fraction)`.
    """
    fit, apart = (_pilot_fits(replace(equations, effects=count), basis, rest, priors) for count in (1, EFFECTS))
    effects, delay = equations.corrections.log_effects, None
    if equations.corrections.sizes["torque_delay"]:
        delay = _find_delay(fit, lambda share: progress(0.5 * share))
    if effects[0] and effects[1] > 1:  # logs may have their own friction
        own = apart(delay, OPERATIONS / 4, ROUNDS)
        with_logs, without_logs = _log_errors(own, own.model, own.model.with_equal_logs)
        fit = fit if np.median(without_logs - with_logs) < np.log(DIFFER) else apart
    progress(0.5)
    pilot = fit(delay, OPERATIONS, MOST_ROUNDS)
    if delay is None or abs(delay + pilot.late[0]) < LINEAR:
        return pilot
    without = fit(None, OPERATIONS, MOST_ROUNDS)
    return pilot if abs(delay) < LONGEST_DELAY and _delay_pays(pilot, without) else without


def _find_delay(fit: Callable[..., LinearFit], progress: Callable[[float], None]) -> float | None:
    """Find the delay of the torques [s] on few windows, to save time.

    It is None if a correction of the delay does not improve predictions of held-out segments on average.
    """
    delay, tried = 0.0, list[tuple[float, float]]()
    for turn in range(MOST_ROUNDS):
        progress(turn / MOST_ROUNDS)
        pilot = fit(delay, OPERATIONS / 4, 1 if tried else ROUNDS)
        remainder, error = pilot.late
        if abs(remainder) < max(LINEAR, 3 * error):
            break
        if not tried:
            free, held = _log_errors(pilot, pilot.model, pilot.model.without_delay)
            if not np.mean(held - free) > 0:
                return None
        tried.append((delay, remainder))
        delay = float(np.clip(delay + _secant_step(tried), -LONGEST_DELAY, LONGEST_DELAY))
    return delay


def _delay_pays(pilot: LinearFit, without: LinearFit) -> bool:
    """Check that a pilot with a delay predicts held-out segments better than one without."""
    fits = pilot, replace(without, components=pilot.components)
    shifted, held = (_log_errors(fit, fit.model)[0] for fit in fits)
    places = (np.linspace(0, 1, len(errors)) for errors in (shifted, held))  # a long delay may lose a segment at an end
    return _clearly_positive(np.interp(next(places), next(places), held) - shifted)


def _log_errors(fit: LinearFit, *models: ModelCorrections) -> list[Array]:
    """Compute the logarithm of chi^2 of held-out segments with each of some models, shape (S,) each."""
    return [np.log(fit.held_out(np.flatnonzero(fit.counts), model)) for model in models]


def _clearly_positive(gain: Array) -> bool:
    """Check that the mean of a gain is larger than two standard errors."""
    return len(gain) > 1 and bool(gain.mean() > 2 * gain.std(ddof=1) / np.sqrt(len(gain)))


def _secant_step(tried: list[tuple[float, float]]) -> float:
    """Find the additional torque delay [s] from the delays that were tried and their residuals.

    Friction that builds up after a reversal explains about the same share of the residual at every delay.
    """
    delay, remainder = tried[-1]
    if len(tried) == 1:
        return remainder
    if delay == tried[-2][0]:  # the longest one
        return 0.0
    slope = (remainder - tried[-2][1]) / (delay - tried[-2][0])
    return remainder / min(max(-slope, 0.2), 1.0)


def with_terms(pilot: LinearFit, columns: Columns) -> LinearFit:
    """Extend the pilot by the columns of all terms, and keep the variance components of the first fit.

    Bodies get the widest prior if it predicts held-out segments better.
    """
    wide, narrow = _log_errors(pilot, pilot.model.widest, pilot.model)
    largest = pilot.model.widest.largest if _clearly_positive(narrow - wide) else pilot.model.largest
    model, by_joint = replace(pilot.model, largest=largest), [columns.by_joint(part) for part in pilot.parts]
    return _linear_fit(pilot.parts, by_joint, columns, model, pilot.components, pilot.delay, OPERATIONS)


def _alternate(fit: LinearFit, rounds: int, basis: Basis) -> LinearFit:
    """Alternate fits and estimates of the variance components until none grows, or for some rounds.

    The initial components describe a good model, so that disturbances of the motion stay visible. If outliers exist
    after `ROUNDS`, the fit starts again without them and searches again in every round.
    """
    first = fit.components
    outliers = any(group.part.set_aside is not None for group in fit.groups)
    for number in range(1, rounds + 1):
        values, covariance = fit.values, fit.covariance
        left = residuals(fit.groups, values)
        if number == ROUNDS or outliers:
            groups = without_outliers(fit.groups, left, fit.components)
            rejections = any(group.part.set_aside is not None for group in groups)
            fit = replace(fit, groups=groups, components=first if rejections and not outliers else fit.components)
            outliers = rejections
        if fit.components.rest.any():
            reversal = _near_standstill(values[: len(fit.precision)], basis)
            fit = replace(fit, components=replace(fit.components, reversal=reversal))
        parts = zip(fit.groups, fit.whiteners, left, strict=True)
        before, fit = fit, replace(fit, components=more_likely(fit.components, parts, covariance))
        grown = float(np.max(fit.components.model / np.maximum(before.components.model, 1e-12)))
        if number >= (2 if outliers else 1) * ROUNDS and grown < 1.2:
            break
    return fit


def _near_standstill(friction: Array, basis: Basis) -> Array:
    """Compute the error of friction where a joint sticks or reverses unseen [N m], shape (n,).

    Friction is anywhere between minus and plus the largest resisting torque up to `SLOW` of the top speed; the
    standard deviation of a uniform distribution is this torque divided by the square root of three. `friction` are the
    coefficients of all joints, of the curves and of further columns, shape (n q,).
    """
    joints, functions = len(basis.velocity), basis.functions.shape[1]
    curves = friction.reshape(joints, -1)[:, :functions] @ basis.functions.T
    middle = basis.velocity.shape[1] // 2
    slow = basis.velocity[0, middle:] < SLOW * basis.velocity[0, -1]
    resisting = (curves[:, middle:] - curves[:, middle::-1]) / 2
    return np.asarray(np.abs(resisting[:, slow]).max(axis=1) / np.sqrt(3))


def _linear_fit(
    parts: list[WeakEquations],
    own: list[Array],
    columns: Columns,
    model: ModelCorrections,
    components: VarianceComponents,
    delay: float,
    operations: float,
) -> LinearFit:
    """Select every other group of windows, or fewer, and compute the prior precision of their coefficients.

    `own` are the columns of each part by joint.

    The prior of curves is as large as the joint's torque, the prior of terms a third of it.
    """
    slopes = model.slopes(np.zeros(model.layout.size))
    width = own[0].shape[1] * own[0].shape[2] + 1 + len(slopes)
    step = max(2, round(sum(part.residual.size for part in parts) * width**2 / operations))

    def design(part: WeakEquations, by_joint: Array) -> Array:
        whole = columns.design(part, by_joint, part.residual.reshape(-1, 1))
        whole[:, -1 - len(slopes) : -1] = slopes.pulled(whole[:, -1 - len(slopes) : -1].T).T
        return whole

    def first(k: int, part: WeakEquations) -> int:
        """Vary the first group from segment to segment; late windows of short steps are among them, too."""
        return min(k % step, len(part.time) // part.lags - 1) if part.gait >= 0 else int(k % (step - 1))

    groups = [  # the designs of all parts at once would take gigabytes
        make_groups(part, first(k, part), step, design(part, each))
        for k, (part, each) in enumerate(zip(parts, own, strict=True))
    ]
    functions = len(columns.basis.variance)
    largest = np.sqrt(np.mean(np.concatenate([block[:, :, functions:] for block in own]) ** 2, axis=0))
    load = np.sqrt(np.mean(np.concatenate([part.torque for part in parts]) ** 2, axis=0))
    load = np.maximum(load, 0.05 * model.torque)
    of_terms = 0.3 * load[:, None] / np.maximum(largest, 1e-9) * np.where(columns.terms.held, 1e-6, 1.0)
    deviation = np.hstack([load[:, None] * np.sqrt(columns.basis.variance), of_terms])
    return LinearFit(groups, components, model, deviation.ravel() ** -2.0, delay, own)


def _loads(parts: list[WeakEquations], layout: Layout) -> Array:
    """Compute the torque of each sensor with a corrected gain, root mean square [N m]."""
    places = layout.part("gains")
    squares = [(part.regressors[:, :, places] ** 2).sum(axis=1) for part in parts if part.regressors is not None]
    return np.sqrt(np.concatenate(squares).mean(axis=0)) if places.stop > places.start else np.zeros(0)

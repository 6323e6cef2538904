"""Equations and statistics of joints whose friction is known, without a robot or a log."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.equations.weak_equations import WeakEquations
from stribeck.core.equations.whole_log.corrections import lay_out
from stribeck.core.equations.whole_log.corrections.correction import Layout
from stribeck.core.estimator.model.basis import make_basis
from stribeck.core.estimator.model.corrections import ModelCorrections, model_corrections
from stribeck.core.estimator.model.laws import Laws
from stribeck.core.estimator.model.terms import Columns, Terms
from stribeck.core.estimator.noise.outliers import Prediction
from stribeck.core.estimator.noise.variance_components import first_components
from stribeck.core.estimator.solver.fit import Fit
from stribeck.core.estimator.solver.statistics import Statistics, accumulate
from stribeck.core.friction import Parameter, get_law
from stribeck.core.friction.terms import LADDER
from stribeck.core.settings import Priors

VALUES = np.array([[0.3, 1.0, 0.2], [0.2, 0.8, -0.3], [0.1, 0.5, 0.0]])
"""Viscous and Coulomb friction and offset of the three joints of `steps`."""


def make_laws(name: str, joints: int, terms: tuple[Parameter, ...] = ()) -> Laws:
    """Joints with a top speed of 1 rad/s and a torque of 1 N m."""
    law, ones = get_law(name), np.ones(joints)
    free = np.ones((joints, len(law.parameters) + len(terms)), dtype=bool)
    return Laws(law, make_basis(law, ones), terms, ones, ones, Priors(), free)


def no_fit(laws: Laws, model: ModelCorrections, internal: Array | None = None) -> Fit:
    """The start of a fit, at the means of the priors or elsewhere."""
    internal = laws.prior[0] if internal is None else internal
    size = internal.size + model.layout.size
    nothing = {"covariance": np.zeros((size, size)), "at_bound": np.zeros(internal.shape, dtype=bool)}
    return Fit(
        laws=laws, model=model, internal=internal, corrections=model.prior_mean, **nothing, chi_square=0, converged=True
    )


def make_model(torque: float = 1.0, **corrections: int) -> ModelCorrections:
    layout = lay_out(corrections, Layout())
    return model_corrections(layout, np.ones(corrections.get("gains", 0)), Priors(), torque)


def statistics(friction: int, information: Array, right: Array, square: float, count: int) -> Statistics:
    return Statistics(friction, information, right, square, count, np.ones((3, 1)))


def some_equations(windows: int, projected: bool, seed: int = 0) -> WeakEquations:
    """Of three joints, one of which swings and one of which stands, with errors of all kinds."""
    generator = np.random.default_rng(seed)
    joints, rows = 3, 2 if projected else 3
    taps = np.full(7, 1 / 7)
    sharp = np.convolve(taps, [1.0, -2.0, 1.0])
    return WeakEquations(
        time=np.arange(windows) * 0.01,
        since=0.03 + np.arange(windows) * 0.01,
        until=0.03 + np.arange(windows)[::-1] * 0.01,
        gait=-1,
        residual=generator.standard_normal((windows, rows)),
        velocity=generator.standard_normal((3 * windows + 6, joints)),
        taps=taps,
        step=3,
        standing=np.array([False, True, seed % 2 == 1]),
        projection=generator.standard_normal((windows, rows, joints)) if projected else None,
        encoder_response=generator.standard_normal((windows, rows, 4)),
        root_response=generator.standard_normal((windows, rows, 6)),
        encoder_noise=generator.uniform(0.5, 1, 4),
        torque_noise=generator.uniform(0.5, 1, joints),
        acceleration_overlap=np.correlate(sharp, sharp, mode="full")[8::3],
        torque_overlap=np.correlate(taps, taps, mode="full")[6::3],
        regressors=None,
        torque=generator.standard_normal((windows, joints)),
        elapsed=np.arange(windows) * 0.01,
        position=np.zeros((3 * windows + 6, joints)),
    )


def steps(count: int = 30) -> list[WeakEquations]:
    """Steps on two feet of joints with friction and little noise, which carry a load that changes."""
    generator, law, found = np.random.default_rng(3), get_law("coulomb-viscous"), []
    for seed in range(count):
        part = some_equations(40, False, seed)
        turns = np.array([0.05, 0.07, 0.11])  # rad from row to row
        time = np.arange(len(part.velocity))[:, None] * turns + generator.uniform(0, 6, 3)
        velocity = np.sin(time)
        friction = np.column_stack([law.torque(velocity[:, k], VALUES[k]) for k in range(3)])
        load = 3 + 2 * np.sin(0.31 * time + 1)
        residual = part.windows(friction) + 0.005 * generator.standard_normal((40, 3))
        part = replace(
            part,
            gait=seed % 2,
            encoder_noise=1e-3 * np.ones(4),
            torque_noise=1e-2 * np.ones(3),
            root_response=np.zeros((40, 3, 0)),
            velocity=velocity,
            position=-np.cos(time) * part.period / turns,
            elapsed=part.elapsed + 0.8 * seed,
            residual=residual,
            torque=residual + part.windows(load),
        )
        found.append(part)
    return found


def make_terms(slope: float = 1e9) -> Terms:
    """Terms of the joints of `steps`, but for the scales that a pilot finds."""
    one = np.ones(3)
    return Terms(
        mean_temperature=None,
        duration=24.0,
        direction=np.zeros((3, 2)),
        slope=slope * one,
        friction=np.zeros((3, 1)),
        top_speed=one,
        unexplained=0.1 * one,
        delay=1e-3,
        settings={name: np.nan * one for term in LADDER for name in term.settings}
        | {"ripple_per_turn": 60 * one, "presliding_travel": 0.005 * one},
    )


class NoTerms:
    """No columns beside the curves."""

    size = 0

    def columns(self, part: WeakEquations, windows: Array) -> Array:  # noqa: ARG002 - there are none
        return windows[:, :, :0]

    def load(self, part: WeakEquations, windows: Array) -> Array:  # noqa: ARG002 - there is none
        return np.zeros_like(part.torque)


def summed(parts: Sequence[WeakEquations], columns: Columns, folds: int, corrections: int = 0) -> list[Statistics]:
    """Statistics of folds, in which nothing is set aside."""
    size = 3 * columns.per_joint + corrections
    components = first_components(parts[0], np.zeros(3), np.zeros(3))
    anything = Prediction(np.zeros(size), 1e8 * np.eye(size), components, 1.0)
    return accumulate(parts, [range(k, len(parts), folds) for k in range(folds)], folds, columns, anything)[0]

"""Properties of every friction law, in addition to the checks of `register_law` (test_register.py)."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stribeck.core.base.typing import Array
from stribeck.core.friction import LAWS, FrictionLaw, Parameter
from stribeck.core.friction.parameters import MAX_GAIN
from stribeck.core.friction.stribeck import from_coefficients
from stribeck.core.friction.terms.motion import beyond_velocity, drift, signals
from stribeck.core.friction.terms.ripple import RIPPLE
from stribeck.core.judgement.curve_fit.problem import FitProblem
from stribeck.paper.curve_fit.fit import fit_joint, grid_starts

every_law = pytest.mark.parametrize("law", [law() for law in LAWS.values()], ids=list(LAWS))

TYPICAL = {"viscous": (0.0, 5.0), "coulomb": (0.05, 20.0), "offset": (-5.0, 5.0), "slope": (5.0, 500.0)}
TYPICAL |= {"stribeck_gain": (0.0, 2.0), "stribeck_velocity": (0.01, 1.0), "exponent": (0.5, 3.0)}
"""Ranges of what joints of robots have, for draws."""


def typical(parameter: Parameter) -> tuple[float, float]:
    return TYPICAL[parameter.name.removesuffix("_positive").removesuffix("_negative")]


def draw_values(law: FrictionLaw, data: st.DataObject) -> Array:
    return np.array([data.draw(st.floats(*typical(parameter))) for parameter in law.parameters])


def offset_of(law: FrictionLaw, values: Array) -> float:
    return dict(zip((p.name for p in law.parameters), values, strict=True)).get("offset", 0.0)


speeds = st.lists(st.floats(-30, 30), min_size=1, max_size=20).map(np.array)


@every_law
@given(data=st.data(), velocity=speeds)
def test_friction_is_odd_and_passive_but_for_the_offset(law: FrictionLaw, data: st.DataObject, velocity: Array) -> None:
    values = draw_values(law, data)
    offset = offset_of(law, values)
    mirrored = values.copy()
    if law.name == "asymmetric":  # what is forward for one is backward for the other
        mirrored = values[[1, 0, 3, 2]]
    forward = law.torque(velocity, values) - offset
    assert np.all(velocity * forward >= -1e-12 * np.abs(velocity * values.sum()))
    np.testing.assert_allclose(law.torque(-velocity, mirrored) - offset, -forward, rtol=1e-12, atol=1e-12)


@every_law
@pytest.mark.parametrize("end", ["lower", "upper"])
def test_law_and_derivatives_are_finite_at_the_bounds_and_at_any_speed(law: FrictionLaw, end: str) -> None:
    values = np.array([np.clip(getattr(parameter, end), -1e6, 1e6) for parameter in law.parameters])
    velocity = np.array([-1e6, -1.0, -1e-300, 0.0, 1e-300, 1e-9, 1.0, 1e6])
    assert np.isfinite(law.torque(velocity, values)).all()
    assert np.isfinite(law.jacobian(velocity, values)).all()


@every_law
@settings(max_examples=15)
@given(seed=st.integers(0, 10_000))
def test_parameters_are_recovered_from_clean_samples(law: FrictionLaw, seed: int) -> None:
    rng = np.random.default_rng(seed)
    middle = {"stribeck_velocity": (0.05, 0.4), "slope": (20, 150), "stribeck_gain": (0.15, 1.5), "viscous": (0.1, 3)}
    truth = np.array([rng.uniform(*middle.get(p.name, typical(p))) for p in law.parameters])
    velocity = rng.uniform(1.0, 4.0) * np.sin(np.linspace(0, 60, 3000)) * np.sin(np.linspace(1, 14, 3000))
    shared = {"velocity": velocity, "friction_torque": law.torque(velocity, truth), "block": np.arange(3000) // 100}
    problem = FitProblem(law=law, parameters=law.parameters, acceleration=None, **shared)
    fit = fit_joint(problem)
    np.testing.assert_allclose(fit.values, truth, rtol=1e-6, atol=1e-6)
    assert len(grid_starts(problem)) == int(np.prod([len(p.starts) for p in law.parameters if p.starts]))


def test_breakaway_remains_if_the_kinetic_part_vanishes() -> None:
    _, coulomb, gain = from_coefficients(0.1, -0.5, 2.0)
    assert (gain, coulomb * gain) == pytest.approx((MAX_GAIN, 2.0))


@pytest.mark.parametrize("phase", [0.4, 2.0])
def test_a_ripple_is_found_where_its_sine_and_cosine_are_correlated(phase: float) -> None:
    position = 3.0 * np.random.default_rng(0).beta(0.3, 1.0, (300, 1))  # mostly near one end
    torque, ones = np.sin(11.4 * position - phase), np.ones((300, 1))
    (found,) = RIPPLE.find(SimpleNamespace(position=position, score=torque, information=ones, speed=np.ones(1)))
    assert found == pytest.approx(11.4, abs=0.01)


def test_a_drift_is_the_change_from_the_start_to_the_end() -> None:
    values, speed = {"coulomb_drift": 0.3, "viscous_drift": 0.1, "slope": 90.0}, np.array([-2.0, 0.5])
    start, end = (beyond_velocity(values, signals(speed, 90.0, elapsed=share)) for share in (-0.5, 0.5))
    np.testing.assert_allclose(drift(values, speed), end - start)

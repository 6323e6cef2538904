"""A joint at rest holds any torque up to its Coulomb friction; it must not be taken for one that slides."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from stribeck.friction import LAWS, get_law
from stribeck.judgement.curve_fit.fit import fit_joint, fit_law
from stribeck.judgement.curve_fit.problem import joint_problem
from stribeck.settings import Settings

TRUTH = {"viscous": 0.5, "coulomb": 2.0, "offset": -0.7}


@pytest.fixture
def half_at_rest(make_samples, make_joint):
    """Return a joint that stands still in every other block, its velocity noise alone, its torque anything."""
    samples = make_samples({"knee": make_joint(law="coulomb-viscous", truth=TRUTH, noise=0.0)})
    rng = np.random.default_rng(1)
    still = (samples.block % 2 == 1)[:, None]
    noise, held = 1e-3 * rng.normal(size=still.shape), rng.uniform(-2.7, 1.3, still.shape)
    return replace(
        samples,
        velocity=np.where(still, noise, samples.velocity),
        friction_torque=np.where(still, held, samples.friction_torque),
    )


def test_rest_is_left_out_of_laws_that_jump(half_at_rest):
    law = get_law("coulomb-viscous")
    fit = fit_law(half_at_rest, law, Settings(law=law.name, holdout=3))["knee"]
    np.testing.assert_allclose(fit.values, list(TRUTH.values()), rtol=1e-6)
    spoilt = fit_law(half_at_rest, law, Settings(law=law.name, holdout=3, rest=0.0))["knee"]
    assert spoilt.values[1] < 0.8 * TRUTH["coulomb"]


def test_rest_stays_in_for_laws_that_are_continuous(half_at_rest):
    settings = Settings()
    kept = {name: len(joint_problem(half_at_rest, "knee", get_law(name), settings).velocity) for name in LAWS}
    assert kept["stribeck"] == len(half_at_rest.time)
    assert kept["coulomb-viscous"] == kept["asymmetric"] == kept["stribeck-exponent"] < len(half_at_rest.time)


def test_one_direction_alone_raises_no_warning(make_samples, make_joint):
    """Coulomb friction and offset cannot be distinguished then; rounding must not turn into an overflow."""
    law = get_law("coulomb-viscous")
    samples = make_samples({"knee": make_joint(law=law.name, truth=TRUTH, speed=0.1, drift=1.0)}, blocks=8)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fit = fit_joint(joint_problem(samples, "knee", law, Settings()))
    assert np.all(np.isfinite(fit.intervals))
    assert fit.standard_errors[1] > 10 * TRUTH["coulomb"]

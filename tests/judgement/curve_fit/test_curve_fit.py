"""The fit recovers known friction, does not use held-out blocks, and excludes rest where a law jumps."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from stribeck.core.friction import LAWS, get_law
from stribeck.core.judgement.curve_fit.problem import joint_problem
from stribeck.core.settings import Settings
from stribeck.paper.curve_fit.fit import eliminate_linear, fit_joint, fit_law, hold_out
from stribeck.paper.curve_fit.prediction import predict

SETTINGS = Settings()


def test_held_out_blocks_are_never_seen(make_samples, make_joint) -> None:
    samples = make_samples({"knee": make_joint()})
    _, unseen = hold_out(joint_problem(samples, "knee", get_law("stribeck"), SETTINGS), SETTINGS.holdout)
    spoilt = samples.friction_torque.copy()
    spoilt[np.isin(samples.block, unseen.block)] = 1e6
    before = fit_law(samples, get_law("stribeck"), SETTINGS)["knee"]
    after = fit_law(replace(samples, friction_torque=spoilt), get_law("stribeck"), SETTINGS)["knee"]
    np.testing.assert_array_equal(before.values, after.values)
    assert len(np.unique(unseen.block)) == 30 // SETTINGS.holdout


@pytest.mark.parametrize("factor", [1e-3, 1e4])
def test_units_of_torque_do_not_matter(make_samples, make_joint, factor: float) -> None:
    samples = make_samples({"knee": make_joint()})
    scaled = replace(samples, friction_torque=factor * samples.friction_torque)
    one = fit_law(samples, get_law("stribeck"), SETTINGS)["knee"]
    other = fit_law(scaled, get_law("stribeck"), SETTINGS)["knee"]
    by_torque = np.where([p.unit.startswith("N m") for p in one.parameters], factor, 1.0)
    np.testing.assert_allclose(other.values, by_torque * one.values, rtol=1e-5)
    np.testing.assert_allclose(other.standard_errors, by_torque * one.standard_errors, rtol=1e-3)


def test_prismatic_speeds_are_found_too(make_samples, make_joint, truth) -> None:
    slow = {**truth, "stribeck_velocity": 0.002, "slope": 6000.0, "viscous": 50.0}
    samples = make_samples({"slide": make_joint(truth=slow, speed=0.02, noise=0.0)})
    assert fit_law(samples, get_law("stribeck"), SETTINGS) == {}  # too slow for a revolute joint
    samples = replace(samples, prismatic=(True,))
    fit = fit_law(samples, get_law("stribeck"), SETTINGS)["slide"]
    np.testing.assert_allclose(fit.values, list(slow.values()), rtol=1e-5)


def test_armature_is_found_beside_the_friction(make_samples, make_joint, truth) -> None:
    samples = make_samples({"knee": make_joint(armature=0.03), "hip": make_joint()})
    fits = fit_law(samples, get_law("stribeck"), Settings(fit_armature=["knee"]))
    assert fits["hip"].names == tuple(truth)
    assert fits["knee"].names == (*truth, "armature")
    low, high = fits["knee"].intervals[-1]
    assert low < 0.03 < high
    assert high - low < 0.002
    np.testing.assert_allclose(fits["knee"].values[:-1], list(truth.values()), rtol=0.1)


@pytest.mark.parametrize("loss", ["soft_l1", "huber", "cauchy"])
def test_robust_loss_shrugs_off_outliers(make_samples, make_joint, truth, loss: str) -> None:
    samples = make_samples({"knee": make_joint()})
    torque = samples.friction_torque.copy()
    torque[::25] += 15.0
    spoilt = replace(samples, friction_torque=torque)
    by_loss = [fit_law(spoilt, get_law("stribeck"), Settings(loss=name))["knee"] for name in ("linear", loss)]
    linear, robust = (np.abs(fit.values / list(truth.values()) - 1).max() for fit in by_loss)
    assert robust < 0.12
    assert linear > 0.5


@pytest.mark.parametrize("name", list(LAWS))
def test_elimination_is_bounded_linear_least_squares(make_samples, make_joint, name: str) -> None:
    samples = make_samples({"knee": make_joint(noise=1.0)}, blocks=8, seed=3)
    law = get_law(name)
    problem = joint_problem(samples, "knee", law, Settings(fit_armature=True))
    shape = {p.name: 0.5 for p in law.parameters if p.starts}
    basis = np.column_stack([law.basis(problem.velocity, shape), problem.acceleration])
    lower = np.zeros(basis.shape[1])
    lower[list(law.free_coefficients)] = -np.inf
    expected = lsq_linear(basis, problem.friction_torque, (lower, np.inf), method="bvls")
    cost, values = eliminate_linear(problem, shape)
    assert cost == pytest.approx(2 * expected.cost)
    assert values[-1] == pytest.approx(expected.x[-1], abs=1e-9)
    assert np.sum((predict(problem, values) - problem.friction_torque) ** 2) == pytest.approx(cost, rel=1e-9)


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


def test_rest_is_excluded_for_laws_that_jump(half_at_rest):
    law = get_law("coulomb-viscous")
    fit = fit_law(half_at_rest, law, Settings(law=law.name, holdout=3))["knee"]
    np.testing.assert_allclose(fit.values, list(TRUTH.values()), rtol=1e-6)
    spoilt = fit_law(half_at_rest, law, Settings(law=law.name, holdout=3, rest=0.0))["knee"]
    assert spoilt.values[1] < 0.8 * TRUTH["coulomb"]


def test_rest_is_used_for_continuous_laws(half_at_rest):
    settings = Settings()
    kept = {name: len(joint_problem(half_at_rest, "knee", get_law(name), settings).velocity) for name in LAWS}
    assert kept["stribeck"] == len(half_at_rest.time)
    assert kept["coulomb-viscous"] == kept["asymmetric"] == kept["stribeck-exponent"] < len(half_at_rest.time)


def test_motion_in_one_direction_raises_no_warning(make_samples, make_joint):
    """Coulomb friction and offset cannot be distinguished then; rounding must not turn into an overflow."""
    law = get_law("coulomb-viscous")
    samples = make_samples({"knee": make_joint(law=law.name, truth=TRUTH, speed=0.1, drift=1.0)}, blocks=8)
    fit = fit_joint(joint_problem(samples, "knee", law, Settings()))  # warnings are errors
    assert np.all(np.isfinite(fit.intervals))
    assert fit.standard_errors[1] > 10 * TRUTH["coulomb"]

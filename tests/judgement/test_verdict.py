"""Verdicts with reasons, violated passivity, and the R^2 of the torque."""

import json
from dataclasses import asdict, replace

import numpy as np
import pytest
from tests.result.made import joint
from tests.samples import make_samples

from stribeck.core.base.typing import Array
from stribeck.core.friction import LAWS, get_law
from stribeck.core.identify.whole_log import CRITERIA
from stribeck.core.judgement.passivity import added_power, passivity_violated
from stribeck.core.judgement.torque_error import change_by_inertias, friction_errors, torque_errors
from stribeck.core.judgement.verdict import judge
from stribeck.core.judgement.weakness import USUAL, is_weak
from stribeck.core.result import Validation
from stribeck.core.result.samples import FrictionSamples
from stribeck.core.settings import Settings
from stribeck.paper.curve_fit.fit import fit_law, validate


def identified(samples, law="stribeck", **settings):
    chosen = Settings(law=law, **settings)
    problem = samples, get_law(law), chosen
    fits = fit_law(*problem)
    results = judge(fits, *problem, validate(fits, *problem)[0])
    json.dumps({joint: asdict(result) for joint, result in results.items()}, allow_nan=False)
    return results


def test_a_well_moved_joint_is_identified(make_samples, make_joint, truth) -> None:
    found = identified(make_samples({"knee": make_joint()}, blocks=60))["knee"]
    assert found.verdict == "identified"
    assert found.reason.startswith("friction known to within 0.0")
    assert " % (60 blocks" in found.reason
    for name, value in truth.items():
        parameter = found.parameters[name]
        assert parameter.verdict == "identified"
        assert parameter.value == pytest.approx(value, abs=4 * parameter.standard_error)
    assert found.residual_rms == pytest.approx(0.05, rel=0.05)
    assert found.validation.rms == pytest.approx(0.05, rel=0.1)
    assert found.validation.rms < found.validation.rms_coulomb_only < found.validation.rms_zero_friction
    assert found.positive_power_fraction < 0.02


@pytest.mark.parametrize(("left", "verdict"), [(0.28, "identified"), (0.35, "weak")])
def test_in_a_disturbed_log_held_out_friction_must_be_explained(make_samples, make_joint, left, verdict) -> None:
    samples = make_samples({"knee": make_joint()}, blocks=60)
    problem = samples, get_law("stribeck"), Settings(law="stribeck")
    seen = {"knee": Validation(rms=left, rms_zero_friction=1.0, rms_coulomb_only=0.5)}
    fits = fit_law(*problem)
    assert judge(fits, *problem, seen)["knee"].verdict == "identified"
    found = judge(fits, *problem, seen, disturbed="from 40.2 to 70.1 s")["knee"]
    assert found.verdict == verdict
    assert ("something else acts on this joint from 40.2 to 70.1 s" in found.reason) == (verdict == "weak")


@pytest.mark.parametrize(("turns", "verdict"), [(3, "weak"), (4, "identified")])
def test_few_reversals_identify_no_joint(make_samples, make_joint, turns, verdict) -> None:
    samples = make_samples({"knee": make_joint()})
    velocity = 2.0 * np.cos(np.linspace(0, turns * np.pi, len(samples.time)))[:, None]
    samples = replace(samples, velocity=velocity, friction_torque=1.5 * np.sign(velocity))
    found = identified(samples, "coulomb-viscous")["knee"]
    assert (found.verdict, found.reversals) == (verdict, turns)
    assert found.parameters["coulomb"].value == pytest.approx(1.5)


def test_a_still_joint_gets_no_numbers(make_samples, make_joint) -> None:
    joints = {"knee": make_joint(), "neck": make_joint(speed=0.002), "hip": make_joint()}
    results = identified(make_samples(joints), "coulomb-viscous")
    assert list(results) == [*joints]
    found = results["neck"]
    assert found.verdict == "not excited"
    numbers = (found.parameters, found.residual_rms, found.validation, found.positive_power_fraction)
    assert numbers == ({}, None, None, None)
    assert "moves only between" in found.reason


def test_viscous_friction_of_a_slow_joint_is_weak_with_a_reason(make_samples, make_joint) -> None:
    found = identified(make_samples({"knee": make_joint(speed=0.06, noise=10.0)}))["knee"]
    assert found.verdict == found.parameters["viscous"].verdict == "weak"
    assert found.reason.startswith("friction near 0.14 rad/s is 1.")
    assert "of the samples are slower than the Stribeck velocity" in found.reason


@pytest.mark.parametrize(("speed", "clears"), [(0.06, False), (0.2, True)])
def test_parameters_above_the_top_speed_are_weak(make_samples, make_joint, speed, clears):
    found = identified(make_samples({"knee": make_joint(speed=speed, noise=1e-4)}))["knee"]
    weak = {name for name, parameter in found.parameters.items() if parameter.verdict == "weak"}
    assert weak == (set() if clears else {"viscous", "coulomb", "stribeck_gain"})
    assert found.verdict == "identified"


def test_a_missing_stribeck_effect_is_reported(make_samples, make_joint, truth) -> None:
    samples = make_samples({"knee": make_joint(truth=truth | {"stribeck_gain": 0.0})})
    found = identified(samples)["knee"]
    weak = {name for name, parameter in found.parameters.items() if parameter.verdict == "weak"}
    assert weak >= {"stribeck_gain", "stribeck_velocity"}
    assert found.verdict == "identified"  # the curve is known, however its parameters share it out
    assert "uncertain parameters: coulomb, stribeck_gain, stribeck_velocity" in found.reason
    assert "weak" not in identified(samples, "coulomb-viscous")["knee"].reason


def test_power_is_judged_by_the_sign_convention(make_samples, make_joint) -> None:
    samples = make_samples({"knee": make_joint(noise=0.0)})
    flipped = replace(samples, friction_torque=-samples.friction_torque)
    assert identified(samples)["knee"].positive_power_fraction == 0.0
    wrong = identified(flipped)["knee"]
    assert wrong.positive_power_fraction > 0.9
    assert wrong.verdict == "weak"
    assert "the fitted friction adds power in 100 % of the samples; check torque sign" in wrong.reason


@pytest.mark.parametrize("law", list(LAWS))
@pytest.mark.parametrize("torque", ["zero", "constant", "random"])
def test_torque_without_friction_is_reported(make_samples, make_joint, law, torque) -> None:
    samples = make_samples({"knee": make_joint()}, blocks=12)
    signal = {"zero": 0.0, "constant": 3.0, "random": np.random.default_rng(2).normal(size=(2400, 1))}[torque]
    found = identified(replace(samples, friction_torque=np.zeros((2400, 1)) + signal), law)["knee"]
    if (law, torque) == ("asymmetric", "constant"):  # it has no offset: friction of one direction is all it can be
        assert found.verdict == "weak"
        return
    assert found.verdict == "no friction"
    assert found.reason.startswith("no friction detected, below ")
    assert found.parameters.keys() <= {"offset"}
    offset = found.parameters["offset"].value if found.parameters else 0.0
    assert np.all(found.friction([-1.0, 0.0, 1.0], offset=True) == offset)


@pytest.mark.parametrize(("width", "weak"), [(0.49, []), (0.51, ["viscous", "coulomb", "stribeck_gain"])])
def test_parameters_are_weak_from_one_width_on(make_samples, make_joint, width: float, weak: list[str]) -> None:
    samples = make_samples({"knee": make_joint()}, blocks=60)
    fit = fit_law(samples, get_law("stribeck"), Settings(law="stribeck"))["knee"]
    intervals = fit.intervals.copy()
    intervals[:3] = fit.values[:3, None] * np.array([1 - width / 2, 1 + width / 2])
    wide = replace(fit, intervals=intervals)
    for criteria in (USUAL, CRITERIA):  # of both methods
        found = is_weak(wide, np.linspace(-2, 2, 100), criteria)
        assert [name for name, called in zip(wide.names, found, strict=True) if called] == weak


@pytest.mark.parametrize(
    ("zero", "lent"),
    [("coulomb", {"stribeck_gain", "stribeck_velocity", "slope"}), ("stribeck_gain", {"stribeck_velocity"})],
)
def test_the_whole_logs_bends_of_friction_that_may_be_none_are_weak(make_samples, make_joint, zero, lent):
    samples = make_samples({"knee": make_joint()}, blocks=60)
    fit = fit_law(samples, get_law("stribeck"), Settings(law="stribeck"))["knee"]
    intervals = fit.values[:, None] + np.abs(fit.values)[:, None] * np.array([-0.05, 0.05])
    assert not is_weak(replace(fit, intervals=intervals), np.linspace(-2, 2, 100), CRITERIA).any()
    intervals[fit.names.index(zero), 0] = 0.0
    found = is_weak(replace(fit, intervals=intervals), np.linspace(-2, 2, 100), CRITERIA)
    assert {name for name, called in zip(fit.names, found, strict=True) if called} == {zero} | lent


def test_a_law_that_fails_on_unseen_blocks_is_weak(make_samples, make_joint) -> None:
    samples = make_samples({"knee": make_joint(noise=0.0)})
    turned = np.isin(samples.block % 5, 2)[:, None]
    spoilt = replace(samples, friction_torque=np.where(turned, -samples.friction_torque, samples.friction_torque))
    found = identified(spoilt)["knee"]
    assert found.verdict == "weak"
    assert "explains held-out blocks no better" in found.reason


COUNT, BLOCKS = 4000, 20
WEAK = joint(verdict="weak")


def samples(friction_torque: Array, velocity: Array, blocks: int = BLOCKS) -> FrictionSamples:
    return make_samples(velocity, friction_torque, ("hinge",), 0.01, block=np.arange(COUNT) * blocks // COUNT)


@pytest.mark.parametrize("seed", range(5))
def test_a_wrong_sign_violates_passivity_and_noise_does_not(seed: int) -> None:
    generator = np.random.default_rng(seed)
    velocity = np.sin(0.3 * np.arange(COUNT) + seed)
    noise = generator.standard_normal(COUNT)
    for friction, violated in ((0.0, False), (0.3, False), (-0.3, True)):
        found = passivity_violated({"hinge": WEAK}, samples(friction * np.sign(velocity) + noise, velocity))
        assert [finding.joints for finding in found] == [("hinge",)] * violated


@pytest.mark.parametrize("size", [3.9, 4.1])
def test_power_is_noise_within_four_standard_errors_of_the_mean_of_blocks(size: float) -> None:
    levels = np.random.default_rng(0).standard_normal(5)
    levels = (levels - levels.mean()) / (levels.std(ddof=1) / np.sqrt(5)) - size
    found = make_samples(np.ones(50), np.repeat(levels, 10), block=np.repeat(np.arange(5), 10))
    assert (added_power(found, 0, 0.0) > 0) == (size > 4)


def test_few_blocks_and_resting_joints_violate_nothing() -> None:
    velocity = np.sin(0.3 * np.arange(COUNT))
    assert passivity_violated({"hinge": joint(verdict="not excited")}, samples(-velocity, velocity)) == []
    assert passivity_violated({"hinge": WEAK}, samples(-velocity, velocity, blocks=4)) == []


LAW = get_law("stribeck")


def fitted(make_samples, joint, carried):
    """Return samples with a torque that is friction and what the model explains, shape (N, 1), and the fits."""
    samples = make_samples({"knee": joint}, blocks=40)
    load = carried * np.sin(3.0 * samples.time)[:, None]
    samples = replace(samples, torque=samples.friction_torque + load)
    return samples, fit_law(samples, LAW, Settings(law=LAW.name))


def torque_r2(samples, fits):
    errors = friction_errors(samples, fits, LAW)
    (found,) = torque_errors(samples.joint_names, samples.velocity, samples.torque, [errors], rest=0.0)
    return {name: error.r2 for name, error in found.items()}


def test_torque_r2_falls_by_the_mean_square_of_a_model_error(make_samples, make_joint) -> None:
    samples, fits = fitted(make_samples, make_joint(noise=0.0), carried=4.0)
    off = replace(samples, friction_torque=samples.friction_torque + 0.8)
    assert torque_r2(samples, fits)["knee"] == pytest.approx(1.0, abs=1e-4)
    assert torque_r2(off, fits)["knee"] == pytest.approx(1 - 0.8**2 / np.var(samples.torque), abs=2e-3)


def test_torque_r2_ignores_unusable_samples(make_samples, make_joint) -> None:
    samples, fits = fitted(make_samples, make_joint(noise=0.2), carried=4.0)
    usable = samples.time[:, None] < samples.time[-1] / 2
    friction = np.where(usable, samples.friction_torque, 1e6)
    spoilt = replace(samples, friction_torque=friction, usable=usable)
    assert torque_r2(spoilt, fits)["knee"] > 0.9
    assert torque_r2(replace(spoilt, usable=np.zeros_like(usable)), fits) == {}


def test_inertias_change_the_torque_error_by_their_share_in_blocks_with_samples() -> None:
    given = np.random.default_rng(1).normal(size=(1000, 3))
    given[:200, 0] = np.nan
    corrected = given * [0.5, 0.8, 1.0]
    mean, error = change_by_inertias(given, given, corrected)
    expected = np.array([np.log([0.8, 1.0]).mean()] * 2 + [np.log([0.5, 0.8, 1.0]).mean()] * 8)
    assert (mean, error) == pytest.approx((expected.mean(), expected.std(ddof=1) / 10**0.5), rel=1e-4)
    assert change_by_inertias(given[:50], given[:50], corrected[:50]) is None

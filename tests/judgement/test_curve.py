"""The friction curve: its interval holds the truth, also where single parameters are open or sit on a bound."""

from dataclasses import replace

import numpy as np
import pytest

from stribeck.core.friction import get_law
from stribeck.core.friction.parameters import COULOMB, SLOPE
from stribeck.core.judgement.curve import SPEEDS, friction_curve
from stribeck.core.judgement.joint_fit import near_bound, parameter_units
from stribeck.core.judgement.speed import top_speed
from stribeck.core.judgement.weakness import is_weak
from stribeck.core.settings import Settings
from stribeck.paper.curve_fit.fit import fit_law

REPETITIONS = 30
CASES = {
    "all is known": ("stribeck", {}, {}, None),
    "no Stribeck effect": ("stribeck", {"stribeck_gain": 0.0}, {}, "stribeck_velocity"),
    "slower than the Stribeck velocity": ("stribeck", {}, {"speed": 0.05, "noise": 0.5}, "coulomb"),
    "Coulomb friction at its bound": ("coulomb-viscous", {"coulomb": 0.0}, {"noise": 1.0}, "coulomb"),
    "no friction": ("coulomb-viscous", {"coulomb": 0.0, "viscous": 0.0}, {}, "viscous"),
}
"""Law, what is true, how the joint moves, and the parameter that is open."""


@pytest.mark.parametrize("case", CASES)
def test_intervals_of_the_curve_cover_the_truth(make_samples, make_joint, truth, case: str) -> None:
    name, changed, joint, weak = CASES[case]
    law = get_law(name)
    true = {parameter.name: (truth | changed)[parameter.name] for parameter in law.parameters}
    held, widths, open_ = [], [], []
    for seed in range(REPETITIONS):
        samples = make_samples({"knee": make_joint(law=name, truth=true, **joint)}, blocks=20, seed=seed)
        fit, velocity = fit_law(samples, law, Settings(law=name))["knee"], samples.velocity[:, 0]
        speeds = top_speed(velocity) * np.array(list(SPEEDS.values()))
        values = np.array(list(true.values()))
        resisting = (law.torque(speeds, values) - law.torque(-speeds, values)) / 2
        for point, r in zip(friction_curve(fit, law, velocity, prismatic=False), resisting, strict=True):
            held.append(point.interval_95[0] <= r <= point.interval_95[1])
            widths.append(point.half_width / max(r, 1.0))
        open_.append(weak is None or is_weak(fit, velocity)[fit.names.index(weak)])
    assert np.mean(held) >= 0.92
    assert np.mean(widths) < 0.1  # though the parameter is open
    assert np.mean(open_) > 0.8


def test_the_curve_leaves_the_offset_out(make_samples, make_joint) -> None:
    law = get_law("asymmetric")
    true = {"viscous_positive": 0.5, "viscous_negative": 0.7, "coulomb_positive": 2.0, "coulomb_negative": 1.0}
    samples = make_samples({"slide": make_joint(law="asymmetric", truth=true, noise=0.0)})
    fit = fit_law(samples, law, Settings(law="asymmetric"))["slide"]
    slow, middle, top = friction_curve(fit, law, samples.velocity[:, 0], prismatic=True)
    for point in (slow, middle, top):
        assert point.value == pytest.approx(1.5 + 0.6 * point.velocity)
        assert point.unit == "N"
    assert [middle.velocity, slow.velocity] == pytest.approx([top.velocity / 2, top.velocity / 10])


def test_the_interval_contains_the_drift_in_addition_to_noise(make_samples, make_joint) -> None:
    law, samples = get_law("coulomb-viscous"), make_samples({"knee": make_joint(noise=2.0)})
    fit, velocity = fit_law(samples, law, Settings(law=law.name))["knee"], samples.velocity[:, 0]
    drift, freedom = replace(COULOMB, name="coulomb_drift"), np.append(fit.degrees_of_freedom, 9.0)
    wider = {"values": np.append(fit.values, 0.3), "covariance": np.pad(fit.covariance, (0, 1))}
    drifting = replace(fit, parameters=(*fit.parameters, drift), degrees_of_freedom=freedom, **wider)
    curves = (friction_curve(each, law, velocity, prismatic=False) for each in (drifting, fit))
    halves = [[point.interval_95[1] - point.value for point in curve] for curve in curves]
    np.testing.assert_allclose(np.sqrt(np.subtract(*np.square(halves))), 0.3, rtol=1e-3)


def test_no_value_is_at_a_bound_because_its_error_has_exploded() -> None:
    parameters, values = (COULOMB, SLOPE), np.array([5.0, 40.0])
    units = parameter_units(parameters, 10.0, 2.0)
    assert not near_bound(parameters, values, np.array([1e6, 1e6]), units).any()
    assert near_bound(parameters, np.array([1e-9, 1.001e-1]), np.array([1e6, 1e6]), units).all()
    assert not near_bound(parameters, np.array([1e-3, 40.0]), np.array([1e-4, 0.1]), units).any()

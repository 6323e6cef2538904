"""How much of the measured torque model and friction explain."""

from dataclasses import replace

import numpy as np
import pytest

from stribeck.friction import get_law
from stribeck.judgement.curve_fit.fit import fit_law
from stribeck.judgement.torque_error import torque_r2
from stribeck.settings import Settings

LAW = get_law("stribeck")


def fitted(make_samples, joint, carried):
    """Return samples with a torque that is friction and what the model explains, shape (N, 1), and the fits."""
    samples = make_samples({"knee": joint}, blocks=40)
    load = carried * np.sin(3.0 * samples.time)[:, None]
    samples = replace(samples, torque=samples.friction_torque + load)
    return samples, fit_law(samples, LAW, Settings(law=LAW.name))


def test_it_is_one_less_the_noise_s_share_of_the_torque_s_variance(make_samples, make_joint) -> None:
    samples, fits = fitted(make_samples, make_joint(noise=0.5), carried=4.0)
    expected = 1 - 0.5**2 / np.var(samples.torque)
    assert torque_r2(samples, fits, LAW)["knee"] == pytest.approx(expected, abs=2e-3)


def test_an_error_of_the_model_costs_its_mean_square_whether_it_varies_or_not(make_samples, make_joint) -> None:
    samples, fits = fitted(make_samples, make_joint(noise=0.0), carried=4.0)
    off = replace(samples, friction_torque=samples.friction_torque + 0.8)
    assert torque_r2(samples, fits, LAW)["knee"] == pytest.approx(1.0, abs=1e-4)
    assert torque_r2(off, fits, LAW)["knee"] == pytest.approx(1 - 0.8**2 / np.var(samples.torque), abs=2e-3)


def test_samples_that_no_fit_may_use_do_not_count(make_samples, make_joint) -> None:
    samples, fits = fitted(make_samples, make_joint(noise=0.2), carried=4.0)
    usable = samples.time[:, None] < samples.time[-1] / 2
    friction = np.where(usable, samples.friction_torque, 1e6)
    spoilt = replace(samples, friction_torque=friction, usable=usable)
    assert torque_r2(spoilt, fits, LAW)["knee"] > 0.9
    assert torque_r2(replace(spoilt, usable=np.zeros_like(usable)), fits, LAW) == {}

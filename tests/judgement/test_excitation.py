"""Motion that can and cannot identify friction."""

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stribeck.core.friction import get_law
from stribeck.core.judgement.curve_fit.problem import joint_problem
from stribeck.core.judgement.excitation import count_reversals, velocity_noise
from stribeck.core.settings import Settings


def judged(samples, joint="knee", prismatic=False):
    return joint_problem(samples, joint, get_law("stribeck"), Settings()).excitation(prismatic)


SLOW = "moves only between -0.01.* rad/s; move the joint faster than 0.05 rad/s in both directions"
ONE_WAY = "moves in only one direction, between 0.* and 1.* rad/s"


@pytest.mark.parametrize(
    ("joint", "blocks", "reason"),
    [
        ({"speed": 0.005}, 30, SLOW),
        ({"speed": 0.3, "drift": 1.0}, 30, ONE_WAY),
        ({}, 5, "the motion is too short: 5 blocks .*; record at least 6"),
    ],
)
def test_reasons_give_the_value_and_the_requirement(make_samples, make_joint, joint, blocks, reason) -> None:
    assert re.match(reason, str(judged(make_samples({"knee": make_joint(**joint)}, blocks=blocks)).reason))


def test_few_samples_and_noise_are_not_enough(make_samples, make_joint) -> None:
    samples = make_samples({"knee": make_joint()})
    usable = np.zeros_like(samples.usable)
    noise = 0.2 * np.random.default_rng(0).normal(size=samples.velocity.shape)
    few = usable | (np.arange(len(usable)) % 100 == 0)[:, None]
    for changed, reason in (
        ({"usable": usable}, "0 usable samples"),
        ({"usable": few}, "60 usable samples, but 6 parameters need at least 120; record a longer motion"),
        ({"velocity": noise}, "hardly more than the velocity's noise; move the joint faster than 0.8"),
    ):
        assert reason in str(judged(replace(samples, **changed)).reason)


def test_velocity_noise_is_found_under_motion() -> None:
    rng = np.random.default_rng(1)
    velocity = np.sin(np.linspace(0, 100, 20_000)) + 0.03 * rng.normal(size=20_000)
    assert velocity_noise(velocity) == pytest.approx(0.03, rel=0.05)


@given(turns=st.integers(0, 12), noise=st.floats(0, 0.05), seed=st.integers(0, 99))
def test_reversals_are_counted_through_noise(turns: int, noise: float, seed: int) -> None:
    velocity = np.cos(np.linspace(0, turns * np.pi, 3001))
    chatter = np.random.default_rng(seed).uniform(-noise, noise, len(velocity))
    assert count_reversals(velocity + chatter, threshold=0.11) == turns
    assert count_reversals(-velocity + chatter, threshold=0.11) == turns

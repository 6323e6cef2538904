"""Passivity is violated where power is added beyond noise, and not where noise alone makes the power."""

import numpy as np
import pytest

from stribeck.identification.judgement.passivity import passivity_violated
from stribeck.result import JointResult
from stribeck.samples import Samples
from stribeck.typing import Array

COUNT, BLOCKS = 4000, 20


def joint(verdict: str = "weak") -> JointResult:
    return JointResult(parameters={}, verdict=verdict, reason="", samples=COUNT, velocity_range=(-1, 1), reversals=9)  # type: ignore[arg-type]


def samples(friction_torque: Array, velocity: Array) -> Samples:
    return Samples(
        joint_names=("hinge",),
        period=0.01,
        time=0.01 * np.arange(COUNT),
        velocity=velocity[:, None],
        acceleration=np.zeros((COUNT, 1)),
        friction_torque=friction_torque[:, None],
        usable=np.ones((COUNT, 1), dtype=bool),
        block=np.arange(COUNT) * BLOCKS // COUNT,
        support=np.zeros(COUNT, dtype=np.int64),
        support_names=("base",),
    )


@pytest.mark.parametrize("seed", range(5))
def test_noise_alone_violates_nothing_and_a_wrong_sign_does(seed: int) -> None:
    generator = np.random.default_rng(seed)
    velocity = np.sin(0.3 * np.arange(COUNT) + seed)
    noise = generator.standard_normal(COUNT)
    for friction, violated in ((0.0, False), (0.3, False), (-0.3, True)):
        found = passivity_violated({"hinge": joint()}, samples(friction * np.sign(velocity) + noise, velocity))
        assert [finding.joints for finding in found] == [("hinge",)] * violated


def test_a_joint_that_does_not_move_is_not_judged() -> None:
    velocity = np.sin(0.3 * np.arange(COUNT))
    assert passivity_violated({"hinge": joint("not excited")}, samples(-velocity, velocity)) == []


def test_few_blocks_say_nothing() -> None:
    velocity = np.sin(0.3 * np.arange(COUNT))
    one = samples(-velocity, velocity)
    few = Samples(**{**vars(one), "block": np.arange(COUNT) * 4 // COUNT})
    assert passivity_violated({"hinge": joint()}, few) == []

"""Passivity is violated where power is added beyond noise, and not where noise alone makes the power."""

import numpy as np
import pytest
from tests.result.made import joint
from tests.samples import make_samples

from stribeck.base.typing import Array
from stribeck.friction_torque.samples import FrictionSamples
from stribeck.judgement.passivity import passivity_violated

COUNT, BLOCKS = 4000, 20
WEAK = joint(verdict="weak")


def samples(friction_torque: Array, velocity: Array, blocks: int = BLOCKS) -> FrictionSamples:
    return make_samples(velocity, friction_torque, ("hinge",), 0.01, block=np.arange(COUNT) * blocks // COUNT)


@pytest.mark.parametrize("seed", range(5))
def test_noise_alone_violates_nothing_and_a_wrong_sign_does(seed: int) -> None:
    generator = np.random.default_rng(seed)
    velocity = np.sin(0.3 * np.arange(COUNT) + seed)
    noise = generator.standard_normal(COUNT)
    for friction, violated in ((0.0, False), (0.3, False), (-0.3, True)):
        found = passivity_violated({"hinge": WEAK}, samples(friction * np.sign(velocity) + noise, velocity))
        assert [finding.joints for finding in found] == [("hinge",)] * violated


def test_few_blocks_and_a_joint_that_does_not_move_say_nothing() -> None:
    velocity = np.sin(0.3 * np.arange(COUNT))
    assert passivity_violated({"hinge": joint(verdict="not excited")}, samples(-velocity, velocity)) == []
    assert passivity_violated({"hinge": WEAK}, samples(-velocity, velocity, blocks=4)) == []

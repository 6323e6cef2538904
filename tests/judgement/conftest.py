"""Synthetic joints: smooth random motion, a known law, noise that a seed decides."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
import pytest
from tests import samples

from stribeck.core.friction import get_law
from stribeck.core.result.samples import FrictionSamples

TRUTH = {"viscous": 0.5, "coulomb": 2.0, "stribeck_gain": 0.6, "stribeck_velocity": 0.15, "offset": -0.7, "slope": 60.0}


@dataclass(frozen=True)
class Joint:
    """How one synthetic joint moves and resists."""

    law: str = "stribeck"
    truth: Mapping[str, float] = field(default_factory=lambda: TRUTH)
    speed: float = 1.5  # rms [rad/s]
    drift: float = 0.0  # mean speed [rad/s]
    noise: float = 0.05  # [N m], white
    armature: float = 0.0  # [kg m^2]


MakeSamples = Callable[..., FrictionSamples]


@pytest.fixture
def make_joint() -> type[Joint]:
    return Joint


@pytest.fixture
def truth() -> dict[str, float]:
    return dict(TRUTH)


@pytest.fixture
def make_samples() -> MakeSamples:
    def make(joints: Mapping[str, Joint], blocks: int = 30, seed: int = 0) -> FrictionSamples:
        rng = np.random.default_rng(seed)
        count, period = blocks * 200, 2e-3
        time = period * np.arange(count)
        velocity, acceleration, torque = (np.empty((count, len(joints))) for _ in range(3))
        for column, joint in enumerate(joints.values()):
            pulse = 2 * np.pi * np.array([0.8, 1.7, 2.9])
            phase = rng.uniform(0, 2 * np.pi, 3)
            size = joint.speed * np.sqrt(2 / 3)
            velocity[:, column] = joint.drift + size * np.sin(pulse * time[:, None] + phase).sum(axis=1)
            acceleration[:, column] = size * (pulse * np.cos(pulse * time[:, None] + phase)).sum(axis=1)
            law = get_law(joint.law)
            torque[:, column] = law.torque(velocity[:, column], np.array(list(joint.truth.values())))
            torque[:, column] += joint.armature * acceleration[:, column] + joint.noise * rng.normal(size=count)
        names = tuple(joints)
        return samples.make_samples(
            velocity, torque, names, period, acceleration=acceleration, block=np.arange(count) // 200
        )

    return make

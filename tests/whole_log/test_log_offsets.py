"""Offsets that differ from log to log, as torque sensors are zeroed anew, cost friction nothing."""

from dataclasses import replace

import numpy as np
import pytest
from tests.whole_log.logs import PLAIN, arm_log

from stribeck import Robot, identify
from stribeck.result import Result
from stribeck.settings import Settings
from stribeck_simulation.sensors.measure import with_noise

LOGS = 3
SETTINGS = Settings(method="whole-log", law="coulomb-viscous", corrections="inertia")


@pytest.fixture(scope="module")
def zeros(arm: Robot) -> np.ndarray:
    """Deviations of each log's torque sensors [N m], shape (logs, joints), whose mean is zero."""
    zeros = 0.3 * np.random.default_rng(5).normal(size=(LOGS, len(arm.joint_names)))
    return zeros - zeros.mean(axis=0)


@pytest.fixture(scope="module")
def found(arm: Robot, zeros: np.ndarray) -> Result:
    exact = [arm_log(8.0, 10 + k, "coulomb-viscous") for k in range(LOGS)]
    off = [replace(log, torque=log.torque + own) for log, own in zip(exact, zeros, strict=True)]
    return identify([with_noise(log, position=5e-5, torque=0.1, seed=k) for k, log in enumerate(off)], arm, SETTINGS)


def test_friction_is_covered_and_the_reported_offset_is_the_mean_one(found: Result) -> None:
    for joint in found.joints.values():
        assert joint.verdict == "identified"
        for name, true in PLAIN.items():
            assert abs(joint.parameters[name].value - true) < 3 * joint.parameters[name].standard_error


def test_each_logs_offsets_are_found_and_shown_without(found: Result, zeros: np.ndarray) -> None:
    assert found.corrections is not None
    offsets = np.array(list(found.corrections.log_offsets.values())).T
    np.testing.assert_allclose(offsets, zeros, atol=0.01)
    assert found.evidence is not None
    samples = found.evidence.samples
    velocities = zip(found.joints.values(), samples.velocity.T, strict=True)
    laws = np.column_stack([joint.friction(velocity, offset=True) for joint, velocity in velocities])
    for log in np.array_split(np.arange(len(laws)), LOGS):
        assert np.abs(np.nanmean((samples.friction_torque - laws)[log], axis=0)).max() < 0.05

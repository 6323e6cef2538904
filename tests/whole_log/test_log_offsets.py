"""Offsets and friction that differ from log to log, as sensors are zeroed anew and grease warms up, are found."""

from dataclasses import replace

import numpy as np
import pytest
from tests.whole_log.logs import PLAIN, arm_log

from stribeck import Robot, identify
from stribeck.core.friction import get_law
from stribeck.core.result import Result
from stribeck.core.settings import Settings
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.sensors.measure import with_noise

LOGS = 3
SETTINGS = Settings(method="whole-log", law="coulomb-viscous", corrections="inertia")


@pytest.fixture(scope="module")
def zeros(arm: Robot) -> np.ndarray:
    """Deviations of each log's torque sensors [N m], shape (logs, joints), whose mean is zero."""
    zeros = 0.3 * np.random.default_rng(5).normal(size=(LOGS, len(arm.joint_names)))
    return zeros - zeros.mean(axis=0)


@pytest.fixture(scope="module")
def found(arm: Robot, zeros: np.ndarray) -> Result:
    exact = [arm_log(4.0, 10 + k, "coulomb-viscous") for k in range(LOGS)]
    off = [replace(log, torque=log.torque + own) for log, own in zip(exact, zeros, strict=True)]
    return identify([with_noise(log, position=5e-5, torque=0.1, seed=k) for k, log in enumerate(off)], arm, SETTINGS)


def test_friction_is_covered_and_the_reported_offset_is_the_mean_one(found: Result) -> None:
    for joint in found.joints.values():
        assert joint.verdict == "identified"
        for name, true in PLAIN.items():
            assert abs(joint.parameters[name].value - true) < 3 * joint.parameters[name].standard_error
        for point in joint.curve:  # another log has the same friction, as all logs do
            assert point.interval_95[1] <= point.interval_next_log[1] < 1.03 * point.value


def test_each_logs_offsets_are_found_and_shown_without(found: Result, zeros: np.ndarray) -> None:
    offsets = np.array(list(found.corrections.log_offsets.values())).T
    np.testing.assert_allclose(offsets, zeros, atol=0.01)
    samples = found.evidence.samples
    velocities = zip(found.joints.values(), samples.velocity.T, strict=True)
    laws = np.column_stack([joint.friction(velocity, offset=True) for joint, velocity in velocities])
    for log in np.array_split(np.arange(len(laws)), LOGS):
        assert np.abs(np.nanmean((samples.friction_torque - laws)[log], axis=0)).max() < 0.05


def test_friction_that_differs_between_logs_is_found_and_the_result_is_its_mean(arm: Robot) -> None:
    """Friction of 85 to 115 %, in one log 60 % in the first joint, which neither bodies nor noise explain."""
    factors = np.random.default_rng(6).uniform(0.85, 1.15, (4, len(arm.joint_names)))
    factors[2, 0] = 0.6
    law = get_law("coulomb-viscous")
    days = []
    for k, row in enumerate(factors.tolist()):
        truth = zip(arm.joint_names, row, strict=True)
        own = {joint: {name: by * PLAIN[name] for name in PLAIN} for joint, by in truth}
        days.append(exact_log(arm, law, own, duration=4.0, seed=20 + k)[0])
    logs = [with_noise(replace(log, path=f"day{k}"), position=5e-5, torque=0.1, seed=k) for k, log in enumerate(days)]
    result = identify(logs, arm, SETTINGS)
    assert result.corrections.chi_square == pytest.approx(1.0, abs=0.25)
    levels = np.array(list(result.corrections.log_friction.values())).T
    np.testing.assert_allclose(levels, factors / factors.mean(axis=0) - 1, atol=0.02)
    (finding,) = result.findings
    assert (finding.check, finding.joints) == ("log-friction", (arm.joint_names[0],))
    assert "in day2)" in finding.text
    assert f"most in day2 ({arm.joint_names[0]} -3" in result.summary()
    for joint, levels in zip(result.joints.values(), factors.T, strict=True):
        for point in joint.curve:
            truth = levels * (PLAIN["coulomb"] + PLAIN["viscous"] * point.velocity)
            assert abs(point.value - truth.mean()) < 1.5 * point.half_width
            low, high = point.interval_next_log
            assert low < truth.min() < truth.max() < high < 2 * point.value

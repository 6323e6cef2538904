"""Pushes, blows and spikes cost what they cover, and no more."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.arm import TRUTH, arm_log, write_arm

from stribeck import Robot, Settings, identify
from stribeck.log import RobotLog
from stribeck.result import Result
from stribeck_simulation.sensors.measure import with_noise

SETTINGS = Settings(law="stribeck", corrections="inertia")


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    return Robot.from_file(write_arm(Path(tmp_path_factory.mktemp("arm"))))


@pytest.fixture(scope="module")
def clean(arm: Robot) -> RobotLog:
    return with_noise(arm_log(arm, duration=20.0), position=2e-5, torque=0.05, seed=3)


def pushed(log: RobotLog) -> RobotLog:
    """The log of an arm that is pushed for 0.3 s every two seconds or so."""
    generator, torque = np.random.default_rng(4), log.torque.copy()
    for start in np.arange(1.0, 20.0, 2.1):
        there = (log.time > start) & (log.time < start + 0.3)
        torque[there] += generator.choice([-1, 1], 3) * np.array([8.0, 4.0, 6.0])
    return replace(log, torque=torque)


def spiked(log: RobotLog) -> RobotLog:
    """The log with spikes of 20 standard deviations in a hundredth of all positions and torques."""
    generator = np.random.default_rng(5)
    there = (generator.random((2, *log.torque.shape)) < 0.01) * generator.choice([-1, 1], (2, *log.torque.shape))
    return replace(log, position=log.position + 4e-4 * there[0], torque=log.torque + there[1])


def told(result: Result) -> list[str]:
    assert result.evidence is not None
    return [note for note in result.evidence.notes if "set aside" in note or "pikes" in note]


def test_of_a_log_without_outliers_nothing_is_set_aside(arm: Robot, clean: RobotLog) -> None:
    assert told(identify(clean, arm, SETTINGS)) == []


@pytest.mark.parametrize("damage", [pushed, spiked])
def test_outliers_hardly_matter(arm: Robot, clean: RobotLog, damage: Callable[[RobotLog], RobotLog]) -> None:
    result = identify(damage(clean), arm, SETTINGS)
    assert told(result)
    for found in result.joints.values():
        coulomb = found.parameters["coulomb"]
        assert coulomb.value == pytest.approx(TRUTH["coulomb"], rel=0.01)
        assert coulomb.interval_95[0] <= TRUTH["coulomb"] <= coulomb.interval_95[1]

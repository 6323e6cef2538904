"""The gyroscope replaces fast changes of a noisy orientation, where both agree."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from stribeck.dynamics.attitude import with_gyroscope
from stribeck.log import RobotLog

PERIOD, ROWS = 0.002, 4000


def swaying_log(noise: float) -> tuple[RobotLog, Rotation]:
    """Make a log of a base that yaws and rolls, with noise of its orientation [rad]; return the true one, too."""
    time, normal = PERIOD * np.arange(ROWS), np.random.default_rng(0).standard_normal
    yaw, roll = (
        Rotation.from_euler("z", 2 * np.sin(3 * time)[:, None]),
        Rotation.from_euler("x", 0.3 * np.sin(25 * time)[:, None]),
    )
    rate = roll.inv().apply(6 * np.cos(3 * time)[:, None] * [0, 0, 1]) + 7.5 * np.cos(25 * time)[:, None] * [1, 0, 0]
    measured = yaw * roll * Rotation.from_rotvec(noise * normal((ROWS, 3)))
    log = RobotLog(
        time=time,
        joint_names=("joint",),
        position=np.zeros((ROWS, 1)),
        torque=np.zeros((ROWS, 1)),
        base_orientation=measured.as_quat(),
        angular_velocity=rate + 0.01 + 3e-3 * normal((ROWS, 3)),
    )
    return log, yaw * roll


def test_a_gyroscope_smooths_a_noisy_orientation() -> None:
    log, true = swaying_log(1e-3)
    found, notes = with_gyroscope(log, (slice(0, 2500), slice(2500, ROWS)), PERIOD)
    (note,) = notes
    assert "0.001 rad of noise" in note
    assert found.base_orientation is not None
    error = (true.inv() * Rotation.from_quat(found.base_orientation)).as_rotvec()
    assert np.sqrt(np.mean(error**2)) < 2e-4
    assert np.diff(error[:2500], axis=0).std() < 3e-5  # 1.4e-3 before


@pytest.mark.parametrize("case", ["clean", "other axes", "no gyroscope", "short"])
def test_an_orientation_stays_where_the_gyroscope_does_not_help(case: str) -> None:
    log, _ = swaying_log(1e-6 if case == "clean" else 1e-3)
    assert log.angular_velocity is not None
    if case == "other axes":
        log = replace(log, angular_velocity=log.angular_velocity[:, [1, 0, 2]])
    if case == "no gyroscope":
        log = replace(log, angular_velocity=None)
    found, notes = with_gyroscope(log, (slice(0, 50 if case == "short" else ROWS),), PERIOD)
    assert found is log
    assert notes == []

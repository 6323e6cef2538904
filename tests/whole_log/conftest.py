"""The robot and the log of most tests of the whole log."""

import pytest
from tests.whole_log.logs import arm_log, read_arm

from stribeck import Robot
from stribeck.core.log import RobotLog


@pytest.fixture(scope="session")
def arm() -> Robot:
    return read_arm()


@pytest.fixture(scope="session")
def exact_arm_log() -> RobotLog:
    """12 s."""
    return arm_log(12.0)

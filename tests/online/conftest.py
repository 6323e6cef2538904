"""An arm in service, and its identified friction."""

import pytest
from tests.arm import arm_log, write_arm
from tests.online.service import RATE, noisy

from stribeck import Result, Robot, Settings, identify


@pytest.fixture(scope="session")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    return Robot.from_file(write_arm(tmp_path_factory.mktemp("arm")))


@pytest.fixture(scope="session")
def result(robot: Robot) -> Result:
    log = noisy(arm_log(robot, duration=20.0, rate=RATE), 0)
    return identify(log, robot, Settings(law="stribeck", method="curve-fit"))

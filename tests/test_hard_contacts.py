"""Unusable contacts are refused in one sentence by every command."""

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.humanoid import stepping_log, talos

from stribeck import Robot, RobotLog, Settings, identify, inspect_log
from stribeck.core.errors import LogError, NothingIdentifiedError
from stribeck.core.settings import FilterSettings

ROWS = np.arange(2000)


@pytest.fixture(scope="module")
def humanoid(tmp_path_factory: pytest.TempPathFactory) -> tuple[Robot, RobotLog]:
    robot = talos(tmp_path_factory.mktemp("talos"))
    return robot, stepping_log(robot, len(ROWS))


def every(rows: int) -> np.ndarray:
    return (ROWS // rows)[:, None] % 2 == np.arange(2)


CONTACTS = {
    "both feet always stand": np.ones((len(ROWS), 2), dtype=bool),
    "contacts at random": np.random.default_rng(0).random((len(ROWS), 2)) > 0.5,
    "another foot each row": every(1),
    "another foot each 20 rows": every(20),
    "another foot each 24 rows": every(24),
    "a foot stands for two rows": np.stack([(ROWS > 1000) & (ROWS < 1003), ROWS < 0], axis=1),
}
FIXED = pytest.param(FilterSettings(kind="savitzky-golay", window=15), False, marks=pytest.mark.long)
MARKS = dict.fromkeys(("another foot each row", "another foot each 20 rows"), pytest.mark.long)


@pytest.mark.parametrize(("kind", "missing"), [(FilterSettings(), True), FIXED])
@pytest.mark.parametrize("method", ["curve-fit", "whole-log", "direct"])
@pytest.mark.parametrize("contact", [pytest.param(CONTACTS[own], marks=MARKS.get(own, ()), id=own) for own in CONTACTS])
def test_contacts_that_leave_nothing(contact, kind, method, missing, humanoid):
    """With every 97th position missing, or none."""
    robot, log = humanoid
    position = log.position.copy()
    position[:: 97 if missing else len(ROWS)] = np.nan
    hard, settings = replace(log, contact=contact, position=position), Settings(filter=kind, method=method)
    with pytest.raises((LogError, NothingIdentifiedError)) as refused:
        identify(hard, robot, settings, force=True)
    assert "\n" not in str(refused.value)
    with suppress(LogError):  # that no filter can be chosen
        inspect_log(hard, robot, settings)

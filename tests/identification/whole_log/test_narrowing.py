"""Summing up fewer columns changes nothing that a log can tell."""

from collections.abc import Iterator

import numpy as np
import pytest

from stribeck import Robot
from stribeck.friction import get_law
from stribeck.identification.whole_log import estimate, narrowing
from stribeck.identification.whole_log.narrowing import Narrowing, all_functions, narrowings
from stribeck.log import RobotLog
from stribeck.methods.whole_log import WholeLog, identify_whole_log
from stribeck.preparation import prepare
from stribeck.settings import Settings
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.robots.biped import MODELS
from stribeck_simulation.sensors.measure import with_noise

TRUTH = {"viscous": 0.3, "coulomb": 1.2, "stribeck_gain": 0.3, "stribeck_velocity": 0.15, "offset": 0.2, "slope": 50.0}


@pytest.fixture(scope="module")
def arm() -> Robot:
    return Robot.from_file(MODELS / "arm.toml")


@pytest.fixture(scope="module")
def noisy(arm: Robot) -> RobotLog:
    log, _ = exact_log(arm, get_law("stribeck"), dict.fromkeys(arm.joint_names, TRUTH), duration=20.0, seed=1)
    return with_noise(log, position=5e-5, torque=0.2, seed=2)


def fitted(arm: Robot, log: RobotLog) -> WholeLog:
    settings = Settings(method="whole-log")
    return identify_whole_log([prepare(log, arm, settings)], arm, get_law("stribeck"), settings)


@pytest.fixture
def tried(monkeypatch: pytest.MonkeyPatch) -> list[Narrowing]:
    """What was summed up, in this order."""
    seen: list[Narrowing] = []

    def watched(*arguments: object) -> Iterator[Narrowing]:
        for each in narrowings(*arguments):  # type: ignore[arg-type]
            seen.append(each)
            yield each

    monkeypatch.setattr(estimate, "narrowings", watched)
    return seen


def test_few_functions_say_what_all_say(
    arm: Robot, noisy: RobotLog, tried: list[Narrowing], monkeypatch: pytest.MonkeyPatch
) -> None:
    few = fitted(arm, noisy).fit
    assert len(tried) == 1
    assert tried[0].nodes.size < 0.7 * few.curves.nodes.size
    monkeypatch.setattr(
        estimate, "narrowings", lambda curves, corrections, *_: [all_functions(curves.nodes, corrections)]
    )
    whole = fitted(arm, noisy).fit
    deviations = np.sqrt(np.diag(whole.solution.covariance))[: few.solution.internal.size]
    off = (few.solution.internal - whole.solution.internal).ravel() / deviations
    assert np.abs(off).max() < 0.05
    assert few.chi_square == pytest.approx(whole.chi_square, rel=1e-4)


def test_a_fit_that_moves_away_from_the_first_one_is_summed_up_again(
    arm: Robot, noisy: RobotLog, tried: list[Narrowing], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(narrowing, "FAR", 1e-6)
    fit = fitted(arm, noisy).fit
    assert [each.nodes.size == fit.curves.nodes.size for each in tried] == [False, True]
    for values in fit.values:
        assert values[1] == pytest.approx(TRUTH["coulomb"], rel=0.03)

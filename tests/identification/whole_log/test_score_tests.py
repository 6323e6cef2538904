"""Friction that is no law of velocity is told of, by its kind; friction that is one, never."""

from dataclasses import replace

import numpy as np
import pytest

from stribeck import Robot, identify
from stribeck.friction import get_law
from stribeck.identification.whole_log.tests_of_fit.score_tests import SENTENCES, ScoreTest, score_test_warnings
from stribeck.log import RobotLog
from stribeck.settings import Settings
from stribeck.typing import Array
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.robots.biped import MODELS
from stribeck_simulation.sensors.measure import with_noise

TRUTH = {"viscous": 0.3, "coulomb": 1.2, "stribeck_gain": 0.3, "stribeck_velocity": 0.15, "offset": 0.2, "slope": 50.0}
SETTINGS = Settings(law="stribeck", corrections="none")


@pytest.fixture(scope="module")
def arm() -> Robot:
    return Robot.from_file(MODELS / "arm.toml")


@pytest.fixture(scope="module")
def exact(arm: Robot) -> RobotLog:
    return exact_log(arm, get_law("stribeck"), dict.fromkeys(arm.joint_names, TRUTH), duration=30.0, seed=1)[0]


def velocity(log: RobotLog) -> Array:
    assert log.velocity is not None
    return np.asarray(log.velocity)


def load(log: RobotLog) -> Array:
    return np.asarray(0.1 * np.abs(log.torque) * np.tanh(50 * velocity(log)))


def drift(log: RobotLog) -> Array:
    return np.asarray(-0.4 * (log.time / log.time[-1])[:, None] * np.tanh(50 * velocity(log)))


def presliding(log: RobotLog) -> Array:
    """The Coulomb friction follows within 10 mrad of travel."""
    sign, travel = np.tanh(50 * velocity(log)), np.abs(np.diff(log.position, axis=0, prepend=log.position[:1])) / 0.01
    z = np.zeros_like(sign)
    for k in range(1, len(z)):
        z[k] = sign[k] + (z[k - 1] - sign[k]) * np.exp(-travel[k])
    return np.asarray(1.2 * (z - sign))


def play(log: RobotLog) -> Array:
    """Nothing gets through for 20 ms after a torque has changed its sign."""
    changed = np.diff(np.sign(log.torque), axis=0, prepend=0) != 0
    crossing = np.apply_along_axis(np.convolve, 0, changed.astype(float), np.ones(20))[: len(log.time)] > 0
    return np.asarray(crossing * log.torque)


@pytest.mark.parametrize("kind", [load, drift, presliding, play])
def test_each_kind_is_flagged_in_the_joint_that_has_it(kind, arm: Robot, exact: RobotLog) -> None:
    torque = exact.torque.copy()
    torque[:, 1] += kind(exact)[:, 1]
    log = with_noise(replace(exact, torque=torque), position=1e-5, torque=0.05, seed=2)
    (warning,) = (text for text in identify(log, arm, SETTINGS).warnings if "average over this log" in text)
    assert warning.startswith(SENTENCES[kind.__name__])
    assert arm.joint_names[1] in warning
    assert not any(name in warning for k, name in enumerate(arm.joint_names) if k != 1)


@pytest.mark.parametrize("corrections", ["none", "inertia"])
def test_a_law_of_velocity_is_never_flagged(corrections: str, arm: Robot, exact: RobotLog) -> None:
    for seed in range(2):
        log = with_noise(exact, position=5e-5, torque=0.2, seed=seed)
        result = identify(log, arm, SETTINGS.model_copy(update={"corrections": corrections}))
        assert not any("average" in warning for warning in result.warnings)


def test_a_warning_names_the_least_probable_kind_of_each_joint() -> None:
    flagged = ScoreTest("load", size=0.3, share=0.25, minus_log10_p=90.0, flagged=True)
    shadow, quiet = ScoreTest("drift", 0.2, 0.16, 40.0, True), ScoreTest("play", 0.1, 0.08, 20.0, False)
    (text,) = score_test_warnings([(flagged, shadow), (quiet,), (flagged,)], ["knee", "hip", "ankle"])
    assert text.startswith(f"{SENTENCES['load']}: knee (25 %), ankle (25 %)")
    assert "hip" not in text

"""What disturbs a part of a log costs that part, and torques that are late are shifted before anything is fitted."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from tests.arm import TRUTH, arm_log, write_arm

from stribeck import Robot, Settings, identify
from stribeck.core.equations import constants
from stribeck.core.equations.constants import WIDEST_PRIOR
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.estimator.estimate import WholeLogFit
from stribeck.core.friction import get_law
from stribeck.core.identify.causes_of_spans import find_causes_of_spans
from stribeck.core.identify.contract import Fitted
from stribeck.core.identify.whole_log import described, identify_whole_log
from stribeck.core.log import RobotLog
from stribeck.simulation.sensors.measure import with_noise

SETTINGS = Settings(law="stribeck", corrections="inertia")


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    return Robot.from_file(write_arm(Path(tmp_path_factory.mktemp("arm"))))


@pytest.fixture(scope="module")
def exact(arm: Robot) -> RobotLog:
    return arm_log(arm, duration=20.0)


def whole_log(log: RobotLog, arm: Robot) -> WholeLogFit:
    noisy = with_noise(log, position=2e-5, torque=0.05, seed=3)
    return identify_whole_log([prepare(noisy, arm, SETTINGS)], arm, get_law("stribeck"), SETTINGS)


@pytest.fixture(scope="module")
def clean(arm: Robot, exact: RobotLog) -> WholeLogFit:
    return whole_log(exact, arm)


HELD = range(6000, 14_000)


def carrying(arm: Robot, log: RobotLog, rows: Iterable[int] = HELD) -> RobotLog:
    """A log in which the hand holds 3 kg, by default for 40 % of it."""
    model = pin.Model(arm.tree.model)
    model.inertias[model.njoints - 1] += pin.Inertia(3.0, np.array([0.05, 0.0, 0.1]), 0.01 * np.eye(3))
    torque = log.torque.copy()
    for k in rows:
        motion = log.position[k], log.velocity[k], log.acceleration[k]
        loaded, empty = (pin.rnea(own, own.createData(), *motion) for own in (model, arm.tree.model))
        torque[k] += loaded - empty
    return replace(log, torque=torque)


def pushed(log: RobotLog) -> RobotLog:
    """The log of an arm that is pushed for 0.3 s every two seconds or so."""
    generator, torque = np.random.default_rng(4), log.torque.copy()
    for start in np.arange(1.0, 20.0, 2.1):
        there = (log.time > start) & (log.time < start + 0.3)
        torque[there] += generator.choice([-1, 1], 3) * np.array([8.0, 4.0, 6.0])
    return replace(log, torque=torque)


def covered(found: WholeLogFit, tolerance: float) -> Fitted:
    """Coulomb friction is right, and as sure as is said."""
    fitted = described(found)
    for fit in fitted.fits.values():
        place = fit.names.index("coulomb")
        assert fit.values[place] == pytest.approx(TRUTH["coulomb"], rel=tolerance)
        assert fit.values[place] == pytest.approx(TRUTH["coulomb"], abs=3 * fit.standard_errors[place])
    return fitted


def test_a_log_without_outliers_is_used_completely(clean: WholeLogFit) -> None:
    assert clean.read.set_aside == 0
    assert len(clean.read.windows) == len(clean.read.equations)
    assert clean.chi_square == pytest.approx(1.0, abs=0.25)
    fitted = covered(clean, 0.01)
    assert (fitted.notes, fitted.findings) == ([], [])


def test_priors_of_bodies_are_widened_if_that_predicts_the_log_better(arm, exact, clean):
    model = pin.Model(arm.tree.model)
    for joint, own in enumerate(arm.tree.model.inertias):
        lever = own.lever + np.array([0.05, -0.05, 0.05])
        model.inertias[joint] = pin.Inertia((1 + 0.25 * (-1) ** joint) * own.mass, lever, own.inertia)
    wrong = replace(arm, tree=replace(arm.tree, model=model))
    assert clean.fit.model.largest == 1.0
    found = whole_log(exact, wrong)
    assert found.fit.model.largest == WIDEST_PRIOR
    covered(found, 0.02)


@pytest.mark.parametrize("most", [False, True])
def test_spans_with_or_without_a_payload_are_set_aside_whichever_are_fewer(arm, exact, clean, most):
    rows = [k for k in range(len(exact.time)) if k not in HELD] if most else HELD
    found = whole_log(carrying(arm, exact, rows), arm)
    assert 0.3 < found.read.set_aside < 0.6
    (finding,) = covered(found, 0.02).findings
    assert finding.check == "payload"  # says when, where and how much
    (payload,) = find_causes_of_spans(found).carried
    assert payload.mass == pytest.approx(3.0, rel=0.02)
    assert (payload.spans != payload.aside) is most
    swinging = found.read.pilot.components.model[0]  # of an arm, no joint stands
    if not most:  # else bodies contain the payload
        np.testing.assert_allclose(swinging, clean.read.pilot.components.model[0], rtol=0.5)


def test_a_hand_that_guides_most_of_the_log_is_set_aside(arm: Robot) -> None:
    log = arm_log(arm, duration=44.0, rate=250.0)
    hand = 4 * np.sin(2.3 * log.time[:, None] ** 1.2 + np.arange(3)) * ((log.time > 8) & (log.time < 36))[:, None]
    found = whole_log(replace(log, torque=log.torque + hand), arm)
    ((start, end, _),) = covered(found, 0.03).set_aside[0]
    assert (start, end) == (pytest.approx(8.0, abs=0.5), pytest.approx(36.0, abs=0.5))


def test_pushes_that_encoder_noise_hides_in_single_windows_are_set_aside(arm: Robot, exact: RobotLog) -> None:
    noisy = with_noise(pushed(exact), position=2e-4, torque=0.05, seed=3)
    found = identify_whole_log([prepare(noisy, arm, SETTINGS)], arm, get_law("stribeck"), SETTINGS)
    assert len(covered(found, 0.01).set_aside[0]) >= 9  # of ten


@pytest.mark.long
def test_spikes_hardly_matter(arm: Robot, exact: RobotLog) -> None:
    """Of 20 standard deviations, in a hundredth of all positions and torques."""
    log, generator = with_noise(exact, position=2e-5, torque=0.05, seed=3), np.random.default_rng(5)
    there = (generator.random((2, *log.torque.shape)) < 0.01) * generator.choice([-1, 1], (2, *log.torque.shape))
    spiked = replace(log, position=log.position + 4e-4 * there[0], torque=log.torque + there[1])
    result = identify(spiked, arm, SETTINGS)
    assert any("pikes are replaced" in note for note in result.evidence.notes)
    for joint in result.joints.values():
        coulomb = joint.parameters["coulomb"]
        assert coulomb.value == pytest.approx(TRUTH["coulomb"], rel=0.01)
        assert coulomb.interval_95[0] <= TRUTH["coulomb"] <= coulomb.interval_95[1]


def late(log: RobotLog, samples: int) -> RobotLog:
    return replace(log, torque=np.roll(log.torque, samples, axis=0)).take(slice(100, -100))


@pytest.mark.parametrize("delay", [*(pytest.param(own, marks=pytest.mark.long) for own in (2, 12)), -30])
def test_a_delay_is_found_beside_the_friction(arm: Robot, exact: RobotLog, delay: int) -> None:
    """By as many samples of 1 ms."""
    found = covered(whole_log(late(exact, delay), arm), 0.015)
    value, error = found.corrections.torque_delay
    assert error < 5e-5
    assert value == pytest.approx(1e-3 * delay, abs=4 * error)
    assert [finding.check for finding in found.findings] == ["torque-delay"]
    shifted = found.correct(late(exact, delay))
    ahead = round(len(exact.time) / 2)
    np.testing.assert_allclose(shifted.torque[ahead - 100], exact.torque[ahead], atol=0.02)


def test_of_a_long_log_evenly_spread_segments_are_read(arm, exact, monkeypatch):
    monkeypatch.setattr(constants, "MOST_SEGMENTS", 6)
    found = whole_log(exact, arm)
    read, whole = len(found.read.windows), len(found.read.equations)
    assert read == 6 + len(found.read.held_out) < whole
    assert covered(found, 0.02).notes[0] == f"{read} of {whole} segments of the log are read, evenly spread."

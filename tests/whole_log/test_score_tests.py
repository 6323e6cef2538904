"""What the law does not describe is flagged, by its kind; what it does describe, never."""

from dataclasses import replace

import numpy as np
import pytest
from tests.whole_log.logs import arm_log

from stribeck import Robot, identify
from stribeck.base.finding import FRICTION
from stribeck.base.typing import Array
from stribeck.log import RobotLog
from stribeck.settings import Settings
from stribeck.whole_log.fit_checks.findings import UNCLEAR, misfit_findings
from stribeck.whole_log.fit_checks.score_tests import Misfit, ScoreTest
from stribeck_simulation.sensors.measure import with_noise

SETTINGS = Settings(law="stribeck", corrections="none")


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


def delay(log: RobotLog) -> Array:
    """A torque that comes 6 ms later than the others."""
    return np.asarray(np.roll(log.torque, 6, axis=0) - log.torque)


def ripple(log: RobotLog) -> Array:
    return np.asarray(0.4 * np.sin(RIPPLES * log.position))


RIPPLES = 18


@pytest.mark.parametrize("kind", [load, drift, presliding, play, delay, ripple])
def test_each_kind_is_flagged_in_the_joint_that_has_it_and_no_other_kind(kind, arm: Robot) -> None:
    exact = arm_log(30.0)
    torque = exact.torque.copy()
    torque[:, 1] += kind(exact)[:, 1]
    log = with_noise(replace(exact, torque=torque), position=1e-5, torque=0.05, seed=2)
    result = identify(log, arm, SETTINGS)
    (finding,) = (each for each in result.findings if each.on_friction)
    assert (finding.check, finding.joints) == (FRICTION + kind.__name__, (arm.joint_names[1],))
    assert str(finding) in result.warnings
    assert finding.cure
    said = {"delay": "(6", "ripple": f"{RIPPLES} periods a turn"}.get(kind.__name__, "% of its friction")
    assert said in finding.text


@pytest.mark.parametrize("corrections", ["none", "inertia"])
def test_a_law_of_velocity_is_never_flagged(corrections: str, arm: Robot) -> None:
    for seed in range(2):
        log = with_noise(arm_log(30.0), position=5e-5, torque=0.2, seed=seed)
        result = identify(log, arm, SETTINGS.model_copy(update={"corrections": corrections}))
        assert result.findings == []


@pytest.mark.parametrize("bits", [10, 11])
def test_a_coarse_encoder_is_not_taken_for_another_cause(bits: int, arm: Robot) -> None:
    """It sees reversals late, as if friction built up after them."""
    log = with_noise(
        replace(arm_log(20.0, seed=0), velocity=None, acceleration=None), position=2e-5, torque=0.1, seed=0
    )
    step = 2 * np.pi / 2**bits
    result = identify(replace(log, position=step * np.round(log.position / step)), arm, Settings())
    assert not [finding for finding in result.findings if finding.on_friction]


def scored(kind: str, chi_square: float = 400.0, shift: float = 5.0) -> ScoreTest:
    return ScoreTest(kind=kind, size=0.3, share=0.25, chi_square=chi_square, minus_log10_p=90.0, shift=shift)


def test_kinds_that_explain_as_much_are_named_together() -> None:
    together = Misfit((scored("ripple"), scored("play", 300.0), scored("presliding", 250.0)), 18)
    (finding,) = misfit_findings([together], ["knee"])
    assert finding.check == UNCLEAR
    assert "not explained by friction of velocity: knee (ripple over position or play or presliding)" in finding.text


@pytest.mark.parametrize(
    ("test", "matters"),
    [
        (scored("load"), True),
        (scored("load", shift=1.0), False),
        (replace(scored("load"), share=0.01), False),
        (replace(scored("presliding"), share=30.0), False),  # friction cannot lag behind by more than itself
        (replace(scored("play"), share=30.0), True),
        (replace(scored("delay"), size=5e-3, share=0.0), True),
        (replace(scored("delay"), size=5e-5, share=0.0), False),
    ],
)
def test_what_matters_is_large_possible_and_moves_the_curve(test: ScoreTest, matters: bool) -> None:
    assert test.matters is matters

"""What the law does not describe is flagged, by its kind; what it does describe, never."""

from dataclasses import replace

import numpy as np
import pytest
from tests.whole_log.logs import arm_log

from stribeck import Robot, identify
from stribeck.core.base.finding import FRICTION
from stribeck.core.base.typing import Array
from stribeck.core.estimator.fit_checks.misfits import Misfit
from stribeck.core.log import RobotLog
from stribeck.core.settings import Settings
from stribeck.simulation.sensors.measure import with_noise

SETTINGS = Settings(law="stribeck", corrections="none")
RIPPLES = 18


def velocity(log: RobotLog) -> Array:
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


@pytest.mark.parametrize("kinds", [(None, play), (None, ripple, delay), (load, None, None, None, presliding, drift)])
def test_each_kind_is_flagged_in_the_joint_that_has_it_and_no_other_kind(kinds, arm):
    exact = arm_log(30.0)
    torque, expected = exact.torque.copy(), {}
    for joint, kind in enumerate(kinds):
        if kind:
            torque[:, joint] += kind(exact)[:, joint]
            expected[FRICTION + kind.__name__] = (arm.joint_names[joint],)
    result = identify(with_noise(replace(exact, torque=torque), position=1e-5, torque=0.05, seed=2), arm, SETTINGS)
    findings = {finding.check: finding for finding in result.findings if finding.on_friction}
    assert {check: own.joints for check, own in findings.items()} == expected
    for finding in findings.values():
        assert str(finding) in result.warnings
        assert finding.cure
        assert finding.note or "identified" not in {result.joints[joint].verdict for joint in finding.joints}
    said = {kind: own.text.partition("(")[2] for kind, own in findings.items()}
    if delay in kinds:
        assert float(said.pop(FRICTION + "delay").split()[0]) == pytest.approx(6.0, abs=0.15)
    if ripple in kinds:
        assert f"{RIPPLES} periods per turn" in said[FRICTION + "ripple"]
    assert all("% of its friction" in own for own in said.values())


@pytest.mark.parametrize(("corrections", "seed"), [pytest.param("none", 0, marks=pytest.mark.long), ("inertia", 1)])
def test_a_law_of_velocity_is_never_flagged(corrections: str, seed: int, arm: Robot) -> None:
    log = with_noise(arm_log(20.0), position=5e-5, torque=0.2, seed=seed)
    assert identify(log, arm, SETTINGS.model_copy(update={"corrections": corrections})).findings == []


@pytest.mark.parametrize("bits", [10, pytest.param(11, marks=pytest.mark.long)])
def test_a_coarse_encoder_is_not_taken_for_another_cause(bits: int, arm: Robot) -> None:
    """It sees reversals late, as if friction built up after them."""
    log = replace(arm_log(20.0, seed=0), velocity=None, acceleration=None)
    log = with_noise(log, position=2e-5, torque=0.1, seed=0)
    step = 2 * np.pi / 2**bits
    result = identify(replace(log, position=step * np.round(log.position / step)), arm, Settings())
    assert not [finding for finding in result.findings if finding.on_friction]


def found(kind: str, evidence: float = 400.0, **changed: float) -> Misfit:
    return Misfit(**({"kind": kind, "evidence": evidence, "size": 0.3, "share": 0.25, "shift": 5.0} | changed))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("misfit", "matters"),
    [
        (found("load"), True),
        (found("load", shift=1.0), False),
        (found("load", share=0.01), False),
        (found("presliding", share=30.0), False),  # friction cannot lag behind by more than itself
        (found("play", share=30.0), True),
        (found("delay", size=5e-3, share=0.0), True),
        (found("delay", size=5e-5, share=0.0), False),
    ],
)
def test_misfits_matter_if_they_are_large_and_possible(misfit: Misfit, matters: bool) -> None:
    assert misfit.matters is matters

"""With external joint torques, every method finds the same friction as without."""

from dataclasses import replace

import numpy as np
import pytest
from tests.arm import arm_log
from tests.friction_torque.test_friction_torque import EXACT
from tests.methods.test_ground_reaction import moved, robot

from stribeck import Robot, Settings, identify
from stribeck.core.equations.friction_torque.inverse_dynamics import torque_chunks
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.log import RobotLog
from stribeck.core.result import Result
from stribeck.simulation.sensors.measure import with_noise


def loaded(log: RobotLog, size: float = 5.0) -> RobotLog:
    """Make a log of the same motion under an external torque, which changes the measured torque."""
    phases = np.arange(len(log.joint_names))
    external = size * np.sin(3 * log.time[:, None] + phases)
    return replace(log, torque=log.torque - external, external_torque=external)


def values(result: Result) -> dict[tuple[str, str], float]:
    found = result.joints.items()
    return {(joint, name): one.value for joint, own in found for name, one in own.parameters.items()}


@pytest.mark.parametrize("method", ["curve-fit", "observer", "direct", "whole-log"])
def test_friction_is_that_of_the_same_motion_without(method: str, arm: Robot) -> None:
    log = with_noise(arm_log(arm, duration=7.0, rate=250.0), position=1e-5, torque=0.05)
    log = replace(log, velocity=None, acceleration=None)
    settings = Settings(method=method, law="coulomb-viscous", corrections="none" if method == "whole-log" else "auto")
    plain, under_load = (values(identify(each, arm, settings)) for each in (log, loaded(log)))
    assert plain
    assert under_load == pytest.approx(plain, rel=1e-3, abs=1e-3)
    wrong = values(identify(replace(loaded(log), external_torque=None), arm, settings, force=True))
    assert max(abs(wrong.get(key, 9.0) - value) for key, value in plain.items()) > 0.1


def test_friction_torque_of_standing_legs_is_that_of_the_same_motion_without() -> None:
    log = moved("walk", 8.0)[0].take(slice(2000))
    settings = Settings.model_validate({"filter": EXACT, "standing_legs": "measured"})
    logs = [prepare(each, robot(), settings) for each in (log, loaded(log))]
    (plain,), (under_load,) = (torque_chunks(each, robot(), settings) for each in logs)
    assert plain.samples.usable.any()
    np.testing.assert_allclose(under_load.samples.friction_torque, plain.samples.friction_torque, atol=1e-9)

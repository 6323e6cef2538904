"""Inspection reports joints with opposite signs, and the delay of the torque."""

from dataclasses import replace

import pytest
from scipy.interpolate import CubicSpline
from tests.arm import arm_log
from tests.models import POSTURES, example_robot

from stribeck import Robot
from stribeck.friction import get_law
from stribeck.inspection import inspect_log
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.sensors.measure import with_noise


@pytest.mark.parametrize("inverted", [(), (1,), (0, 2)])
def test_the_sign_audit_names_inverted_torques_and_no_others(arm: Robot, inverted: tuple[int, ...]) -> None:
    log = arm_log(arm)
    torque = log.torque.copy()
    torque[:, list(inverted)] *= -1
    found = inspect_log(replace(log, torque=torque), arm)
    names = [arm.joint_names[k] for k in inverted]
    assert [name for name, joint in found.joints.items() if joint.sign == "opposite"] == names
    assert bool(inverted) == any("wrong sign of torque" in text for text in found.findings)
    for name in names:
        assert name in found.findings[0]


@pytest.mark.parametrize("delay", [-0.004, 0.0, 0.0025, 0.0125])
def test_the_delay_of_the_torque_is_found_to_a_fraction_of_a_sample(arm: Robot, delay: float) -> None:
    log = arm_log(arm)
    late = CubicSpline(log.time, log.torque)(log.time - delay)
    found = inspect_log(replace(log, torque=late).take(slice(50, -50)), arm)
    for joint in found.joints.values():
        assert joint.delay == pytest.approx(delay, abs=2e-4)
    assert any(f"{1e3 * delay:+.2f} ms" in text for text in found.findings) == (delay != 0)


def test_a_walking_robot_has_no_delay_and_no_finding() -> None:
    robot = example_robot("talos")
    exact, _ = exact_log(robot, get_law("stribeck"), {}, duration=12, posture=POSTURES["talos"])
    found = inspect_log(with_noise(exact, position=1e-5, torque=0.1, seed=1), robot)
    assert found.findings == []
    assert found.support_source == "flags"
    assert {phase[2] for phase in found.phases} == {"left", "right", "left+right"}
    assert found.joints["leg_left_4_joint"].sign == "agrees"
    assert abs(found.joints["leg_left_4_joint"].delay) < 1e-3

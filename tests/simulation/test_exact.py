"""Exact logs obey the laws of motion, as Pinocchio states them from the untouched model files."""

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from tests import models

from stribeck.core.errors import SettingsError
from stribeck.core.friction import Stribeck
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.simulation.prescribed.exact import Truth, exact_log

RATE = 1000.0
CASES = ("ur5 walk", "panda walk", "kinova walk", "talos walk", "g1 stand", "go2 walk", "go2 trot", "go2 walk 0.5")
STANDING = [case for case in CASES if case.split()[0] in models.POSTURES]


def made(case: str) -> tuple[Robot, RobotLog, Truth]:
    name, gait, *pace = case.split()
    return models.example_robot(name), *models.example_log(name, 3.5, gait, pace=float(pace[0]) if pace else 1.0)


def samples(log: RobotLog, count: int = 40) -> np.ndarray:
    return np.linspace(0, len(log.time) - 1, count).astype(int)


def plain_state(case: str, k: int) -> tuple[pin.Model, np.ndarray, np.ndarray, np.ndarray]:
    robot, log, truth = made(case)
    model = models.plain_model(case.split()[0])
    if truth.base_position is None:
        bases: tuple[np.ndarray | None, ...] = (None, None, None)
    else:
        pose = np.concatenate([truth.base_position[k], log.base_orientation[k]])
        bases = (pose, truth.base_velocity[k], truth.base_acceleration[k])
    return (
        model,
        models.plain_configuration(model, robot, log.position[k], bases[0]),
        models.plain_rates(model, robot, log.velocity[k], bases[1]),
        models.plain_rates(model, robot, log.acceleration[k], bases[2]),
    )


def difference(signal: np.ndarray) -> np.ndarray:
    """Fourth-order central difference, two samples lost at each end."""
    return (8 * (signal[3:-1] - signal[1:-3]) - (signal[4:] - signal[:-4])) * RATE / 12


@pytest.mark.parametrize("case", CASES)
def test_velocity_and_acceleration_are_the_derivatives_of_position_within_limits(case):
    """Free joints stay within their limits; legs, placed by inverse kinematics, within a tenth of a radian."""
    robot, log, truth = made(case)
    low, high = robot.position_limits
    assert np.all((log.position > low - 0.1) & (log.position < high + 0.1))
    np.testing.assert_allclose(difference(log.position), log.velocity[2:-2], atol=5e-6)
    np.testing.assert_allclose(difference(log.velocity), log.acceleration[2:-2], atol=5e-2 if "trot" in case else 2e-4)
    if truth.base_position is not None:
        spin = pin.Quaternion(*log.base_orientation[7][[3, 0, 1, 2]]).toRotationMatrix()
        world = difference(truth.base_position)[5]
        np.testing.assert_allclose(spin.T @ world, truth.base_velocity[7, :3], atol=1e-9)
        np.testing.assert_allclose(
            difference(truth.base_velocity), truth.base_acceleration[2:-2], atol=1e-2 if "trot" in case else 1e-4
        )


@pytest.mark.parametrize("case", CASES)
def test_equation_of_motion_holds(case):
    """M a + h = S^T (tau - R) + J^T W, row by row, from the untouched model; base rows are the rate of momentum."""
    robot, log, truth = made(case)
    for k in samples(log):
        model, q, v, a = plain_state(case, k)
        data = model.createData()
        left = pin.rnea(model, data, q, v, a)
        right = models.plain_rates(model, robot, (log.torque - truth.friction_torque)[k])
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        for foot, wrench in zip(log.foot_names, log.foot_wrench[k] if log.foot_names else (), strict=True):
            frame = model.getFrameId(robot.contacts[foot].frame)
            right += pin.getFrameJacobian(model, data, frame, pin.LOCAL).T @ wrench
        np.testing.assert_allclose(left, right, atol=1e-9 * max(1.0, np.abs(left).max()))


@pytest.mark.parametrize("case", STANDING)
def test_standing_feet_stay_where_they_are(case):
    robot, log, _ = made(case)
    places: dict[str, list[np.ndarray]] = {foot: [] for foot in log.foot_names}
    for k in samples(log, 120):
        model, q, v, a = plain_state(case, k)
        data = model.createData()
        pin.forwardKinematics(model, data, q, v, a)
        pin.updateFramePlacements(model, data)
        for foot, stands in zip(log.foot_names, log.contact[k], strict=True):
            contact = robot.contacts[foot]
            frame = model.getFrameId(contact.frame)
            if stands:
                pose = data.oMf[frame]
                places[foot].append(pose.homogeneous if contact.kind == "surface" else pose.translation)
                rate = pin.getFrameVelocity(model, data, frame, pin.LOCAL).vector[: contact.size]
                change = pin.getFrameClassicalAcceleration(model, data, frame, pin.LOCAL).vector[: contact.size]
                assert np.abs(rate).max() < 1e-9
                assert np.abs(change).max() < 1e-9
    for poses in places.values():
        assert len(poses) > 10
        assert np.abs(np.array(poses) - poses[0]).max() < 1e-9


WRONG: dict[str, tuple[str, dict[str, Any], str]] = {
    "unknown joint": ("ur5", {"parameters": {"elbow": models.STRIBECK}}, "no joint 'elbow'"),
    "missing parameter": ("ur5", {"parameters": {"elbow_joint": {"viscous": 1.0}}}, "'elbow_joint': found viscous"),
    "unknown posture": ("ur5", {"posture": {"elbow": 0.1}}, "posture: robot has no joint 'elbow'"),
    "trot on two": ("talos", {"gait": "trot"}, "needs four contacts, the robot has 2"),
    "too many joints": ("cassie", {}, "expected 3 for a point contact"),
    "out of reach": ("talos", {"posture": {"leg_left_4_joint": 0.0, "leg_left_3_joint": -1.5}}, "bent knees"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_arguments_are_named(name):
    robot, arguments, words = WRONG[name]
    with pytest.raises(SettingsError, match=words):
        exact_log(models.example_robot(robot), Stribeck(), arguments.pop("parameters", {}), duration=1.0, **arguments)
    with pytest.raises(SettingsError, match=r"needs \[contacts\] to stand on"):
        exact_log(models.make_robot("go2_description/urdf/go2.urdf", {}, {}), Stribeck(), {}, duration=1.0)

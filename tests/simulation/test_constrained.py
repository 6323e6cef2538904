"""The ideal simulator: its logs obey mechanics, and friction is found in them exactly."""

import numpy as np
import pinocchio as pin
from tests.simulation.stepping import FRICTION, stepping, toro

from stribeck import Settings
from stribeck.core.equations.friction_torque.inverse_dynamics import torque_chunks
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.friction import Stribeck
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.simulation.prescribed.exact import Truth

EXACT = Settings.model_validate({"filter": {"kind": "log"}})
TOUCHDOWNS = (1000, 2100)


def states(robot: Robot, log: RobotLog, truth: Truth) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return configuration, velocity and acceleration of all samples as Pinocchio has them for the tree."""
    columns = robot.tree.columns
    q = np.hstack([truth.base_position, log.base_orientation, log.position[:, columns]])
    v = np.hstack([truth.base_velocity, log.velocity[:, columns]])
    a = np.hstack([truth.base_acceleration, log.acceleration[:, columns]])
    return q, v, a


def foot_motion(log: RobotLog, truth: Truth, foot: str, k: int) -> tuple[pin.SE3, np.ndarray]:
    model = toro().tree.model
    data, frame = model.createData(), model.getFrameId(toro().contacts[foot].frame)
    q, v, _ = (x[k] for x in states(toro(), log, truth))
    pin.forwardKinematics(model, data, q, v)
    pose = pin.updateFramePlacement(model, data, frame)
    return pin.SE3(pose), pin.getFrameVelocity(model, data, frame).vector


def test_single_support_is_recovered_exactly_and_double_support_is_not():
    """Fig. 6.1: on one foot every joint, swinging or standing; on two the legs are left open."""
    log, truth = stepping()
    (chunk,) = torque_chunks(prepare(log, toro(), EXACT), toro(), EXACT)
    for column, foot in enumerate(log.foot_names):  # the predicted ground reaction is the force of the constraint
        rows = chunk.samples.support == chunk.samples.support_names.index(foot)
        true = truth.friction_torque[chunk.rows[rows]][:, toro().torque_controlled]
        wrong = chunk.samples.friction_torque[rows] - true
        assert len(wrong) == 650
        assert np.sqrt((wrong**2).mean(axis=0)).max() < 1e-5
        np.testing.assert_allclose(chunk.wrench[rows], log.foot_wrench[chunk.rows[rows], column], atol=1e-4)
    both = chunk.samples.support == chunk.samples.support_names.index("left_foot+right_foot")
    legs = toro().standing(("left_foot", "right_foot"))[toro().torque_controlled]
    assert (both & (chunk.rows < 200)).sum() > 100
    assert np.isnan(chunk.samples.friction_torque[both][:, legs]).all()


def test_total_wrench_is_the_rate_of_momentum():
    """h' = sum of (F, (p - c) x F + moment) and (m g, 0), about the centre of mass c, at every sample."""
    log, truth = stepping()
    model = toro().tree.model
    data = model.createData()
    for k in range(0, len(log.time), 7):
        q, v, a = (x[k] for x in states(toro(), log, truth))
        change = pin.computeCentroidalMomentumTimeVariation(model, data, q, v, a).vector
        pin.updateFramePlacements(model, data)
        total = np.concatenate([toro().mass * toro().gravity, np.zeros(3)])
        for column, contact in enumerate(toro().contacts.values()):
            pose = data.oMf[model.getFrameId(contact.frame)]
            force, moment = log.foot_wrench[k, column].reshape(2, 3) @ pose.rotation.T
            total += np.concatenate([force, moment + np.cross(pose.translation - data.com[0], force)])
        np.testing.assert_allclose(change, total, atol=1e-7)


def test_the_friction_is_that_of_the_law():
    """At the velocity in the middle of the step, which is the central difference of the positions."""
    log, truth = stepping()
    for joint, named in FRICTION.items():
        column = log.joint_names.index(joint)
        values = np.array([named[parameter.name] for parameter in Stribeck.parameters])
        middle = log.velocity[:, column] + 0.5e-3 * log.acceleration[:, column]
        assert np.all(middle * (truth.friction_torque[:, column] - named["offset"]) >= 0)  # it puts no energy in
        assert np.mean(np.abs(middle) > 0.1) > 0.1
        wrong = truth.friction_torque[:, column] - Stribeck().torque(middle, values)
        assert np.abs(wrong).max() < 5e-3
        assert np.sqrt((wrong**2).mean()) < 5e-4
        steady = slice(250, 950)  # no impact
        central = (log.position[2:, column] - log.position[:-2, column])[steady] / 2e-3
        np.testing.assert_allclose(central, middle[1:-1][steady], atol=1e-4)
    assert np.all(truth.friction_torque[:, toro().joint_names.index("waist")] == 0)


def test_a_foot_that_touches_down_loses_energy_stops_turns_level_and_is_set_down():
    log, truth = stepping()
    model = toro().tree.model
    data = model.createData()
    q, v, a = states(toro(), log, truth)
    for k, foot in zip(TOUCHDOWNS, ("right_foot", "left_foot"), strict=True):
        before, speed = foot_motion(log, truth, foot, k - 1)
        assert np.abs(speed).max() > 1e-3
        assert np.abs(foot_motion(log, truth, foot, k)[1]).max() < 1e-9
        after, _ = foot_motion(log, truth, foot, k + 295)
        ground = foot_motion(log, truth, "left_foot", 0)[0].translation[2]
        assert abs(before.translation[2] - ground) > 1e-3
        assert abs(after.translation[2] - ground) < 3e-5
        assert np.arccos(after.rotation[2, 2]) < 5e-4
        free, stopped = (pin.computeKineticEnergy(model, data, q[k], x) for x in (v[k - 1] + 1e-3 * a[k - 1], v[k]))
        assert stopped < free

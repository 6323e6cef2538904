"""Friction observer: a first-order low-pass of the friction torque, in a controller and over a log."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.signal import lfilter
from tests.arm import arm_log, stribeck_torque
from tests.models import example_log, example_robot

from stribeck import LogError, MomentumObserver, Robot, Settings, identify
from stribeck.core.base.typing import Array
from stribeck.core.dynamics.momentum import momentum_balance
from stribeck.core.dynamics.rooted import RootMotion
from stribeck.core.equations.friction_torque import inverse_dynamics as stream
from stribeck.core.equations.friction_torque.inverse_dynamics import torque_chunks
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.log import RobotLog
from stribeck.core.settings import FilterSettings

PERIOD = 1e-3
EXACT = FilterSettings(kind="log")


@pytest.fixture(scope="module")
def log(arm: Robot) -> RobotLog:
    return arm_log(arm, duration=12)


def first_order(signal: Array, bandwidth: float, start: Array | float) -> Array:
    """Filter means over sample periods with a first-order low-pass, exact for constant means."""
    shrinks = np.exp(-2 * np.pi * bandwidth * PERIOD)
    means = (signal[1:] + signal[:-1]) / 2
    begin = np.broadcast_to(shrinks * np.asarray(start), (1, means.shape[1]))
    return np.asarray(lfilter([1 - shrinks], [1, -shrinks], means, axis=0, zi=begin)[0])


def test_on_a_moving_root_the_change_is_the_slope_of_the_kinetic_energy() -> None:
    """Lagrange's equations of the joints: p' = dT/dq + tau - R - g, with the root's velocity in its own coordinates."""
    robot = example_robot("go2")
    generator = np.random.default_rng(1)
    q, v = generator.uniform(-1, 1, (2, 1, 12))
    twist = generator.uniform(-1, 1, (1, 6))
    _, change = momentum_balance(robot.tree, q, v, RootMotion(np.zeros((1, 3)), twist))
    model, data, columns = robot.tree.model, robot.tree.model.createData(), robot.tree.columns
    rates = np.concatenate([twist[0], v[0, columns]])

    def energy(at: Array) -> float:
        return float(pin.computeKineticEnergy(model, data, np.concatenate([[0, 0, 0, 0, 0, 0, 1], at[columns]]), rates))

    step = 1e-5 * np.eye(12)
    slope = [(energy(q[0] + each) - energy(q[0] - each)) / 2e-5 for each in step]
    np.testing.assert_allclose(change[0], slope, atol=1e-6)


@pytest.mark.parametrize("bandwidth", [1e-3, 20.0, 1e3, 1e9])
def test_it_is_stable_at_every_bandwidth(arm: Robot, log: RobotLog, bandwidth: float) -> None:
    observer = MomentumObserver(arm, PERIOD, bandwidth)
    rows = slice(0, 600)
    found = np.array([observer.update(*row) for row in zip(*_motion(log, rows), strict=True)])
    friction = stribeck_torque(log.velocity[rows])  # type: ignore[index]
    assert np.abs(found).max() <= np.abs(friction).max() + 0.01
    np.testing.assert_allclose(found[1:], first_order(friction, bandwidth, 0.0), atol=0.01)


def _motion(log: RobotLog, rows: slice) -> tuple[Array, Array, Array]:
    return log.position[rows], log.velocity[rows], log.torque[rows]


def test_a_log_gives_the_same_samples_as_a_controller(arm, log, monkeypatch):
    monkeypatch.setattr(stream, "CHUNK", 700)  # the low-pass goes on from part to part
    log = replace(log.take(slice(0, 2101)), acceleration=None)
    settings = Settings(method="observer", filter=EXACT, observer_bandwidth=20.0)
    chunks = list(torque_chunks(prepare(log, arm, settings), arm, settings))
    found = np.concatenate([chunk.samples.friction_torque for chunk in chunks])
    velocity = np.concatenate([chunk.samples.velocity for chunk in chunks])
    assert len(chunks) > 3
    observer = MomentumObserver(arm, PERIOD, 20.0)
    pairs = []
    for row in zip(*_motion(log, slice(None)), strict=True):
        pairs.append((observer.update(*row), observer.velocity))
    online = np.array(pairs)
    begun = np.exp(-2 * np.pi * 20.0 * PERIOD * np.arange(2101))[:, None]  # a controller's estimate begins at zero
    np.testing.assert_allclose(found, online[:, 0] + begun * found[0], atol=1e-8)
    np.testing.assert_allclose(velocity, online[:, 1] + begun * velocity[0], atol=1e-8)


def test_on_its_feet_a_robot_has_the_low_pass_of_its_friction() -> None:
    log, truth = example_log("talos")
    robot = example_robot("talos")
    settings = Settings(method="observer", filter=EXACT, observer_bandwidth=20.0)
    (chunk,) = torque_chunks(prepare(log, robot, settings), robot, settings)
    known = robot.torque_controlled
    standing = robot.standing(robot.contacts)[known]
    seen = set()
    for run in chunk.runs():
        support = chunk.samples.support_names[chunk.samples.support[run.start]]
        friction = truth.friction_torque[chunk.rows[run]][:, known]
        low_passed = first_order(friction, 20.0, (friction[0] + friction[1]) / 2)
        found = chunk.samples.friction_torque[run][1:]
        open_ = standing if "+" in support else np.zeros_like(standing)
        np.testing.assert_allclose(found[:, ~open_], low_passed[:, ~open_], atol=0.02)
        assert np.isnan(found[:, open_]).all()
        seen.add(support)
    assert seen == {"left", "right", "left+right"}
    assert np.isnan(chunk.wrench).all()


def test_in_a_controller_the_estimate_is_carried_on_when_other_feet_stand() -> None:
    log, _ = example_log("talos")
    robot = example_robot("talos")
    observer = MomentumObserver(robot, PERIOD, 20.0)
    standing = robot.standing(tuple(robot.contacts))
    before, feet_before = observer.friction_torque, ()
    changes = 0
    for k in range(600, 1400):
        feet = tuple(np.array(log.foot_names)[log.contact[k]])
        now = observer.update(log.position[k], log.velocity[k], log.torque[k], feet, log.base_orientation[k])
        if feet != feet_before:
            changes += 1
            np.testing.assert_array_equal(now, before)
        if len(feet) == 2:
            np.testing.assert_array_equal(now[standing], before[standing])
        before, feet_before = now, feet
    assert changes > 2  # the first of them from nothing
    assert np.array_equal(np.isnan(before), [name in robot.position_controlled for name in robot.joint_names])
    np.testing.assert_array_equal(observer.update(log.position[0], log.velocity[0], log.torque[0]), before)  # flight


def test_on_point_feet_the_limbs_that_swing_are_seen() -> None:
    robot, (log, truth) = example_robot("go2"), example_log("go2", 1.5, "trot")
    phase = np.flatnonzero(log.contact.sum(axis=1) == 2)
    phase = phase[: np.argmax(np.append(np.diff(phase), 2) > 1) + 1]
    feet = tuple(np.array(log.foot_names)[log.contact[phase[0]]])
    observer = MomentumObserver(robot, PERIOD, 1e6)  # the mean over each sample period
    found = [
        observer.update(
            log.position[k], log.velocity[k], log.torque[k], feet, log.base_orientation[k], truth.base_velocity[k, 3:]
        )
        for k in phase
    ]
    friction = truth.friction_torque[phase]
    swinging = ~robot.standing(feet)
    assert swinging.sum() == 6
    np.testing.assert_allclose(
        np.array(found)[1:, swinging], (friction[1:] + friction[:-1])[:, swinging] / 2, atol=0.02
    )
    assert not np.array(found)[:, ~swinging].any()


def test_the_momentum_of_a_rotor_that_the_model_lacks_is_found(arm: Robot, log: RobotLog) -> None:
    with_rotors = replace(log, torque=log.torque + 0.15 * log.acceleration, acceleration=None)
    settings = Settings(method="observer", filter=EXACT, observer_bandwidth=20.0, fit_armature=True)
    for joint in identify(with_rotors, arm, settings).joints.values():
        assert joint.parameters["armature"].value == pytest.approx(0.15, rel=1e-3)


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ((np.zeros(2), np.zeros(3), np.zeros(3)), r"position: found shape \(2,\), expected \(3,\)"),
        ((np.zeros(3), np.array([0, np.nan, 0]), np.zeros(3)), "velocity: found nan at place 1, expected finite"),
        ((np.zeros(3), np.zeros(3), np.full(3, np.inf)), "torque: found inf at place 0"),
        ((np.zeros(3), np.zeros(3), np.zeros(3), ("toe",)), "feet: found 'toe', expected none on a fixed base"),
        ((np.zeros(3), np.zeros(3), np.zeros(3), (), np.zeros(4)), "base_orientation: found zeros"),
    ],
)
def test_a_bad_sample_is_refused_and_changes_nothing(arm: Robot, row: tuple[Array, ...], said: str) -> None:
    good = np.full((2, 3, 3), [[[0.1], [0.2], [0.3]], [[0.4], [0.5], [0.6]]])
    observer, other = MomentumObserver(arm, PERIOD, 20.0), MomentumObserver(arm, PERIOD, 20.0)
    observer.update(*good[0])
    with pytest.raises(LogError, match=said):
        observer.update(*row)
    other.update(*good[0])
    np.testing.assert_array_equal(observer.update(*good[1]), other.update(*good[1]))

"""Friction of a robot in service: estimates, alarms, hostile streams, restarts, and the motion of single samples."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from scipy.signal import lfilter
from tests.arm import TRUTH, arm_log, stribeck_torque
from tests.models import example_robot
from tests.online.service import RATE, elbow, feed, noisy, same, stream

from stribeck import LogError, Result, Robot, RobotLog, SettingsError, identify
from stribeck.core.base.typing import Array
from stribeck.core.dynamics.contact.mode import ContactMode
from stribeck.core.dynamics.momentum import momentum_balance
from stribeck.core.dynamics.rooted import rooted_inverse_dynamics
from stribeck.core.dynamics.state import Orientation, State
from stribeck.service.online import Alarm, OnlineFriction
from stribeck.service.online.alarms import Watchdog
from stribeck.service.online.kalman import JointFilters
from stribeck.service.online.motion import Tree


def numbers(online: OnlineFriction) -> Array:
    rows = [[own.scale, own.offset, own.viscous, *own.interval_95] for own in online.state().values()]
    return np.array(rows, dtype=np.float64)


def test_a_step_is_reported_for_the_right_joint_and_cleared_when_it_returns(robot: Robot, result: Result) -> None:
    online = OnlineFriction(result, robot, RATE)
    log = stream(robot, 180.0, elbow(lambda time: 0.15 * ((time > 70) & (time < 100))))
    raised, cleared = feed(online, log)
    assert (raised.name, raised.kind, raised.raised, cleared.raised) == ("elbow", "joint", True, False)
    assert 70 < raised.time < 90
    assert 65 < raised.since < raised.time
    assert raised.sureness > 0.999
    assert 0.08 < raised.change < 0.2
    assert cleared.time > 100
    assert not online.alarms


@pytest.mark.parametrize("change", [-0.25, 0.25])
def test_a_change_before_the_start_is_reported_where_logs_are_alike(robot: Robot, change: float) -> None:
    logs = [noisy(arm_log(robot, duration=20.0, rate=RATE, seed=seed), seed) for seed in range(2)]
    online = OnlineFriction(identify(logs, robot, law="stribeck", method="curve-fit"), robot, RATE)
    (alarm,) = feed(online, stream(robot, 30.0, elbow(lambda time: change + 0 * time)))
    assert (alarm.name, alarm.kind) == ("elbow", "joint")


def test_the_friction_now_is_the_simulated_friction(robot: Robot, result: Result) -> None:
    online = OnlineFriction(result, robot, RATE)
    assert not feed(online, stream(robot, 60.0, lambda _: np.full((1, 1), 0.8)))
    truths = 0.8 * stribeck_torque(online.baseline.speed, TRUTH | {"offset": 0.0})
    for own, truth in zip(online.state().values(), truths.tolist(), strict=True):
        assert own.interval_95[0] < truth < own.interval_95[1]
        assert own.friction == pytest.approx(truth, rel=0.08)
        assert own.motion > 15


def test_the_state_does_not_depend_on_how_the_stream_is_cut(robot: Robot, result: Result) -> None:
    log = stream(robot, 10.0, same)
    found = []
    for length in (1, 7, 100_000):
        online = OnlineFriction(result, robot, RATE)
        feed(online, log, length)
        found.append(numbers(online))
    assert np.array_equal(found[0], found[1])
    assert np.array_equal(found[0], found[2])


def test_gaps_jumps_and_missing_samples_do_not_disturb(robot: Robot, result: Result) -> None:
    log = stream(robot, 60.0, same)
    time, velocity, torque = log.time.copy(), log.velocity.copy(), log.torque.copy()
    time[1200:] += 500.0  # a pause
    time[2400:] -= 5000.0  # the clock is set back
    time[3600:] += 1e9  # and far ahead
    time[2800] = time[2799]  # a stamp twice
    torque[3200:3250] = np.nan
    time[3400] = np.nan
    torque[3800:3810] += 200.0  # a push
    velocity[4200, 0], torque[4400, 1] = 1e160, 1e200
    online, calm, patchy = (OnlineFriction(result, robot, RATE) for _ in range(3))
    assert not feed(online, replace(log, time=time, velocity=velocity, torque=torque))
    feed(calm, log)
    assert online.counts["missing"] == 51
    assert online.counts["repeated"] == 1
    assert online.counts["breaks"] >= 4
    torque = np.where(np.random.default_rng(0).random(log.torque.shape) < 0.2, np.nan, log.torque)
    assert not feed(patchy, replace(log, torque=torque))
    for own in (online, patchy):
        assert np.abs(numbers(own)[:, 0] - numbers(calm)[:, 0]).max() < 0.1


def columns(log: RobotLog, order: list[int]) -> RobotLog:
    channels = {name: getattr(log, name)[:, order] for name in ("position", "velocity", "torque")}
    return replace(log, **channels)


DAMAGES: dict[str, Callable[[RobotLog], RobotLog]] = {
    "milliseconds": lambda log: replace(log, time=1e3 * log.time),
    "nanoseconds": lambda log: replace(log, time=1e9 * log.time),
    "constant stamps": lambda log: replace(log, time=0 * log.time),
    "no velocity": lambda log: replace(log, velocity=0 * log.velocity),
    "degrees": lambda log: replace(log, position=np.degrees(log.position), velocity=np.degrees(log.velocity)),
    "swapped joints": lambda log: columns(log, [1, 0, 2]),
    "reversed order": lambda log: columns(log, [2, 1, 0]),
    "negated torque": lambda log: replace(log, torque=-log.torque),
    "dead sensor": lambda log: replace(log, torque=log.torque * [np.nan, 1, 1]),
}


@pytest.mark.parametrize("late", [False, True])
@pytest.mark.parametrize("name", DAMAGES)
def test_a_damaged_stream_is_named_within_a_minute(robot: Robot, result: Result, name: str, late: bool) -> None:
    online, log = OnlineFriction(result, robot, RATE), stream(robot, 90.0, same)
    if late:
        assert not feed(online, log.take(slice(3000)))
    damaged = DAMAGES[name](log).take(slice(3000, None))
    alarms = [alarm for alarm in feed(online, damaged) if alarm.kind in ("unseen", "strange")]
    assert alarms
    assert name != "dead sensor" or [(alarm.kind, alarm.name) for alarm in alarms] == [("unseen", "shoulder")]
    assert all(online.state()[alarm.name].alarm for alarm in alarms if alarm.key in online.alarms)


BAD = {"text": "text", "ragged": [[1.0], [1.0, 2.0]], "3-D": np.ones((2, 2, 3)), "complex": 1j * np.ones(3)}


@pytest.mark.parametrize("bad", BAD)
@pytest.mark.parametrize("name", ["time", "position", "torque", "temperature"])
def test_bad_arguments_are_named(robot: Robot, result: Result, name: str, bad: str) -> None:
    sample = {"time": 0.0, "position": np.zeros(3), "velocity": np.zeros(3), "torque": np.zeros(3), name: BAD[bad]}
    with pytest.raises(LogError, match=f"^{name}: "):
        OnlineFriction(result, robot, RATE).update(**sample)


def test_a_joint_at_rest_is_not_judged(robot: Robot, result: Result) -> None:
    online = OnlineFriction(result, robot, RATE)
    log = arm_log(robot, duration=40.0, rate=RATE, still="elbow")
    assert not feed(online, log)
    assert online.state()["elbow"].motion == 0.0
    assert online.state()["elbow"].scale == 1.0


def test_a_restart_continues(robot: Robot, result: Result, tmp_path: Path) -> None:
    log = stream(robot, 60.0, elbow(lambda time: 0.6 * (time > 40)))
    whole, first = OnlineFriction(result, robot, RATE), OnlineFriction(result, robot, RATE)
    alarms = feed(whole, log)
    path = tmp_path / "state.json"
    feed(first, log, rows=slice(0, 4_000))
    first.save(path)
    second = OnlineFriction(result, robot, RATE)
    second.load(path)
    assert np.array_equal(numbers(first), numbers(second))
    later = feed(second, log, rows=slice(4_000, None))
    assert [alarm.name for alarm in later] == [alarm.name for alarm in alarms] == ["elbow"]
    assert numbers(second) == pytest.approx(numbers(whole), abs=0.1)
    second.save(path)
    third = OnlineFriction(result, robot, RATE)
    third.load(path)
    assert third.alarms == second.alarms
    sound, generator = path.read_text(), np.random.default_rng(0)
    for place in generator.integers(len(sound), size=50):
        path.write_text(sound[:place] + chr((ord(sound[place]) + 1) % 128) + sound[place + 1 :])
        with pytest.raises(SettingsError, match="is damaged"):
            third.load(path)
    for factor in (-1.0, np.nan):
        third.filters.covariance *= factor
        third.save(path)
        with pytest.raises(SettingsError, match="not finite, or a covariance is not positive"):
            second.load(path)


@pytest.mark.parametrize("factor", [0.6, 1.0, 2.5])
def test_compensation_stays_below_the_friction(robot: Robot, result: Result, factor: float) -> None:
    online = OnlineFriction(result, robot, RATE)
    assert all(0.4 < gain < 0.9 for gain in online.compensation_gains().values())
    feed(online, stream(robot, 40.0, lambda _: np.full((1, 1), factor)))
    speeds = online.baseline.speeds
    compensated = online.baseline.friction(speeds, 0 * speeds, 0 * speeds)
    truth = stribeck_torque(speeds, TRUTH | {"offset": 0.0})
    for k, gain in enumerate(online.compensation_gains().values()):
        assert 0.8 * min(factor, 1.5) < gain < factor
        assert (gain * compensated[:, k] < factor * truth[:, k]).all()


def test_covariances_stay_sound_for_days() -> None:
    filters = JointFilters(np.full((4, 4), 0.3), np.full((4, 4), 0.02), 3600.0, np.ones(4))
    generator = np.random.default_rng(0)
    for k in range(4_000):
        regressor = generator.normal(size=(4, 4)) * [1.0, 0.0, 1e-6, 1e3]
        filters.predict(0.05 if k % 100 else 86_400.0)
        filters.update(regressor, generator.normal(size=4), generator.random(4) < 0.5, generator.random(4) < 0.5)
    P = filters.covariance
    assert np.array_equal(P, P.transpose(0, 2, 1))
    assert np.linalg.eigvalsh(P).min() > 0
    assert np.abs(filters.state).max() < 10


def test_noise_is_inflated_to_the_variance_of_a_mean_of_correlated_errors() -> None:
    filters = JointFilters(np.ones((1, 4)), np.ones((1, 4)), 3600.0, np.ones(1))
    filters.lagged[:] = 0.6
    errors = lfilter([0.8], [1.0, -0.6], np.random.default_rng(0).standard_normal((2_000, 220)))[:, 20:]
    assert filters.inflation() == pytest.approx(200 * errors.mean(axis=1).var(), rel=0.1)


def test_the_interval_is_that_of_both_changes_together(robot: Robot, result: Result) -> None:
    online, changes = OnlineFriction(result, robot, RATE), np.array([1.0, 0.0, 1.0, 0.0])
    root = 0.01 * np.random.default_rng(0).standard_normal(online.filters.covariance.shape)
    online.filters.covariance = root @ root.transpose(0, 2, 1)
    covariance = online.filters.with_shared_payload()[1]
    found = [np.ptp(own.interval_95) / own.baseline / 2 for own in online.state().values()]
    np.testing.assert_allclose(found, 1.96 * np.sqrt(changes @ covariance @ changes))


@pytest.mark.parametrize(("change", "viscous"), [(0.35, 0.0), (0.0, 0.4)])
def test_a_change_of_all_joints_is_named_as_one(change: float, viscous: float) -> None:
    names, share = tuple("abcdefgh"), np.linspace(0.1, 0.8, 8)
    of: Any = SimpleNamespace(names=names, spread=np.full(8, 0.13), viscous_share=share)
    dog, alarms, covariance = Watchdog(of, 50.0, 100.0), list[Alarm](), np.tile(np.diag([4e-4, 4e-4]), (8, 1, 1))
    for second in range(140):
        later = second > 70
        changes = later * np.stack([np.full(8, change), viscous * share], axis=1)
        payload, stream = (0.06 * later, 0.005), np.zeros((2, 8))
        alarms += dog.check(float(second), changes, covariance, np.ones(8, bool), payload, stream)
    assert {alarm.kind for alarm in alarms} == {"all joints", "payload"}
    sizes = {alarm.kind: alarm.change for alarm in alarms}
    assert sizes["all joints"] == pytest.approx(max(change, viscous), abs=0.1)
    assert sizes["payload"] == pytest.approx(3.0, abs=0.3)  # 6 % of 50 kg


@pytest.mark.parametrize(("change", "raised"), [(0.12, []), (0.5, ["c"])])
def test_a_sure_change_is_no_alarm_while_it_is_a_normal_one(change: float, raised: list[str]) -> None:
    of: Any = SimpleNamespace(names=tuple("abcd"), spread=np.full(4, 0.05), viscous_share=np.full(4, 0.3))
    dog, alarms, covariance = Watchdog(of, 50.0, 100.0), list[Alarm](), np.tile(1e-8 * np.eye(2), (4, 1, 1))
    for second in range(50):
        changes = np.zeros((4, 2))
        changes[2, 0] = change * (second > 20)
        alarms += dog.check(float(second), changes, covariance, np.ones(4, bool), (0.0, np.inf), np.zeros((2, 4)))
    assert [alarm.name for alarm in alarms] == raised


MODES = {"panda": (), "talos": ("left",), "g1": ("right", "left"), "go2": ("FL", "RR"), "cassie": ("left",)}


@pytest.mark.parametrize("name", MODES)
def test_a_sample_has_the_momentum_of_a_batch(name: str) -> None:
    robot, feet = example_robot(name), MODES[name]
    generator = np.random.default_rng(0)
    position, velocity = generator.normal(size=(2, 1, len(robot.joint_names)))
    turn = generator.normal(size=(1, 4))
    turn /= np.linalg.norm(turn)
    omega = generator.normal(size=(1, 3))
    mode = ContactMode(robot, feet, feet[0] if feet else "")
    orientation = Orientation(turn, omega, np.zeros((1, 3))) if feet else None
    rooted, root = mode.rooted, mode.root(State(position, velocity, 0 * velocity, orientation))
    expected = momentum_balance(rooted, position, velocity, root)
    tree = Tree(mode)
    found = tree.momentum(position[0], velocity[0], (turn[0], omega[0]) if feet else (None, None))
    for own, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(own, other[0], rtol=1e-6, atol=1e-6 * np.abs(other).max())


def test_a_payload_is_the_difference_of_two_models() -> None:
    robot = example_robot("talos")
    mode = ContactMode(robot, ("left",), "left")
    position = np.random.default_rng(0).normal(size=(1, len(robot.joint_names)))
    still, turn = np.zeros_like(position), np.array([[0.1, -0.2, 0.3, 0.9]])
    turn /= np.linalg.norm(turn)
    state = State(position, still, still, Orientation(turn, *np.zeros((2, 1, 3))))
    rooted, root = mode.rooted, mode.root(state)
    joint, pose = rooted.bodies[1]
    model = rooted.model.copy()
    model.appendBodyToJoint(joint, pin.Inertia(1.0, robot.tree.model.inertias[1].lever, np.zeros((3, 3))), pose)
    light, heavy = (
        rooted_inverse_dynamics(tree, position, still, still, root)[1][0]
        for tree in (rooted, replace(rooted, model=model))
    )
    found = Tree(mode).payload(position[0], (turn[0], None))
    np.testing.assert_allclose(found, heavy - light, atol=1e-9 * np.abs(heavy).max())

"""The law auto finds the terms that a joint has, with their sizes, and none that it does not have."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.interpolate import make_interp_spline
from tests.whole_log.logs import PLAIN

from stribeck import Robot, identify
from stribeck.core.base.typing import Array
from stribeck.core.friction import get_law
from stribeck.core.log import RobotLog
from stribeck.core.result import Result
from stribeck.core.settings import Settings
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.sensors.measure import with_noise

AUTO = Settings(method="whole-log", corrections="none", law="auto")


def plain_log(arm: Robot, duration: float, seed: int) -> tuple[RobotLog, Array]:
    """A log of Coulomb and viscous friction, and the torques that the joints carry."""
    law, friction = get_law("coulomb-viscous"), dict.fromkeys(arm.joint_names, PLAIN)
    log, truth = exact_log(arm, law, friction, duration=duration, seed=seed)
    return log, log.torque - truth.friction_torque


def dahl_lag(position: Array, travel: float) -> Array:
    """What is missing if friction of one follows within a travel, from positions alone."""
    step = np.diff(position, prepend=position[:1])
    z = np.zeros(len(position))
    for k in range(1, len(z)):
        z[k] = np.sign(step[k]) + (z[k - 1] - np.sign(step[k])) * np.exp(-abs(step[k]) / travel)
    return np.asarray(z - np.sign(step))


def kept(result: Result) -> dict[str, set[str]]:
    return {
        name: {term for term, verdict in joint.terms.items() if verdict.kept}
        for name, joint in result.joints.items()
        if joint.terms
    }


@pytest.fixture(scope="module")
def mixed(arm: Robot) -> Result:
    """Each joint has a term of its own: none, a Stribeck effect, load, drift, asymmetry, no viscous friction."""
    log, load = plain_log(arm, 30.0, 1)
    v, run = log.velocity, log.time / log.time[-1] - 0.5
    more = np.zeros_like(v)
    stribeck = 1.2 * np.tanh(50 * v[:, 1]) * (1 + 0.3 * np.exp(-((v[:, 1] / 0.15) ** 2)))
    more[:, 1] = stribeck - 1.2 * np.sign(v[:, 1])
    more[:, 2] = 0.08 * np.abs(load[:, 2]) * np.sign(v[:, 2])
    more[:, 3] = run * (-0.3 * np.sign(v[:, 3]) - 0.1 * v[:, 3])
    more[:, 4] = 0.2 * 0.3 * np.abs(v[:, 4])
    more[:, 5] = -0.3 * v[:, 5]
    return identify(with_noise(replace(log, torque=log.torque + more), position=5e-5, torque=0.1, seed=2), arm, AUTO)


def test_each_joint_has_its_own_terms_and_no_other(arm: Robot, mixed: Result) -> None:
    expected = [{"viscous"}, {"viscous", "stribeck"}, {"viscous", "load"}]
    expected += [{"viscous", "viscous_drift", "coulomb_drift"}, {"viscous", "asymmetry"}, set()]
    assert kept(mixed) == dict(zip(arm.joint_names, expected, strict=True))
    assert mixed.law == "auto"
    assert "between the" not in mixed.summary()  # a single log


def test_terms_have_their_true_sizes_within_their_intervals(arm: Robot, mixed: Result) -> None:
    truths = [
        PLAIN,
        PLAIN | {"stribeck_gain": 0.3, "stribeck_velocity": 0.15, "slope": 50.0},
        PLAIN | {"load": 0.08},
        PLAIN | {"coulomb_drift": -0.3, "viscous_drift": -0.1},
        PLAIN | {"viscous_asymmetry": 0.2},
        {"coulomb": 1.2, "offset": 0.2},
    ]
    off = []
    for name, truth in zip(arm.joint_names, truths, strict=True):
        found = mixed.joints[name].parameters
        assert set(found) == set(truth), name
        off += [(found[key].value - value) / found[key].standard_error for key, value in truth.items()]
    assert np.mean(np.abs(off) < 2) > 0.85
    assert np.abs(off).max() < 4
    for name, size in (("load", 0.08), ("coulomb_drift", -0.3), ("viscous_asymmetry", 0.2), ("stribeck_gain", 0.3)):
        value = next(j.parameters[name].value for j in mixed.joints.values() if name in j.parameters)
        assert value == pytest.approx(size, rel=0.15), name


def test_no_drift_is_tried_where_speed_rises_with_time(arm: Robot) -> None:
    """A chirp would explain with time what friction does at higher speeds."""
    log, _ = plain_log(arm, 15.0, 3)
    motion, time = make_interp_spline(log.time, log.position, k=5), np.arange(0.0, 30.0, 2e-3)[:, None]
    phase, pace = (15 * (time / 30) ** 3)[:, 0], 1.5 * (time / 30) ** 2
    q, slope, bend = (motion(phase, order) for order in range(3))
    v, a = slope * pace, bend * pace**2 + slope * time / 300
    model, data = arm.tree.model, arm.tree.model.createData()
    torque = np.array([pin.rnea(model, data, *state) for state in zip(q, v, a, strict=True)])
    torque += PLAIN["coulomb"] * np.sign(v) + PLAIN["viscous"] * v + PLAIN["offset"]
    chirp = replace(log, time=time[:, 0], position=q, torque=torque, velocity=None, acceleration=None)
    found = identify(with_noise(chirp, position=5e-5, torque=0.1, seed=4), arm, AUTO).joints.values()
    assert all(joint.terms["coulomb_drift"].reason.startswith("the speed changes steadily") for joint in found)


@pytest.mark.parametrize(("cold", "verdict"), [(1.0, "identified"), (3.0, "weak")])
def test_friction_of_a_robot_that_warms_up_is_the_mean_and_its_interval_contains_the_change(arm, cold, verdict):
    """Viscous friction settles at 60 % with a time constant of a third of the log."""
    log, _ = plain_log(arm, 30.0, 7)
    cooled = cold - (cold - 0.6) * (1 - np.exp(-log.time / 10.0)) / (1 - np.exp(-3.0))
    torque = log.torque + ((cooled - 1) * PLAIN["viscous"])[:, None] * log.velocity
    result = identify(with_noise(replace(log, torque=torque), position=5e-5, torque=0.1, seed=8), arm, AUTO)
    (finding,) = result.findings
    assert (finding.check, finding.joints) == ("friction-drift", arm.joint_names)
    for joint in result.joints.values():
        assert (joint.verdict, joint.remedy) == (verdict, finding.cure if verdict == "weak" else None)
        for point in joint.curve:
            shares = np.array([cold, cooled.mean(), 0.6])
            start, mean, end = PLAIN["coulomb"] + shares * PLAIN["viscous"] * point.velocity
            assert point.value == pytest.approx(mean, rel=0.02 * cold)
            assert point.interval_95[0] < end < start < point.interval_95[1]


def test_a_logged_temperature_takes_the_place_of_time(arm: Robot) -> None:
    log, _ = plain_log(arm, 20.0, 3)
    warming = np.array([10.0, 10.0, 10.0, 10.0, 1.0, 10.0]) * (1 - np.exp(-log.time[:, None] / 8))
    temperature = 30.0 + warming
    temperature[:, 5] = np.nan
    change = np.zeros(6)
    change[:2] = -0.012
    torque = log.torque + change * (temperature - temperature.mean(axis=0)) * log.velocity
    torque[:, 5] = log.torque[:, 5]
    log = replace(log, torque=torque, temperature=temperature)
    result = identify(with_noise(log, position=5e-5, torque=0.1, seed=4), arm, AUTO)
    first, second, *others = result.joints.values()
    for joint in (first, second):
        found = joint.parameters["viscous_per_kelvin"]
        assert found.value == pytest.approx(-0.012, abs=3 * found.standard_error)
        assert found.unit == "N m s/(rad K)"
        assert "coulomb_per_kelvin" not in joint.parameters
    for joint in others:
        assert set(joint.parameters) == {"viscous", "coulomb", "offset"}
    means = [joint.mean_temperature for joint in result.joints.values()]
    np.testing.assert_allclose(means[0] or 0.0, temperature[:, 0].mean(), atol=0.1 * np.ptp(temperature[:, 0]))
    assert means[5] is None
    reasons = [joint.terms["viscous_temperature"].reason for joint in others if joint.terms]
    assert reasons[2].startswith("its temperature changes by 0.9")
    assert reasons[3] == "the log has no temperature of this joint throughout"
    assert others[0].terms["coulomb_drift"].reason == "the log has temperatures, which explain drift better than time"


def test_friction_and_torque_that_change_over_position_are_found(arm: Robot) -> None:
    """Coulomb friction of two joints changes in the course of a turn; the torque of another ripples 12 times a turn.

    In a fourth one friction builds up over 12 mrad after a reversal.
    """
    log, _ = plain_log(arm, 20.0, 9)
    turning = np.zeros(6)
    turning[[0, 3]] = 0.3
    change = turning * np.cos(log.position - 0.5) * np.sign(log.velocity)
    change[:, 2] = 0.15 * np.cos(12 * log.position[:, 2] - 1.0)
    change[:, 4] = 1.2 * dahl_lag(log.position[:, 4], 0.012)
    noisy = with_noise(replace(log, torque=log.torque + change), position=5e-5, torque=0.1, seed=10)
    result = identify(noisy, arm, AUTO)
    for name, joint in result.joints.items():
        assert joint.terms["ripple"].kept == (name == arm.joint_names[2]), joint.terms["ripple"]
        assert (joint.ripple_per_turn is None) == (name != arm.joint_names[2])
        assert joint.terms["presliding"].kept == (name == arm.joint_names[4]), joint.terms["presliding"]
    bending = result.joints[arm.joint_names[4]]
    assert bending.presliding_travel == pytest.approx(0.012, rel=0.15)
    for name in ("presliding", "coulomb"):
        assert bending.parameters[name].value == pytest.approx(1.2, rel=0.02)
    period = float(np.median(np.diff(log.time)))
    acted = log.torque[:, 4] - plain_log(arm, 20.0, 9)[1][:, 4] + change[:, 4]
    built_up = bending.friction(log.velocity[:, 4], period=period, offset=True)
    steady = bending.friction(log.velocity[:, 4], offset=True)
    assert np.std(acted - built_up) < 0.1 * np.std(acted) < 0.5 * np.std(acted - steady)
    rippling = result.joints[arm.joint_names[2]]
    assert rippling.ripple_per_turn == pytest.approx(12, abs=0.1)
    where = np.linspace(log.position[:, 2].min(), log.position[:, 2].max(), 30)
    ripple = rippling.friction(np.ones(30), position=where) - rippling.friction(np.ones(30))
    np.testing.assert_allclose(ripple, 0.15 * np.cos(12 * where - 1.0), atol=0.02)
    for size, joint in zip(turning, result.joints.values(), strict=True):
        assert joint.terms["coulomb_position"].kept == bool(size), joint.terms["coulomb_position"]
        if size:
            found = {name: joint.parameters[name] for name in ("coulomb_cosine", "coulomb_sine")}
            truth = {"coulomb_cosine": size * np.cos(0.5), "coulomb_sine": size * np.sin(0.5)}
            for name, value in truth.items():
                assert found[name].value == pytest.approx(value, abs=3 * found[name].standard_error)
                assert found[name].interval_95[0] > 0


def test_the_simplest_law_wins_where_a_log_is_short_and_noisy(arm: Robot) -> None:
    log, load = plain_log(arm, 9.0, 9)
    torque = log.torque + 0.02 * np.abs(load) * np.sign(log.velocity)
    noisy = with_noise(replace(log, torque=torque), position=3e-3, torque=5.0, seed=10)
    result = identify(noisy, arm, AUTO)
    assert all(own <= {"viscous"} for own in kept(result).values())
    for joint in result.joints.values():
        if joint.terms:
            assert "are needed" in joint.terms["coulomb_drift"].reason  # 9 s are too short for it


def test_the_law_is_drawn_at_the_load_that_the_joint_carries(mixed: Result) -> None:
    joint = next(joint for joint in mixed.joints.values() if "load" in joint.parameters)
    speeds = np.array([-1.0, 1.0])
    truth = np.sign(speeds) * (1.2 + 0.08 * joint.mean_load) + 0.3 * speeds
    fitted = joint.band(speeds)
    found, band = fitted
    np.testing.assert_allclose(found, truth, rtol=0.01)
    np.testing.assert_allclose(found, joint.friction(speeds), rtol=1e-12)
    assert np.all((band[1] > found) & (band[1] < found + 0.1))


def test_a_joint_that_shows_too_little_has_the_term_that_most_others_have(arm: Robot) -> None:
    shape = {"stribeck_gain": 0.3, "stribeck_velocity": 0.15, "slope": 50.0}
    truth = dict.fromkeys(arm.joint_names, PLAIN | shape)
    light = arm.joint_names[4]
    truth[light] = {"viscous": 0.05, "coulomb": 0.1, "offset": 0.0} | shape
    log, _ = exact_log(arm, get_law("stribeck"), truth, duration=15.0, seed=4)
    log = with_noise(log, position=5e-5, torque=0.15, seed=5)
    together = identify(log, arm, AUTO).joints[light]
    assert together.terms["stribeck"].kept
    assert together.terms["stribeck"].reason.startswith("most joints with friction have it")
    low, high = together.parameters["coulomb"].interval_95
    assert low < 0.1 < high


def test_the_interval_contains_a_curve_that_the_law_does_not_have(arm: Robot) -> None:
    """Friction that rises up to a quarter of the top speed; and that of the law, whose interval stays narrow."""
    log, widths = plain_log(arm, 30.0, 5)[0], []
    for size in (0.36, 0.0):
        torque = log.torque + size * np.tanh(log.velocity / 0.4)
        noisy = with_noise(replace(log, torque=torque), position=5e-5, torque=0.1)
        points = [point for joint in identify(noisy, arm, AUTO).joints.values() for point in joint.curve]
        speed, value, half = np.array([(point.velocity, point.value, point.half_width) for point in points]).T
        true = PLAIN["coulomb"] + PLAIN["viscous"] * speed + size * np.tanh(speed / 0.4)
        assert np.mean(np.abs(value - true) > half) < 0.1
        widths.append(np.median(half / true))
    assert 10 * widths[1] < widths[0] < 0.15

"""A law with state is fitted along the whole motion, through the filter that the samples have passed."""

from dataclasses import replace

import numpy as np
import pytest
from tests.samples import make_samples

from stribeck import Robot, RobotLog, Settings, identify
from stribeck.core.base.typing import Array
from stribeck.core.filters.averaging import average_nodes
from stribeck.core.friction import get_law
from stribeck.core.friction.law import Motion
from stribeck.core.judgement.curve_fit.along import FORGOTTEN, Along, along, state_known
from stribeck.core.judgement.curve_fit.problem import joint_problem
from stribeck.core.judgement.verdict import judge
from stribeck.core.result.samples import FrictionSamples
from stribeck.paper.curve_fit.fit import fit_joint, fit_law, validate
from stribeck.paper.lugre import LuGre
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.robots import MODELS
from stribeck.simulation.sensors.measure import with_noise

TRUTH = np.array([0.3, 1.2, 0.3, 0.15, 0.2, 4e-3, 2.0])
PERIOD = 2e-3


def samples_of(velocity: Array, torque: Array, breaks: tuple[int, ...] = (), **others: object) -> FrictionSamples:
    time = np.arange(len(velocity)) * PERIOD
    for row in breaks:
        time[row:] += 1.0
    block = np.arange(len(velocity)) // 500
    return make_samples(velocity, torque, period=PERIOD, time=time, block=block, **others)


def swinging(count: int) -> Array:
    time = np.arange(count) * PERIOD
    return np.asarray(1.2 * np.sin(3.1 * time) * np.sin(0.7 * time + 1))


@pytest.mark.parametrize("changes", [(3.0, 3.0), (0.3, 0.3), (3.0, 0.1)])
def test_known_bristles_are_recovered_from_any_start(changes: tuple[float, float]) -> None:
    velocity, law = swinging(10_000), LuGre()
    motion = Motion(velocity=velocity, period=PERIOD, begins=np.arange(10_000) == 0)
    truth = TRUTH * [1, 1, 1, 1, 1, *changes]
    found = fit_joint(joint_problem(samples_of(velocity, law.torque_along(motion, truth)), "knee", law, Settings()))
    np.testing.assert_allclose(found.values, truth, rtol=1e-5)


def test_averages_stop_at_the_ends_of_pieces() -> None:
    motion = Motion(velocity=np.ones(7), period=1.0, begins=np.array([1, 0, 0, 0, 1, 0, 0], dtype=bool))
    kernel = np.array([0.25, 0.5, 0.25])
    torque = np.array([0.0, 0.0, 4.0, 0.0, 8.0, 8.0, 0.0])
    found = Along(motion=motion, rows=np.arange(7), kernel=kernel).average(torque)
    np.testing.assert_allclose(found, [0.0, 1.0, 2.0, 1.0, 8.0, 6.0, 2.0])
    part = Along(motion=motion, rows=np.array([2, 5]), kernel=kernel).average(np.column_stack([torque, -torque]))
    np.testing.assert_allclose(part, [[2.0, -2.0], [6.0, -6.0]])


@pytest.mark.parametrize("stride", [1, 3])
def test_thinned_samples_have_the_filters_average(stride: int) -> None:
    weights = np.hanning(25)
    nodes = average_nodes(weights / weights.sum(), PERIOD)
    velocity = swinging(3000)
    thin = slice(None, None, stride)
    own = samples_of(velocity, velocity, nodes=nodes)
    kept = replace(
        own, stride=stride, **{name: getattr(own, name)[thin] for name in ("time", "velocity", "friction_torque")}
    )
    found = along(kept, 0, np.arange(len(kept.time))).average(velocity[thin])
    exact = np.convolve(velocity, weights / weights.sum(), "same")[thin]
    inside = slice(20, -20)
    np.testing.assert_allclose(found[inside], exact[inside], atol=1e-4)


def test_samples_before_the_state_is_known_are_left_out_after_every_break() -> None:
    velocity = np.concatenate([np.zeros(500), np.ones(1000), -np.ones(1000)])
    known = state_known(samples_of(velocity, velocity, breaks=(1500,)), 0, rest=0.005)
    begin, needed = 500, round(FORGOTTEN / PERIOD)
    assert not known[: begin + needed - 2].any()
    assert known[begin + needed + 2 : 1500].all()
    assert not known[1500 : 1500 + needed - 2].any()
    assert known[1500 + needed + 2 :].all()


def bristled(robot: Robot, seconds: float = 10.0) -> RobotLog:
    """Return a noisy log whose friction is LuGre's, of a prescribed motion, evaluated ten times as often as logged."""
    exact, _ = exact_log(robot, get_law("coulomb-viscous"), {}, duration=seconds, rate=5000.0, seed=3)
    begins = np.arange(len(exact.time)) == 0
    torque = [LuGre().torque_along(Motion(velocity=own, period=2e-4, begins=begins), TRUTH) for own in exact.velocity.T]
    log = replace(exact, torque=exact.torque + np.column_stack(torque), velocity=None, acceleration=None)
    return with_noise(log.take(slice(None, None, 10)), position=2e-5, torque=0.05, seed=4)


def test_bristles_are_covered_in_a_noisy_log() -> None:
    robot = Robot.from_file(MODELS / "arm.toml")
    log = bristled(robot)
    result = identify(log, robot, law="lugre", method="curve-fit")
    static = identify(log, robot, law="stribeck", method="curve-fit")
    truth = dict(zip([parameter.name for parameter in LuGre.parameters], TRUTH, strict=True))
    holds = []
    for name, joint in result.joints.items():
        travel = joint.parameters["bristle_travel"]
        assert abs(travel.value - truth["bristle_travel"]) < 0.2 * truth["bristle_travel"], name
        holds += [p.interval_95[0] <= truth[key] <= p.interval_95[1] for key, p in joint.parameters.items()]
        assert joint.validation.rms < 0.6 * static.joints[name].validation.rms
        assert 1 - joint.torque_r2.nominal < 0.5 * (1 - static.joints[name].torque_r2.nominal)
    assert sum(holds) >= 0.8 * len(holds)
    velocity = np.array([0.01, 0.01, -0.01, -0.01])
    one = result.joints["elbow"]
    after = one.friction(velocity, period=1e-4)
    assert after[2] > 0  # bristles are still bent forward
    np.testing.assert_allclose(one.friction(velocity[:2], period=1e-4), one.friction(velocity[:2]))


def test_stiff_bristles_are_called_weak_and_why() -> None:
    velocity, law = swinging(10_000), LuGre()
    weights = np.hanning(61)
    nodes = average_nodes(weights / weights.sum(), PERIOD)
    motion = Motion(velocity=velocity, period=PERIOD, begins=np.arange(10_000) == 0)
    stiff = TRUTH * [1, 1, 1, 1, 1, 0.02, 0.02]
    whole = along(samples_of(velocity, velocity, nodes=nodes), 0, np.arange(10_000))
    torque = whole.average(law.torque_along(motion, stiff))
    noise = 0.02 * np.random.default_rng(1).standard_normal(len(torque))
    samples = samples_of(velocity, torque + noise, nodes=nodes)
    fits = fit_law(samples, law, Settings())
    joint = judge(fits, samples, law, Settings(), validate(fits, samples, law, Settings())[0])["knee"]
    assert joint.verdict == "identified"
    assert joint.parameters["bristle_damping"].verdict == "weak"
    assert joint.parameters["bristle_travel"].verdict == "weak"
    assert joint.parameters["coulomb"].verdict == "identified"
    assert "filter's window, more than the bristle travel of" in joint.reason

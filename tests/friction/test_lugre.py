"""Friction with a state: LuGre's state, derivatives and steady law, and presliding over travel."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stribeck.core.base.typing import Array
from stribeck.core.friction.law import Motion
from stribeck.core.friction.presliding import lag_behind
from stribeck.paper.lugre import LuGre
from stribeck.simulation.friction import FrictionTruth, Instant
from stribeck.simulation.friction import LuGre as SimulatedLuGre

LAW = LuGre()
VALUES = np.array([0.3, 1.0, 0.4, 0.2, 0.1, 4e-3, 2.0])


def motion_of(velocity: Array, period: float = 1e-3, begins: tuple[int, ...] = (0,)) -> Motion:
    return Motion(velocity=velocity, period=period, begins=np.isin(np.arange(len(velocity)), begins))


def swinging(time: Array) -> Array:
    return np.asarray(1.5 * np.sin(3 * time) * np.sin(0.7 * time + 1))


def test_it_equals_the_simulator_with_short_steps() -> None:
    fine, every = 5e-5, 40
    velocity = swinging(np.arange(30_000) * fine + 0.5)
    Fv, Fc, S, vs, offset, d, damping = VALUES
    steady = {"viscous": Fv, "coulomb": Fc, "stribeck_gain": S, "stribeck_velocity": vs, "offset": offset}
    bristles = {"joint": {**steady, "bristle_stiffness": Fc / d, "bristle_damping": damping}}
    truth, nothing = FrictionTruth(1, [SimulatedLuGre(["joint"], bristles)]), np.zeros(1)
    torque, before = np.empty_like(velocity), velocity[:1]
    for k, now in enumerate(velocity[:, None]):
        truth.before(Instant(0.0, fine, nothing, before, nothing))
        torque[k], before = truth.after(now)[0], now
    found = LAW.torque_along(motion_of(velocity[::every], fine * every), VALUES)
    later = slice(100, None)  # the simulator's bristles begin straight
    np.testing.assert_allclose(found[later], torque[::every][later], atol=1e-2)


@settings(max_examples=20)
@given(st.integers(0, 10_000))
def test_its_derivatives_are_differences(seed: int) -> None:
    generator = np.random.default_rng(seed)
    values = VALUES * np.exp(generator.uniform(-1, 1, 7))
    motion = motion_of(swinging(np.arange(3000) * 2e-3 + generator.uniform(0, 9)), 2e-3, (0, 1200))
    jacobian = LAW.jacobian_along(motion, values)
    for k, value in enumerate(values):
        step = 1e-6 * value * (np.arange(7) == k)
        slope = LAW.torque_along(motion, values + step) - LAW.torque_along(motion, values - step)
        slope /= 2 * step[k]
        np.testing.assert_allclose(jacobian[:, k], slope, atol=2e-5 * (1 + np.abs(slope).max()))


@given(st.floats(0.01, 3.0), st.sampled_from([-1.0, 1.0]), st.floats(1e-4, 0.1))
def test_steady_sliding_is_the_law_of_velocity(speed: float, way: float, period: float) -> None:
    velocity = np.full(50, way * speed)
    np.testing.assert_allclose(
        LAW.torque_along(motion_of(velocity, period), VALUES), LAW.torque(velocity, VALUES), rtol=1e-12
    )


@given(st.floats(1e-6, 1.0), st.floats(1e-4, 10.0))
def test_bristles_never_bend_further_than_they_slip(travel: float, period: float) -> None:
    values = VALUES * [0, 1, 1, 1, 0, 0, 0] + [0, 0, 0, 0, 0, travel, 0]
    torque = LAW.torque_along(motion_of(swinging(np.arange(500) * period), period), values)
    assert np.abs(torque).max() <= VALUES[1] * (1 + VALUES[2]) * (1 + 1e-12)


def test_pieces_do_not_see_each_other() -> None:
    velocity = swinging(np.arange(2000) * 1e-3)
    together = LAW.torque_along(motion_of(velocity, begins=(0, 700)), VALUES)
    apart = [LAW.torque_along(motion_of(part), VALUES) for part in (velocity[:700], velocity[700:])]
    np.testing.assert_allclose(together, np.concatenate(apart), rtol=1e-12)


TRAVEL, SMOOTH = 0.01, 1e-3


@pytest.mark.parametrize("speed", [0.05, 0.5])
def test_friction_comes_back_within_the_travel_at_any_speed(speed: float) -> None:
    travels, period = np.array([0.002, 0.01, 0.03, 0.09]), 1e-3
    velocity = speed * np.repeat([-1.0, 1.0], round(0.1 / (speed * period)))[:, None]  # a reversal from steady sliding
    lag = lag_behind(velocity, period, SMOOTH, np.full((1, 1), TRAVEL))[0, len(velocity) // 2 :, 0]
    found = np.interp(travels, speed * period * np.arange(1, len(lag) + 1), lag)
    np.testing.assert_allclose(found, -2 * np.exp(-travels / TRAVEL), rtol=0.05)

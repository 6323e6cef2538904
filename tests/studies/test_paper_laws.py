"""Chapter 3: what the studies of friction laws and of fixed steps rest on."""

import numpy as np
import pytest
from studies.paper.chapter3 import smoothing
from studies.paper.coasting import STEP, chatter, coast, least_inertia
from studies.paper.laws import BRISTLES, KNEE, SLOPE, STATIC, breakaway, curve, lugre
from studies.paper.laws import STEP as LUGRE_STEP

FALL = {"start": 0.5, "duration": 0.6}


@pytest.mark.parametrize("slope", [20.0, 40.0, 1000.0])
def test_explicit_steps_chatter_below_the_least_inertia_and_nowhere_else(slope: float) -> None:
    least = least_inertia(slope)
    assert chatter(coast(1.05 * least, slope, implicit=False, **FALL)) == 0
    assert chatter(coast(0.95 * least, slope, implicit=False, **FALL)) > 0


def test_chatter_is_the_velocity_that_one_step_of_friction_turns_round() -> None:
    inertia = 0.9 * least_inertia(SLOPE)
    found = chatter(coast(inertia, SLOPE, implicit=False, **FALL))
    assert 2 * found == pytest.approx(STEP / inertia * curve("stribeck", np.array([found]))[0], rel=1e-6)


@pytest.mark.parametrize("slope", [10.0, 1000.0, np.inf])
def test_implicit_steps_only_ever_lose_speed(slope: float) -> None:
    speed = np.abs(coast(0.01, slope, implicit=True, **FALL))
    assert np.all(np.diff(speed) <= 0)


@pytest.mark.parametrize(("implicit", "order"), [(False, 1), (True, 2)])
def test_shorter_steps_are_closer_by_their_order(implicit: bool, order: int) -> None:
    fine = coast(0.5, 10.0, implicit=True, step=STEP / 64, start=0.5, duration=0.2)
    long, short = (
        np.abs(coast(0.5, 10.0, implicit=implicit, step=step, start=0.5, duration=0.2)[-1] - fine[-1])
        for step in (8 * STEP, 4 * STEP)
    )
    assert np.log2(long / short) == pytest.approx(order, abs=0.2)


def test_without_a_stribeck_effect_the_band_is_that_of_tanh() -> None:
    steep = smoothing(1e4)  # so steep that the Stribeck effect is constant across the band
    assert steep["band"] == pytest.approx(np.arctanh(1 - 0.05 / STATIC) / 1e4, rel=1e-3)
    assert steep["creep"] == pytest.approx(np.arctanh(0.5 / STATIC) / 1e4, rel=1e-3)
    assert steep["kept"] == pytest.approx(1.0, abs=1e-3)


def test_lugre_is_the_steady_law_when_it_slides_and_a_spring_before() -> None:
    steady = lugre(np.full(5000, 0.3))[-1]
    assert steady == pytest.approx(curve("stribeck-exponent", np.array([0.3]))[0], rel=1e-3)
    slow = np.full(100, 1e-3)  # so slow that damping says nothing
    spring = lugre(slow)[-1] - BRISTLES["bristle_damping"] * 1e-3 - KNEE["viscous"] * 1e-3
    assert spring == pytest.approx(BRISTLES["bristle_stiffness"] * 1e-3 * 100 * LUGRE_STEP, rel=0.02)


def test_slow_loads_break_away_at_static_friction_and_fast_ones_below() -> None:
    assert breakaway(0.02) == pytest.approx(STATIC, rel=0.01)
    assert breakaway(10.0) < breakaway(1.0) < breakaway(0.1) < STATIC

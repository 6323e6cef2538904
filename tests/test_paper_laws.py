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
def test_implicit_steps_never_turn_a_joint_round(slope: float) -> None:
    velocity = coast(0.01, slope, implicit=True, **FALL)
    assert np.all(velocity >= 0)
    assert np.all(np.diff(velocity) <= 0)


def test_both_ways_become_the_same_as_steps_become_short() -> None:
    ends = [
        np.abs(
            np.subtract(*(coast(0.5, SLOPE, implicit=way, step=step, start=0.5, duration=0.2) for way in (True, False)))
        )
        for step in (STEP, STEP / 10)
    ]
    assert ends[1][::10].max() < 0.2 * ends[0].max()


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

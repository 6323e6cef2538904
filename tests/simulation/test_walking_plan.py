"""Footsteps and the divergent component of motion."""

import numpy as np
import pytest

from stribeck_simulation.walking.footsteps import Footprint, Steps, plan_steps
from stribeck_simulation.walking.plan import BOTH, Stretch, plan_dcm, plan_walk

FEET = (Footprint(0.0, 0.1, 0.0), Footprint(0.0, -0.1, 0.0))
PULSATION = 3.2  # [1/s]
PERIOD = 1e-3  # [s]


def test_dcm_obeys_its_equation_and_ends_at_rest() -> None:
    places = [np.array(place) for place in ((0.0, 0.0), (0.0, -0.1), (0.3, 0.1), (0.3, 0.0))]
    stretches = [Stretch(0.7, places[0], places[0]), Stretch(0.2, places[0], places[1])]
    stretches += [Stretch(0.8, places[1], places[1]), Stretch(0.3, places[1], places[2])]
    stretches += [Stretch(0.4, places[2], places[3]), Stretch(1.0, places[3], places[3])]
    zmp, dcm = plan_dcm(stretches, PULSATION, PERIOD)
    slope = (dcm[2:] - dcm[:-2]) / (2 * PERIOD)
    np.testing.assert_allclose(slope, (PULSATION * (dcm - zmp))[1:-1], atol=1e-3)
    assert len(zmp) == 3401
    np.testing.assert_allclose(dcm[-1], places[3], atol=1e-12)
    np.testing.assert_allclose(zmp[1000], places[1], atol=1e-12)


@pytest.mark.parametrize(("sideways", "leader"), [(0.25, 0), (-0.25, 1)])
def test_sideways_the_leading_foot_is_the_one_on_that_side(sideways: float, leader: int) -> None:
    steps = plan_steps([Steps(count=6, sideways=sideways, width=0.16)], FEET)
    assert steps[0].foot == leader
    moved = [np.ptp([foot.y for foot in (step.goal, step.stance)]) for step in steps]
    np.testing.assert_allclose(moved[0], 0.25 + 0.18, atol=1e-12)
    np.testing.assert_allclose(moved[1::2], 0.16, atol=1e-12)
    np.testing.assert_allclose(moved[2::2], 0.16 + 0.25, atol=1e-12)


def test_a_plan_puts_the_weight_on_the_standing_foot() -> None:
    walk = [Steps(count=4, forward=0.2, turn=0.1), Steps(count=0, stand=1.0), Steps(count=2, sideways=0.1)]
    plan = plan_walk(walk, FEET, PULSATION, PERIOD)
    for foot in (0, 1):
        flying = plan.swing == foot
        assert flying.any()
        np.testing.assert_array_equal(plan.share[flying, foot], 0.0)
    np.testing.assert_allclose(plan.share.sum(axis=1), 1.0)
    assert np.abs(np.diff(plan.share, axis=0)).max() < 2 * PERIOD / 0.2
    assert np.sum(np.diff(plan.swing) != 0) == 12
    np.testing.assert_allclose(np.gradient(plan.heading, PERIOD), plan.heading_rate, atol=2e-3)
    rest = int(np.sum(plan.swing == BOTH))
    expected = 0.5 + 4 * 0.2 + 0.4 + 1.0 + 0.5 + 2 * 0.2 + 0.4 + 1.0
    assert rest * PERIOD == pytest.approx(expected, abs=0.01)

"""Steps that change when the robot is pushed, on the model they are derived from."""

import numpy as np
import pytest

from stribeck_simulation.robots.sole import Sole
from stribeck_simulation.walking.balance.step_adjustment import GAP, LAST, LEFT, REACH, StepAdjuster
from stribeck_simulation.walking.footsteps import Footprint, Steps
from stribeck_simulation.walking.plan import BOTH, Plan, plan_walk

PULSATION = 3.2  # [1/s]
FEEDBACK = 3.0  # [1/s]
SOLE = Sole((0.0, 0.0, 0.0), 0.1, 0.05)


def walk(turned: float = 0.0) -> Plan:
    feet = [Footprint(-0.1 * side * np.sin(turned), 0.1 * side * np.cos(turned), turned) for side in (1, -1)]
    return plan_walk([Steps(count=6, forward=0.3)], (feet[0], feet[1]), PULSATION)


def swing_of(plan: Plan, number: int) -> np.ndarray:
    return np.flatnonzero((plan.step == number) & (plan.swing != BOTH))


def adjusted(plan: Plan, number: int, error: np.ndarray, share: float = 0.5) -> np.ndarray:
    """Return how the goal of a step has moved late in its swing, if this error of the DCM [m] stays from `share` on."""
    adjuster = StepAdjuster(plan, [SOLE, SOLE], PULSATION)
    rows = swing_of(plan, number)
    for k in rows:
        seen = error if plan.progress[k] > share else np.zeros(2)
        shift = adjuster.shift(int(k), plan.dcm[k] + seen)
    return shift.goal


def errors_after(plan: Plan, number: int, jump: np.ndarray, *, steps: bool) -> np.ndarray:
    """Return how far the DCM is from the plan [m], when it jumps in the middle of a swing, until the walk ends."""
    adjuster = StepAdjuster(plan, [SOLE, SOLE], PULSATION)
    size = 0.9 * np.array([SOLE.half_length, SOLE.half_width])
    start = swing_of(plan, number)[400]
    dcm, off = plan.dcm[0].copy(), []
    for k in range(plan.samples):
        dcm += jump * (k == start)
        shift = adjuster.shift(k, dcm)
        shift_zmp, shift_dcm = (shift.zmp, shift.dcm) if steps else (np.zeros(2), np.zeros(2))
        wish = shift_zmp + (1 + FEEDBACK / PULSATION) * (dcm - plan.dcm[k] - shift_dcm)
        zmp = plan.zmp[k] + shift_zmp + np.clip(wish - shift_zmp, -size, size)
        dcm = dcm + plan.period * PULSATION * (dcm - zmp)
        off.append(dcm - plan.dcm[k] - shift_dcm)
    return np.array(off)


@pytest.mark.parametrize("jump", [(0.1, 0.0), (-0.12, 0.0), (0.0, 0.07), (0.06, 0.06)])
def test_a_jump_that_no_sole_can_bear_is_met_by_a_step(jump: tuple[float, float]) -> None:
    plan = walk()
    number = next(n for n in (2, 3) if plan.steps[n].foot == 0)  # the left one, so that it can step to the left
    assert np.abs(errors_after(plan, number, np.array(jump), steps=False)[-1]).max() > 1.0
    assert np.abs(errors_after(plan, number, np.array(jump), steps=True)[-1]).max() < 2e-3


def test_what_the_sole_bears_and_what_comes_too_late_changes_nothing() -> None:
    assert np.all(adjusted(walk(), 2, 0.99 * LEFT * np.array([SOLE.half_width, SOLE.half_width])) == 0.0)
    assert np.any(adjusted(walk(), 2, np.array([0.08, 0.0])) != 0.0)
    assert np.all(adjusted(walk(), 2, np.array([0.3, 0.3]), share=LAST) == 0.0)  # too late
    assert np.all(adjusted(walk(), 5, np.array([0.3, 0.0])) == 0.0)  # the last step goes where it was planned


def test_feet_keep_apart_and_within_reach() -> None:
    plan = walk()
    foot = plan.steps[2].foot
    outwards = 1.0 if foot == 0 else -1.0
    inwards = adjusted(plan, 2, np.array([0.0, -0.3 * outwards]))
    apart = abs(plan.steps[2].goal.y - plan.steps[2].stance.y)
    assert abs(inwards[1]) == pytest.approx(apart - 2 * SOLE.half_width - GAP)
    far = adjusted(plan, 2, np.array([0.5, 0.5 * outwards]), share=0.4)
    np.testing.assert_allclose(np.abs(far), REACH)


def test_a_turned_walk_is_adjusted_in_its_own_directions() -> None:
    angle = 0.7
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    error = np.array([0.09, 0.02])
    np.testing.assert_allclose(adjusted(walk(angle), 2, turn @ error), turn @ adjusted(walk(), 2, error), atol=1e-9)

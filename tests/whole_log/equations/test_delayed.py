"""Equations with torques that are late: the same segments up to 0.02 s, and none is lost beyond it."""

import numpy as np
import pytest
from tests.whole_log.logs import arm_log, read_arm

from stribeck import Settings
from stribeck.friction_torque.preparation import prepare
from stribeck.whole_log.equations.build import weak_form
from stribeck.whole_log.equations.equation_sequence import EquationSequence, equation_sequence


@pytest.fixture(scope="module")
def undelayed() -> EquationSequence:
    robot, settings = read_arm(), Settings(corrections="inertia")
    part = prepare(arm_log(8.0), robot, settings)
    sampling = part.sampling
    joints = np.arange(len(robot.joint_names))
    phases = part.support.phases
    form = weak_form(robot, part.log, joints, phases, sampling.segments, sampling.period, settings)
    return equation_sequence([form])


@pytest.mark.parametrize("delay", [-0.02, 0.0, 0.01, 0.02])
def test_segments_are_the_same_for_delays_up_to_20_ms(undelayed: EquationSequence, delay: float) -> None:
    delayed = undelayed.delayed(delay)
    assert delayed.parts == undelayed.parts
    for k in (0, len(delayed) - 1):
        assert np.isfinite(delayed[k].residual).all()


def test_torques_come_later_by_the_delay(undelayed: EquationSequence) -> None:
    middle, form = len(undelayed) // 2, undelayed.forms[0]
    delay = form.window.step * form.period
    later, plain = undelayed.delayed(delay)[middle].torque, undelayed[middle].torque
    np.testing.assert_allclose(later[:-1], plain[1:], atol=1e-9)


@pytest.mark.parametrize("delay", [-0.1, 0.1])
def test_longer_delays_cut_rows_at_the_ends_of_the_log(undelayed: EquationSequence, delay: float) -> None:
    delayed = undelayed.delayed(delay)
    (log, first, _), (_, last, _) = delayed.parts[0], delayed.parts[-1]
    late = round(delay / delayed.forms[log].period)
    assert len(delayed) == len(undelayed)
    assert first.first + late >= first.unbroken.start
    assert last.last + late <= last.unbroken.stop
    assert delayed.parts[1:-1] == undelayed.parts[1:-1]

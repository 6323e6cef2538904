"""Equations with torques that are late lose the rows whose torques are not in the log."""

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
    form = weak_form(robot, prepare(arm_log(8.0), robot, settings), np.arange(len(robot.joint_names)), settings)
    return equation_sequence([form], np.ones(len(form.joints)))


@pytest.mark.parametrize("delay", [-0.1, 0.1])
def test_longer_delays_cut_rows_at_the_ends_of_the_log(undelayed: EquationSequence, delay: float) -> None:
    delayed = undelayed.delayed(delay)
    (log, first, _), (_, last, _) = delayed.parts[0], delayed.parts[-1]
    late = round(delay / delayed.forms[log].period)
    assert len(delayed) == len(undelayed)
    assert first.first + late >= first.unbroken.start
    assert last.last + late <= last.unbroken.stop
    assert delayed.parts[1:-1] == undelayed.parts[1:-1]

"""Base parameters: every motion's columns of inertial parameters are the same sums of the independent ones."""

import numpy as np
import pytest

from stribeck import Robot
from stribeck.equations.base_parameters import base_parameters
from stribeck.equations.build import weak_form
from stribeck.friction import get_law
from stribeck.preparation import prepare
from stribeck.settings import FilterSettings, Settings
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.prescribed.gait import Gait
from stribeck_simulation.robots.biped import MODELS
from stribeck_simulation.run import POSTURES

TRUTH = {"viscous": 0.3, "coulomb": 1.2, "offset": 0.2}
SETTINGS = Settings(method="whole-log", filter=FilterSettings(kind="savitzky-golay", window=31))


@pytest.mark.parametrize(
    ("file", "gait", "posture"),
    [("arm.toml", "swing", ""), ("robot.toml", "walk", "biped"), ("quadruped.toml", "walk", "quadruped")],
)
def test_the_columns_of_a_log_are_sums_of_the_independent_ones(file: str, gait: Gait, posture: str) -> None:
    robot = Robot.from_file(MODELS / file)
    friction = {joint: TRUTH for joint in robot.joint_names if joint not in robot.position_controlled}
    log, _ = exact_log(
        robot, get_law("coulomb-viscous"), friction, duration=4.0, gait=gait, posture=POSTURES.get(posture), seed=6
    )
    ready = prepare(log, robot, SETTINGS)
    arguments = ready.support.phases, ready.sampling.segments, ready.sampling.period, SETTINGS
    form = weak_form(robot, log, robot.torque_controlled, *arguments)
    independent, sums = base_parameters(robot, form.supports.values())
    assert len(independent) < 0.75 * sums.shape[1]
    np.testing.assert_allclose(sums[:, independent], np.eye(len(independent)), atol=1e-9)
    for stretch in form.stretches:
        columns = form.equations(stretch, 0).columns
        assert columns is not None
        inertial = columns[:, :, : sums.shape[1]]
        scale = np.abs(inertial).max()
        np.testing.assert_allclose(inertial[:, :, independent] @ sums, inertial, atol=1e-9 * scale)

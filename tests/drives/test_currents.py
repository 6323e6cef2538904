"""Currents without a torque constant: gravity determines the torque per ampere, or friction is in amperes."""

import re
from dataclasses import replace

import numpy as np
import pytest
from tests.arm import TRUTH, arm_log, write_arm

from stribeck import Robot, identify, inspect_log
from stribeck.check.drives import find_torques, gains
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.errors import LogError
from stribeck.core.log import RobotLog
from stribeck.core.settings import FilterSettings, Settings

GAINS = np.array([5.0, 8.0, 40.0])
"""Torque constants times gear ratios [N m/A]; gravity hardly loads the slide, whose constant the file omits."""
CURRENTS = 'torque_source = "motor_current"\nposition_controlled = ["slide"]\n'
EXACT = Settings(method="curve-fit", filter=FilterSettings(kind="log"), fit_armature=False)


def in_amperes(robot: Robot, log: RobotLog) -> RobotLog:
    """Convert the torques of an arm's log to currents with 10 mA of noise."""
    current = log.torque / GAINS + 0.01 * np.random.default_rng(1).normal(size=log.torque.shape)
    joints = dict.fromkeys((robot.joint_names[k] for k in robot.torque_controlled), 1.0)
    return replace(log, torque=current, unscaled=joints, torque_source="motor_current")


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    robot = Robot.from_file(write_arm(tmp_path_factory.mktemp("arm"), CURRENTS))
    return robot, arm_log(robot, duration=16.0, rate=250.0)


def test_gravity_determines_the_torque_per_ampere(arm):
    robot, log = arm
    found = identify(in_amperes(robot, log), robot, EXACT)
    (finding,) = [each for each in found.findings if each.check == "torque-constant"]
    assert finding.joints == ("shoulder", "elbow")
    assert "shoulder 4.999 ± 0.3 N m/A, elbow 7.963 ± 0.7 N m/A" in finding.text
    true = identify(log, robot, EXACT)
    for joint in ("shoulder", "elbow"):
        coulomb, known = (result.joints[joint].parameters["coulomb"] for result in (found, true))
        assert coulomb.interval_95[0] < TRUTH["coulomb"] < coulomb.interval_95[1]
        assert coulomb.standard_error > known.standard_error
        gain = found.joints[joint].parameters["offset"].value / TRUTH["offset"]
        assert gain == pytest.approx(1.0, abs=0.05)
    shown = inspect_log(in_amperes(robot, log), robot, EXACT)
    assert (shown.audit[0].check, shown.torque_source) == ("torque-constant", "motor_current")


def test_the_interval_of_the_gain_contains_the_truth(arm):
    robot, _ = arm
    off = []
    for seed in range(3):
        log = arm_log(robot, duration=30.0, rate=250.0, seed=seed)
        prepared = [prepare(replace(in_amperes(robot, log), unscaled={"shoulder": 1.0}), robot, robot.settings)]
        converted, _, errors, _ = find_torques(prepared, robot, robot.settings)
        factor = converted[0].log.torque[0, 0] / prepared[0].log.torque[0, 0]
        off.append((factor / GAINS[0] - 1) / errors["shoulder"])
    assert max(map(abs, off)) < 3


def test_the_interval_includes_errors_of_the_models_weights(arm):
    """With models as wrong as the priors, the gain's error matches its standard error. A wrist with little load has
    none.
    """
    robot, log = arm
    amperes, off = replace(in_amperes(robot, log), unscaled={"shoulder": 1.0}), []
    for seed in range(12):
        wrong = gains._drawn(robot, robot.settings.priors, 1000 + seed)
        prepared = [prepare(amperes, wrong, robot.settings)]
        converted, _, errors, _ = find_torques(prepared, wrong, robot.settings)
        off.append((converted[0].log.torque[0, 0] / amperes.torque[0, 0] / GAINS[0] - 1) / errors["shoulder"])
    assert 0.6 < np.sqrt(np.mean(np.square(off))) < 1.6
    unknown = robot.settings.model_copy(update={"priors": robot.settings.priors.model_copy(update={"mass": 0.5})})
    (finding,) = [each for each in inspect_log(amperes, robot, unknown).audit if each.check == "torque-constant"]
    assert re.search(r"shoulder \(gravity .* uncertain by \d+ % because of the model's weights\)", finding.text)


def test_without_gravity_load_no_gain_is_invented(arm, tmp_path):
    """The friction is in A: it agrees with the truth divided by the gain."""
    _, log = arm
    robot = Robot.from_file(write_arm(tmp_path, CURRENTS + "gravity = [0.0, 0.0, 0.0]\n"))
    found = identify(in_amperes(robot, log), robot, EXACT)
    (finding,) = [each for each in found.findings if each.check == "torque-constant"]
    assert "shoulder (gravity varies by 0 N m)" in finding.text
    assert "set torque_constant and ratio" in finding.cure
    for joint, gain in zip(("shoulder", "elbow"), GAINS, strict=False):
        own = found.joints[joint]
        assert (own.torque_unit, own.curve[0].unit, own.parameters["viscous"].unit) == ("A", "A", "A s/rad")
        assert own.reason.endswith("friction in A, multiply by torque constant and gear ratio for N m")
        true = TRUTH["coulomb"] / gain
        assert own.parameters["coulomb"].interval_95[0] < true < own.parameters["coulomb"].interval_95[1]


def test_currents_that_run_against_gravity_are_named(arm):
    robot, log = arm
    turned = in_amperes(robot, log)
    turned = replace(turned, torque=turned.torque * np.array([-1.0, 1.0, 1.0]))
    with pytest.raises(LogError, match=r"torque of shoulder opposes gravity; set its scale in \[log.torque\] to -1"):
        inspect_log(turned, robot, EXACT)


def test_a_joint_at_rest_gives_no_gain(arm):
    robot, _ = arm
    still = arm_log(robot, duration=8.0, rate=250.0, still="elbow")
    found = identify(in_amperes(robot, still), robot, EXACT)
    assert found.joints["elbow"].verdict == "not excited"
    assert any("elbow (too little motion)" in finding.text for finding in found.findings)

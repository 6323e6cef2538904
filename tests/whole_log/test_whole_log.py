"""The whole log gives friction back, of every leg in every support, and what is wrong with the model beside it."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.signal import lfilter
from tests.whole_log.logs import PLAIN, TRUTH, walk, with_wrong_bodies

from stribeck import Robot, identify
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.errors import NothingIdentifiedError
from stribeck.core.friction import get_law
from stribeck.core.identify.contract import Fitted
from stribeck.core.identify.whole_log import described, identify_whole_log
from stribeck.core.log import RobotLog
from stribeck.core.settings import Settings
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.robots import MODELS
from stribeck.simulation.run import POSTURES
from stribeck.simulation.sensors.measure import with_noise

WHOLE_LOG = Settings(law="stribeck", corrections="none")


def whole_log(log: RobotLog, robot: Robot, settings: Settings) -> Fitted:
    return described(identify_whole_log([prepare(log, robot, settings)], robot, get_law(settings.law), settings))


def test_an_exact_log_gives_the_truth(arm: Robot, exact_arm_log: RobotLog) -> None:
    for joint in identify(exact_arm_log, arm, WHOLE_LOG).joints.values():
        assert joint.verdict == "identified"
        for name, truth in TRUTH.items():
            assert joint.parameters[name].value == pytest.approx(truth, rel=2e-3)


def test_a_noisy_log_gives_it_within_its_intervals(arm: Robot, exact_arm_log: RobotLog) -> None:
    result = identify(with_noise(exact_arm_log, position=5e-5, torque=0.2, seed=6), arm, WHOLE_LOG)
    assert result.corrections.chi_square == pytest.approx(1.0, abs=0.15)
    found = [(joint.parameters[name], truth) for joint in result.joints.values() for name, truth in TRUTH.items()]
    off = [abs(parameter.value - truth) / parameter.standard_error for parameter, truth in found]
    assert np.mean(np.array(off) < 2) > 0.85
    assert 0.6 < np.sqrt(np.mean(np.square(off))) < 1.5
    for joint in result.joints.values():
        assert joint.parameters["coulomb"].value == pytest.approx(1.2, rel=0.03)


def test_a_law_that_jumps_is_not_misled_by_joints_at_rest(arm: Robot) -> None:
    law = get_law("coulomb-viscous")
    exact, known = exact_log(arm, law, dict.fromkeys(arm.joint_names, PLAIN), duration=16.0, seed=3)
    held = np.abs(exact.velocity) < 0.02  # as if nothing held the joint at rest
    stiction = replace(exact, torque=exact.torque - held * known.friction_torque)
    log = with_noise(stiction, position=1e-6, torque=0.02, seed=4)
    settings = WHOLE_LOG.model_copy(update={"law": law.name, "rest": 0.01})
    for name, joint in identify(log, arm, settings).joints.items():
        assert joint.parameters["coulomb"].value == pytest.approx(1.2, rel=0.01), name


@pytest.mark.long
def test_a_late_base_orientation_is_found() -> None:
    robot, log = walk("biped", 8.0)
    late = replace(log, base_orientation=np.roll(log.base_orientation, 10, axis=0)).take(slice(50, None))
    found = whole_log(late, robot, Settings(law="stribeck", corrections="calibration"))
    delay, error = found.corrections.base_delay
    assert error < 2e-3
    assert delay == pytest.approx(0.01, abs=3 * error)


def test_every_leg_of_a_biped_counts_and_corrections_are_determined_by_swinging_limbs() -> None:
    """On one foot and on two."""
    robot, log = walk("biped", 8.0)
    result = identify(log, robot, Settings(law="stribeck", corrections="inertia"))
    for joint, found in result.joints.items():
        assert found.parameters["coulomb"].value == pytest.approx(1.2, rel=0.04), joint
    before, after = result.evidence.correction
    assert before.usable.any(axis=0).all()
    np.testing.assert_array_equal(before.usable, after.usable)
    np.testing.assert_array_equal(before.velocity, after.velocity)
    legs = robot.standing(tuple(robot.contacts))[robot.torque_controlled]
    for support, name in enumerate(after.support_names):
        standing = robot.standing((name,))[robot.torque_controlled] if name in robot.contacts else legs
        assert not after.usable[after.support == support][:, standing].any()


def test_encoder_zeros_of_a_robot_that_never_stands_on_one_foot_are_refused() -> None:
    robot, log = walk("quadruped", 12.0)
    with pytest.raises(NothingIdentifiedError, match="set corrections = 'inertia'"):
        identify(log, robot, Settings(law="stribeck", corrections="calibration"))


def test_wrong_inertias_are_found_beside_the_friction(arm: Robot, exact_arm_log: RobotLog) -> None:
    log = with_noise(exact_arm_log, position=1e-5, torque=0.05, seed=4)
    wrong = with_wrong_bodies(arm)
    believed = identify(log, wrong, WHOLE_LOG)
    corrected = identify(log, wrong, Settings(law="stribeck", corrections="inertia"))

    def worst(result: object) -> float:
        return max(abs(joint.parameters["coulomb"].value / 1.2 - 1) for joint in result.joints.values())  # type: ignore[attr-defined]

    assert worst(believed) > 0.04
    assert worst(corrected) < 0.02
    for joint in corrected.joints.values():
        assert joint.validation.rms < 0.2 * joint.validation.rms_zero_friction
    for body in corrected.corrections.bodies.values():
        xx, _, yy, _, _, zz = body.inertia[1]
        assert body.mass[1] > 0
        assert max(xx, yy, zz) < xx + yy + zz - max(xx, yy, zz)  # triangle inequality


def test_a_motor_that_logs_no_torque_does_no_harm_to_the_others(arm: Robot, exact_arm_log: RobotLog) -> None:
    torque = exact_arm_log.torque.copy()
    torque[:, arm.joint_names.index("elbow")] = 0.0
    result = identify(replace(exact_arm_log, torque=torque), arm, Settings(corrections="inertia"))
    assert set(result.joints) == set(arm.joint_names) - {"elbow"}
    for joint in result.joints.values():
        assert joint.parameters["coulomb"].value == pytest.approx(TRUTH["coulomb"], rel=0.02)
    for body in result.corrections.bodies.values():
        assert body.mass[1] == pytest.approx(body.mass[0], rel=0.01)


@pytest.mark.long
def test_wrenches_on_the_feet_make_offsets_clearer() -> None:
    """They weigh the bodies, and so tell gravity from an offset, whatever their own zeros and gains are."""
    robot = Robot.from_file(MODELS / "robot.toml")
    names = [name for name in robot.joint_names if name not in robot.position_controlled]
    law, posture = get_law("stribeck"), POSTURES["biped"]
    exact, _ = exact_log(robot, law, dict.fromkeys(names, TRUTH), duration=8.0, posture=posture, seed=2)
    log = with_noise(exact, position=2e-5, torque=1.0, seed=3)
    sensed = 1.03 * exact.foot_wrench + np.array([5.0, -4.0, 8.0, 0.3, -0.2, 0.1])
    settings = Settings(law="stribeck", corrections="inertia")
    error, deviation, flagged = {}, {}, {}
    for name, wrench in {"none": None, "right": sensed, "wrong sign": -sensed}.items():
        found = whole_log(replace(log, foot_wrench=wrench), with_wrong_bodies(robot), settings)
        column = [parameter.name for parameter in law.parameters].index("offset")
        error[name] = np.array([fit.values[column] - TRUTH["offset"] for fit in found.fits.values()])
        deviation[name] = np.array([fit.standard_errors[column] for fit in found.fits.values()])
        flagged[name] = any("wrench sensors" in text for text in map(str, found.findings))
    assert np.mean(deviation["right"]) < 0.75 * np.mean(deviation["none"])
    assert np.mean(np.abs(error["right"])) < 0.75 * np.mean(np.abs(error["none"]))
    for name in error:
        assert np.sqrt(np.mean((error[name] / deviation[name]) ** 2)) < 2, name
    assert flagged == {"none": False, "right": False, "wrong sign": True}


def test_a_body_far_from_the_model_is_named_and_friction_that_lags_is_no_body(arm, exact_arm_log):
    """Of a hand that has a third of its mass in the model; and with friction that builds up after a reversal."""
    model = pin.Model(arm.tree.model)
    hand = model.inertias[model.njoints - 1]
    model.inertias[model.njoints - 1] = pin.Inertia(hand.mass / 3, hand.lever, hand.inertia / 3)
    lighter = replace(arm, tree=replace(arm.tree, model=model))
    log = with_noise(exact_arm_log, position=1e-5, torque=0.05, seed=5).take(slice(0, 10_000))
    settings = Settings(law="stribeck", corrections="inertia")
    said = {finding.check: finding for finding in whole_log(log, lighter, settings).findings}
    assert arm.joint_names[-1] in said["bodies-differ"].joints
    assert "kg heavier" in said["bodies-differ"].text
    assert "corrections" not in said["bodies-differ"].cure
    lagging = lfilter([0.05], [1.0, -0.95], np.sign(exact_arm_log.velocity), axis=0)
    late = replace(log, torque=log.torque + (lagging - np.sign(exact_arm_log.velocity))[:10_000])
    assert "bodies-differ" not in {finding.check for finding in whole_log(late, arm, settings).findings}


def test_gains_and_zeros_are_found_beside_the_friction(arm: Robot, exact_arm_log: RobotLog) -> None:
    gains = np.array([0.012, -0.008, 0.004, -0.012, 0.009, -0.005])
    zeros = 2e-3 * np.array([0.0, 1.0, -1.0, 0.5, -0.8, 0.0])
    log = with_noise(exact_arm_log, position=1e-5, torque=0.05, seed=5)
    log = replace(log, torque=log.torque * (1 + gains), position=log.position + zeros)
    found = identify(log, arm, Settings(law="stribeck", corrections="calibration"))
    gain, error = np.array(list(found.corrections.torque_gain.values())).T
    true = np.array([gains[arm.joint_names.index(name)] for name in found.corrections.torque_gain])
    known = error < 0.3 * np.std(gains)  # the wrist carries next to nothing
    assert 3 <= known.sum() < len(gains)
    assert np.std((gain - true)[known]) < 0.25 * np.std(gains)  # up to the gain that they share, which nothing shows
    assert abs(gain.mean()) < 1e-4
    for column, name in enumerate(arm.joint_names):
        value, error = found.corrections.encoder_zero[name]
        assert value == pytest.approx(zeros[column], abs=4 * error)


def test_rotors_of_motor_side_torque_are_corrected_without_being_asked_for(arm: Robot, exact_arm_log: RobotLog) -> None:
    """Those of the model are guesses; where it has none, nothing is known of them."""
    modelled = 0.05 * np.array([0.8, 1.2, 0.9, 1.1, 0.0, 0.0])
    model = pin.Model(arm.tree.model)
    model.armature = modelled
    believed = replace(arm, tree=replace(arm.tree, model=model), torque_source="motor_current")
    log = replace(exact_arm_log, torque=exact_arm_log.torque + 0.05 * exact_arm_log.acceleration)
    log = with_noise(log, position=1e-5, torque=0.05, seed=6)
    for joint in identify(log, believed, WHOLE_LOG).joints.values():
        low, high = joint.parameters["armature"].interval_95
        assert low < 0.05 < high
        assert high - low < 0.02
        assert joint.parameters["armature"].verdict == "identified"
        assert joint.parameters["offset"].value == pytest.approx(0.2, abs=0.02)
    sensed = identify(log.take(slice(0, 4000)), replace(believed, torque_source="link_side_sensor"), WHOLE_LOG)
    assert all("armature" not in joint.parameters for joint in sensed.joints.values())


def test_a_rotor_that_is_held_at_zero_is_as_uncertain_as_others(arm: Robot, exact_arm_log: RobotLog) -> None:
    log = with_noise(exact_arm_log.take(slice(0, 6000)), position=1e-4, torque=0.5, seed=2)  # without rotors
    found = identify(log, arm, WHOLE_LOG.model_copy(update={"fit_armature": True})).joints
    rotors = [joint.parameters["armature"] for joint in found.values()]
    assert any(rotor.value < 1e-6 for rotor in rotors)
    assert all(rotor.interval_95[0] <= 0 < 1e-4 < rotor.interval_95[1] for rotor in rotors)


def test_encoder_noise_does_not_make_rotors_light(arm: Robot, exact_arm_log: RobotLog) -> None:
    """Noise of the acceleration is motion that takes no torque: least squares on it would find next to no inertia."""
    log = replace(exact_arm_log, torque=exact_arm_log.torque + 0.05 * exact_arm_log.acceleration)
    log = with_noise(log, position=1e-3, torque=0.05, seed=7)
    found = identify(log, arm, WHOLE_LOG.model_copy(update={"fit_armature": True}))
    armature = [joint.parameters["armature"].value for joint in found.joints.values()]
    np.testing.assert_allclose(armature, 0.05, rtol=0.15)
    assert np.mean(armature) == pytest.approx(0.05, rel=0.05)


def test_jitter_of_the_clock_is_not_taken_for_torque(arm: Robot, exact_arm_log: RobotLog) -> None:
    """One reading in twenty is late: half of all sixth differences know nothing of it."""
    late = np.random.default_rng(8).random(len(exact_arm_log.time)) < 0.05
    jittered = exact_arm_log.position - 5e-4 * late[:, None] * exact_arm_log.velocity
    log = with_noise(replace(exact_arm_log, position=jittered), position=1e-5, torque=0.05, seed=8)
    result = identify(log, arm, Settings(law="stribeck", corrections="inertia"))
    assert result.corrections.chi_square == pytest.approx(1.0, abs=0.3)
    for joint in result.joints.values():
        assert joint.parameters["coulomb"].value == pytest.approx(1.2, rel=0.05)
    for name, body in result.corrections.bodies.items():
        assert body.mass[1] == pytest.approx(body.mass[0], abs=3 * body.mass_error), name

"""Direct identification gives known friction and bodies back, from a wrong model."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from studies.held_out import predicted_torque
from tests.models import POSTURES, example_robot
from tests.result.made import of_one_log

from stribeck import Robot, Settings, identify
from stribeck.app.exporters.posterior import drawn
from stribeck.core.friction import get_law
from stribeck.core.log import RobotLog
from stribeck.core.result import BodyCorrection
from stribeck.core.robot.inertial_parameters import pseudo_inertia
from stribeck.paper.direct.consistent import base_parameters
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.sensors.measure import with_noise

LAW = "coulomb-viscous"
TRUTH = {"viscous": 0.3, "coulomb": 1.2, "offset": -0.4}
OWN_MOTION = {"filter": {"kind": "log"}}
REGRESSIONS = ("ordinary", "weighted", "robust")


def wrong(robot: Robot, seed: int = 0) -> Robot:
    """Return a robot with bodies that are 10 % too heavy, 15 % too large, and centred 10 mm elsewhere."""
    generator, model = np.random.default_rng(seed), pin.Model(robot.tree.model)
    for body in range(1, model.njoints):
        own = model.inertias[body]
        shift = 0.01 * generator.standard_normal(3)
        model.inertias[body] = pin.Inertia(1.1 * own.mass, own.lever + shift, 1.15 * own.inertia)
    return replace(robot, tree=replace(robot.tree, model=model))


def settings(**own: object) -> Settings:
    return Settings.model_validate({"method": "direct", "law": LAW, **own})


@pytest.fixture(scope="module")
def log(arm: Robot) -> RobotLog:
    truth = dict.fromkeys(arm.joint_names, TRUTH)
    exact, _ = exact_log(arm, get_law(LAW), truth, duration=20, rate=250)
    return replace(exact, velocity=None, acceleration=None)


def parameters_of(robot: Robot) -> np.ndarray:
    return np.concatenate([body.toDynamicParameters() for body in list(robot.tree.model.inertias)[1:]])


@pytest.mark.parametrize("regression", REGRESSIONS)
def test_friction_and_base_parameters_come_back_from_a_wrong_model(arm: Robot, log: RobotLog, regression: str) -> None:
    result = identify(log, wrong(arm), settings(regression=regression))
    for name, joint in result.joints.items():
        assert joint.verdict == "identified", f"{name}: {joint.reason}"
        for key, truth in TRUTH.items():
            assert joint.parameters[key].value == pytest.approx(truth, rel=0.01), (name, key)
    model, generator = arm.tree.model, np.random.default_rng(7)
    states = generator.standard_normal((40, 3, model.nv))
    regressor = np.vstack([pin.computeJointTorqueRegressor(model, model.createData(), *state) for state in states])
    found = np.concatenate([_parameters(body) for body in result.corrections.bodies.values()])
    error, before = (regressor @ (each - parameters_of(arm)) for each in (found, parameters_of(wrong(arm))))
    assert np.linalg.norm(error) < 0.02 * np.linalg.norm(before)
    assert any(f"{len(base_parameters(regressor)[0])} of 30 inertial" in note for note in result.evidence.notes)


def _parameters(body: BodyCorrection) -> np.ndarray:
    xx, xy, yy, xz, yz, zz = body.inertia[1]
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return pin.Inertia(body.mass[1], np.array(body.centre_of_mass[1]), tensor).toDynamicParameters()


def test_every_corrected_body_can_exist_however_wrong_the_torques(arm: Robot, log: RobotLog) -> None:
    pulled = replace(log, torque=log.torque - 3 * (log.torque - log.torque.mean(axis=0)))  # as of negative masses
    result = identify(pulled, arm, settings(), force=True)
    for name, body in result.corrections.bodies.items():
        assert np.linalg.eigvalsh(pseudo_inertia(_parameters(body))).min() > 0, name


def test_intervals_cover_the_truth_under_noise(arm: Robot, log: RobotLog) -> None:
    inside = []
    for seed in range(3):
        noisy = with_noise(log, position=5e-5, torque=0.3, seed=seed)
        for joint in identify(noisy, wrong(arm, seed), settings()).joints.values():
            for key, truth in TRUTH.items():
                low, high = joint.parameters[key].interval_95
                assert key != "coulomb" or high - low < 0.1 * truth
                inside.append(low <= truth <= high)
    assert np.mean(inside) > 0.8


def test_robots_that_are_drawn_agree_on_the_torques_that_the_log_has_shown(arm: Robot, log: RobotLog) -> None:
    """Errors of friction and bodies make up for one another: drawn one by one, they would be off by far more."""
    result = of_one_log(identify(with_noise(log, position=5e-5, torque=0.3), arm, settings()))
    joints = {name: replace(joint, correlation=None) for name, joint in result.joints.items()}
    alone = replace(result, corrections=replace(result.corrections, correlation=None), joints=joints)
    velocity = np.gradient(log.position, log.time, axis=0)
    motion = [each[20:-20:50] for each in (log.position, velocity, np.gradient(velocity, log.time, axis=0))]
    draws = ([predicted_torque(arm, each, *motion)[0] for each in drawn(of, 60)] for of in (result, alone))
    together, apart = (np.std(torques, axis=0).mean(axis=0) for torques in draws)
    assert (together < 0.5 * apart).all(), (together, apart)


def test_robust_regression_reduces_the_effect_of_outliers(arm: Robot, log: RobotLog) -> None:
    generator = np.random.default_rng(5)
    torque = log.torque.copy()
    for row in generator.integers(0, len(log.time) - 60, 12):
        torque[row : row + 60] += 8 * generator.standard_normal(3)
    pushed = replace(log, torque=torque)

    def error(regression: str) -> float:
        joints = identify(pushed, arm, settings(regression=regression), force=True).joints.values()
        return float(np.mean([abs(joint.parameters["coulomb"].value - TRUTH["coulomb"]) for joint in joints]))

    assert error("robust") < 0.6 * error("weighted")


def test_weights_tell_good_torque_sensors_from_bad_ones(arm: Robot, log: RobotLog) -> None:
    noisy = replace(log, torque=log.torque + np.random.default_rng(1).standard_normal(log.torque.shape) * [3, 0.01, 1])
    results = {each: identify(noisy, arm, settings(regression=each), force=True) for each in REGRESSIONS[:2]}
    errors = {each: result.joints["elbow"].parameters["coulomb"].standard_error for each, result in results.items()}
    assert errors["weighted"] < 0.5 * errors["ordinary"]


def test_a_rotor_inertia_is_found_where_the_torque_is_the_motors(arm: Robot, log: RobotLog) -> None:
    v = np.gradient(log.position, log.time, axis=0)
    turned = replace(log, torque=log.torque + 0.2 * np.gradient(v, log.time, axis=0), torque_source="motor_current")
    result = identify(turned, arm, settings(fit_armature=["elbow"]))
    assert "armature" not in result.joints["slide"].parameters
    low, high = result.joints["elbow"].parameters["armature"].interval_95
    assert low < 0.2 < high  # which the moment of the arm's own bodies cannot be told from surely


def test_held_out_blocks_judge_the_law(arm: Robot, log: RobotLog) -> None:
    noisy = with_noise(log, position=0.0, torque=0.2, seed=2)
    result = identify(noisy, wrong(arm), settings(holdout=4))
    for joint in result.joints.values():
        assert joint.validation.rms < 0.2 * joint.validation.rms_zero_friction
        assert joint.torque_r2.corrected > joint.torque_r2.nominal


@pytest.fixture(scope="module")
def walk() -> tuple[Robot, RobotLog]:
    """A quadruped lifts one leg at a time."""
    robot = example_robot("go2")
    truth = dict.fromkeys(robot.joint_names, TRUTH)
    log, _ = exact_log(robot, get_law(LAW), truth, duration=32, rate=25, posture=POSTURES["go2"], seed=3)
    return robot, log


def test_standing_legs_of_a_walk_do_without_their_contact_forces(walk: tuple[Robot, RobotLog]) -> None:
    robot, log = walk
    result = identify(log, wrong(robot), settings(**OWN_MOTION, double_support="fit", regression="ordinary"))
    for name, joint in result.joints.items():
        assert joint.verdict == "identified", f"{name}: {joint.reason}"
        assert joint.parameters["coulomb"].value == pytest.approx(TRUTH["coulomb"], rel=0.05), name


def test_a_leg_that_always_stands_gets_no_numbers(walk: tuple[Robot, RobotLog]) -> None:
    robot, log = walk
    contact = log.contact.copy()
    contact[:, log.foot_names.index("FL")] = True  # its swings count as standing, and its rows are left out
    stood = replace(log, contact=contact)
    result = identify(stood, wrong(robot), settings(**OWN_MOTION), force=True)
    for name, joint in result.joints.items():
        assert (joint.verdict == "not excited") == name.startswith("FL"), name
        if joint.parameters:
            assert joint.parameters["coulomb"].value == pytest.approx(TRUTH["coulomb"], rel=0.05), name

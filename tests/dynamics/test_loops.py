"""Closed chains: the tree without loop forces equals the model in independent coordinates."""

from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from tests.loops import LAW, MJCF, PARALLELOGRAM, PARALLELOGRAM_FILE, TRUTH, leg, loop_log, robot_of

from stribeck import Robot, identify
from stribeck.core.dynamics.loops import closed_log, loop_terms
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.errors import RobotFileError, SettingsError
from stribeck.core.estimator.uncertainty.intervals import joint_fits
from stribeck.core.friction import get_law
from stribeck.core.identify.whole_log import identify_whole_log
from stribeck.core.settings import FilterSettings, Settings
from stribeck.paper.observer import loop_inertia, loop_momentum_balance

EXACT = Settings(method="curve-fit", law="coulomb-viscous", filter=FilterSettings(kind="log"), standing_legs=True)
GRAVITY = 9.81


@pytest.fixture(scope="module")
def parallelogram(tmp_path_factory):
    robot = robot_of(tmp_path_factory.mktemp("parallelogram"), PARALLELOGRAM, PARALLELOGRAM_FILE)
    return robot, loop_log(robot, size=1.5)


@pytest.fixture(scope="module", params=["fixed", "floating"])
def ankle(request, tmp_path_factory):
    robot = leg(tmp_path_factory.mktemp(request.param), request.param)
    return robot, loop_log(robot)


def friction_of(log, column):
    return LAW.torque(log.velocity[:, column], np.array([TRUTH[parameter.name] for parameter in LAW.parameters]))


def test_a_parallelogram_is_its_one_coordinate(parallelogram):
    """Coupler and rocker: upper = -motor, lower = motor; the torque is I a - g sin(q) (m c) in closed form."""
    robot, log = parallelogram
    motor, upper, lower = (robot.joint_names.index(name) for name in ("motor", "upper", "lower"))
    q, a = log.position[:, motor], log.acceleration[:, motor]
    np.testing.assert_allclose(log.position[:, lower], q, atol=1e-9)
    np.testing.assert_allclose(log.position[:, upper], -q, atol=1e-9)
    np.testing.assert_allclose(log.acceleration[:, lower], a, atol=1e-9)
    inertia = (0.003 + 1.5 * 0.2**2) + (0.003 + 1.0 * 0.25**2) + 2.0 * 0.4**2
    load = GRAVITY * (1.5 * 0.2 + 1.0 * 0.25 + 2.0 * 0.4)
    wanted = inertia * a - load * np.sin(q) + friction_of(log, motor)
    np.testing.assert_allclose(log.torque[:, motor], wanted, atol=1e-9)
    some = log.position[::100]
    np.testing.assert_allclose(loop_inertia(robot, robot.tree, some)[:, motor, motor], inertia, rtol=1e-9)


def test_the_loop_of_an_mjcf_moves_as_in_mujoco(tmp_path):
    """Frames come from <connect>, and MuJoCo, which solves for the constraint, computes the same acceleration."""
    (tmp_path / "robot.xml").write_text(MJCF)
    text = PARALLELOGRAM_FILE.replace("model.urdf", "robot.xml")
    (tmp_path / "tree.toml").write_text(text[: text.index("passive")])
    (warning,) = [each for each in Robot.from_file(tmp_path / "tree.toml").warnings if "equality" in each]
    remedy = "to close the loops, set [[robot.loops]] frames = ['pin.1', 'pin.2']"
    assert warning.endswith(f"only the tree is modeled; {remedy}")
    text = text.replace("coupler_end", "pin.1").replace("rocker_end", "pin.2")
    (tmp_path / "robot.toml").write_text(text)
    robot = Robot.from_file(tmp_path / "robot.toml")
    assert not robot.warnings
    own = loop_log(robot, duration=2.0, size=1.5)
    motor = robot.joint_names.index("motor")
    model = mujoco.MjModel.from_xml_string(MJCF)
    data = mujoco.MjData(model)
    for k in range(0, len(own.time), 100):
        found = []
        for given_way in (1e-4, 1e-3):  # MuJoCo's constraints are soft: none at all is beyond the stiffest
            model.eq_solimp[0, :2] = 1 - given_way
            for column, name in enumerate(robot.joint_names):
                data.joint(name).qpos[:], data.joint(name).qvel[:] = own.position[k, column], own.velocity[k, column]
            data.joint("motor").qfrc_applied[:] = own.torque[k, motor] - friction_of(own, motor)[k]
            mujoco.mj_forward(model, data)
            found.append(np.array([data.joint(name).qacc[0] for name in robot.joint_names]))
        rigid = found[0] + (found[0] - found[1]) / 9
        np.testing.assert_allclose(rigid, own.acceleration[k], atol=1e-4 * np.abs(own.acceleration).max())


def test_passive_joints_move_consistently_with_their_derivatives(ankle):
    robot, log = ankle
    step = log.time[1]
    slope = (log.position[2:] - log.position[:-2]) / (2 * step)
    np.testing.assert_allclose(log.velocity[1:-1], slope, atol=2e-3 * np.abs(log.velocity).max())
    slope = (log.velocity[2:] - log.velocity[:-2]) / (2 * step)
    np.testing.assert_allclose(log.acceleration[1:-1], slope, atol=2e-3 * np.abs(log.acceleration).max())
    assert np.abs(loop_terms(robot, log.position[::50]).gap).max() < 1e-9


def test_the_torques_make_the_motion_by_constrained_dynamics(ankle):
    """Pinocchio's constraint solver, with loops and foot as constraints, computes the log's acceleration."""
    robot, log = ankle
    model, data = robot.tree.model, robot.tree.model.createData()
    constraints, memory = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    LOCAL = pin.ReferenceFrame.LOCAL
    for loop in robot.loops:
        one, other = (model.frames[model.getFrameId(name)] for name in loop.frames)
        places = one.parentJoint, one.placement, other.parentJoint, other.placement
        constraints.append(pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, model, *places, LOCAL))
    if robot.base == "floating":
        sole = model.frames[model.getFrameId("sole")]
        ends = sole.parentJoint, sole.placement
        constraints.append(pin.RigidConstraintModel(pin.ContactType.CONTACT_6D, model, *ends, LOCAL))
    for constraint in constraints:
        memory.append(constraint.createData())
    pin.initConstraintDynamics(model, data, constraints, memory)
    size, columns = robot.tree.root_size, robot.tree.columns
    friction = np.zeros_like(log.torque)
    for column in robot.torque_controlled:
        friction[:, column] = friction_of(log, column)
    for k in range(0, len(log.time), 150):
        q, v, tau = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
        q[model.nq - len(columns) :], v[size:] = log.position[k, columns], log.velocity[k, columns]
        if size:  # the trunk, as the flat foot has it
            pin.framesForwardKinematics(model, data, q)
            q[:7] = pin.SE3ToXYZQUAT(data.oMf[model.getFrameId("sole")].inverse())
            jacobian = pin.computeFrameJacobian(model, data, q, model.getFrameId("sole"), pin.LOCAL)
            v[:size] = np.linalg.solve(jacobian[:, :size], -jacobian[:, size:] @ v[size:])
        tau[size:] = (log.torque - friction)[k, columns]
        found = pin.constraintDynamics(model, data, q, v, tau, constraints, memory)
        np.testing.assert_allclose(found[size:], log.acceleration[k, columns], atol=1e-5)


def test_the_momentum_of_a_closed_chain_changes_by_its_torques(tmp_path):
    robot = leg(tmp_path, "fixed")
    log, moving = loop_log(robot), robot.torque_controlled
    momentum, change = loop_momentum_balance(robot, robot.tree, log.position, log.velocity)
    slope = ((momentum[2:] - momentum[:-2]) / (2 * log.time[1]))[:, moving]
    applied = log.torque[:, moving] - friction_of(log, moving) + change[:, moving]
    assert np.all(np.abs(slope - applied[1:-1]) < 1e-3 * np.abs(slope).max(axis=0))


def test_logs_of_only_the_motors_are_enough(ankle):
    """Positions and velocities of passive joints are missing: derivatives come from the filter."""
    robot, log = ankle
    log = replace(log, position=_of_motors(robot, log), velocity=None, acceleration=None)
    method = "observer" if robot.base == "fixed" else "curve-fit"
    found = identify(log, robot, EXACT.model_copy(update={"method": method, "filter": FilterSettings()}))
    for joint in found.joints.values():
        assert joint.parameters["coulomb"].value == pytest.approx(TRUTH["coulomb"], rel=0.03)
    notes = " ".join(found.evidence.notes)
    assert "Positions of the passive joints" in notes
    assert "Friction of passive joints cannot be separated" in notes


@pytest.mark.parametrize("ankle", ["floating"], indirect=True)
def test_the_whole_log_method_handles_loops(ankle):
    """Uses the weak form and positions of the motors with encoder noise."""
    robot, log = ankle
    generator = np.random.default_rng(0)
    position = log.position + 2e-5 * generator.normal(size=log.position.shape)
    position[:, robot.passive_columns] = np.nan
    torque = log.torque + 0.01 * generator.normal(size=log.torque.shape)
    log = replace(log, position=position, torque=torque, velocity=None, acceleration=None)
    settings = Settings(method="whole-log", law="coulomb-viscous", corrections="inertia")
    whole_log = identify_whole_log([prepare(log, robot, settings)], robot, get_law("coulomb-viscous"), settings)
    found = joint_fits(whole_log)
    assert set(found) == {"hip", "knee", "motor_left", "motor_right"}
    for name, fit in found.items():
        coulomb = fit.names.index("coulomb")
        assert fit.values[coulomb] == pytest.approx(TRUTH["coulomb"], rel=5e-3), name
        assert fit.intervals[coulomb, 0] < TRUTH["coulomb"] < fit.intervals[coulomb, 1]


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"method": "direct", "law": None}, "method 'direct' takes a robot for a tree"),
        ({"double_support": "fit"}, "double_support = 'fit' takes a robot for a tree"),
        ({"method": "whole-log", "corrections": "calibration"}, "corrections = 'calibration' takes a robot for a tree"),
        ({"standing_legs": "measured"}, "standing_legs = 'measured' takes a robot for a tree"),
    ],
)
def test_methods_for_trees_only_are_refused(changed, words, parallelogram):
    robot, log = parallelogram
    with pytest.raises(SettingsError, match=words):
        identify(log, robot, EXACT.model_copy(update=changed))


REFUSED = {
    "a stranger": ('passive = ["upper", "hip"]', "passive names joint 'hip'"),
    "no loop": ("", "belong together"),
    "a frame": ('passive = ["upper", "lower"]', "is not in the model"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_robot_files_with_invalid_loops(case, tmp_path):
    line, words = REFUSED[case]
    text = PARALLELOGRAM_FILE.replace('passive = ["upper", "lower"]', line)
    if case == "a frame":
        text = text.replace("rocker_end", "rocker_tip")
    with pytest.raises(RobotFileError, match=words):
        robot_of(tmp_path, PARALLELOGRAM, text)


def test_a_model_of_few_digits_closes_as_well_as_it_can(tmp_path):
    """A rocker rotated by a tenth of a degree does not meet the coupler; the gap is reported."""
    bent = PARALLELOGRAM.replace('xyz="0.3 0 0"/><axis', 'xyz="0.3 0 0" rpy="0.001 0 0"/><axis', 1)
    assert bent != PARALLELOGRAM
    robot = robot_of(tmp_path, bent, PARALLELOGRAM_FILE)
    log = loop_log(robot, duration=1.0)
    _, notes = closed_log(replace(log, position=_of_motors(robot, log)), robot)
    assert any("Gaps of the closed loops are up to 0.4 mm" in note for note in notes)
    motor = robot.joint_names.index("motor")
    np.testing.assert_allclose(log.position[:, robot.joint_names.index("lower")], log.position[:, motor], atol=1e-4)


def _of_motors(robot, log):
    position = log.position.copy()
    position[:, robot.passive_columns] = np.nan
    return position

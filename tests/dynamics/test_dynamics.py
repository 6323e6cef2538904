"""Re-rooted recursion versus the dense equations (5.4) to (5.13), and the orientation of the base."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from studies.dense import constrained_sample, dense_friction_torque
from tests.models import POSTURES, example_log, example_robot, make_robot

from stribeck.core.dynamics.attitude import with_gyroscope
from stribeck.core.dynamics.root_motion import base_root, standing_root
from stribeck.core.dynamics.rooted import joint_inertia, rooted_inverse_dynamics
from stribeck.core.dynamics.state import Orientation, State, orientation_from_derivatives, root_quaternions
from stribeck.core.errors import LogError
from stribeck.core.friction import Stribeck
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.simulation.prescribed.exact import Truth, exact_log

SLIDING_LEG = (Path(__file__).parent / "slider.urdf").read_text()


@pytest.fixture(scope="module")
def slider(tmp_path_factory) -> Robot:
    """Robot with a leg of one continuous and one prismatic joint."""
    path: Path = tmp_path_factory.mktemp("models") / "slider.urdf"
    path.write_text(SLIDING_LEG)
    return make_robot(path, {"armature": {"hip": 0.3, "knee": 1.1}}, {"left": {"frame": "sole"}})


def made(name: str, gait: str) -> tuple[Robot, RobotLog, Truth]:
    return example_robot(name), *example_log(name, 3.0, gait, rate=200)


def state_of(robot: Robot, log: RobotLog, truth: Truth) -> State:
    quaternion = root_quaternions(robot, log.position, log.base_orientation)
    turn = Orientation(quaternion, truth.base_velocity[:, 3:], truth.base_acceleration[:, 3:])
    return State(log.position, log.velocity, log.acceleration, turn)


def random_state(robot: Robot, count: int = 6, seed: int = 0) -> tuple[State, np.ndarray]:
    generator = np.random.default_rng(seed)
    position, velocity, acceleration, torque = generator.uniform(-1, 1, (4, count, len(robot.joint_names)))
    turn = Orientation(Rotation.random(count, rng=generator).as_quat(), *generator.normal(size=(2, count, 3)))
    return State(position, 2 * velocity, 20 * acceleration, turn), 30 * torque


def rooted_friction(robot: Robot, foot: str, state: State, torque: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    wrench, needed = rooted_inverse_dynamics(
        robot.rooted_at(foot), state.position, state.velocity, state.acceleration, standing_root(robot, foot, state)
    )
    return torque - needed, wrench


@pytest.mark.parametrize("tilted", [True, False])
@pytest.mark.parametrize(
    ("name", "foot"), [("talos", "left"), ("talos", "right"), ("g1", "left"), ("go2", "FL"), ("slider", "left")]
)
def test_rooted_equals_dense(name, foot, tilted, slider):
    """Friction torques and ground reactions, also with rotors and with prismatic and position-controlled joints."""
    robot = slider if name == "slider" else example_robot(name)
    if name == "go2":
        robot = make_robot("go2_description/urdf/go2.urdf", {}, {"FL": {"frame": "FL_foot"}})  # as a surface
    state, torque = random_state(robot)
    state = state if tilted else State(state.position, state.velocity, state.acceleration)
    friction, wrench = rooted_friction(robot, foot, state, torque)
    dense, reaction = dense_friction_torque(robot, (foot,), state, torque)
    columns = robot.torque_controlled
    np.testing.assert_allclose(friction[:, columns], dense[:, columns], atol=1e-9 * np.nanmax(np.abs(dense)), rtol=0)
    np.testing.assert_allclose(wrench, reaction, atol=1e-9 * np.abs(reaction).max(), rtol=0)
    assert np.isnan(dense[:, [k for k in range(dense.shape[1]) if k not in columns]]).all()


@pytest.mark.parametrize("name", ["talos", "g1", "slider"])
def test_effective_inertia_equals_the_rooted_inertia(name, slider):
    """M_mod of (5.13), with given motion of the position-controlled joints."""
    robot = slider if name == "slider" else example_robot(name)
    state, torque = random_state(robot, 3)
    rooted = joint_inertia(robot.rooted_at("left"), state.position)
    place = np.ix_(robot.torque_controlled, robot.torque_controlled)
    for k in range(3):
        mobility = constrained_sample(robot, ("left",), state, torque, k).mobility
        M_mod = np.linalg.inv(mobility)
        np.testing.assert_allclose(M_mod, rooted[k][place], atol=1e-8 * np.abs(M_mod).max())


@pytest.mark.parametrize("angle", [0.7, 3.0])
def test_heading_does_not_matter_and_tilt_does(angle):
    robot, log, truth = made("talos", "walk")
    rows = log.contact[:, 0]
    state, torque = state_of(robot, log, truth).take(rows), log.torque[rows]
    reference, _ = rooted_friction(robot, "left", state, torque)
    for axis, same in (((0, 0, 1), True), ((1, 0, 0), False)):
        turned = Rotation.from_rotvec(angle * np.array(axis)) * Rotation.from_quat(state.orientation.quaternion)
        turn = Orientation(turned.as_quat(), state.orientation.angular_velocity, state.orientation.angular_acceleration)
        moved = State(state.position, state.velocity, state.acceleration, turn)
        friction, _ = rooted_friction(robot, "left", moved, torque)
        assert (np.abs(friction - reference).max() < 1e-9) == same


@pytest.mark.parametrize(("gait", "standing"), [("walk", 3), ("trot", 2), ("stand", 4)])
def test_motion_of_the_base_follows_from_point_feet(gait, standing):
    robot, log, truth = made("go2", gait)
    state = state_of(robot, log, truth)
    rows_of: dict[tuple[str, ...], list[int]] = {}
    for k, flags in enumerate(log.contact):
        if flags.sum() == standing:
            rows_of.setdefault(tuple(np.array(log.foot_names)[flags]), []).append(k)
    assert rows_of
    for feet, rows in rows_of.items():
        motion = base_root(robot, feet, state.take(np.array(rows)))
        np.testing.assert_allclose(motion.velocity, truth.base_velocity[rows], atol=1e-9)
        np.testing.assert_allclose(motion.acceleration, truth.base_acceleration[rows], atol=1e-8)
        needed = rooted_inverse_dynamics(
            robot.tree, log.position[rows], log.velocity[rows], log.acceleration[rows], motion
        )[1]
        swinging = ~robot.standing(feet)
        friction = (log.torque[rows] - needed)[:, swinging]
        np.testing.assert_allclose(friction, truth.friction_torque[rows][:, swinging], atol=1e-8)


def test_the_acceleration_of_a_base_on_rolling_feet_is_the_slope_of_its_velocity():
    robot = example_robot("go2")
    rolling = {name: replace(foot, radius=0.2) for name, foot in robot.contacts.items()}
    time, rates = 1e-4 * np.arange(3), np.random.default_rng(7).normal(size=(3, len(robot.joint_names)))
    angles = rates[2] + rates[0] * time[:, None] + rates[1] * time[:, None] ** 2 / 2
    speeds = rates[0] + rates[1] * time[:, None]
    spin, first = np.array([1.0, -2.0, 3.0]), Rotation.from_rotvec([0.3, 0.2, -0.5])
    turn = (Rotation.from_rotvec(time[:, None] * spin) * first).as_quat()
    orientation = Orientation(turn, np.tile(first.inv().apply(spin), (3, 1)), np.zeros((3, 3)))
    state = State(angles, speeds, np.tile(rates[1], (3, 1)), orientation)
    motion = base_root(replace(robot, contacts=rolling), ("FL", "RR"), state)
    slope = (motion.velocity[2] - motion.velocity[0]) / 2e-4
    np.testing.assert_allclose(motion.acceleration[1], slope, atol=1e-5)


def test_point_feet_need_a_base_orientation():
    robot = example_robot("go2")
    state, _ = random_state(robot)
    bare = State(state.position, state.velocity, state.acceleration)
    with pytest.raises(LogError, match=r"FL\+RR are point feet.*expected a channel base_orientation"):
        base_root(robot, ("FL", "RR"), bare)


def test_orientation_from_quaternions_is_that_of_the_base():
    """Angular velocity and acceleration from the quaternion's derivatives, compared with fine splines."""
    robot, log, truth = made("g1", "walk")
    quaternion = root_quaternions(robot, log.position, log.base_orientation)
    step = log.time[1] - log.time[0]
    rate = (quaternion[2:] - quaternion[:-2]) / (2 * step)
    change = (quaternion[2:] - 2 * quaternion[1:-1] + quaternion[:-2]) / step**2
    turn = orientation_from_derivatives(quaternion[1:-1], rate, change)
    np.testing.assert_allclose(turn.angular_velocity, truth.base_velocity[1:-1, 3:], atol=1e-3)
    np.testing.assert_allclose(turn.angular_acceleration, truth.base_acceleration[1:-1, 3:], atol=1e-2)


def test_the_root_link_rotates_with_a_frame_on_it():
    """The orientation belongs to a frame behind two moving joints; quaternions are continuous in sign."""
    robot, log, truth = made("talos", "walk")
    other = replace(robot, base_frame="torso_2_link")
    seen, _ = exact_log(
        other, Stribeck(), truth.parameters, duration=3, posture=POSTURES["talos"], gait="walk", rate=200
    )
    np.testing.assert_array_equal(seen.torque, log.torque)
    assert np.abs(seen.base_orientation - log.base_orientation).max() > 0.1
    flipped = seen.base_orientation * np.where(np.arange(len(seen.time)) % 7 < 3, 1, -1)[:, None]
    for given in (seen.base_orientation, 2.0 * flipped):
        found = root_quaternions(other, seen.position, given)
        assert np.abs(np.diff(found, axis=0)).max() < 0.01
        same = np.abs(np.sum(found * log.base_orientation, axis=1))
        np.testing.assert_allclose(same, 1.0, atol=1e-12)


STEP, ROWS = 0.002, 4000


def swaying_log(noise: float) -> tuple[RobotLog, Rotation]:
    """Make a log of a base that yaws and rolls, with noise of its orientation [rad]; return the true one, too."""
    time, normal = STEP * np.arange(ROWS), np.random.default_rng(0).standard_normal
    yaw = Rotation.from_euler("z", 2 * np.sin(3 * time)[:, None])
    roll = Rotation.from_euler("x", 0.3 * np.sin(25 * time)[:, None])
    rate = roll.inv().apply(6 * np.cos(3 * time)[:, None] * [0, 0, 1]) + 7.5 * np.cos(25 * time)[:, None] * [1, 0, 0]
    measured = yaw * roll * Rotation.from_rotvec(noise * normal((ROWS, 3)))
    rate += 0.01 + 3e-3 * normal((ROWS, 3))
    log = RobotLog(time=time, joint_names=("joint",), position=np.zeros((ROWS, 1)), torque=np.zeros((ROWS, 1)))
    return replace(log, base_orientation=measured.as_quat(), angular_velocity=rate), yaw * roll


def test_a_gyroscope_smooths_a_noisy_orientation() -> None:
    log, true = swaying_log(1e-3)
    found, notes = with_gyroscope(log, (slice(0, 2500), slice(2500, ROWS)), STEP)
    (note,) = notes
    assert "0.001 rad of noise" in note
    error = (true.inv() * Rotation.from_quat(found.base_orientation)).as_rotvec()
    assert np.sqrt(np.mean(error**2)) < 2e-4
    assert np.diff(error[:2500], axis=0).std() < 8e-6  # 6e-6 from the gyroscope alone, 1.4e-3 before


@pytest.mark.parametrize("case", ["clean", "other axes", "no gyroscope", "short"])
def test_an_orientation_stays_where_the_gyroscope_does_not_help(case: str) -> None:
    log, _ = swaying_log(1e-6 if case == "clean" else 1e-3)
    if case == "other axes":
        log = replace(log, angular_velocity=log.angular_velocity[:, [1, 0, 2]])
    if case == "no gyroscope":
        log = replace(log, angular_velocity=None)
    found, notes = with_gyroscope(log, (slice(0, 50 if case == "short" else ROWS),), STEP)
    assert found is log
    assert notes == []

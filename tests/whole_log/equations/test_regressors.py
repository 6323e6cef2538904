"""The corrections' columns are the derivatives that they say they are, whatever foot the tree is rooted at."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from stribeck import Robot, RobotLog
from stribeck.core.base.typing import Array
from stribeck.core.dynamics.root_motion import standing_root
from stribeck.core.dynamics.rooted import RootMotion, rooted_inverse_dynamics
from stribeck.core.dynamics.state import Orientation, State
from stribeck.core.equations.whole_log.corrections import CORRECTIONS
from stribeck.core.equations.whole_log.regressors import inertia_regressors, zero_regressors
from stribeck.core.robot.rooting import BASE_FRAME, RootedModel
from stribeck.simulation.robots import MODELS

FEET = [("toro.toml", "left_foot"), ("toro.toml", "right_foot"), ("arm.toml", "")]


def case(file: str, foot: str) -> tuple[Robot, RootedModel, State, RootMotion | None]:
    robot = Robot.from_file(MODELS / file)
    generator = np.random.default_rng(4)
    joints = len(robot.joint_names)
    turn = generator.standard_normal((5, 4))
    orientation = Orientation(turn / np.linalg.norm(turn, axis=1, keepdims=True), np.zeros((5, 3)), np.zeros((5, 3)))
    position, velocity, acceleration = 0.5 * generator.standard_normal((3, 5, joints))
    state = State(position, velocity, acceleration, orientation if foot else None)
    root = standing_root(robot, foot, state) if foot else None
    return robot, robot.rooted_at(foot) if foot else robot.tree, state, root


def torque(robot: Robot, rooted: RootedModel, foot: str, state: State) -> Array:
    root = standing_root(robot, foot, state) if foot else None
    return rooted_inverse_dynamics(rooted, state.position, state.velocity, state.acceleration, root)[1]


@pytest.mark.parametrize(("file", "foot"), FEET)
def test_inverse_dynamics_is_linear_in_the_bodies(file: str, foot: str) -> None:
    robot, rooted, state, root = case(file, foot)
    joints = np.arange(len(robot.joint_names))
    columns = inertia_regressors(robot, rooted, rooted.root_size + joints, state, root)
    model = robot.tree.model
    bodies = np.concatenate([model.inertias[body].toDynamicParameters() for body in range(1, model.njoints)])
    rotors = robot.armature * state.acceleration if np.any(robot.armature) else 0.0
    np.testing.assert_allclose(columns @ bodies + rotors, torque(robot, rooted, foot, state), atol=1e-9)


@pytest.mark.parametrize(("file", "foot"), FEET)
def test_encoder_zeros_have_the_effect_of_their_columns(file: str, foot: str) -> None:
    robot, rooted, state, root = case(file, foot)
    joints = np.arange(len(robot.joint_names))
    zeros = 1e-4 * np.random.default_rng(5).standard_normal(len(joints))
    columns = zero_regressors(rooted, rooted.root_size + joints, state, root)
    true = replace(state, position=state.position - zeros)
    change = torque(robot, rooted, foot, true) - torque(robot, rooted, foot, state)
    np.testing.assert_allclose(columns[:, :, : len(joints)] @ zeros, change, atol=2e-3 * np.abs(change).max())


def test_a_tilted_imu_has_the_effect_of_its_columns() -> None:
    robot, rooted, state, root = case("toro.toml", "left_foot")
    joints = np.arange(len(robot.joint_names))
    turn = 1e-4 * np.array([1.0, -2.0, 0.5])
    columns = zero_regressors(rooted, rooted.root_size + joints, state, root)[:, :, len(joints) :]
    quaternion = [pin.Quaternion(q) * pin.Quaternion(pin.exp3(-turn)) for q in state.orientation.quaternion]
    true = replace(state.orientation, quaternion=np.stack([q.coeffs() for q in quaternion]))
    change = torque(robot, rooted, "left_foot", replace(state, orientation=true))
    change -= torque(robot, rooted, "left_foot", state)
    np.testing.assert_allclose(columns @ turn, change, atol=2e-3 * np.abs(change).max())


def test_the_columns_of_gains_and_delays_are_what_their_corrections_remove() -> None:
    by_name, generator = {each.name: each for each in CORRECTIONS}, np.random.default_rng(6)
    time, spin, robot = 1e-3 * np.arange(9), np.array([1.0, -2.0, 3.0]), SimpleNamespace(base_frame=BASE_FRAME)
    turned = Rotation.from_rotvec([0.3, 0.2, -0.5]) * Rotation.from_rotvec(time[:, None] * spin)
    torque, effects, by_angles = (generator.normal(size=shape) for shape in ((9, 2), (9, 4, 2), (9, 4, 5)))
    log = RobotLog(time=time, joint_names=("a", "b"), position=torque, torque=torque, base_orientation=turned.as_quat())
    state = SimpleNamespace(position=torque, orientation=SimpleNamespace(angular_velocity=np.tile(spin, (9, 1))))
    signals = SimpleNamespace(torque=torque, torque_effects=effects, by_angles=by_angles, state=state)
    gains, delay = np.array([0.02, -0.03]), np.array([1e-3])
    removed = torque - by_name["gains"].apply(log, robot, np.arange(2), gains).torque
    np.testing.assert_allclose(by_name["gains"].columns(signals) @ gains, np.einsum("tri,ti->tr", effects, removed))
    later = Rotation.from_quat(by_name["base_delay"].apply(log, robot, np.arange(2), delay).base_orientation)
    removed = (later.inv() * turned).as_rotvec()[:-1]
    found = (by_name["base_delay"].columns(signals) @ delay)[:-1]
    np.testing.assert_allclose(found, np.einsum("tra,ta->tr", by_angles[:-1, :, -3:], removed), rtol=1e-6)

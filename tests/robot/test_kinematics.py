"""Kinematics, re-rooted trees and inertial parameters, compared with Pinocchio."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation
from tests.models import MODELS, example_robot, make_robot, plain_configuration, plain_model

from stribeck.core.robot import Robot
from stribeck.core.robot.inertial_parameters import carried, inertial_parameters, pseudo_inertia
from stribeck.core.robot.kinematics import direction_in_root, frame_pose, point_motion
from stribeck.core.robot.rooting import RootedModel
from stribeck.simulation.prescribed.limb import BodyMotion, end_motion, limb_to

SAMPLES = 5
CRANE = (Path(__file__).parent / "crane.urdf").read_text()
FRAMES = {"crane": "hook", "talos": "gripper_left_base_link", "go2": "RR_foot"}


@pytest.fixture(params=FRAMES)
def case(request, tmp_path):
    (tmp_path / "crane.urdf").write_text(CRANE)
    crane = request.param == "crane"
    robot = make_robot(tmp_path / "crane.urdf", {}, {}) if crane else example_robot(request.param)
    motion = np.random.default_rng(0).uniform(-1, 1, (3, SAMPLES, len(robot.joint_names)))
    return robot, FRAMES[request.param], motion


def reference(robot: Robot, frame: str, motion: np.ndarray, k: int, root: np.ndarray | None = None) -> tuple:
    """Compute pose, velocity and acceleration of a frame in the world, with the root at rest or moving with `root`."""
    model, columns = robot.tree.model, robot.tree.columns
    data = model.createData()
    q, v, a = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
    q[7:], v[6:], a[6:] = motion[:, k, columns]
    if root is not None:
        q[:7], v[:6], a[:6] = root
    pin.forwardKinematics(model, data, q, v, a)
    index = model.getFrameId(frame)
    pin.updateFramePlacement(model, data, index)
    velocity = pin.getFrameVelocity(model, data, index, pin.LOCAL_WORLD_ALIGNED).vector
    acceleration = pin.getFrameClassicalAcceleration(model, data, index, pin.LOCAL_WORLD_ALIGNED).vector
    return data.oMf[index], velocity, acceleration


def test_poses_and_points_move_as_in_pinocchio(case):
    robot, frame, motion = case
    index = robot.tree.model.getFrameId(frame)
    rotation, translation = frame_pose(robot.tree, index, motion[0])
    point = point_motion(robot.tree, index, *motion)
    directions = np.random.default_rng(1).normal(size=(SAMPLES, 3))
    turned = direction_in_root(robot.tree, index, motion[0], directions)
    for k in range(SAMPLES):
        pose, velocity, acceleration = reference(robot, frame, motion, k)
        np.testing.assert_allclose(rotation[k], pose.rotation, atol=1e-12)
        np.testing.assert_allclose(translation[k], pose.translation, atol=1e-12)
        np.testing.assert_allclose(turned[k], pose.rotation @ directions[k], atol=1e-12)
        np.testing.assert_allclose(point.position[k], pose.translation, atol=1e-12)
        np.testing.assert_allclose(point.velocity[k], velocity[:3], atol=1e-12)
        np.testing.assert_allclose(point.acceleration[k], acceleration[:3], atol=1e-11)


def test_ends_of_limbs_on_a_moving_base_move_as_in_pinocchio(case):
    robot, frame, motion = case
    generator = np.random.default_rng(2)
    turns = Rotation.random(SAMPLES, rng=generator)
    place, *twists = generator.normal(size=(5, SAMPLES, 3))
    base = BodyMotion(turns.as_matrix(), place, np.hstack(twists[:2]), np.hstack(twists[2:]))
    limb = limb_to(robot, frame)
    end, jacobian = end_motion(limb, base, motion[:, :, limb.columns])
    for k in range(SAMPLES):
        back = turns[k].inv()
        v = np.concatenate([back.apply(base.velocity[k, :3]), back.apply(base.velocity[k, 3:])])
        a = np.concatenate([back.apply(base.acceleration[k, :3]), back.apply(base.acceleration[k, 3:])])
        a[:3] -= np.cross(v[3:], v[:3])
        root = [np.concatenate([place[k], turns[k].as_quat()]), v, a]
        pose, velocity, acceleration = reference(robot, frame, motion, k, root)
        np.testing.assert_allclose(end.rotation[k], pose.rotation, atol=1e-12)
        np.testing.assert_allclose(end.position[k], pose.translation, atol=1e-12)
        np.testing.assert_allclose(end.velocity[k], velocity, atol=1e-12)
        np.testing.assert_allclose(end.acceleration[k], acceleration, atol=1e-11)
        carried = end_motion(limb, base, motion[:, :, limb.columns] * [[[1.0]], [[0.0]], [[0.0]]])[0]
        np.testing.assert_allclose(
            end.velocity[k], carried.velocity[k] + jacobian[k] @ motion[1, k, limb.columns], atol=1e-12
        )


FEET = [(name, foot) for name in ("talos", "g1", "go2", "icub", "cassie") for foot in MODELS[name][2]]


def configuration(tree: RootedModel, joints: np.ndarray) -> np.ndarray:
    result = pin.neutral(tree.model)
    result[tree.model.nq - len(joints) :] = joints[tree.columns]
    return result


def placements(model: pin.Model, q: np.ndarray) -> dict[str, pin.SE3]:
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    frames = zip(model.frames, data.oMf, strict=True)
    return {frame.name: pose.copy() for frame, pose in frames if frame.type != pin.FrameType.JOINT}


@pytest.mark.parametrize(("name", "foot"), FEET)
def test_frames_stand_to_one_another_as_before(name, foot):
    robot = example_robot(name)
    generator = np.random.default_rng(0)
    for _ in range(3):
        joints = generator.uniform(-2, 2, len(robot.joint_names))
        tree = robot.rooted_at(foot)
        ours = placements(tree.model, configuration(tree, joints))
        assert ours[robot.contacts[foot].frame].isApprox(pin.SE3.Identity(), 1e-12)
        model = plain_model(name)
        theirs = placements(model, plain_configuration(model, robot, joints))
        frames = set(theirs) & set(ours) - {"universe"}
        assert len(frames) > len(robot.joint_names) / 2
        for frame in frames:
            expected = theirs[robot.contacts[foot].frame].actInv(theirs[frame])
            np.testing.assert_allclose(ours[frame].homogeneous, expected.homogeneous, atol=1e-12)


@pytest.mark.parametrize(("name", "foot"), FEET)
def test_rotors_and_limits_stay(name, foot):
    robot = example_robot(name)
    tree, own = robot.rooted_at(foot), robot.tree
    for attribute in ("lowerPositionLimit", "upperPositionLimit", "armature", "effortLimit", "velocityLimit"):
        ours, before = np.empty((2, len(robot.joint_names)))
        ours[tree.columns] = np.asarray(getattr(tree.model, attribute))[-len(ours) :]
        before[own.columns] = np.asarray(getattr(own.model, attribute))[-len(ours) :]
        np.testing.assert_array_equal(ours, before)


def test_standing_joints_are_those_between_base_and_foot():
    robot = example_robot("talos")
    names = np.array(robot.joint_names)
    assert set(names[robot.standing(("left",))]) == {f"leg_left_{k}_joint" for k in range(1, 7)}
    assert robot.standing(("left", "right")).sum() == 12
    assert not robot.standing(()).any()


def some_bodies(count: int = 5) -> list[pin.Inertia]:
    """Make ellipsoids with arbitrary poses."""
    pin.seed(3)
    sizes = np.random.default_rng(3).uniform(0.1, 0.5, (count, 4))
    return [pin.SE3.Random().act(pin.Inertia.FromEllipsoid(*size)) for size in sizes]


def test_there_and_back() -> None:
    parameters = np.stack([body.toDynamicParameters() for body in some_bodies()])
    np.testing.assert_allclose(inertial_parameters(pseudo_inertia(parameters)), parameters, atol=1e-14)


@pytest.mark.parametrize("seed", range(3))
def test_parameters_are_carried_as_pinocchio_carries_the_body(seed: int) -> None:
    pin.seed(seed)
    body, pose = pin.Inertia.Random(), pin.SE3.Random()
    there = carried(pose.homogeneous) @ body.toDynamicParameters()
    np.testing.assert_allclose(there, pose.act(body).toDynamicParameters(), atol=1e-12)

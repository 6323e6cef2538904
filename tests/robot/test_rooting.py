"""The re-rooted tree has the same dynamics."""

import numpy as np
import pinocchio as pin
import pytest
from tests.models import MODELS, example_robot, plain_configuration, plain_model

from stribeck.robot.rooting import BASE_FRAME, RootedModel, root_at

FEET = [(name, foot) for name in ("talos", "g1", "go2", "icub", "cassie") for foot in MODELS[name][2]]


def configuration(tree: RootedModel, joints: np.ndarray) -> np.ndarray:
    result = pin.neutral(tree.model)
    result[tree.model.nq - len(joints) :] = joints[tree.columns]
    return result


def rates(tree: RootedModel, joints: np.ndarray, root: np.ndarray | None = None) -> np.ndarray:
    return np.concatenate([np.zeros(tree.root_size) if root is None else root, joints[tree.columns]])


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
def test_mass_inertia_rotors_and_limits_stay(name, foot):
    """The same twist of all bodies requires the same wrench: total inertia relative to the foot."""
    robot = example_robot(name)
    tree, own = robot.rooted_at(foot), robot.tree
    joints = np.random.default_rng(1).uniform(-1, 1, len(robot.joint_names))
    composite = []
    for rooted in (tree, own):
        data = rooted.model.createData()
        pin.framesForwardKinematics(rooted.model, data, configuration(rooted, joints))
        pin.crba(rooted.model, data, configuration(rooted, joints))
        pose = data.oMf[rooted.model.getFrameId(robot.contacts[foot].frame)]
        pin.ccrba(rooted.model, data, configuration(rooted, joints), np.zeros(rooted.model.nv))
        offset = pin.SE3(np.eye(3), data.com[0])
        composite.append(pose.actInv(offset).act(data.Ig).matrix())
    np.testing.assert_allclose(composite[0], composite[1], atol=1e-9)
    for attribute in ("lowerPositionLimit", "upperPositionLimit", "armature", "effortLimit", "velocityLimit"):
        ours, before = (np.empty(len(joints)) for _ in range(2))
        ours[tree.columns] = np.asarray(getattr(tree.model, attribute))[-len(joints) :]
        before[own.columns] = np.asarray(getattr(own.model, attribute))[-len(joints) :]
        np.testing.assert_array_equal(ours, before)


@pytest.mark.parametrize("name", ["panda", "ur5", "kinova"])
def test_a_fixed_tree_made_plain_has_the_same_dynamics(name):
    """Continuous joints lose cosine and sine, prismatic ones stay."""
    robot, model = example_robot(name), plain_model(name)
    generator = np.random.default_rng(3)
    for _ in range(5):
        joints, speeds, changes = generator.uniform(-2, 2, (3, len(robot.joint_names)))
        tree = robot.tree
        ours = pin.rnea(
            tree.model,
            tree.model.createData(),
            configuration(tree, joints),
            rates(tree, speeds),
            rates(tree, changes),
        )
        q = plain_configuration(model, robot, joints)
        v, a = np.empty((2, model.nv))
        places = [model.joints[model.getJointId(joint)].idx_v for joint in robot.joint_names]
        v[places], a[places] = speeds, changes
        theirs = pin.rnea(model, model.createData(), q, v, a)[places]
        np.testing.assert_allclose(ours[np.argsort(tree.columns)], theirs, atol=1e-10)
    assert sum(robot.prismatic) == (2 if name == "panda" else 0)


def test_standing_joints_are_those_between_base_and_foot():
    robot = example_robot("talos")
    names = np.array(robot.joint_names)
    assert set(names[robot.standing(("left",))]) == {f"leg_left_{k}_joint" for k in range(1, 7)}
    assert robot.standing(("left", "right")).sum() == 12
    assert not robot.standing(()).any()


@pytest.mark.parametrize(("name", "foot"), FEET)
def test_there_and_back_is_the_tree_again(name, foot):
    robot = example_robot(name)
    there = robot.rooted_at(foot)
    back = root_at(there.model, BASE_FRAME)
    own = robot.tree
    generator = np.random.default_rng(2)
    joints, speeds, changes = generator.uniform(-2, 2, (3, len(robot.joint_names)))
    twist, change = generator.normal(size=(2, 6))
    columns = there.columns[back.columns]  # back's joints -> there's -> the robot's
    effort = []
    for model, order in ((back.model, columns), (own.model, own.columns)):
        q = pin.neutral(model)
        q[model.nq - len(joints) :] = joints[order]
        v, a = np.concatenate([twist, speeds[order]]), np.concatenate([change, changes[order]])
        gravity = model.gravity.linear.copy()
        model.gravity.linear = np.array([0, 0, -9.81])
        found = pin.rnea(model, model.createData(), q, v, a)
        model.gravity.linear = gravity
        joint_effort = np.empty(len(joints))
        joint_effort[order] = found[6:]
        effort.append(np.concatenate([found[:6], joint_effort]))
    np.testing.assert_allclose(effort[0], effort[1], atol=1e-9 * np.abs(effort[1]).max())

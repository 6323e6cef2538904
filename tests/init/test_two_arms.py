"""Bags of two arms whose joints have the same names in two namespaces, and of a humanoid with two IMUs."""

from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.init.test_draft import noisy_log
from tests.log.readers.formats import write_messages_of_ros1
from tests.log.readers.messages import ROS1, STORE, messages_of, write_bag, write_messages
from tests.models import EXAMPLES, MODELS, example_robot
from tests.robot.test_generated_bodies import SCENE, record, scene

from stribeck import Settings, identify, read_log
from stribeck.check.init.answers import draft_robot_file
from stribeck.core.log import RobotLog
from stribeck.core.robot.kinematics import frame_pose
from stribeck.io.readers import bags
from stribeck.io.readers.topics import collect


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, RobotLog, dict[str, tuple[float, float]]]:
    path = scene(tmp_path_factory.mktemp("arms"), SCENE)
    return path, *record(path)


def messages(log: RobotLog, spaces: dict[str, str], store=STORE):
    """Make messages of each arm; those of the second arm are sent 0.7 ms later."""
    for delay, (side, space) in enumerate(spaces.items()):
        columns = [k for k, name in enumerate(log.joint_names) if name.startswith(side)]
        names = tuple(log.joint_names[k].removeprefix(f"{side}_") for k in columns)
        motion = {
            name: np.ascontiguousarray(getattr(log, name)[:, columns]) for name in ("position", "velocity", "torque")
        }
        arm = RobotLog(time=log.time + 7e-4 * delay, joint_names=names, **motion)
        yield from ((f"{space}/joint_states", *message[1:]) for message in messages_of(arm, store))


SPACES = {
    "same names": ({"left": "/left", "right": "/right"}, 1),
    "longer names": ({"left": "/left_arm", "right": "/cell/right_arm"}, 1),
    "unknown names": ({"left": "/robot1", "right": "/robot2"}, 2),
}
"""Namespaces of the arms, and the number of questions, one about the torques."""


@pytest.mark.parametrize("case", SPACES)
def test_namespaces_become_prefixes_and_a_bag_is_decoded_once(case: str, recorded, tmp_path, monkeypatch) -> None:
    decode = Mock(side_effect=collect)
    monkeypatch.setattr(bags, "collect", decode)
    path, log, _ = recorded
    spaces, questions = SPACES[case]
    bag = write_messages(tmp_path / "log.mcap", messages(log, spaces))
    draft = draft_robot_file(str(path), bag, tmp_path / "robot.toml")
    assert len(draft.questions) == questions
    of_log = {f"{space[1:]}/j{k}": f"{side}_j{k}" for side, space in spaces.items() for k in (1, 2)}
    assert draft.document["log"]["joint_names"] == of_log
    assert decode.call_count == 1


@pytest.mark.parametrize("suffix", ["", pytest.param(".mcap", marks=pytest.mark.long), ".bag"])
def test_the_friction_of_both_arms_is_found(suffix: str, recorded, tmp_path: Path) -> None:
    path, log, truth = recorded
    store = ROS1 if suffix == ".bag" else STORE
    write = {"": write_bag, ".mcap": write_messages, ".bag": write_messages_of_ros1}[suffix]
    sent = sorted(messages(log, {"left": "/left", "right": "/right"}, store), key=lambda message: message[2])
    bag = write(tmp_path / f"log{suffix}", sent)
    draft = draft_robot_file(str(path), bag, tmp_path / "robot.toml")
    result = identify(bag, draft.robot(), Settings(law="coulomb-viscous", fit_armature=True))
    for name, (coulomb, viscous) in truth.items():
        joint = result.joints[name]
        assert joint.verdict == "identified"
        assert joint.parameters["coulomb"].value == pytest.approx(coulomb, rel=0.01)
        assert joint.parameters["viscous"].value == pytest.approx(viscous, rel=0.01)


def with_imu(log: RobotLog, turn: Rotation) -> RobotLog:
    """Add the signals of an IMU with this orientation."""
    rate = (turn[:-1].inv() * turn[1:]).as_rotvec() / np.diff(log.time)[:, None]
    signals = {"angular_velocity": np.vstack([rate, rate[-1:]]), "linear_acceleration": turn.inv().apply([0, 0, 9.81])}
    return replace(log, base_orientation=turn.as_quat(), **signals)


FRAMES = [(("torso_2_link", "base_link"), "Its frame is fixed"), (("b", "a"), "% with /imu")]


@pytest.mark.parametrize(("frames", "evidence"), FRAMES)
def test_init_asks_which_of_two_imus_is_the_base_s(frames, evidence: str, tmp_path: Path) -> None:
    log, tree = noisy_log("talos"), example_robot("talos").tree
    log = replace(log, velocity=np.gradient(log.position, log.time, axis=0), contact=log.foot_wrench[..., 2] > 50.0)
    base = Rotation.from_quat(log.base_orientation)
    inside = frame_pose(tree, tree.model.getFrameId("torso_2_link"), log.position)[0]
    torso, log = with_imu(log, base * Rotation.from_matrix(inside)), with_imu(log, base)
    sent = [*messages_of(log), *(("/torso/imu", *m[1:]) for m in messages_of(torso) if m[0] == "/imu")]
    for topic, _, _, message in sent:
        if "imu" in topic:
            message.header.frame_id = frames[topic == "/imu"]
    bag = write_messages(tmp_path / "log.mcap", sent)
    draft = draft_robot_file(str(EXAMPLES / MODELS["talos"][0]), bag, tmp_path / "robot.toml")
    assert all(text in draft.text for text in ("TODO: is this the right topic?", 'name = "/imu"', evidence))
    read = read_log(bag, draft.robot())
    for channel in ("base_orientation", "angular_velocity", "linear_acceleration"):
        np.testing.assert_allclose(getattr(read, channel), getattr(log, channel), atol=1e-12)

"""Robots whose feet do not step: joints whose equations need no contact are identified all the same."""

import numpy as np
import pytest
from tests.standing import UPPER, still_humanoid

from stribeck import LogError, Settings, identify
from stribeck.init import draft_robot_file


def worst_error(result, truth, joints) -> float:
    """The largest relative error of the curves of some joints."""
    return max(
        abs(point.value / (truth[joint][0] + truth[joint][1] * point.velocity) - 1)
        for joint in joints
        for point in result.joints[joint].curve
    )


@pytest.mark.parametrize("kind", ["stand", "squat"])
def test_arms_and_trunk_are_identified_while_both_feet_stand(kind, tmp_path) -> None:
    truth = still_humanoid(tmp_path, kind)
    result = identify(tmp_path / "log.npz", tmp_path / "robot.toml")
    verdicts = {joint: result.joints[joint].verdict for joint in truth}
    assert verdicts == {joint: "identified" if joint in UPPER else "not excited" for joint in truth}
    assert worst_error(result, truth, UPPER) < 0.03
    assert "lift one foot at a time" in result.joints["left_knee"].reason


def test_every_joint_is_identified_while_the_robot_hangs(tmp_path) -> None:
    truth = still_humanoid(tmp_path, "hung")
    result = identify(tmp_path / "log.npz", tmp_path / "robot.toml")
    assert {joint.verdict for joint in result.joints.values()} == {"identified"}
    assert worst_error(result, truth, truth) < 0.03


def test_flags_that_are_always_false_are_refused_if_a_foot_rests(tmp_path) -> None:
    still_humanoid(tmp_path, "squat")
    log = dict(np.load(tmp_path / "log.npz"))
    np.savez(tmp_path / "log.npz", **log | {"contact": np.zeros_like(log["contact"])})
    with pytest.raises(LogError, match=r"some foot always rests; set .* source = 'kinematics'"):
        identify(tmp_path / "log.npz", tmp_path / "robot.toml")


@pytest.mark.parametrize("corrections", ["none", "inertia", "calibration"])
def test_loops_of_legs_that_hardly_move_are_left_out(corrections, tmp_path) -> None:
    still_humanoid(tmp_path, "stand", seconds=8.0)
    settings = Settings(double_support="fit", corrections=corrections, law="coulomb-viscous")
    result = identify(tmp_path / "log.npz", tmp_path / "robot.toml", settings)
    assert [joint for joint, found in result.joints.items() if found.curve] == UPPER


def test_arms_and_trunk_are_identified_while_the_robot_rolls_on_wheels(tmp_path) -> None:
    truth = still_humanoid(tmp_path, "roll")
    draft = draft_robot_file(str(tmp_path / "humanoid.xml"), None, tmp_path / "draft.toml").text
    assert draft.count('kind = "wheel"') == 4
    result = identify(tmp_path / "log.npz", tmp_path / "robot.toml")
    assert {joint: bool(result.joints[joint].curve) for joint in truth} == {joint: joint in UPPER for joint in truth}
    assert worst_error(result, truth, UPPER) < 0.05
    assert "jack the robot up" in result.joints["FL_foot"].reason

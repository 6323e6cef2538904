"""Robots whose feet do not step: joints whose equations need no contact are identified all the same."""

import numpy as np
import pytest
from tests.rolling import rolling_robot
from tests.standing import UPPER, still_humanoid

from stribeck import NothingIdentifiedError, Settings, identify
from stribeck.check.init import draft_robot_file


def worst_error(result, truth, joints) -> float:
    """The largest relative error of the curves of some joints."""
    return max(
        abs(point.value / (truth[joint][0] + truth[joint][1] * point.velocity) - 1)
        for joint in joints
        for point in result.joints[joint].curve
    )


def covered(result, truth, joints) -> float:
    """The share of curve points whose intervals contain the truth."""
    points = [(truth[joint], point) for joint in joints for point in result.joints[joint].curve]
    return np.mean(
        [low <= own[0] + own[1] * point.velocity <= high for own, point in points for low, high in [point.interval_95]]
    )


@pytest.mark.parametrize("kind", [pytest.param("stand", marks=pytest.mark.long), "squat"])
def test_arms_and_trunk_are_identified_while_both_feet_stand(kind, tmp_path) -> None:
    truth = still_humanoid(tmp_path, kind, seconds=8.0)
    result = identify(tmp_path / "log.npz", tmp_path / "robot.toml")
    verdicts = {joint: result.joints[joint].verdict for joint in truth}
    assert verdicts == {joint: "identified" if joint in UPPER else "not excited" for joint in truth}
    assert worst_error(result, truth, UPPER) < 0.03
    assert covered(result, truth, UPPER) >= 0.9
    assert "lift one foot at a time" in result.joints["left_knee"].reason


def test_every_joint_is_identified_while_the_robot_hangs(tmp_path) -> None:
    truth = still_humanoid(tmp_path, "hung")
    result = identify(tmp_path / "log.npz", tmp_path / "robot.toml")
    assert {joint.verdict for joint in result.joints.values()} == {"identified"}
    assert worst_error(result, truth, truth) < 0.03
    assert covered(result, truth, truth) >= 0.9


@pytest.mark.parametrize(
    "corrections", [*(pytest.param(own, marks=pytest.mark.long) for own in ("none", "inertia")), "calibration"]
)
def test_loops_of_legs_that_hardly_move_are_left_out(corrections, tmp_path) -> None:
    still_humanoid(tmp_path, "stand", seconds=8.0)
    settings = Settings(double_support="fit", corrections=corrections, law="coulomb-viscous")
    result = identify(tmp_path / "log.npz", tmp_path / "robot.toml", settings)
    assert [joint for joint, found in result.joints.items() if found.curve] == UPPER


def drafted(folder, without="nothing"):
    """Draft the robot file of a robot on wheels, and return its text."""
    text = draft_robot_file(str(folder / "rover.xml"), folder / "log.npz", folder / "robot.toml").text
    (folder / "robot.toml").write_text(text.replace("link_side_sensor", "motor_current").replace(without, ""))
    return text


@pytest.mark.parametrize("legs", [pytest.param(True, marks=pytest.mark.long), False])
def test_wheels_roll(legs, tmp_path) -> None:
    truth = rolling_robot(tmp_path, legs, seed=2, seconds=20.0)
    text = drafted(tmp_path)
    assert (text.count('kind = "wheel"'), text.count("radius = 0.086")) == (4, 4 * legs)
    result = identify(tmp_path / "log.npz", tmp_path / "robot.toml")
    known = [joint for joint, found in result.joints.items() if found.verdict == "identified"]
    assert len(known) >= (8 if legs else 6)
    assert worst_error(result, truth, [name for name in known if "calf" not in name]) < 0.05
    assert worst_error(result, truth, known) < 0.2
    assert covered(result, truth, known) >= 0.9
    assert legs or "jack the robot up" in result.joints["FL_wheel_joint"].reason


@pytest.mark.long
def test_ball_feet_that_never_lift_are_identified_if_their_radius_is_given(tmp_path) -> None:
    truth = rolling_robot(tmp_path, legs=True, wheels=False, seed=2, seconds=15.0)
    text = drafted(tmp_path)
    assert (text.count('kind = "point"'), text.count("radius = 0.022")) == (4, 4)
    result = identify(tmp_path / "log.npz", tmp_path / "robot.toml")
    known = [joint for joint, found in result.joints.items() if found.verdict == "identified"]
    assert len(known) >= 6
    assert worst_error(result, truth, known) < 0.1
    assert covered(result, truth, known) >= 0.9


@pytest.mark.parametrize(
    ("wheels", "radius", "remedy"),
    [
        (True, 0.086, r"set their radius .* or jack the robot up"),
        pytest.param(False, 0.022, "set the radius of any ball feet", marks=pytest.mark.long),
    ],
)
def test_an_unknown_radius_is_refused_with_a_remedy(wheels, radius, remedy, tmp_path) -> None:
    rolling_robot(tmp_path, legs=True, seconds=8.0, wheels=wheels)
    drafted(tmp_path, without=f"radius = {radius}")
    with pytest.raises(NothingIdentifiedError, match=remedy):
        identify(tmp_path / "log.npz", tmp_path / "robot.toml", law="coulomb-viscous")

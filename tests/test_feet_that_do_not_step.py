"""Robots whose feet do not step: joints whose equations need no contact are identified all the same."""

import numpy as np
import pytest
from studies.coverage import points_of
from tests.rolling import rolling_robot
from tests.standing import UPPER, still_humanoid

from stribeck import NothingIdentifiedError, Settings, identify
from stribeck.check.init import draft_robot_file

BALLS = pytest.param(True, False, marks=pytest.mark.long)


def worst_error_and_coverage(result, truth, joints) -> tuple[float, float]:
    """Compute the largest relative error of the curves of some joints, and the share of intervals with the truth."""
    points = points_of(result, joints, lambda joint, speed: truth[joint][0] + truth[joint][1] * speed)
    _, covered, error = np.transpose(points)
    return error.max(), covered.mean()


@pytest.mark.parametrize("kind", [pytest.param("stand", marks=pytest.mark.long), "squat", "hung"])
def test_arms_and_trunk_are_identified_while_both_feet_stand_and_every_joint_of_a_robot_that_hangs(kind, tmp_path):
    truth = still_humanoid(tmp_path, kind, seconds=10.0 if kind == "hung" else 8.0)
    known = [*truth] if kind == "hung" else UPPER
    result = identify(tmp_path / "log.npz", tmp_path / "robot.toml")
    verdicts = {joint: result.joints[joint].verdict for joint in truth}
    assert verdicts == {joint: "identified" if joint in known else "not excited" for joint in truth}
    error, covered = worst_error_and_coverage(result, truth, known)
    assert error < 0.03
    assert covered >= 0.9
    assert kind == "hung" or "lift one foot at a time" in result.joints["left_knee"].reason


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


@pytest.mark.parametrize(
    ("legs", "wheels"), [pytest.param(True, True, marks=pytest.mark.long), (False, True), BALLS], ids=str
)
def test_wheels_and_ball_feet_that_never_lift_roll_with_a_given_radius(legs, wheels, tmp_path) -> None:
    truth = rolling_robot(tmp_path, legs, wheels=wheels, seed=2, seconds=20.0 if wheels else 15.0)
    kind, radius = ("wheel", 0.086) if wheels else ("point", 0.022)
    text = drafted(tmp_path)
    assert (text.count(f'kind = "{kind}"'), text.count(f"radius = {radius}")) == (4, 4 * legs)
    result = identify(tmp_path / "log.npz", tmp_path / "robot.toml")
    known = [joint for joint, found in result.joints.items() if found.verdict == "identified"]
    assert len(known) >= (8 if legs and wheels else 6)
    error, covered = worst_error_and_coverage(result, truth, known)
    of_others, _ = worst_error_and_coverage(result, truth, [name for name in known if "calf" not in name])
    assert of_others < (0.05 if wheels else 0.1)
    assert error < (0.2 if wheels else 0.1)
    assert covered >= 0.9
    assert legs or "jack the robot up" in result.joints["FL_wheel_joint"].reason


def test_wheels_of_unknown_radius_are_refused_with_a_remedy(tmp_path) -> None:
    rolling_robot(tmp_path, legs=True, seconds=8.0, wheels=True)
    drafted(tmp_path, without="radius = 0.086")
    with pytest.raises(NothingIdentifiedError, match=r"set their radius .* or jack the robot up"):
        identify(tmp_path / "log.npz", tmp_path / "robot.toml", law="coulomb-viscous")

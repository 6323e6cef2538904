"""Exact logs at 1 kHz give back all six parameters of the law (3.5), for every joint and kind of robot."""

import pytest
from tests.models import POSTURES, STRIBECK, example_robot, make_robot

from stribeck import Robot, Settings, identify
from stribeck.friction import get_law
from stribeck.log import RobotLog
from stribeck.settings import FilterSettings
from stribeck.simulation.exact import exact_log
from stribeck.survey import survey


def thirty_joint_talos() -> Robot:
    """TALOS without its grippers; the neck is position-controlled, as TORO's."""
    table = {
        "position_controlled": ["head_1_joint", "head_2_joint"],
        "locked": {"gripper_left_joint": 0.0, "gripper_right_joint": 0.0},
    }
    feet = {side: {"frame": f"{side}_sole_link", "kind": "surface"} for side in ("left", "right")}
    return make_robot("talos_data/robots/talos_reduced.urdf", table, feet)


CASES = {
    "fixed-base arm": ("ur5", "walk", 6, 24.0),
    "humanoid": ("talos", "walk", 28, 24.0),
    "quadruped, one leg at a time": ("go2", "walk", 12, 48.0),
    "quadruped, trot": ("go2", "trot", 12, 16.0),
}


@pytest.fixture(scope="module", params=CASES.values(), ids=CASES)
def case(request: pytest.FixtureRequest) -> tuple[Robot, RobotLog, int]:
    name, gait, joints, duration = request.param
    robot = thirty_joint_talos() if name == "talos" else example_robot(name)
    truth = {joint: STRIBECK for joint in robot.joint_names if joint not in robot.position_controlled}
    log, _ = exact_log(
        robot, get_law("stribeck"), truth, duration=duration, gait=gait, posture=POSTURES.get(name, {}), seed=3
    )
    return robot, log, joints


@pytest.mark.parametrize(("kind", "tolerance"), [("log", 1e-3), ("auto", 1e-2)])
def test_every_parameter_of_every_joint_comes_back(
    case: tuple[Robot, RobotLog, int], kind: str, tolerance: float
) -> None:
    robot, log, joints = case
    result = identify(log, robot, Settings(filter=FilterSettings(kind=kind)))
    assert len(result.joints) == joints
    for name, joint in result.joints.items():
        assert joint.verdict == "identified", f"{name}: {joint.reason}"
        for parameter, truth in STRIBECK.items():
            assert joint.parameters[parameter].value == pytest.approx(truth, rel=tolerance), name


def test_the_robot_has_thirty_joints() -> None:
    assert len(thirty_joint_talos().joint_names) == 30


def test_the_predicted_ground_reaction_is_what_the_foot_feels() -> None:
    robot = thirty_joint_talos()
    log, _ = exact_log(robot, get_law("stribeck"), {}, duration=6, posture=POSTURES["talos"])
    settings = Settings(filter=FilterSettings(kind="log"))
    notes = survey(log, 0, 1, robot, settings, lambda *_: None, lambda *_: None).notes
    assert any("ground reaction" in note and "vertical 0.0 N" in note for note in notes)

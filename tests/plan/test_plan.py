"""What a plan says of joints that are weak or do not move, and what it refuses."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.arm import arm_log, save_npz, write_arm

from stribeck import Robot, Settings, identify, plan
from stribeck.app.cli.app import app
from stribeck.core.errors import SettingsError
from stribeck.core.judgement.curve import WIDEST, relative_width
from stribeck.core.result import JointResult, Result, read_result
from stribeck.design.planning.advice import PERIOD, motions_of, of_pace, present_length, sweep
from stribeck.design.planning.information import covariances, dynamics_of, expected_curve, read_noise
from stribeck.design.planning.joint import PlannedJoint, PresentMotion, Reach
from stribeck.design.planning.selection import gravity

NOISE = 20.0
"""Of the torques [N m]: so much that the slide, which has little friction, is weak."""


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a robot file and what a noisy log says, in which the elbow does not move."""
    folder = tmp_path_factory.mktemp("arm")
    robot = Robot.from_file(write_arm(folder))
    log = arm_log(robot, duration=12, still="elbow")
    noise = np.random.default_rng(0).standard_normal(log.torque.shape) * [0.1, 0.1, NOISE]
    save_npz(replace(log, torque=log.torque + noise), folder / "log.npz")
    settings = Settings(method="curve-fit", law="coulomb-viscous")
    result = identify(folder / "log.npz", robot, settings, table=folder / "friction_torque.parquet")
    (folder / "result.json").write_text(result.to_json())
    return folder


@pytest.fixture(scope="module")
def result(out: Path) -> Result:
    return read_result(out / "result.json")


def planned(joint: JointResult, noise: float = 1e-3) -> PlannedJoint:
    reach = Reach(middle=0.0, amplitude=1.0, speed=2.0)
    return PlannedJoint(
        column=0, result=joint, guessed=False, prismatic=False, settings=Settings(), reach=reach, noise=noise
    )


def random_motion(seed: int) -> PresentMotion:
    velocity = np.repeat(np.random.default_rng(seed).uniform(-2, 2, 50), 100)
    usable = np.ones(len(velocity), dtype=bool)
    return PresentMotion(velocity=velocity, friction_torque=velocity, usable=usable, period=0.005)


def wider(joint: JointResult, width: float, shares: dict[str, float] | None = None) -> JointResult:
    """Return a joint whose curve has another relative width, made of these parts."""
    factor = width / relative_width(joint.curve)
    curve = tuple(
        replace(
            point,
            standard_error=point.standard_error * factor,
            interval_95=(0.0, point.value + factor * point.half_width),
        )
        for point in joint.curve
    )
    parameters = {name: replace(own, variance_shares=shares) for name, own in joint.parameters.items()}
    return replace(joint, curve=curve, parameters=parameters)


def test_weak_and_still_joints_are_planned_for(out: Path, result: Result) -> None:
    verdicts = {name: joint.verdict for name, joint in result.joints.items()}
    assert verdicts == {"shoulder": "identified", "elbow": "not excited", "slide": "weak"}
    found = plan(out / "result.json", out / "robot.toml")
    assert list(found.joints) == ["elbow", "slide"]
    assert "the present motion is not sufficient: moves only" in found.joints["elbow"].advice
    assert found.joints["elbow"].guessed
    assert "the present motion is sufficient if recorded" in found.joints["slide"].advice
    for joint in found.joints.values():
        needed = [np.inf if one.needed is None else one.needed for one in joint.candidates]
        assert needed == sorted(needed)
        assert needed[0] < 120
    assert json.loads(found.to_json())["joints"]["slide"]["unit"] == "m/s"
    assert found.notes == ["elbow: no data; the median friction of the other joints is assumed"]


def test_a_longer_motion_is_as_much_longer_as_the_interval_is_too_wide(result: Result) -> None:
    """Four times as long halves it; what does not fall with the length leaves less room, and in the end none."""
    shoulder = result.joints["shoulder"]
    assert present_length(planned(wider(shoulder, 2 * WIDEST)), 10.0) == pytest.approx(40)
    some = wider(shoulder, 2 * WIDEST, {"noise": 0.8, "repeated errors": 0.2})
    assert present_length(planned(some), 10.0) == pytest.approx(10 * 0.8 / (0.25 - 0.2))
    most = wider(shoulder, 2 * WIDEST, {"noise": 0.7, "repeated errors": 0.3})
    assert present_length(planned(most), 10.0) is None


def test_the_present_motion_at_its_own_pace_brings_what_it_has_brought(result: Result) -> None:
    """Twice as fast it halves what falls with the length of viscous friction, and nothing of what stays."""
    for stays in (0.0, 1.0):
        joint = wider(result.joints["shoulder"], WIDEST / 2, {"noise": 1 - stays, "repeated errors": stays})
        same, faster = (of_pace("", pace, planned(joint), random_motion(2), 2.0) for pace in (1.0, 2.0))
        for now, again in zip(joint.curve, same.curve, strict=True):
            assert again.half_width == pytest.approx(now.half_width)
        gain = faster.curve[-1].half_width / joint.curve[-1].half_width
        assert gain == pytest.approx(1.0) if stays else 0.4 < gain < 0.9


def test_the_noise_explains_the_intervals(result: Result) -> None:
    motion, joint = random_motion(1), planned(result.joints["shoulder"])
    covariance = np.linalg.inv(joint.information(motion) / 1e-3 + np.diag(joint.precision))
    curve = expected_curve(joint, covariance, joint.result.curve[-1].velocity, 25.0)
    assert read_noise(motion, planned(replace(joint.result, curve=curve))) == pytest.approx(1e-3)


def test_covariances_equal_least_squares_with_bodies_known_and_are_larger_otherwise(out: Path, result: Result) -> None:
    robot = Robot.from_file(out / "robot.toml")
    joint = planned(result.joints["shoulder"])
    dynamics = dynamics_of(robot, gravity(robot, "z"), Settings().priors)
    slow, fast, turns = motions_of(joint)["fast"]
    state = sweep(slow, fast, joint, np.zeros(3), turns)[1]
    known = replace(dynamics, directions=1e-9 * dynamics.directions)
    sure, open_ = (covariances(each, state, [joint], PERIOD)[0] for each in (known, dynamics))
    velocity = state.velocity[:, 0]
    columns = np.column_stack([velocity, np.sign(velocity), np.ones(len(velocity))])
    least_squares = np.linalg.inv(columns.T @ columns * PERIOD / 1e-3)
    assert np.sqrt(np.diag(sure)) == pytest.approx(np.sqrt(np.diag(least_squares)), rel=0.05)
    assert np.all(np.diag(open_) >= np.diag(sure))
    assert open_[2, 2] > 10 * sure[2, 2]  # gravity makes up for an offset
    # without noise friction becomes known, however far the information about bodies outweighs their priors
    quiet = [planned(joint.result, noise) for noise in (1e-6, 1e-20, 1e-40)]
    errors = np.array([np.sqrt(np.diag(covariances(dynamics, state, [each], PERIOD)[0])) for each in quiet])
    assert np.all(errors > 0)
    np.testing.assert_allclose(errors[1], errors[2])
    assert np.all(errors[1] < 1e-2 * errors[0])


def test_the_command_writes_plan_and_trajectory_once(out, tmp_path, capsys):
    words = ["plan", str(out), "-r", str(out / "robot.toml"), "-o", str(tmp_path / "new")]
    words += ["--duration", "10", "--joints", "slide"]
    app(words, standalone_mode=False)
    shown = capsys.readouterr().out
    assert "slide weak: the present motion is sufficient if recorded" in shown
    assert "expected intervals after the trajectory (10 s): slide ±" in shown
    document = json.loads((tmp_path / "new/plan.json").read_text())
    assert list(document["trajectory"]["promise"]) == ["slide"]
    assert {path.name for path in (tmp_path / "new").iterdir()} == {"plan.json", "trajectory.csv"}
    with pytest.raises(SettingsError, match=r"plan\.json: already exists$"):
        app(words, standalone_mode=False)


def test_a_base_that_moves_gets_no_trajectory_unless_it_is_held(out: Path) -> None:
    robot = Robot.from_model(out / "arm.urdf", base="floating")
    walking = plan(out / "result.json", robot, duration=10.0)
    assert walking.trajectory is None
    assert walking.notes[-1].startswith("no trajectory, because the base moves")
    lying = plan(out / "result.json", robot, joints=["slide"], held="-x", duration=10.0)
    assert lying.trajectory is not None


def test_a_trajectory_respects_the_velocity_limit_of_the_model(out: Path, tmp_path: Path) -> None:
    urdf, slow = (out / "arm.urdf").read_text(), 0.25  # [m/s]; the slide is fast enough for more
    (tmp_path / "arm.urdf").write_text(re.sub('velocity="[^"]*"', f'velocity="{slow}"', urdf))
    robot = Robot.from_model(tmp_path / "arm.urdf", base="fixed")
    np.testing.assert_array_equal(robot.speed_limits, [slow, np.inf, slow])
    fastest = []
    for limited in (robot, Robot.from_model(out / "arm.urdf", base="fixed")):
        trajectory = plan(out / "result.json", limited, joints=["slide"], duration=10.0).trajectory
        fastest.append(np.abs(trajectory.at(np.arange(0, 10, 0.01)).velocity).max())
    assert fastest[0] <= 0.8 * slow * 1.001 < fastest[1]

"""Trajectories, also before a first log: within all limits, clear of the robot's body, and the same in every file."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.csv as csv
import pytest
from tests.arm import TRUTH, needed_torque, stribeck_torque, write_arm
from tests.cli.test_cli import refused, run
from tests.plan.test_plan import planned
from tests.result import made

from stribeck import Robot, Settings, identify, plan
from stribeck.core.log import RobotLog
from stribeck.design.planning.collision import CLEARANCE, load_self_collision
from stribeck.design.planning.information import dynamics_of
from stribeck.design.planning.joint import Reach, guess
from stribeck.design.planning.selection import gravity
from stribeck.design.planning.series import FREE, TORQUE_SHARE, Series, Task
from stribeck.design.planning.trajectory import FINE, Promise, Trajectory, design, promise_of, within_limits

EMPTY = made.joint(reason="", samples=0, velocity_range=(0.0, 0.0), reversals=0, law="stribeck")

ELBOW = (Path(__file__).parent / "elbow.urdf").read_text()


def task_of(robot: Robot, moving: tuple[int, ...], posture: np.ndarray, reach: float = 2.0) -> Task:
    """Return the task to find the friction of some joints, which may go so far either way, at 2 units a second."""
    joint = guess(EMPTY, [])
    known = {name: replace(own, value=TRUTH[name]) for name, own in joint.parameters.items()}
    own = planned(replace(joint, parameters=known), 1e-4)
    joints = [replace(own, column=k, reach=Reach(middle=posture[k], amplitude=reach, speed=2.0)) for k in moving]
    return Task(dynamics_of(robot, gravity(robot, "z"), Settings().priors), joints, posture)


@pytest.fixture(scope="module")
def task(tmp_path_factory: pytest.TempPathFactory) -> Task:
    robot = Robot.from_file(write_arm(tmp_path_factory.mktemp("arm")))
    return task_of(robot, (0,), np.array([0.3, 0.2, 0.1]))


@pytest.fixture(scope="module")
def trajectory(task: Task) -> Trajectory:
    found, notes = design(task, 30.0, None)
    assert all("drawn" in note for note in notes)
    return found


def test_a_series_has_its_own_derivatives_and_rests_between_periods() -> None:
    generator = np.random.default_rng(0)
    series = Series(np.array([0.5, -1.0]), generator.standard_normal((FREE, 2)))
    time = np.linspace(0, 20, 20001)
    state = series.at(time)
    assert np.gradient(state.position, time, axis=0)[1:-1] == pytest.approx(state.velocity[1:-1], abs=1e-4)
    assert np.gradient(state.velocity, time, axis=0)[1:-1] == pytest.approx(state.acceleration[1:-1], abs=1e-4)
    for end in (0, 10000, 20000):
        assert state.velocity[end] == pytest.approx(0, abs=1e-9)
        assert state.acceleration[end] == pytest.approx(0, abs=1e-9)


def test_a_trajectory_stays_within_all_limits(task: Task, trajectory: Trajectory) -> None:
    robot = task.dynamics.robot
    state = trajectory.at(np.arange(0, trajectory.duration, 0.003))
    assert trajectory.duration == 30
    assert np.abs(state.position[:, 0] - 0.3).max() <= 2.001
    assert 1.0 < np.abs(state.velocity[:, 0]).max() <= 2.001
    assert np.all(state.position[:, 1:] == [0.2, 0.1])
    torque = needed_torque(robot, state.position, state.velocity, state.acceleration)
    torque[:, 0] += task.joints[0].result.friction(state.velocity[:, 0], offset=True)
    used = np.abs(torque / (TORQUE_SHARE * robot.effort_limits)).max()
    assert used <= 1.001
    assert used == pytest.approx(trajectory.used["torque"], rel=0.02)


def test_a_trajectory_is_more_informative_than_random_ones(task: Task, trajectory: Trajectory) -> None:
    """Each as large as the limits let it be."""

    def uncertainty(promise: Promise) -> float:
        return float(np.mean(np.log(list(promise.half_width.values()))))

    generator = np.random.default_rng(5)
    of_random = []
    for _ in range(5):
        series = task.series(np.append(0.0, generator.standard_normal(FREE)))
        state = task.motion(within_limits(task, series, None)[0], np.arange(0, 10, FINE))
        of_random.append(uncertainty(promise_of(task, state, 3)["shoulder"]))
    assert uncertainty(trajectory.promise["shoulder"]) < min(of_random)


def test_the_file_contains_the_trajectory(trajectory: Trajectory, tmp_path: Path) -> None:
    trajectory.write_csv(tmp_path / "trajectory.csv")
    table = csv.read_csv(tmp_path / "trajectory.csv")
    time = table["time"].to_numpy()
    assert time[[0, 1, -1]] == pytest.approx([0, 0.01, trajectory.duration])
    for kind in ("position", "velocity", "acceleration"):
        found = np.column_stack([table[f"{kind}.{name}"].to_numpy() for name in trajectory.joint_names])
        assert found == pytest.approx(getattr(trajectory.at(time), kind), abs=1e-9)


def test_bodies_keep_clear_of_each_other(tmp_path: Path) -> None:
    """The forearm would swing into the base: without bodies it does, with them it does not."""
    (tmp_path / "elbow.urdf").write_text(ELBOW)
    robot = Robot.from_model(tmp_path / "elbow.urdf", base="fixed")
    posture = np.array([0.0, -2.0])
    bodies, notes = load_self_collision(robot, posture)
    assert not notes
    task = task_of(robot, (1,), posture, reach=1.2)
    blind, _ = design(task, 10.0, None)
    assert bodies.nearest(blind.at(np.arange(0, 10, 0.05)).position)[0] <= 0
    seeing, notes = design(task, 10.0, bodies)
    assert bodies.nearest(seeing.at(np.arange(0, 10, 0.05)).position)[0] > 0.9 * CLEARANCE
    assert seeing.clearance is not None
    assert "the distance of base and fore" in notes[0]


MJCF = (Path(__file__).parent / "elbow.xml").read_text()


def followed(robot: Robot, trajectory: Trajectory) -> RobotLog:
    """Return the log of a robot with known friction that follows a trajectory, with noise of 0.5 N m."""
    time = np.arange(round(trajectory.duration * 250)) / 250
    state = trajectory.at(time)
    torque = needed_torque(robot, state.position, state.velocity, state.acceleration) + stribeck_torque(state.velocity)
    torque += 0.5 * np.random.default_rng(0).standard_normal(torque.shape)
    return RobotLog(time=time, joint_names=robot.joint_names, position=state.position, torque=torque)


def test_the_first_trajectory_identifies_every_joint(tmp_path: Path) -> None:
    robot = Robot.from_file(write_arm(tmp_path))
    found = plan(None, robot, duration=30.0)
    assert found.joints == {}
    assert found.trajectory.promise == {}
    assert max(found.trajectory.used.values()) <= 1
    state = found.trajectory.at(np.arange(0, 30, 0.01))
    assert np.abs(state.velocity).max(axis=0) == pytest.approx([2.5, 1.0, 2.5], rel=0.5)  # half of the limit, or 1
    assert np.all(np.abs(state.velocity).max(axis=0) <= [2.5, 1.0, 2.5])
    assert "elbow: the model has no speed limit; at most 1 rad/s" in found.notes
    result = identify(followed(robot, found.trajectory), robot)
    assert {joint.verdict for joint in result.joints.values()} == {"identified"}
    for joint in result.joints.values():
        assert joint.friction([0.5])[0] == pytest.approx(1.2 + 0.15, rel=0.1)


@pytest.mark.parametrize("free", ["", "<freejoint/>"])
def test_the_bodies_of_an_mjcf_keep_clear_of_each_other_and_of_the_world_that_holds_them(tmp_path, free):
    """The capsule folds back to the base: its axis passes the face of the base at 0.3 m, and the floor at 0.1 m."""
    (tmp_path / "elbow.xml").write_text(MJCF.format(free=free))
    robot = Robot.from_model(tmp_path / "elbow.xml", base="floating" if free else "fixed")
    bodies, notes = load_self_collision(robot, np.zeros(2))
    distance, pair = bodies.nearest(np.array([[0.0, np.pi]]))  # the capsule ends at x = 0.35 - 0.4
    assert distance <= 0
    assert pair in ("base and fore", "fore and base")
    distance, _ = bodies.nearest(np.array([[0.0, 0.0]]))
    assert distance == pytest.approx(0.35 - 0.05, abs=1e-6) if free else distance < 0.2
    (tmp_path / "elbow.urdf").write_text(ELBOW)
    assert load_self_collision(Robot.from_model(tmp_path / "elbow.urdf", base="fixed"), np.zeros(2))[1] == notes == []


def test_the_command_plans_from_a_model_or_a_robot_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_arm(tmp_path)
    for source, more in (("arm.urdf", ["--held=-x"]), ("robot.toml", [])):
        arguments = ("plan", tmp_path / source, "-o", tmp_path / "new", "--duration", "10", "--joints", "slide", *more)
        assert run(*arguments, "--overwrite") == 0
        printed = capsys.readouterr().out
        assert "trajectory before the first log, 10 s:\nslide: " in printed
        assert (tmp_path / "new/trajectory.csv").exists()
    assert "result.json: cannot be read" in refused(capsys, "plan", tmp_path, "-o", tmp_path / "no")
    assert "expected one with --robot" in refused(capsys, "plan", tmp_path / "arm.urdf", "-r", tmp_path / "robot.toml")
    (tmp_path / "robot.toml").write_text('[robot]\nmodel = "arm.urdf"\nbase = "floating"\n')
    assert "name its axis that points up (`--held z`)" in refused(capsys, "plan", tmp_path / "robot.toml")

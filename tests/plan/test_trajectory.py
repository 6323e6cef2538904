"""Trajectories: at rest at both ends, within all limits, clear of the robot's own body, and the same in every file."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pyarrow.csv as csv
import pytest
from tests.arm import TRUTH, write_arm

from stribeck import Robot, Settings
from stribeck.plan.collision import CLEARANCE, load_self_collision
from stribeck.plan.information import dynamics_of
from stribeck.plan.joint import PlannedJoint, Reach, guess
from stribeck.plan.selection import gravity
from stribeck.plan.series import FREE, TORQUE_SHARE, Series, Task
from stribeck.plan.trajectory import FINE, Promise, Trajectory, design, promise_of, within_limits
from stribeck.result import JointResult

EMPTY = JointResult(
    parameters={}, verdict="not excited", reason="", samples=0, velocity_range=(0.0, 0.0), reversals=0, law="stribeck"
)

ELBOW = """<robot name="elbow">
  <link name="base"><collision><geometry><box size="0.1 0.1 0.4"/></geometry></collision></link>
  <joint name="shoulder" type="revolute"><origin xyz="0.15 0 0.1"/><parent link="base"/><child link="upper"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="100" velocity="3"/></joint>
  <link name="upper"><inertial><origin xyz="0.1 0 0"/><mass value="1"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <joint name="elbow" type="revolute"><origin xyz="0.2 0 0"/><parent link="upper"/><child link="fore"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="100" velocity="3"/></joint>
  <link name="fore"><inertial><origin xyz="0.2 0 0"/><mass value="1"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
    <collision><origin xyz="0.2 0 0"/><geometry><box size="0.4 0.05 0.05"/></geometry></collision></link>
</robot>
"""


def task_of(robot: Robot, moving: tuple[int, ...], posture: np.ndarray, reach: float = 2.0) -> Task:
    """Return the task to find the friction of some joints, which may go so far either way, at 2 units a second."""
    joint = guess(EMPTY, [])
    known = {name: replace(own, value=TRUTH[name]) for name, own in joint.parameters.items()}
    joints = [
        PlannedJoint(
            column=k,
            found=replace(joint, parameters=known),
            guessed=False,
            prismatic=False,
            settings=Settings(),
            reach=Reach(middle=posture[k], amplitude=reach, speed=2.0),
            noise=1e-4,
        )
        for k in moving
    ]
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
    model, data = robot.tree.model, robot.tree.model.createData()
    rows = zip(state.position, state.velocity, state.acceleration, strict=True)
    torque = np.array([pin.rnea(model, data, *row) for row in rows])
    torque[:, 0] += task.joints[0].found.friction(state.velocity[:, 0], offset=True)
    used = np.abs(torque / (TORQUE_SHARE * robot.effort_limits)).max()
    assert used <= 1.001
    assert used == pytest.approx(trajectory.used["torque"], rel=0.02)


def test_a_trajectory_says_more_than_random_ones(task: Task, trajectory: Trajectory) -> None:
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


def test_four_times_as_long_halves_the_intervals(task: Task, trajectory: Trajectory) -> None:
    longer, _ = design(task, 120.0, None)
    short, long = (each.promise["shoulder"].curve[1].standard_error for each in (trajectory, longer))
    assert short / long == pytest.approx(2, rel=0.1)


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
    assert bodies is not None
    assert not notes
    task = task_of(robot, (1,), posture, reach=1.2)
    blind, _ = design(task, 10.0, None)
    assert bodies.nearest(blind.at(np.arange(0, 10, 0.05)).position)[0] <= 0
    seeing, notes = design(task, 10.0, bodies)
    assert bodies.nearest(seeing.at(np.arange(0, 10, 0.05)).position)[0] > 0.9 * CLEARANCE
    assert seeing.clearance is not None
    assert "the distance of base and fore" in notes[0]

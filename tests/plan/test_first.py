"""Trajectories before the first log: within the limits, clear of the robot's body, and enough to identify friction."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from tests.arm import TRUTH, write_arm
from tests.cli.test_cli import refused, run
from tests.plan.test_trajectory import ELBOW

from stribeck import Robot, identify, plan
from stribeck.friction import get_law
from stribeck.log import RobotLog
from stribeck.plan.collision import load_self_collision
from stribeck.plan.trajectory import Trajectory

MJCF = """<mujoco><worldbody><geom type="plane" size="9 9 1"/><body name="base">{free}
  <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/><geom type="box" size="0.05 0.05 0.2"/>
  <body name="upper" pos="0.15 0 0.1"><joint name="shoulder" axis="0 1 0" range="-3 3"/>
    <inertial pos="0.1 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
    <body name="fore" pos="0.2 0 0"><joint name="elbow" axis="0 1 0" range="-3 3"/>
      <inertial pos="0.2 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
      <geom type="capsule" fromto="0.05 0 0 0.35 0 0" size="0.05"/></body></body></body></worldbody>
<compiler angle="radian"/></mujoco>"""


def followed(robot: Robot, trajectory: Trajectory) -> RobotLog:
    """Return the log of a robot with known friction that follows a trajectory, with noise of 0.5 N m."""
    time = np.arange(round(trajectory.duration * 250)) / 250
    state, law = trajectory.at(time), get_law("stribeck")
    values = np.array([TRUTH[parameter.name] for parameter in law.parameters])
    model, data = robot.tree.model, robot.tree.model.createData()
    rows = zip(state.position, state.velocity, state.acceleration, strict=True)
    torque = np.array([pin.rnea(model, data, *row) for row in rows])
    torque += law.torque(state.velocity.ravel(), values).reshape(torque.shape)
    torque += 0.5 * np.random.default_rng(0).standard_normal(torque.shape)
    return RobotLog(time=time, joint_names=robot.joint_names, position=state.position, torque=torque)


def test_the_first_trajectory_identifies_every_joint(tmp_path: Path) -> None:
    robot = Robot.from_file(write_arm(tmp_path))
    found = plan(None, robot, duration=30.0)
    assert found.joints == {}
    assert found.trajectory is not None
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
def test_the_bodies_of_an_mjcf_keep_clear_of_each_other_and_of_the_world_that_holds_them(
    tmp_path: Path, free: str
) -> None:
    """The capsule folds back to the base: its axis passes the face of the base at 0.3 m, and the floor at 0.1 m."""
    (tmp_path / "elbow.xml").write_text(MJCF.format(free=free))
    robot = Robot.from_model(tmp_path / "elbow.xml", base="floating" if free else "fixed")
    bodies, notes = load_self_collision(robot, np.zeros(2))
    assert bodies is not None
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
    assert "pass --robot FILE" in refused(capsys, "plan", tmp_path, "-o", tmp_path / "no")
    assert "expected one with --robot" in refused(capsys, "plan", tmp_path / "arm.urdf", "-r", tmp_path / "robot.toml")
    (tmp_path / "robot.toml").write_text('[robot]\nmodel = "arm.urdf"\nbase = "floating"\n')
    assert "name its axis that points up (`--held z`)" in refused(capsys, "plan", tmp_path / "robot.toml")

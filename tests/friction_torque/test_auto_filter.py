"""Choice of the filter for robots whose inertia matrix is singular, and for logs that start in a gantry."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from tests.arm import arm_log, write_arm
from tests.loops import joint, link

from stribeck import Robot
from stribeck.friction_torque.auto_filter import cutoff_from_log
from stribeck.friction_torque.preparation import prepare

COAXIAL = (
    '<robot name="coaxial"><link name="base"/><link name="empty"/>'
    + joint("first", "base", "empty", "0 0 1", "0 0 0")
    + link("body", 2.0, "0.1 0 0.1")
    + joint("second", "empty", "body", "0 0 1", "0 0 0.1")
    + link("hand", 1.0, "0.1 0 0.1")
    + joint("third", "body", "hand", "0 1 0", "0 0 0.3")
    + "</robot>"
)


def test_joints_about_one_axis_with_nothing_between_them_choose_no_filter(tmp_path: Path) -> None:
    (tmp_path / "model.urdf").write_text(COAXIAL)
    (tmp_path / "robot.toml").write_text('[robot]\nmodel = "model.urdf"\nbase = "fixed"\n')
    robot = Robot.from_file(tmp_path / "robot.toml")
    prepared = prepare(arm_log(robot, duration=4.0), robot, robot.settings)
    choice = cutoff_from_log(prepared, robot, robot.settings)
    assert np.isfinite(choice.cutoff)


def test_contact_flags_that_are_missing_at_first_choose_the_filter_of_the_rest(tmp_path: Path) -> None:
    robot = Robot.from_file(write_arm(tmp_path))
    prepared = prepare(arm_log(robot, duration=40.0), robot, robot.settings)
    (phase,) = prepared.support.phases
    rest = replace(phase, start=35_000, first=35_000, steady_first=35_000)
    hung = replace(phase, kind="flight", feet=(), stop=35_000, last=35_000, steady_last=35_000)
    chosen = [
        cutoff_from_log(replace(prepared, support=replace(prepared.support, phases=phases)), robot, robot.settings)
        for phases in ((hung, rest), (rest,))
    ]
    assert chosen[0].cutoff == chosen[1].cutoff

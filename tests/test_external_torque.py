"""With external joint torques, every method finds the same friction as without."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tests.arm import arm_log, write_arm
from tests.cli.test_cli import refused
from tests.friction_torque.test_friction_torque import EXACT
from tests.methods.test_ground_reaction import moved, robot

from stribeck import Robot, Settings, identify
from stribeck.friction_torque.inverse_dynamics import torque_chunks
from stribeck.friction_torque.preparation import prepare
from stribeck.log import RobotLog
from stribeck.replay.replay import replay
from stribeck.result import Result
from stribeck_simulation.sensors.measure import with_noise


def loaded(log: RobotLog, size: float = 5.0) -> RobotLog:
    """Make a log of the same motion under an external torque, which changes the measured torque."""
    phases = np.arange(len(log.joint_names))
    external = size * np.sin(3 * log.time[:, None] + phases)
    return replace(log, torque=log.torque - external, external_torque=external)


@cache
def arm(folder: Path) -> tuple[Robot, RobotLog]:
    robot = Robot.from_file(write_arm(folder))
    log = with_noise(arm_log(robot, duration=7.0, rate=250.0), position=1e-5, torque=0.05)
    return robot, replace(log, velocity=None, acceleration=None)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("arm")


def values(result: Result) -> dict[tuple[str, str], float]:
    found = result.joints.items()
    return {(joint, name): one.value for joint, own in found for name, one in own.parameters.items()}


@pytest.mark.parametrize("method", ["curve-fit", "observer", "direct", "whole-log"])
def test_friction_is_that_of_the_same_motion_without(method: str, folder: Path) -> None:
    robot, log = arm(folder)
    settings = Settings(method=method, law="coulomb-viscous", corrections="none" if method == "whole-log" else "auto")
    plain, under_load = (values(identify(each, robot, settings)) for each in (log, loaded(log)))
    assert plain
    assert under_load == pytest.approx(plain, rel=1e-3, abs=1e-3)
    wrong = values(identify(replace(loaded(log), external_torque=None), robot, settings, force=True))
    assert max(abs(wrong.get(key, 9.0) - value) for key, value in plain.items()) > 0.1


def test_friction_torque_of_standing_legs_is_that_of_the_same_motion_without() -> None:
    log = moved("walk", 8.0)[0].take(slice(2000))
    settings = Settings.model_validate({"filter": EXACT, "standing_legs": "measured"})
    (plain,), (under_load,) = (
        torque_chunks(prepare(each, robot(), settings), robot(), settings) for each in (log, loaded(log))
    )
    assert plain.samples.usable.any()
    np.testing.assert_allclose(under_load.samples.friction_torque, plain.samples.friction_torque, atol=1e-9)


def test_a_model_explains_as_much_as_without(folder: Path) -> None:
    robot, log = arm(folder)
    log = log.take(slice(1000))
    plain, under_load = (replay(each, robot, robot.model_path, Settings()).models[0] for each in (log, loaded(log)))
    for joint, error in plain.torque.items():
        assert under_load.torque[joint].rms == pytest.approx(error.rms, rel=1e-6)
        of_rollouts = [one.rms for one in under_load.rollouts[joint] if one]
        assert of_rollouts == pytest.approx([one.rms for one in plain.rollouts[joint] if one], rel=1e-6)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda external: external[:, :2], "'external_torque' has 2 columns"),
        (lambda external: external[:-5], "'external_torque' has 1495 rows, 'time' has 1500; expected as many"),
        (lambda external: external * [np.nan, 1, 1], "missing: external_torque.shoulder (1500)"),
        (lambda external: external.astype(str), "array 'external_torque' contains values of type"),
    ],
)
def test_what_cannot_be_used_is_refused(change, said, folder, capsys) -> None:  # type: ignore[no-untyped-def]
    robot, log = arm(folder)
    log = loaded(arm_log(robot, duration=3.0, rate=500.0))
    arrays = log.channels() | {"external_torque": change(log.external_torque)}
    np.savez(folder / "bad.npz", joint_names=np.array(log.joint_names), **arrays)
    assert said in refused(capsys, "identify", folder / "bad.npz", "--robot", robot.path, "-o", folder / "out")

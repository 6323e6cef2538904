"""Joints that stand still while another one moves do not judge a log: brakes or stiction carry their loads."""

from pathlib import Path

import numpy as np
import pytest
from tests.mujoco_arm import JOINTS, friction, record, urdf

from stribeck import identify
from stribeck.errors import LogError
from stribeck.inspection import inspect_log


@pytest.mark.parametrize("moving", [0, pytest.param(2, marks=pytest.mark.long)])
def test_a_test_of_one_joint_is_identified_while_brakes_hold_the_others(moving: int, tmp_path: Path) -> None:
    speed = np.full(3, 1e-6)
    speed[moving] = 2.0
    log = record(speed.tolist(), 30.0 if moving else 16.0)
    braked = [k for k in range(3) if k != moving]
    rng = np.random.default_rng(3)
    log["torque"][:, braked] = rng.normal(0.3, 0.2, (len(log["time"]), 2))
    log["position"][:, braked] = 0.7 + 0.001 * np.round(rng.normal(0.0, 0.3, (len(log["time"]), 2)))  # last digit
    (tmp_path / "arm.urdf").write_text(urdf())
    (tmp_path / "robot.toml").write_text(
        '[robot]\nmodel = "arm.urdf"\nbase = "fixed"\ntorque_source = "motor_current"\n'
    )
    path = tmp_path / "log.npz"

    def save(sign: float) -> Path:
        torque = log["torque"] * np.where(np.arange(3) == moving, sign, 1.0)
        np.savez(path, joint_names=np.array(JOINTS), time=log["time"], position=log["position"], torque=torque)
        return path

    result = identify(save(1.0), tmp_path / "robot.toml")
    assert [joint.verdict == "identified" for joint in result.joints.values()] == [k == moving for k in range(3)]
    v = np.zeros((1, 3))
    v[:, moving] = 0.8
    found = result.joints[JOINTS[moving]].friction(0.8)
    assert found == pytest.approx(friction(v)[0, moving], rel=0.05)
    if moving == 0:  # gravity loads it: the joint that moves still judges the log
        save(-1.0)
        with pytest.raises(LogError, match=JOINTS[0]):
            identify(path, tmp_path / "robot.toml")
        named = {
            name for each in inspect_log(path, tmp_path / "robot.toml").audit if each.stops for name in each.joints
        }
        assert named == {JOINTS[0]}

"""Torque constants and kp that nobody knows: gravity determines some; the friction of other joints is in A or rad."""

import json
from pathlib import Path

import numpy as np
import pytest
from tests.command_logs import hobby_arm
from tests.commanded import ARM, arm_drives, arm_log, write_robot

from stribeck import Result, export, identify, write_report
from stribeck.core.result import read_result

LOADED = ("lift", "elbow", "wrist_pitch")
"""Joints whose factor gravity determines; the axis of the first joint is vertical, and the last ones carry little."""
CONSTANTS = {"pan": 2.1, "lift": 2.5, "elbow": 1.6, "wrist_pitch": 1.1, "wrist_roll": 0.9, "gripper": 0.7}
"""Torque constants times gear ratios [N m/A]."""


def commands(folder: Path) -> tuple[dict, dict]:
    drives = hobby_arm(folder, keys=())
    return drives, {name: drive.kp for name, drive in drives.items()}


def currents(folder: Path) -> tuple[dict, dict]:
    drives = arm_drives(5, latency=0.0)
    log = arm_log(drives, 5, 30.0, policy=1000.0, rate=250.0)
    kp, kd = np.array([(drive.kp, drive.kd) for drive in drives.values()]).T
    torque = kp * (log.pop("desired_position") - log["position"]) - kd * log["velocity"]
    np.savez(folder / "log.npz", joint_names=list(drives), torque=torque / [*CONSTANTS.values()], **log)
    write_robot(folder, ARM, drives, ())
    text = (folder / "robot.toml").read_text().replace('"command"', '"motor_current"')
    (folder / "robot.toml").write_text(text + '\n[log.torque]\nunit = "A"\n')
    return drives, CONSTANTS


@pytest.mark.parametrize(("write", "unit"), [pytest.param(commands, "rad", marks=pytest.mark.long), (currents, "A")])
def test_joints_without_a_known_factor_are_identified_in_the_unit_of_their_channel(write, unit, tmp_path: Path) -> None:
    drives, factors = write(tmp_path)
    found = identify(tmp_path / "log.npz", tmp_path / "robot.toml")
    identified = 0
    for name, own in drives.items():
        joint, known = found.joints[name], name in LOADED
        assert joint.torque_unit == (None if known else unit)
        identified += joint.verdict == "identified"
        damping = own.kd if write is commands else 0.0  # kd is not given: viscous friction includes it
        for point in joint.curve:
            assert point.unit == ("N m" if known else unit)
            truth = (own.coulomb + (own.viscous + damping) * point.velocity) / (1.0 if known else factors[name])
            within = point.interval_95[0] <= truth <= point.interval_95[1] or abs(point.value / truth - 1) < 0.1
            assert within or joint.verdict != "identified"
    assert identified >= 5
    handed_over(found, unit, tmp_path)


def handed_over(found: Result, unit: str, folder: Path) -> None:
    """Check that report, result.json and exports state the unit."""
    write_report(found, folder / "report.html")
    assert f"friction [{unit}]" in (folder / "report.html").read_text()
    found.save(folder / "result.json")
    assert read_result(folder / "result.json").joints == found.joints
    plain = json.loads(found.to_json())["joints"]
    assert [name for name, joint in plain.items() if "torque_unit" in joint] == ["pan", "wrist_roll", "gripper"]
    lines = export(found, folder / "robot.toml", folder / "found.urdf", "urdf")
    factor = "kp" if unit == "rad" else "torque constant and gear ratio"
    assert f"Left out joint wrist_roll: friction in {unit}, multiply by {factor} for N m." in lines
    export(found, folder / "robot.toml", folder / "found.yaml", "yaml")
    assert (folder / "found.yaml").read_text().count(f"torque_unit: {unit}") >= 2

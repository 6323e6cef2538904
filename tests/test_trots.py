"""Trots as robots log them are identified without settings."""

import pytest
from tests.command_logs import trotting_quadruped

from stribeck import identify


@pytest.mark.parametrize(
    "log",
    [{"rate": 200.0}, pytest.param({"flags": False}, marks=pytest.mark.long)],
    ids=["raw flags at 200 Hz", "no flags"],
)
def test_a_trot_is_identified_and_covered_by_default(log, tmp_path):
    drives = trotting_quadruped(tmp_path, keys=(), seconds=15.0, ramps=True, **log)
    path = tmp_path / "robot.toml"
    path.write_text(path.read_text().replace('"command"', '"motor_current"'))
    joints = identify(tmp_path / "log.npz", path).joints
    assert sum(joint.verdict == "identified" for joint in joints.values()) >= 10
    inside = []
    for name, drive in drives.items():
        for point in joints[name].curve:
            friction = drive.coulomb + drive.viscous * point.velocity
            low, high = point.interval_95
            inside.append(low <= friction <= high)
            assert inside[-1] or abs(point.value / friction - 1) < 0.15, name
    assert sum(inside) >= 29

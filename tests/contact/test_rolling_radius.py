"""The radius of a ball foot comes from a sphere, or from a mesh that is nearly one."""

from pathlib import Path

import pytest

from stribeck.core.robot.packages import model_path
from stribeck.core.robot.rolling_radius import rolling_radius


def test_a_ball_has_the_radius_of_its_sphere_or_mesh(tmp_path: Path) -> None:
    go2 = model_path("package:go2", tmp_path)
    assert rolling_radius(go2, "FL_foot", meshes=True) == pytest.approx(0.022, abs=1.5e-3)
    assert rolling_radius(go2, "FL_foot") == rolling_radius(go2, "FL_calf", meshes=True) == 0
    assert rolling_radius(model_path("package:a1", tmp_path), "FL_foot") == 0.02
    assert rolling_radius(tmp_path / "missing.urdf", "FL_foot") == 0

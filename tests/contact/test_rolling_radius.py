"""A ball foot has the radius and the center of a sphere, or the radius of a mesh that is nearly one."""

from pathlib import Path

import numpy as np
import pytest

from stribeck.core.robot import Robot
from stribeck.core.robot.packages import model_path
from stribeck.core.robot.rolling_radius import ball_beside, rolling_radius


def test_a_ball_has_the_radius_of_its_sphere_or_mesh(tmp_path: Path) -> None:
    go2 = model_path("package:go2", tmp_path)
    assert rolling_radius(go2, "FL_foot", meshes=True) == pytest.approx(0.022, abs=1.5e-3)
    assert rolling_radius(go2, "FL_foot") == rolling_radius(go2, "FL_calf", meshes=True) == 0
    assert rolling_radius(model_path("package:a1", tmp_path), "FL_foot") == 0.02
    assert rolling_radius(tmp_path / "missing.urdf", "FL_foot") == 0


@pytest.mark.parametrize(("radius", "height"), [(None, 0.0225), (0.03, 0.0225), (0.0, 0.0)])
def test_a_foot_is_the_center_of_the_ball_beside_its_frame(radius: float | None, height: float) -> None:
    foot = {"frame": "LF_FOOT", "kind": "point"} | ({} if radius is None else {"radius": radius})
    anymal = "package:anymal_c_simple_description/anymal"
    robot = Robot.from_model(anymal, contacts={"LF": foot})  # type: ignore[dict-item]  # as in a robot file
    model, names = robot.tree.model, ("LF_FOOT", robot.contacts["LF"].frame)
    frame, own = (model.frames[model.getFrameId(name)].placement for name in names)
    np.testing.assert_allclose(frame.actInv(own.translation), [0, 0, height], atol=1e-9)
    assert robot.contacts["LF"].ball == (0.03 if height else 0.0)


def test_the_center_of_a_ball_is_in_the_frame_of_the_site_beside_it(tmp_path: Path) -> None:
    leg = '<joint/><geom size="0.02" pos="0 0 -0.3" mass="1"/><site name="sole" pos="0 0 -0.32" euler="90 0 0"/>'
    model = tmp_path / "leg.xml"
    model.write_text(f'<mujoco><worldbody><body name="shin">{leg}</body></worldbody></mujoco>')
    ball = ball_beside(model, "sole")
    assert ball is not None
    assert ball[0] == 0.02
    np.testing.assert_allclose(ball[1], [0, 0.02, 0], atol=1e-9)

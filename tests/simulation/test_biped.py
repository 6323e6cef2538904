"""The packaged biped is what its table says, and its sides are mirror images."""

import numpy as np
import pinocchio as pin
import pytest

from stribeck.robot import Robot
from stribeck_simulation.robots.biped import MODELS, biped_urdf, solid_inertia


def test_the_packaged_file_is_made_of_the_table():
    assert (MODELS / "biped.urdf").read_text(encoding="utf-8") == biped_urdf()


def test_size_and_mass():
    robot = Robot.from_file(MODELS / "robot.toml")
    assert robot.mass == pytest.approx(60.0, abs=0.01)
    assert len(robot.joint_names) == 23
    assert robot.position_controlled == ("neck_yaw", "neck_pitch")
    assert robot.warnings == ()
    sole = robot.foot_pose("left_foot", np.zeros((1, 23)))[1][0, 2]
    crown = 0.10 + 0.40 + 0.05 + 0.19  # up the trunk to the top of the head
    assert crown - sole == pytest.approx(1.64)


def test_inertia_of_solids():
    """A box is the sum of its halves; a thin rod and a disc are the textbook's."""
    np.testing.assert_allclose(solid_inertia(12, (1.0, 2.0, 3.0)), (13, 10, 5))
    half = np.array(solid_inertia(6, (1.0, 2.0, 1.5)))
    np.testing.assert_allclose(2 * (half + 6 * 0.75**2 * np.array([1, 1, 0])), (13, 10, 5))
    np.testing.assert_allclose(solid_inertia(3, (1e-9, 2.0)), (1, 1, 0), atol=1e-12)
    np.testing.assert_allclose(solid_inertia(4, (1.0, 1e-9)), (1, 1, 2))


def test_sides_are_mirror_images():
    """Torques of the mirrored motion are the mirrored torques: sides change places, roll and yaw change sign."""
    model = pin.buildModelFromUrdf(str(MODELS / "biped.urdf"))
    names = list(model.names)[1:]
    other = [name.replace("left", "#").replace("right", "left").replace("#", "right") for name in names]
    place = [names.index(name) for name in other]
    sign = np.array([1.0 if any(word in name for word in ("pitch", "knee", "elbow")) else -1.0 for name in names])
    generator = np.random.default_rng(0)
    for _ in range(5):
        motion = generator.uniform(-1, 1, (3, model.nv))
        torque = pin.rnea(model, model.createData(), *motion)
        mirrored = pin.rnea(model, model.createData(), *(sign * motion[:, place]))
        np.testing.assert_allclose(mirrored, sign * torque[place], atol=1e-12)
    low, high = model.lowerPositionLimit, model.upperPositionLimit
    np.testing.assert_array_equal(np.where(sign > 0, low, -high)[place], low)

"""The packaged humanoids are what their tables say, the same to both engines, and their sides are mirror images."""

from collections.abc import Callable

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from stribeck.robot import Robot
from stribeck_simulation.robots import MODELS
from stribeck_simulation.robots.toro import FOOT_SIZE, MODEL_FILE, ROBOT_FILE, standing_posture, toro_links, toro_mjcf


@pytest.fixture(scope="module")
def robot() -> Robot:
    return Robot.from_file(ROBOT_FILE)


@pytest.fixture(scope="module")
def engines() -> tuple[mujoco.MjModel, pin.Model]:
    return mujoco.MjModel.from_xml_path(str(MODEL_FILE)), pin.buildModelFromMJCF(str(MODEL_FILE))


def test_the_packaged_file_is_made_of_the_table(engines):
    assert MODEL_FILE.read_text(encoding="utf-8") == toro_mjcf()
    compiled, _ = engines
    for link in toro_links():
        effort = link.drive.effort
        np.testing.assert_allclose(compiled.jnt_actfrcrange[compiled.joint(link.name).id], (-effort, effort))
        np.testing.assert_allclose(compiled.joint(link.name).range, np.radians(link.range), atol=1e-5)


def biped() -> tuple[pin.Model, set[str]]:
    """Return a biped with a fixed base, and the joints whose axis goes from side to side."""
    model = pin.buildModelFromUrdf(str(MODELS / "biped.urdf"))
    names = list(model.names)[1:]
    return model, {name for name in names if any(word in name for word in ("pitch", "knee", "elbow"))}


def toro() -> tuple[pin.Model, set[str]]:
    floating = pin.buildModelFromMJCF(str(MODEL_FILE))
    model = pin.buildReducedModel(floating, [1], pin.neutral(floating))
    return model, {link.name for link in toro_links() if link.axis[1] != 0}


@pytest.mark.parametrize("make", [biped, toro])
def test_sides_are_mirror_images(make: Callable[[], tuple[pin.Model, set[str]]]):
    """Torques of the mirrored motion are the mirrored torques: sides change places, roll and yaw change sign."""
    model, across = make()
    names = list(model.names)[1:]
    other = [name.replace("left", "#").replace("right", "left").replace("#", "right") for name in names]
    place = [names.index(name) for name in other]
    sign = np.array([1.0 if name in across else -1.0 for name in names])
    generator = np.random.default_rng(0)
    for _ in range(5):
        motion = generator.uniform(-1, 1, (3, model.nv))
        torque = pin.rnea(model, model.createData(), *motion)
        mirrored = pin.rnea(model, model.createData(), *(sign * motion[:, place]))
        np.testing.assert_allclose(
            mirrored, sign * torque[place], atol=1e-12 if make is biped else 1e-4
        )  # toro.xml has six digits
    low, high = model.lowerPositionLimit, model.upperPositionLimit
    np.testing.assert_array_equal(np.where(sign > 0, low, -high)[place], low)


def test_it_stands_with_its_weight_over_level_soles(robot):
    posture = np.array([standing_posture().get(name, 0.0) for name in robot.joint_names])
    model = robot.tree.model
    configuration = np.concatenate([[0, 0, 0, 0, 0, 0, 1], posture[robot.tree.columns]])
    centre = pin.centerOfMass(model, model.createData(), configuration)
    for side, sign in (("left", 1), ("right", -1)):
        rotation, translation = robot.foot_pose(f"{side}_foot", posture[None])
        np.testing.assert_allclose(rotation[0], np.eye(3), atol=1e-6)
        assert abs(translation[0, 0] - centre[0]) < FOOT_SIZE[0] / 2 - 0.03
        assert sign * translation[0, 1] == pytest.approx(0.1)

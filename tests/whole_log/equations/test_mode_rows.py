"""What contacts let one see: no contact force is in it, and friction that is put in comes out."""

import numpy as np
import pytest

from stribeck import Robot
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.equations.whole_log.build import WeakForm, weak_form
from stribeck.core.equations.whole_log.mode_rows import null_projection, rows_of_mode
from stribeck.core.friction import get_law
from stribeck.core.log import RobotLog
from stribeck.core.settings import FilterSettings, Settings
from stribeck.simulation.prescribed.exact import Truth, exact_log
from stribeck.simulation.robots import MODELS
from stribeck.simulation.run import POSTURES

TRUTH = {"viscous": 0.3, "coulomb": 1.2, "stribeck_gain": 0.3, "stribeck_velocity": 0.15, "offset": 0.2, "slope": 50.0}
CASES = {
    "quadruped, one leg at a time": ("quadruped.toml", "quadruped", "walk"),
    "quadruped, trot": ("quadruped.toml", "quadruped", "trot"),
    "biped": ("robot.toml", "biped", "walk"),
}


@pytest.fixture(params=CASES.values(), ids=CASES, scope="module")
def walked(request: pytest.FixtureRequest) -> tuple[Robot, RobotLog, Truth, WeakForm]:
    file, posture, gait = request.param
    robot = Robot.from_file(MODELS / file)
    friction = {joint: TRUTH for joint in robot.joint_names if joint not in robot.position_controlled}
    log, truth = exact_log(
        robot, get_law("stribeck"), friction, duration=5.0, gait=gait, posture=POSTURES[posture], seed=6
    )
    narrow = FilterSettings(kind="savitzky-golay", window=31)
    settings = Settings(method="whole-log", corrections="none", double_support="fit", filter=narrow)
    form = weak_form(robot, prepare(log, robot, settings), robot.torque_controlled, settings)
    return robot, log, truth, form


def test_the_projected_equations_contain_only_friction(walked: tuple[Robot, RobotLog, Truth, WeakForm]) -> None:
    robot, _, truth, form = walked
    kinds = {len(stretch.feet) for stretch in form.segments}
    assert len(kinds) > 1 or kinds == {2}
    for stretch in form.segments:
        equations = form.equations(stretch, 0)
        friction = truth.friction_torque[stretch.first : stretch.last, robot.torque_controlled]
        expected = np.einsum("kmn,kn->km", equations.weights, form.filters.window.apply(friction))
        # contact forces of hundreds of newtons are gone; what is left is how friction changes under a turning P
        np.testing.assert_allclose(equations.residual, expected, atol=0.02)


def test_no_projected_row_has_a_contact_force_in_it() -> None:
    robot = Robot.from_file(MODELS / "quadruped.toml")
    generator = np.random.default_rng(2)
    joints = np.arange(len(robot.joint_names))
    posture = np.array([POSTURES["quadruped"].get(name, 0.0) for name in robot.joint_names])
    position = posture + 0.1 * generator.standard_normal((4, len(joints)))
    for count, seen in ((1, 15), (2, 12), (3, 9), (4, 6)):
        support = rows_of_mode(robot, tuple(robot.contacts)[:count], joints)
        jacobian = support.jacobian(position)[:, :, support.rows]
        projection = null_projection(jacobian)
        assert projection.shape == (4, seen, 18)
        np.testing.assert_allclose(projection @ jacobian.transpose(0, 2, 1), 0, atol=1e-10)
        np.testing.assert_allclose(
            projection @ projection.transpose(0, 2, 1), np.eye(seen) + np.zeros((4, 1, 1)), atol=1e-10
        )

"""Weight and effort limits detect wrong torque units if no gain can be found; slopes are not wrong contacts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation
from studies.accuracy_cases import wrong_model
from tests.arm import TRUTH, arm_log, write_arm
from tests.audit.clean import CleanLog, checks_of
from tests.models import example_robot
from tests.trotting import HEIGHT, OUTER, SIDES, leg_angles

from stribeck import Robot, RobotLog, identify
from stribeck.check.audit import audit, base, gather
from stribeck.check.audit.base import check_contacts
from stribeck.check.audit.regression import regress
from stribeck.core.base.finding import Finding
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.friction import get_law
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.robots import MODELS
from stribeck.simulation.sensors.measure import with_noise

TURNTABLE = """<robot name="turntable"><link name="base"/><link name="table"><inertial><mass value="4"/>
<inertia ixx="0.05" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.05"/></inertial></link>
<joint name="axis" type="revolute"><parent link="base"/><child link="table"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="30" velocity="4"/></joint></robot>"""
FRICTION = dict(zip(TRUTH, (1.0, 3.0, 0.2, 0.2, 0.0, 40.0), strict=True))


def _clean(robot: Robot, seed: int) -> CleanLog:
    truth = dict.fromkeys(robot.joint_names, FRICTION)
    log, _ = exact_log(robot, get_law("stribeck"), truth, duration=20.0, rate=500.0, seed=seed, gait="stand")
    log = replace(with_noise(log, position=2e-5, torque=0.1, seed=seed), velocity=None, acceleration=None)
    return CleanLog(wrong_model(robot, seed), log)


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> dict[str, CleanLog]:
    """A vertical axis whose friction is far larger than its inertial torque, and a quadruped on all feet."""
    path = tmp_path_factory.mktemp("models") / "turntable.urdf"
    path.write_text(TURNTABLE)
    return {
        "turntable": _clean(Robot.from_model(str(path), base="fixed"), 31),
        "standing": _clean(Robot.from_file(MODELS / "quadruped.toml"), 32),
    }


def _said(honest: CleanLog, factor: float) -> list[Finding]:
    log, robot = replace(honest.log, torque=factor * honest.log.torque), honest.robot
    return audit(prepare(log, robot, robot.settings), robot, robot.settings)


@pytest.mark.parametrize("of", ["turntable", "standing"])
def test_a_good_log_has_no_finding(of: str, honest: dict[str, CleanLog]) -> None:
    assert checks_of(honest[of].log, honest[of].robot) == ([], "")


def test_the_effort_limits_bound_the_torque_of_an_axis_that_carries_nothing(honest: dict[str, CleanLog]) -> None:
    (finding,) = _said(honest["turntable"], 1000.0)
    assert finding.check == "torque-scale"
    assert finding.stops
    assert "et scale = 0.001 in [log.torque]" in finding.cure


def test_unknown_torque_scale_is_reported_without_loads(honest: dict[str, CleanLog]) -> None:
    found = identify(honest["turntable"].log, honest["turntable"].robot)
    assert found.joints["axis"].verdict == "identified"
    assert [finding.text.partition(",")[0] for finding in found.findings] == ["Friction scales with the torques"]


def test_limits_that_are_missing_or_too_small_are_none(honest: dict[str, CleanLog]) -> None:
    robot = honest["turntable"].robot
    for limit in (0.0, 1e-3, np.inf):
        model = robot.tree.model.copy()
        model.effortLimit = np.array([limit])
        changed = replace(robot, tree=replace(robot.tree, model=model))
        assert _said(replace(honest["turntable"], robot=changed), 1000.0) == []


@pytest.mark.parametrize(("factor", "unit"), [(1000.0, "N mm or mN m"), (1 / 9.81, "kgf m")])
def test_the_weight_bounds_the_torques_of_legs_that_all_stand(factor, unit, honest):
    (finding,) = _said(honest["standing"], factor)
    assert finding.check == "torque-scale"
    assert finding.stops
    assert f"times the robot's weight, as if they were in {unit}" in finding.text


def test_only_the_joint_beyond_its_limit_is_named(honest: dict[str, CleanLog]) -> None:
    one = honest["standing"]
    torque = one.log.torque * np.where(np.arange(len(one.robot.joint_names)) == 0, 1000.0, 1.0)
    scaled = replace(one, log=replace(one.log, torque=torque))
    found = [finding for finding in _said(scaled, 1.0) if finding.check == "torque-gain"]
    assert [finding.joints for finding in found] == [one.robot.joint_names[:1]]
    assert not found[0].stops


def test_joints_that_stand_still_without_a_torque_are_in_no_other_unit(tmp_path: Path) -> None:
    robot = Robot.from_file(write_arm(tmp_path))
    log = arm_log(robot, duration=4.0, rate=250.0)
    still = replace(log, position=np.full_like(log.position, 0.7), velocity=None, acceleration=None)
    torque = np.zeros_like(log.torque)
    torque[:, 2] = 0.01 * np.sin(log.time)  # of the one joint that carries little
    assert checks_of(replace(still, torque=torque), robot) == ([], "")


def test_rotors_are_no_gains_while_the_source_of_the_torque_is_a_guess(tmp_path: Path) -> None:
    robot = Robot.from_file(write_arm(tmp_path, "[identify]\nfit_armature = true\n"))
    log = arm_log(robot, rate=250.0)
    assert checks_of(replace(log, torque=log.torque + [3.0, 1.0, 5.0] * log.acceleration), robot) == ([], "")


ROBOT = example_robot("go2")
FEET = tuple(ROBOT.contacts)
RIGHT = FEET.index("RR")


def stepping(degrees: float, direction: float) -> RobotLog:
    """Make a log of a robot that stands on a slope, and lifts its right rear foot 0.1 m behind the left one."""
    time = np.arange(0.0, 8.0, 0.005)
    lift = np.maximum(0.0, np.sin(np.pi * time))  # four steps
    feet = np.stack([np.tile([0.0, side * OUTER, -HEIGHT], (len(time), 1)) for side in SIDES])
    feet[3, :, 0] -= 0.1
    feet[3, :, 2] += 0.06 * lift
    angles = [[leg_angles(foot, side) for foot in leg] for leg, side in zip(feet, SIDES, strict=True)]
    order = [("FL", "FR", "RL", "RR").index(name.split("_")[0]) for name in ROBOT.joint_names[::3]]
    position = np.hstack([np.array(angles[leg]) for leg in order])
    contact = np.ones((len(time), 4), dtype=bool)
    contact[:, RIGHT] = lift < 0.02
    slope = Rotation.from_euler("ZY", [direction, -degrees], degrees=True)  # the base is parallel to the slope
    heading = slope * Rotation.from_euler("Z", -direction, degrees=True)
    generator = np.random.default_rng(0)
    return RobotLog(
        time=time,
        joint_names=ROBOT.joint_names,
        position=position,
        torque=generator.normal(size=position.shape),
        base_orientation=np.tile(heading.as_quat(), (len(time), 1)),
        foot_names=FEET,
        contact=contact,
    )


def found(log: RobotLog) -> list[Finding]:
    return check_contacts(gather(prepare(log, ROBOT, ROBOT.settings), ROBOT, ROBOT.settings))


@pytest.mark.parametrize(("degrees", "direction"), [(0, 0), (10, 0), (-10, 0), (10, 30), (20, 180)])
def test_a_slope_is_no_wrong_contact_and_hides_none(degrees, direction, monkeypatch):
    log = stepping(degrees, direction)
    assert found(log) == []
    stuck = found(replace(log, contact=np.ones_like(log.contact)))
    assert [each.check for each in stuck] == ["contact-stuck"]
    assert "RR is logged as standing, but is above another standing foot" in stuck[0].text
    monkeypatch.setattr(base, "SLOPE", -1.0)  # all ground is level
    uphill = degrees * np.cos(np.deg2rad(direction)) > 0  # the left rear foot is above the right one
    assert bool(found(log)) == uphill


def test_the_error_of_a_gain_counts_correlated_samples_as_few() -> None:
    noise = lfilter([1.0], [1.0, -0.9], np.random.default_rng(0).standard_normal((2, 300, 800)))
    shapes, run, scores = np.ones((800, 1)), np.zeros(800, dtype=int), []
    for model, error in zip(*noise, strict=True):
        gain, deviation, *_ = regress(shapes, model, model + error, run)
        scores.append((gain - 1) / deviation)
    assert np.std(scores) == pytest.approx(1.0, abs=0.15)

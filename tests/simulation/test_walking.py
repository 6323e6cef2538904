"""Footsteps and the DCM are planned, robots walk in the contact simulator, and their logs contain the friction."""

from functools import cache

import numpy as np
import pinocchio as pin
import pytest
from studies.walking_cases import WALKERS, robot_of
from tests.models import leg_friction

from stribeck import identify
from stribeck.core.robot import Robot
from stribeck.simulation.sensors.profiles import PROFILES
from stribeck.simulation.walking.footsteps import Footprint, Push, Steps, plan_steps
from stribeck.simulation.walking.plan import BOTH, Stretch, plan_dcm, plan_walk
from stribeck.simulation.walking.simulate import Conditions, FellError, Walk, simulate_walk

COARSE = 0.0005  # [s], twice the usual physics step


POSTURE = WALKERS["TORO-like"].posture


@cache
def exact_walk() -> Walk:
    """Return a few steps with exact sensors, on the estimated state."""
    robot = robot_of("TORO-like")
    walk = [Steps(count=3, forward=0.2, single_support=0.6), Steps(count=2, sideways=0.15, width=0.18)]
    return simulate_walk(robot, walk, POSTURE, Conditions(friction=leg_friction(robot, 1.0)))


def test_it_goes_where_the_plan_says_and_stays_upright() -> None:
    walk = exact_walk()
    position, orientation = walk.truth.base_position, walk.truth.base_orientation
    shift = 0.029  # by which it starts behind the middle of its feet, over which it ends
    np.testing.assert_allclose(position[-1, :2] - position[0, :2], [0.4 + shift, 0.15], atol=0.02)
    assert np.abs(orientation[:, :2]).max() < 0.03
    np.testing.assert_array_equal(orientation, walk.log.base_orientation)  # the sensors are ideal
    assert np.ptp(position[:, 2]) < 0.04


def test_the_log_gives_back_the_friction_of_the_swinging_leg() -> None:
    walk = exact_walk()
    samples = identify(walk.log, robot_of("TORO-like"), method="curve-fit").evidence.samples
    legs = [column for column, name in enumerate(samples.joint_names) if name in walk.truth.parameters]
    rows = np.round(samples.time / 1e-3).astype(int)
    for column in legs:
        usable = samples.usable[:, column]
        truth = walk.truth.friction_torque[rows, walk.log.joint_names.index(samples.joint_names[column])]
        error = (samples.friction_torque[:, column] - truth)[usable]
        assert usable.sum() > 500
        assert np.sqrt(np.mean(error**2)) < 0.1  # of 1.3 N m
        assert np.median(np.abs(error)) < 0.02


def largest_tilt_of_feet(robot: Robot, walk: Walk) -> float:
    """Return it over all feet and times [rad]."""
    model, data = robot.tree.model, robot.tree.model.createData()
    frames = [model.getFrameId(contact.frame) for contact in robot.contacts.values()]
    level = []
    for k in range(0, len(walk.log.time), 10):
        base = [walk.truth.base_position[k], walk.truth.base_orientation[k]]
        pin.framesForwardKinematics(model, data, np.concatenate([*base, walk.log.position[k][robot.tree.columns]]))
        level += [data.oMf[frame].rotation[2, 2] for frame in frames]
    return float(np.arccos(min(level)))


@pytest.mark.long
@pytest.mark.parametrize("name", ["TALOS", "G1"])
def test_other_robots_walk_with_the_same_gains(name: str) -> None:
    robot = robot_of(name)
    conditions = Conditions(
        friction=leg_friction(robot, 0.2, offset=0.2), soles=WALKERS[name].soles, physics_step=COARSE
    )
    width = 0.16 if name == "G1" else None  # its ankles roll little
    steps = Steps(count=3, forward=0.1, turn=0.1, width=width, single_support=0.6)
    walk = simulate_walk(robot, [steps], WALKERS[name].posture, conditions)
    assert np.linalg.norm(walk.truth.base_position[-1] - walk.truth.base_position[0]) == pytest.approx(0.2, abs=0.04)
    trunk = ["waist" in joint or "torso" in joint for joint in walk.log.joint_names]
    assert np.abs(walk.log.position[:, trunk]).max() < 0.35  # it is upright, and not what the walk is balanced with
    assert largest_tilt_of_feet(robot, walk) < 0.13  # though friction is large beside a light foot's inertia


def pushed(force: float) -> np.ndarray:
    """Return the base's path when it is pushed aside while it stands, shape (T, 3)."""
    push = Push(start=0.3, duration=0.1, force=[0.0, force, 0.0])
    conditions = Conditions(state="true", pushes=[push], physics_step=COARSE)
    return simulate_walk(robot_of("TORO-like"), [], POSTURE, conditions).truth.base_position


@pytest.mark.long
def test_a_push_that_one_foot_cannot_bear_is_met_by_a_step_aside() -> None:
    walk = [Steps(count=4, forward=0.2)]
    conditions = Conditions(
        profile=PROFILES["realistic"],
        pushes=[Push(start=2.0, duration=0.1, force=[0.0, -200.0, 0.0])],
        physics_step=COARSE,
    )
    found = simulate_walk(robot_of("TORO-like"), walk, POSTURE, conditions)  # the right foot swings then
    position, orientation = found.truth.base_position, found.truth.base_orientation
    assert -0.35 < position[-1, 1] - position[0, 1] < -0.1
    assert np.abs(orientation[:, :2]).max() < 0.03


def test_a_push_moves_it_and_a_fall_ends_the_run_with_a_sentence() -> None:
    assert np.abs(pushed(0.0)[:, 1]).max() < 1e-3
    assert 0.005 < np.abs(pushed(80.0)[:, 1]).max() < 0.1
    with pytest.raises(FellError, match=r"^TORO-like humanoid fell [0-9.]+ s after the start, standing$") as caught:
        pushed(3000.0)
    assert caught.value.exit_code == 2


FEET = (Footprint(0.0, 0.1, 0.0), Footprint(0.0, -0.1, 0.0))
PULSATION = 3.2  # [1/s]
PERIOD = 1e-3  # [s]


def test_dcm_obeys_its_equation_and_ends_at_rest() -> None:
    places = [np.array(place) for place in ((0.0, 0.0), (0.0, -0.1), (0.3, 0.1), (0.3, 0.0))]
    stretches = [Stretch(0.7, places[0], places[0]), Stretch(0.2, places[0], places[1])]
    stretches += [Stretch(0.8, places[1], places[1]), Stretch(0.3, places[1], places[2])]
    stretches += [Stretch(0.4, places[2], places[3]), Stretch(1.0, places[3], places[3])]
    zmp, dcm = plan_dcm(stretches, PULSATION, PERIOD)
    slope = (dcm[2:] - dcm[:-2]) / (2 * PERIOD)
    np.testing.assert_allclose(slope, (PULSATION * (dcm - zmp))[1:-1], atol=1e-3)
    assert len(zmp) == 3401
    np.testing.assert_allclose(dcm[-1], places[3], atol=1e-12)
    np.testing.assert_allclose(zmp[1000], places[1], atol=1e-12)


@pytest.mark.parametrize(("sideways", "leader"), [(0.25, 0), (-0.25, 1)])
def test_sideways_the_leading_foot_is_the_one_on_that_side(sideways: float, leader: int) -> None:
    steps = plan_steps([Steps(count=6, sideways=sideways, width=0.16)], FEET)
    assert steps[0].foot == leader
    moved = [np.ptp([foot.y for foot in (step.goal, step.stance)]) for step in steps]
    np.testing.assert_allclose(moved[0], 0.25 + 0.18, atol=1e-12)
    np.testing.assert_allclose(moved[1::2], 0.16, atol=1e-12)
    np.testing.assert_allclose(moved[2::2], 0.16 + 0.25, atol=1e-12)


def test_a_plan_puts_the_weight_on_the_standing_foot() -> None:
    walk = [Steps(count=4, forward=0.2, turn=0.1), Steps(count=0, stand=1.0), Steps(count=2, sideways=0.1)]
    plan = plan_walk(walk, FEET, PULSATION, PERIOD)
    for foot in (0, 1):
        flying = plan.swing == foot
        assert flying.any()
        np.testing.assert_array_equal(plan.share[flying, foot], 0.0)
    np.testing.assert_allclose(plan.share.sum(axis=1), 1.0)
    assert np.abs(np.diff(plan.share, axis=0)).max() < 2 * PERIOD / 0.2
    assert np.sum(np.diff(plan.swing) != 0) == 12
    np.testing.assert_allclose(np.gradient(plan.heading, PERIOD), plan.heading_rate, atol=2e-3)
    rest = int(np.sum(plan.swing == BOTH))
    expected = 0.5 + 4 * 0.2 + 0.4 + 1.0 + 0.5 + 2 * 0.2 + 0.4 + 1.0
    assert rest * PERIOD == pytest.approx(expected, abs=0.01)

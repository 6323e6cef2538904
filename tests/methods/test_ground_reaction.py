"""Friction from ground reactions: exact with the wrenches, not moved by the rest of the robot, refused without them."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np
import pinocchio as pin
import pytest
from tests.friction_torque.test_friction_torque import EXACT, by_support, chunks
from tests.models import MODELS, POSTURES, example_log, example_robot, make_robot
from tests.samples import make_samples

from stribeck import Robot, Settings, identify
from stribeck.core.equations.friction_torque.inverse_dynamics import torque_chunks
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.friction import get_law
from stribeck.core.judgement.curve_fit.problem import joint_problem
from stribeck.core.log import RobotLog
from stribeck.core.result import Result
from stribeck.paper.ground_reaction import _compared
from stribeck.simulation.prescribed.exact import Truth, exact_log

LAW, TRUTH = get_law("coulomb-viscous"), {"viscous": 0.4, "coulomb": 1.0, "offset": 0.3}
MEASURED = Settings(method="ground-reaction", filter=EXACT, law=LAW.name)
BIAS = np.array([5.0, -4.0, 8.0, 0.3, -0.2, 0.1])
KNEE = "leg_left_4_joint"


@cache
def robot() -> Robot:
    """Return TALOS, of which the legs alone have torque sensors."""
    path, table, contacts = MODELS["talos"]
    others = [joint for joint in example_robot("talos").joint_names if not joint.startswith("leg")]
    return make_robot(path, table | {"position_controlled": others}, contacts)


@cache
def moved(gait: Literal["walk", "stand"], duration: float) -> tuple[RobotLog, Truth]:
    truth = {joint: TRUTH for joint in robot().joint_names if joint.startswith("leg")}
    return exact_log(robot(), LAW, truth, duration=duration, posture=POSTURES["talos"], gait=gait)


def parameters(result: Result) -> dict[str, Mapping[str, float]]:
    return {key: {name: one.value for name, one in own.parameters.items()} for key, own in result.joints.items()}


def heavier(robot: Robot, joint: str) -> Robot:
    """Return the robot with twice the mass on the body that a joint moves."""
    model = pin.Model(robot.tree.model)
    body = model.inertias[model.getJointId(joint)]
    model.inertias[model.getJointId(joint)] = pin.Inertia(2 * body.mass, body.lever, 2 * body.inertia)
    return replace(robot, tree=replace(robot.tree, model=model))


@pytest.mark.parametrize("name", ["talos", "go2"])
def test_true_friction_balances_the_measured_wrenches_in_every_contact_mode(name: str) -> None:
    log, truth = example_log(name, 6.0 if name == "go2" else 5.0)
    modes = by_support(chunks(name, log, standing_legs="measured"), truth, name)
    assert any("+" in mode for mode in modes)
    for measured, true in modes.values():
        np.testing.assert_allclose(measured, true, atol=1e-8)


def test_standing_legs_do_not_feel_an_error_of_the_rest_of_the_model() -> None:
    log, truth = moved("walk", 8.0)
    wrong = heavier(robot(), "torso_1_joint")
    errors = []
    for standing_legs in ("measured", True):
        settings = Settings.model_validate({"filter": EXACT, "standing_legs": standing_legs})
        (chunk,) = torque_chunks(prepare(log, robot(), settings), wrong, settings)
        alone = chunk.samples.support == chunk.samples.support_names.index("left")
        true = truth.friction_torque[chunk.rows[alone], robot().joint_names.index(KNEE)]
        found = chunk.samples.friction_torque[alone, chunk.samples.joint_names.index(KNEE)]
        errors.append(np.abs(found - true).max())
    assert errors[0] < 1e-8
    assert errors[1] > 1.0


def test_the_law_is_found_exactly_in_spite_of_zeros_of_the_sensors() -> None:
    log, _ = moved("walk", 8.0)
    biased = replace(log, foot_wrench=log.foot_wrench + BIAS)
    result = identify(biased, robot(), MEASURED)
    assert result.method == "ground-reaction"
    for joint, found in parameters(result).items():
        assert found == pytest.approx(TRUTH, rel=1e-3), joint
        assert result.joints[joint].torque_r2.nominal > 0.9999
    notes = "\n".join(result.evidence.notes)
    assert "the wrench on 'left' reads 5, -4, 8 N and 0.3, -0.2, 0.1 N m while it swings" in notes
    assert f"{KNEE} (1.00 times" in notes
    assert not {"swing-differs", "wrench-zero", "foot-sensors"} & {each.check for each in result.findings}


def test_a_difference_within_noise_is_none() -> None:
    velocity, block = np.sin(0.1 * np.arange(600)), np.repeat(np.arange(6), 100)
    friction, settings = LAW.torque(velocity, np.array([*TRUTH.values()])), Settings(law=LAW.name, averaged_law=False)
    noise = np.linspace(-1.2, 1.2, 6)  # of the gain, swing by swing: 0.3 in the mean
    swung, stood = (
        joint_problem(make_samples(velocity, gain * friction, block=block), "knee", LAW, settings)
        for gain in (1 + noise[block], 1.0)
    )
    fit: Any = SimpleNamespace(values=np.array([*TRUTH.values()]), rms=0.01)
    assert not _compared(fit, swung, stood)[1]


def test_zeros_of_feet_that_never_swing_change_offsets_and_are_reported() -> None:
    log, _ = moved("stand", 8.0)
    assert parameters(identify(log, robot(), MEASURED))[KNEE] == pytest.approx(TRUTH, rel=1e-3)
    turned = log.foot_wrench + 2.0 * np.eye(6)[4]
    found = identify(replace(log, foot_wrench=turned), robot(), MEASURED)
    for joint, values in parameters(found).items():
        pitches = joint.split("_")[2] in "345"  # about the axis of the moment, up to the tilt of the foot
        assert abs(values["offset"] - 0.3) == pytest.approx(2.0 if pitches else 0.0, abs=0.2)
        assert values["coulomb"] == pytest.approx(1.0, abs=0.05)
    (told,) = (each for each in found.findings if each.check == "wrench-zero")
    assert "left, right: the foot never swings" in told.text
    assert 0.6 < float(told.text.split("up to ")[1].split()[0]) < 1.1  # a leg's length


def test_other_friction_of_swinging_legs_is_reported() -> None:
    log, truth = moved("walk", 16.0)
    torque, joint = log.torque.copy(), robot().joint_names.index(KNEE)
    swings = ~log.contact[:, log.foot_names.index("left")]
    torque[swings, joint] += 2 * truth.friction_torque[swings, joint]
    found = identify(replace(log, torque=torque), robot(), MEASURED)
    (told,) = (each for each in found.findings if each.check == "swing-differs")
    assert told.joints == (KNEE,)

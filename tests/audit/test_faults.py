"""Every fault in the list is detected; good logs, even short ones or with brakes, have no finding."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation
from studies.fault_cases import FAULTS
from tests.arm import TRUTH, arm_log
from tests.audit.clean import CleanLog, checks_of
from tests.models import POSTURES, example_robot
from tests.mujoco_arm import JOINTS, friction, record, write_case

from stribeck import Robot, identify
from stribeck.check.audit import audit, gather
from stribeck.check.audit.torque import check_torques
from stribeck.check.audit.trials import check_by_trial
from stribeck.check.inspection import inspect_log
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.errors import LogError
from stribeck.core.friction import get_law
from stribeck.core.robot.scale_setting import scale_setting
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.sensors.measure import with_noise

FRICTION = dict(zip(TRUTH, (0.3, 0.6, 0.2, 0.2, 0.1, 40.0), strict=True))


def _honest(name: str, duration: float, posture: dict[str, float] | None = None) -> CleanLog:
    robot, law, rate = example_robot(name), get_law("stribeck"), 250.0
    truth = dict.fromkeys(robot.joint_names, FRICTION)
    log, _ = exact_log(robot, law, truth, duration=duration, rate=rate, seed=3, posture=posture)
    if log.base_orientation is not None:
        base = Rotation.from_quat(log.base_orientation)
        turned = (base[:-1].inv() * base[1:]).as_rotvec() * rate
        gyroscope = {"angular_velocity": np.vstack([turned, turned[-1:]])}
        log = replace(log, **gyroscope, linear_acceleration=base.inv().apply([0.0, 0.0, 9.81]))
    log = replace(with_noise(log, position=1e-5, torque=0.1, seed=1), velocity=None, acceleration=None)
    return CleanLog(robot, log)


@pytest.fixture(scope="module")
def honest() -> dict[str, CleanLog]:
    return {"panda": _honest("panda", 12.0), "talos": _honest("talos", 8.0, POSTURES["talos"])}


PUT = [
    pytest.param(name, log, marks=[pytest.mark.long] * (log == "talos" and "panda" in fault.of))
    for name, fault in FAULTS.items()
    for log in ("panda", "talos")
    if log in fault.of
]
"""A fault in each log that it can be put in; of two, the second is long."""
ALONE = {
    "torques quantized to 2 N m",
    "torques low-passed at 3 Hz",
    "torque clock 1 % off",
    "a torque of noise",
    "degrees, one joint beyond its limit",
}
"""Faults that must not cause other findings."""


@pytest.mark.parametrize(("name", "log"), PUT)
def test_a_fault_in_a_log_is_detected(name: str, log: str, honest: dict[str, CleanLog]) -> None:
    fault = FAULTS[name]
    found, refusal = checks_of(*fault.apply(honest[log].log, honest[log].robot))
    assert set(found) & set(fault.checks) or any(word in refusal for word in fault.words), (found, refusal)
    assert name not in ALONE or set(found) == set(fault.checks)


@pytest.mark.parametrize("seconds", [1.0, 2.0, 7.9])
@pytest.mark.parametrize("of", ["panda", "talos"])
def test_a_good_log_has_no_finding(of: str, seconds: float, honest: dict[str, CleanLog]) -> None:
    log = honest[of].log
    length = round(seconds * (len(log.time) - 1) / (log.time[-1] - log.time[0]))
    for start in np.linspace(0, len(log.time) - length, 4 if seconds < 3 else 1).astype(int).tolist():
        assert checks_of(log.take(slice(start, start + length)), honest[of].robot) == ([], "")


def test_joints_that_are_exchanged_whole_stop(honest: dict[str, CleanLog]) -> None:
    log, robot = honest["panda"].log, honest["panda"].robot
    order = [1, 0, *range(2, 9)]
    exchanged = replace(log, position=log.position[:, order], torque=log.torque[:, order])
    found = audit(prepare(exchanged, robot, robot.settings), robot, robot.settings)
    assert "torque-unexplained" in [finding.check for finding in found if finding.stops]


def test_a_joint_that_carries_little_gets_no_advice(honest: dict[str, CleanLog]) -> None:
    """The arm's last wrist joint carries almost no load: if inverted, only its friction shows the sign."""
    arm = honest["panda"]
    torque = arm.log.torque.copy()
    torque[:, -1] += 0.5 * np.sin(20 * arm.log.time)
    assert checks_of(replace(arm.log, torque=torque), arm.robot) == ([], "")


def test_a_single_joint_gives_no_delay(honest: dict[str, CleanLog]) -> None:
    arm = honest["panda"]
    torque = arm.log.torque.copy()
    torque[:, 1] = np.interp(arm.log.time - 0.012, arm.log.time, torque[:, 1])
    assert "torque-delay" not in checks_of(replace(arm.log, torque=torque), arm.robot)[0]


def test_a_last_digit_that_flickers_in_some_rests_is_not_frozen_in_the_others(honest: dict[str, CleanLog]) -> None:
    arm = honest["panda"]
    generator = np.random.default_rng(3)
    time = 0.01 * np.arange(3000) + generator.uniform(-1e-3, 1e-3, 3000)
    phase = time % 3.0
    moving = 0.5 * (1 - np.cos(np.pi * np.clip(phase, 0.0, 1.5) / 1.5))
    flicker = generator.choice([-1e-4, 1e-4], 3000) * (phase > 2.2)
    position = np.round(moving * (1 + time // 3 % 2) + flicker, 4)
    log = replace(arm.log, time=time, position=np.tile(position, (9, 1)).T, torque=generator.normal(size=(3000, 9)))
    assert "channel-frozen" not in checks_of(log, arm.robot)[0]


@pytest.mark.parametrize("moves", [True, False])
def test_a_joint_that_stands_still_has_no_gain(moves: bool, honest: dict[str, CleanLog]) -> None:
    """Its gear can carry any torque."""
    arm = honest["panda"]
    evidence = gather(prepare(arm.log, arm.robot, arm.robot.settings), arm.robot, arm.robot.settings)
    factors = np.where(np.arange(len(evidence.joints)) == 1, 3.0, 1.0)
    velocity = evidence.velocity * np.where(factors == 1, 1.0, float(moves))
    found = check_torques(replace(evidence, torque=evidence.torque * factors, velocity=velocity))
    assert [finding.joints for finding in found] == [(evidence.joints[1],)] * moves


def test_a_model_that_is_unknown_for_one_joint_says_nothing_about_gains(honest: dict[str, CleanLog]) -> None:
    arm = honest["panda"]
    evidence = gather(prepare(arm.log, arm.robot, arm.robot.settings), arm.robot, arm.robot.settings)
    unknown = np.where(np.arange(len(evidence.joints)) == 1, np.nan, 1.0)
    assert check_torques(replace(evidence, model=evidence.model * unknown)) == []


@pytest.mark.parametrize(("noise", "found"), [(0.0, True), (2.0, False)])
def test_a_delay_that_explains_almost_nothing_is_not_reported(noise, found, honest):
    arm = honest["panda"]
    log, robot = FAULTS["torques 8 ms late"].apply(arm.log, arm.robot)
    torque = log.torque + noise * np.random.default_rng(3).normal(size=log.torque.shape)
    assert ("torque-delay" in checks_of(replace(log, torque=torque), robot)[0]) == found


@pytest.mark.parametrize(
    ("lie", "channel"), [("a position frozen halfway", "position"), ("a torque of zero", "torque")]
)
def test_a_finding_names_its_channel(lie: str, channel: str, honest: dict[str, CleanLog]) -> None:
    log, robot = FAULTS[lie].apply(honest["panda"].log, honest["panda"].robot)
    found = audit(prepare(log, robot, robot.settings), robot, robot.settings)
    assert {finding.channel for finding in found} == {channel}


def test_the_remedy_of_a_sign_starts_from_the_current_scale(honest: dict[str, CleanLog]) -> None:
    log, robot = FAULTS["one torque inverted"].apply(honest["panda"].log, honest["panda"].robot)
    table = robot.log_table.model_copy(update={"torque": robot.log_table.torque.model_copy(update={"scale": -1.0})})
    of = (robot := replace(robot, log_table=table)), robot.settings
    (finding,) = audit(prepare(log, *of), *of)
    for name in robot.joint_names:
        assert f"{name} = {1 if name in finding.joints else -1}" in finding.cure
    assert "desired_position" in audit(prepare(replace(log, command=log.torque), *of), *of)[0].cure  # has no scale


def test_the_scale_of_a_position_includes_joints_without_a_torque(arm: Robot) -> None:
    setting = scale_setting(replace(arm, position_controlled=("slide",)), {"slide": 1e-3, "elbow": -1.0}, "position")
    assert setting.value == {"elbow": -1.0, "slide": 1e-3}


def test_a_log_too_short_for_any_bin_shows_no_sign(honest: dict[str, CleanLog]) -> None:
    robot, log = honest["talos"].robot, honest["talos"].log.take(slice(200, 300))
    evidence = gather(prepare(log, robot, robot.settings), robot, robot.settings)
    none = {name: getattr(evidence, name)[:0] for name in ("rows", "run", "support", "velocity", "model", "torque")}
    assert check_by_trial(replace(evidence, **none, support_names=()), robot.settings) == []


@pytest.mark.parametrize("inverted", [(), (0, 2)])
def test_the_sign_audit_names_inverted_torques_and_no_others(arm: Robot, inverted: tuple[int, ...]) -> None:
    log = arm_log(arm)
    torque = log.torque.copy()
    torque[:, list(inverted)] *= -1
    found = inspect_log(replace(log, torque=torque), arm)
    names = [arm.joint_names[k] for k in inverted]
    assert [name for name, joint in found.joints.items() if joint.sign == "opposite"] == names
    assert bool(inverted) == any("wrong sign of torque" in text for text in found.findings)
    for name in names:
        assert name in found.findings[0]


@pytest.mark.parametrize("delay", [-0.004, 0.0, 0.0125])
def test_the_delay_of_the_torque_is_found_to_a_fraction_of_a_sample(arm: Robot, delay: float) -> None:
    log = arm_log(arm)
    late = CubicSpline(log.time, log.torque)(log.time - delay)
    found = inspect_log(replace(log, torque=late).take(slice(50, -50)), arm)
    for joint in found.joints.values():
        assert joint.delay == pytest.approx(delay, abs=2e-4)
    assert any("The torques are delayed" in text for text in found.findings) == (delay != 0)


@pytest.mark.parametrize("moving", [0, pytest.param(2, marks=pytest.mark.long)])
def test_a_test_of_one_joint_is_identified_while_brakes_hold_the_others(moving: int, tmp_path: Path) -> None:
    speed = np.full(3, 1e-6)
    speed[moving] = 2.0
    log = record(speed.tolist(), 30.0 if moving else 16.0)
    braked = [k for k in range(3) if k != moving]
    rng = np.random.default_rng(3)
    log["torque"][:, braked] = rng.normal(0.3, 0.2, (len(log["time"]), 2))
    log["position"][:, braked] = 0.7 + 0.001 * np.round(rng.normal(0.0, 0.3, (len(log["time"]), 2)))  # last digit
    del log["velocity"]
    write_case(tmp_path, log)
    path = tmp_path / "log.npz"
    result = identify(path, tmp_path / "robot.toml")
    assert [joint.verdict == "identified" for joint in result.joints.values()] == [k == moving for k in range(3)]
    v = np.zeros((1, 3))
    v[:, moving] = 0.8
    found = result.joints[JOINTS[moving]].friction(0.8)
    assert found == pytest.approx(friction(v)[0, moving], rel=0.05)
    if moving == 0:  # gravity loads it: the joint that moves still judges the log
        log["torque"][:, moving] *= -1
        write_case(tmp_path, log)
        with pytest.raises(LogError, match=JOINTS[0]):
            identify(path, tmp_path / "robot.toml")
        named = {
            name for each in inspect_log(path, tmp_path / "robot.toml").audit if each.stops for name in each.joints
        }
        assert named == {JOINTS[0]}

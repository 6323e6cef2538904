"""Make the logs with known friction: one motion per robot, to which the errors of each condition are added.

A motion is prescribed or a walk simulated in MuJoCo. Motors compensate friction, therefore motion, contacts and
equations of motion are the same for any kind of friction R:

    torque = torque of the motion without friction + R
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from studies.accuracy_cases import walk_scenario
from studies.walking_cases import WALKERS

from benchmarks.contest import cases
from benchmarks.contest.commanded_cases import publish_commanded
from benchmarks.contest.model_errors import publish_model
from benchmarks.contest.schema import CASE, SUMS, TRUTH, Asked, Case, KnownFriction, Truth, checksums, folders_of, write
from stribeck.core.base.toml import parse_toml
from stribeck.core.base.typing import Array
from stribeck.core.friction import get_law
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.io.writers import write_log
from stribeck.simulation.friction import FrictionTruth, LuGre
from stribeck.simulation.friction.injection import Instant
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.robots import MODELS
from stribeck.simulation.run import PACKAGED, POSTURES, Simulated, run_scenario
from stribeck.simulation.sensors.measure import measure, sensors_for

POINTS = 61
"""Number of velocities of a curve (odd), over the middle 98 % of the joint's velocities."""
GRAVITY = np.array([0.0, 0.0, -9.81])
"""Gravity [m/s^2]."""

Parameters = dict[str, dict[str, float]]


def make(
    folder: Path, robots: tuple[str, ...], seconds: float = cases.SECONDS, progress: Callable[[str], None] = print
) -> None:
    """Write cases and ground truth of the named robots, and the checksums of all files in the folder."""
    for name in robots:
        if name in cases.COMMANDED:
            publish_commanded(name, folder, cases.SEED)
            progress(f"{name}: {len(cases.LATENCIES)} cases of {cases.COMMANDED_SECONDS:.3g} s")
            continue
        moved = motion(name, folder, seconds)
        for number, condition in enumerate(cases.CONDITIONS):
            publish(name, moved, condition, folder, np.random.SeedSequence([cases.SEED, number]))
        progress(f"{name}: {len(cases.CONDITIONS)} cases of {np.ptp(moved.log.time):.3g} s")
    (folder / SUMS).write_text(checksums(folder), encoding="utf-8")


def robot_file(name: str, folder: Path) -> Path:
    """Write the robot file that a motion is made with."""
    if name in cases.PRESCRIBED:
        return MODELS / PACKAGED[name]
    path = folder / "robots" / f"{name}.toml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(WALKERS[name].robot_file, encoding="utf-8")
    return path


def motion(name: str, folder: Path, seconds: float) -> Simulated:
    """Simulate a robot's motion, with friction parameters as its truth but without friction in its torques.

    Walks are simulated with friction, so that feet and base move realistically. The friction is then subtracted from
    the torques.
    """
    path = robot_file(name, folder)
    if name in cases.WALKS:
        found = run_scenario(walk_scenario(name, cases.WALKS[name], path.name), path.parent)
        robot, truth = found.robot, found.truth
        log = replace(found.log, torque=found.log.torque - truth.friction_torque)
        levels = {joint: values["coulomb"] for joint, values in truth.parameters.items()}
    else:
        robot, law = Robot.from_file(path), get_law("coulomb-viscous")
        gait, posture = cases.PRESCRIBED[name], POSTURES.get(name)
        rate, seed = cases.RATE, cases.SEED
        log, truth = exact_log(robot, law, {}, duration=seconds, rate=rate, seed=seed, gait=gait, posture=posture)
        log = replace(log, velocity=None, acceleration=None)
        if truth.base_velocity is not None and truth.base_acceleration is not None:
            log = _with_imu(log, truth.base_velocity, truth.base_acceleration)
        levels = dict.fromkeys(robot.joint_names, cases.COULOMB)
    if name not in cases.WRENCHES:
        log = replace(log, foot_wrench=None)
    return Simulated(robot, log, replace(truth, parameters=drawn(levels)))


def _with_imu(log: RobotLog, velocity: Array, acceleration: Array) -> RobotLog:
    """Add the angular velocity and acceleration of an IMU at the root to a log that contains its orientation."""
    turn = Rotation.from_quat(np.asarray(log.base_orientation))
    linear = acceleration[:, :3] + np.cross(velocity[:, 3:], velocity[:, :3]) - turn.inv().apply(GRAVITY)
    return replace(log, angular_velocity=velocity[:, 3:], linear_acceleration=linear)


def drawn(levels: dict[str, float]) -> Parameters:
    """Draw Coulomb friction, viscous friction and offset of every joint around a level [N m]."""
    generator, found = np.random.default_rng([cases.SEED, 100]), {}
    for joint, level in levels.items():
        coulomb, viscous = np.exp(cases.SPREAD * generator.standard_normal(2)) * [level, cases.VISCOUS]
        offset = level * generator.uniform(-1, 1)
        found[joint] = {"coulomb": float(coulomb), "viscous": float(viscous), "offset": float(offset)}
    return found


def friction(condition: cases.Condition, parameters: Parameters, log: RobotLog) -> Array:
    """Compute the friction torque R for the log of a motion without friction [N m], shape (T, n)."""
    velocity = np.gradient(log.position, log.time, axis=0)
    found = np.zeros_like(velocity)
    if condition.bristles:
        return _bristles(parameters, log, velocity)
    for joint, values in parameters.items():
        column = log.joint_names.index(joint)
        v = velocity[:, column]
        found[:, column] = values["coulomb"] * np.tanh(cases.SLOPE * v) + values["viscous"] * v + values["offset"]
        carried, share = log.torque[:, column] + found[:, column], condition.load * np.tanh(cases.SLOPE * v)
        # the share refers to the total torque, which includes this friction
        found[:, column] += share * np.abs(carried) / (1 - share * np.sign(carried))
    return found


def _bristles(parameters: Parameters, log: RobotLog, velocity: Array) -> Array:
    bristles = LuGre(log.joint_names, {joint: {**cases.BRISTLES, **values} for joint, values in parameters.items()})
    truth, found = FrictionTruth(len(log.joint_names), [bristles]), np.empty_like(velocity)
    for k, v in enumerate(velocity):  # the state depends on the previous sample
        truth.before(Instant(float(log.time[k]), 1 / cases.RATE, log.position[k], v, log.torque[k]))
        found[k] = truth.after(v)
    return found


def known(condition: cases.Condition, values: dict[str, float], asked: Asked) -> KnownFriction:
    """Compute the ground truth of a joint; the curve of LuGre friction is its steady sliding friction."""
    v = np.array(asked.velocity)
    level = values["coulomb"] + condition.load * asked.load
    if condition.bristles:
        effect = cases.BRISTLES["stribeck_gain"] * np.exp(-((v / cases.BRISTLES["stribeck_velocity"]) ** 2))
        levels = level * (1 + effect)
        curve = levels * np.sign(v) + values["viscous"] * v
    else:
        curve = level * np.tanh(cases.SLOPE * v) + values["viscous"] * v
    return KnownFriction(**values, curve=curve.tolist())


def seen(log: RobotLog, condition: cases.Condition, seeds: np.random.SeedSequence) -> RobotLog:
    """Add the sensor errors of a condition to an exact log, and reduce it to the published samples."""
    gains, noise = seeds.spawn(2)
    late = np.maximum(np.arange(len(log.time)) - round(condition.late * cases.RATE), 0)
    factors = 1 + condition.gains * np.random.default_rng(gains).standard_normal(len(log.joint_names))
    log = replace(log, torque=log.torque[late] * factors)
    log = measure(log, sensors_for(log, condition.sensors, int(noise.generate_state(1)[0])))
    return log.take(slice(None, None, cases.EVERY))


def publish(name: str, moved: Simulated, label: str, folder: Path, seeds: np.random.SeedSequence) -> None:
    """Write a case and its ground truth."""
    condition, parameters, robot = cases.CONDITIONS[label], moved.truth.parameters, moved.robot
    case_folder, truth_folder = folders_of(folder, name, label)
    model_seed, log_seed = seeds.spawn(2)
    model = publish_robot(robot, case_folder)
    generator = np.random.default_rng(model_seed) if condition.wrong_model else None
    publish_model(Path(robot.model_path), case_folder / model, generator)
    exact = replace(moved.log, torque=moved.log.torque + friction(condition, parameters, moved.log))
    log = seen(exact, condition, log_seed)
    write_log(log, case_folder / "log.npz")
    asked = asked_joints(exact, tuple(parameters))
    case = Case(
        robot=name,
        condition=label,
        base=robot.base,
        seconds=float(np.ptp(log.time)),
        rate=cases.RATE / cases.EVERY,
        logs=["log.npz"],
        joints=asked,
    )
    write(case, case_folder / CASE)
    truth = Truth(
        says=condition.says, joints={joint: known(condition, parameters[joint], asked[joint]) for joint in asked}
    )
    write(truth, truth_folder / TRUTH)


def asked_joints(log: RobotLog, joints: tuple[str, ...]) -> dict[str, Asked]:
    """Choose the velocities of the joints' curves, and compute the mean absolute torque as their load."""
    found = {}
    for joint in joints:
        column = log.joint_names.index(joint)
        velocity = np.gradient(log.position[:, column], log.time)
        low, high = np.percentile(velocity, [1, 99])
        load = float(np.mean(np.abs(log.torque[:, column])))
        found[joint] = Asked(velocity=np.linspace(low, high, POINTS).tolist(), load=load)
    return found


def publish_robot(robot: Robot, folder: Path) -> str:
    """Write the robot file of a case, without settings, channels and drive gains; return its model's name."""
    document = parse_toml(Path(robot.path).read_text(encoding="utf-8"))
    table, model = document["robot"], Path(robot.model_path)
    table["model"] = f"model{model.suffix}"
    lines = ["[robot]", *(_toml(key, value) for key, value in table.items() if key not in {"couplings", "kp", "kd"})]
    for coupling in table.get("couplings", []):
        lines += ["", "[[robot.couplings]]", *(_toml(key, value) for key, value in coupling.items())]
    for foot, contact in document.get("contacts", {}).items():
        lines += ["", f"[contacts.{foot}]", *(_toml(key, value) for key, value in contact.items())]
    (folder / "robot.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return str(table["model"])


def _toml(key: str, value: object) -> str:
    if isinstance(value, dict):
        return f"{key} = {{ {', '.join(_toml(name, item) for name, item in value.items())} }}"
    return f"{key} = {value if isinstance(value, float | int) else repr(value).replace(chr(39), chr(34))}"

"""Whether the audit names what is wrong with a log: well-formed lies, one at a time, and logs in which there are none.

    python -m studies.lies --save studies/lies.json

Every lie is put into the log of an arm and into that of a humanoid's walk, where it applies, with sensor noise and a
wrong model. The arm is a Panda in random motion, the walk a G1's, turning; thresholds were chosen on other logs: other
arms, straight, sideways and diagonal walks, and real robots. Wrong units are told in logs as well in which no gain can
be found: of a turntable, which carries nothing and whose gear rubs, and of a quadruped that stands on all feet. Printed
is what the audit says of
each lie, and whether a lie that it does not name made a method call a joint's friction identified at a wrong value
without any warning. Clean logs, whole and in windows of 1, 2 and 10 s, should have no finding.
"""

import argparse
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypedDict

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from stribeck import LogError, NothingIdentifiedError, Robot, Settings, identify
from stribeck.audit import audit
from stribeck.friction import get_law
from stribeck.log import RobotLog
from stribeck.preparation import prepare
from stribeck.typing import Array
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.robots.biped import MODELS
from stribeck_simulation.run import run_scenario
from stribeck_simulation.scenario import read_scenario
from stribeck_simulation.sensors.measure import with_noise
from studies.accuracy_cases import CASES, LAW, exact_walks, measured, wrong_model
from studies.harder_cases import other_walks
from studies.log_coverage import EXAMPLES

SECONDS = 20.0
"""Of a log that lies are put into."""
WINDOWS = {1.0: 12, 2.0: 8, 10.0: 3}
"""Length of a window of a clean log [s] -> how many, evenly over it."""
WRONG = 0.25
"""Relative error of a Coulomb friction from which a value is wrong."""
SMALL = 0.1
"""[N m] of error that is small whatever the friction."""
Flags = NDArray[np.bool_]
HEAD = "| lie | log | found | named |\n|---|---|---|---|"
CLEAN_HEAD = "| clean log | whole | 10 s | 2 s | 1 s |\n|---|---:|---:|---:|---:|"


@dataclass(frozen=True, eq=False)
class Honest:
    """A robot as it is believed to be, its log without lies, and the true Coulomb friction by joint [N m]."""

    robot: Robot
    log: RobotLog
    coulomb: dict[str, float]


@dataclass(frozen=True)
class Lie:
    """What it does to a log and its robot, and the checks that name it; words name it where a log is refused."""

    tell: Callable[[RobotLog, Robot], tuple[RobotLog, Robot]]
    checks: tuple[str, ...]
    words: str = ""
    of: tuple[str, ...] = ("arm", "humanoid")


class Said(TypedDict):
    """What was said of a lie."""

    lie: str
    log: str
    found: list[str]
    named: bool
    wrong: list[str]


def arm(model: str = "panda_description/urdf/panda.urdf", seed: int = 21) -> Honest:
    """Return an arm in random motion, with friction in every joint and a wrong model."""
    text = f'[robot]\nname = "arm"\nmodel = "{EXAMPLES}/{model}"\nbase = "fixed"\n'
    path = Path("build") / "lies.toml"
    path.parent.mkdir(exist_ok=True)
    path.write_text(text, encoding="utf-8")
    robot = Robot.from_file(path)
    friction = {
        "viscous": 0.4, "coulomb": 0.8, "stribeck_gain": 0.2, "stribeck_velocity": 0.2, "offset": 0.0, "slope": 40.0,
    }  # fmt: skip
    parameters = dict.fromkeys(robot.joint_names, friction)
    log, _ = exact_log(robot, get_law(LAW), parameters, duration=SECONDS, rate=500.0, seed=seed)
    log = replace(with_noise(log, position=2e-5, torque=0.1, seed=seed), velocity=None, acceleration=None)
    return Honest(wrong_model(robot, seed), log, dict.fromkeys(robot.joint_names, 0.8))


TURNTABLE = """<robot name="turntable"><link name="base"/><link name="table"><inertial><mass value="4"/>
<inertia ixx="0.05" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.05"/></inertial></link>
<joint name="axis" type="revolute"><parent link="base"/><child link="table"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="30" velocity="4"/></joint></robot>"""
FRICTION = {
    "viscous": 1.0, "coulomb": 3.0, "stribeck_gain": 0.2, "stribeck_velocity": 0.2, "offset": 0.0, "slope": 40.0,
}  # fmt: skip


def turntable() -> Honest:
    """Return a single vertical axis, whose friction is far larger than what accelerates it."""
    path = Path("build") / "turntable.urdf"
    path.parent.mkdir(exist_ok=True)
    path.write_text(TURNTABLE, encoding="utf-8")
    return _exact(Robot.from_model(path, base="fixed"), 31)


def standing() -> Honest:
    """Return a quadruped that moves about and stands on all feet throughout."""
    return _exact(Robot.from_file(MODELS / "quadruped.toml"), 32)


def _exact(robot: Robot, seed: int) -> Honest:
    parameters = dict.fromkeys(robot.joint_names, FRICTION)
    log, _ = exact_log(robot, get_law(LAW), parameters, duration=SECONDS, rate=500.0, seed=seed, gait="stand")
    log = replace(with_noise(log, position=2e-5, torque=0.1, seed=seed), velocity=None, acceleration=None)
    return Honest(wrong_model(robot, seed), log, dict.fromkeys(robot.joint_names, FRICTION["coulomb"]))


def humanoid() -> Honest:
    """Return a walk that nothing was tuned on, with sensor noise and a wrong model."""
    walk = other_walks("G1")[2]
    return _walked(walk.robot, walk.log, walk.truth.parameters, 5)


def _walked(robot: Robot, log: RobotLog, parameters: dict[str, dict[str, float]], seed: int) -> Honest:
    rows = slice(0, min(len(log.time), round(SECONDS * len(log.time) / (log.time[-1] - log.time[0]))))
    log = measured(log.take(rows), CASES["A"], seed, 0)
    coulomb = {name: values["coulomb"] for name, values in parameters.items()}
    return Honest(wrong_model(robot, seed), log, coulomb)


def tuning() -> dict[str, Honest]:
    """Return logs that thresholds were chosen on."""
    scenario = read_scenario(Path("examples/scenarios/arm.toml"))
    made = run_scenario(scenario, MODELS)
    coulomb = {name: values["coulomb"] for name, values in made.truth.parameters.items()}
    walk = exact_walks("TORO-like")[1]
    return {
        "arm": Honest(wrong_model(made.robot, 1), replace(made.log, velocity=None, acceleration=None), coulomb),
        "humanoid": _walked(walk.robot, walk.log, walk.truth.parameters, 2),
    }


def _column(robot: Robot, nth: int = 0) -> int:
    """Return a joint that carries much: of an arm the second, of a leg the knee."""
    knees = [k for k, name in enumerate(robot.joint_names) if "knee" in name]
    return (knees or [1, 2])[nth]


def _torque(change: Callable[[Array, Robot], Array]) -> Callable[[RobotLog, Robot], tuple[RobotLog, Robot]]:
    return lambda log, robot: (replace(log, torque=change(log.torque.copy(), robot)), robot)


def _one(change: Callable[[Array], Array]) -> Callable[[RobotLog, Robot], tuple[RobotLog, Robot]]:
    def applied(torque: Array, robot: Robot) -> Array:
        torque[:, _column(robot)] = change(torque[:, _column(robot)])
        return torque

    return _torque(applied)


def _position(change: Callable[[Array, Robot], Array]) -> Callable[[RobotLog, Robot], tuple[RobotLog, Robot]]:
    return lambda log, robot: (replace(log, position=change(log.position.copy(), robot)), robot)


def _imu(**changes: Callable[[Array], Array]) -> Callable[[RobotLog, Robot], tuple[RobotLog, Robot]]:
    def applied(log: RobotLog, robot: Robot) -> tuple[RobotLog, Robot]:
        changed: dict[str, Any] = {name: change(getattr(log, name)) for name, change in changes.items()}
        return replace(log, **changed), robot

    return applied


def _swapped(torque: Array, robot: Robot) -> Array:
    a, b = _column(robot), _column(robot, 1)
    torque[:, [a, b]] = torque[:, [b, a]]
    return torque


def _mirrored(torque: Array, robot: Robot) -> Array:
    names = list(robot.joint_names)
    order = [names.index(_other(name)) if _other(name) in names else k for k, name in enumerate(names)]
    return torque[:, order]


def _other(name: str) -> str:
    return name.replace("left", "#").replace("right", "left").replace("#", "right")


def _amperes(torque: Array, _: Robot) -> Array:
    return torque * np.random.default_rng(4).uniform(0.03, 0.15, torque.shape[1])


def _late(log: RobotLog, robot: Robot) -> tuple[RobotLog, Robot]:
    return replace(log, torque=CubicSpline(log.time, log.torque)(log.time - 0.008)), robot


def _wrapped(position: Array, robot: Robot) -> Array:
    column = position[:, _column(robot)]
    position[:, _column(robot)] = np.where(column > np.median(column), column - 2 * np.pi, column)
    return position


def _outside(position: Array, robot: Robot) -> Array:
    _, high = robot.position_limits
    limited = [k for k in (_column(robot), _column(robot, 1)) if np.isfinite(high[k])]
    for k in limited[:1]:
        position[:, k] += high[k] - np.median(position[:, k]) + 0.5
    return position


def _frozen(values: Array) -> Array:
    return np.where(np.arange(len(values)) < len(values) // 2, values, values[len(values) // 2])


def _frozen_position(position: Array, robot: Robot) -> Array:
    k = _column(robot)
    speed = np.abs(np.diff(position[:, k]))
    middle = len(position) // 2
    start = middle + int(np.argmax(speed[middle:] > np.percentile(speed, 60)))
    position[start:, k] = position[start, k]
    return position


def _held(values: Array) -> Array:
    return values[np.arange(len(values)) // 10 * 10]


def _clipped(values: Array) -> Array:
    low, high = np.percentile(values, [5, 95])
    return np.clip(values, low, high)


def _clock(factor: float) -> Callable[[RobotLog, Robot], tuple[RobotLog, Robot]]:
    return lambda log, robot: (replace(log, time=log.time * factor), robot)


def _gravity(log: RobotLog, robot: Robot) -> tuple[RobotLog, Robot]:
    model = pin.Model(robot.tree.model)
    model.gravity.linear = -robot.gravity
    return log, replace(robot, gravity=-robot.gravity, tree=replace(robot.tree, model=model))


def _falls(log: RobotLog, robot: Robot) -> tuple[RobotLog, Robot]:
    assert log.base_orientation is not None
    angle = np.clip((log.time - 0.8 * log.time[-1]) / 0.5, 0, 1)[:, None] * [0.0, np.pi / 2, 0.0]
    turned = Rotation.from_quat(log.base_orientation) * Rotation.from_rotvec(angle)
    return replace(log, base_orientation=turned.as_quat()), robot


def _lost(log: RobotLog, robot: Robot) -> tuple[RobotLog, Robot]:
    torque = log.torque.copy()
    period = (log.time[-1] - log.time[0]) / (len(log.time) - 1)
    block = np.floor(log.time / (60 * period)).astype(int)
    torque[np.random.default_rng(3).random(block.max() + 1)[block] < 0.4] = np.nan
    return replace(log, torque=torque), robot


def _contact(change: Callable[[Flags], Flags]) -> Callable[[RobotLog, Robot], tuple[RobotLog, Robot]]:
    def applied(log: RobotLog, robot: Robot) -> tuple[RobotLog, Robot]:
        assert log.contact is not None
        return replace(log, contact=change(log.contact.copy())), robot

    return applied


def _set_first(value: bool) -> Callable[[Flags], Flags]:
    def applied(contact: Flags) -> Flags:
        contact[len(contact) // 8 :, 0] = value
        return contact

    return applied


ALL = ("arm", "humanoid", "turntable", "standing")
_YAW = Rotation.from_euler("z", 90, degrees=True)
LIES = {
    "one torque inverted": Lie(_one(np.negative), ("torque-sign",)),
    "all torques inverted": Lie(_torque(lambda torque, _: -torque), ("torque-sign",)),
    "torques in mN m": Lie(_torque(lambda torque, _: 1e3 * torque), ("torque-scale",), of=ALL),
    "torques in kgf m": Lie(
        _torque(lambda torque, _: torque / 9.81), ("torque-scale",), of=("arm", "humanoid", "standing")
    ),
    "amperes read as N m": Lie(_torque(_amperes), ("torque-scale",)),
    "one torque off by two": Lie(_one(lambda torque: 2 * torque), ("torque-gain",)),
    "one torque half": Lie(_one(lambda torque: torque / 2), ("torque-gain",)),
    "a gear ratio left out": Lie(_one(lambda torque: torque / 100), ("torque-gain",)),
    "torques without a sign": Lie(_torque(lambda torque, _: np.abs(torque)), ("torque-unsigned",)),
    "one torque without a sign": Lie(_one(np.abs), ("torque-unsigned",)),
    "torques 8 ms late": Lie(_late, ("torque-delay",)),
    "two torques swapped": Lie(_torque(_swapped), ("joints-swapped",)),
    "left and right torques swapped": Lie(_torque(_mirrored), ("joints-swapped",), of=("humanoid",)),
    "a position jumps by a turn": Lie(_position(_wrapped), ("position-jump",)),
    "positions in degrees": Lie(_position(lambda position, _: np.rad2deg(position)), ("position-degrees",)),
    "a position outside its limits": Lie(_position(_outside), ("position-limits",)),
    "a position frozen halfway": Lie(_position(_frozen_position), ("channel-frozen",)),
    "a torque frozen halfway": Lie(_one(_frozen), ("channel-frozen",)),
    "a dead torque": Lie(_one(np.zeros_like), ("channel-dead",)),
    "a clipped torque": Lie(_one(_clipped), ("channel-clipped",)),
    "a torque held for 10 samples": Lie(_one(_held), ("channel-held",)),
    "a clock twice too fast": Lie(_clock(2.0), ("clock",)),
    "a clock twice too slow": Lie(_clock(0.5), ("clock",)),
    "gravity upside down": Lie(_gravity, ("gravity",), "[robot] gravity"),
    "many samples lost": Lie(_lost, ("samples-lost",)),
    "quaternion wxyz": Lie(
        _imu(base_orientation=lambda q: q[:, [3, 0, 1, 2]]), ("base-orientation",), 'order = "wxyz"', of=("humanoid",)
    ),
    "quaternion inverted": Lie(
        _imu(base_orientation=lambda q: q * [-1, -1, -1, 1]), ("quaternion-inverse",), of=("humanoid",)
    ),
    "IMU turned by 90 degrees": Lie(
        _imu(base_orientation=lambda q: (Rotation.from_quat(q) * _YAW).as_quat()), ("imu-axes",), of=("humanoid",)
    ),
    "gyroscope axes exchanged": Lie(_imu(angular_velocity=lambda w: w[:, [1, 0, 2]]), ("imu-axes",), of=("humanoid",)),
    "accelerometer inverted": Lie(_imu(linear_acceleration=np.negative), ("imu-axes",), of=("humanoid",)),
    "contacts swapped": Lie(_contact(lambda c: c[:, ::-1]), ("contacts-swapped",), of=("humanoid",)),
    "a contact stuck on": Lie(_contact(_set_first(True)), ("contact-stuck",), of=("humanoid",)),
    "a contact stuck off": Lie(_contact(_set_first(False)), ("contact-stuck",), of=("humanoid",)),
    "the robot falls": Lie(_falls, ("base-falls",), of=("humanoid",)),
}
"""By name; every one leaves a log that can be read."""


def checks_of(log: RobotLog, robot: Robot) -> tuple[list[str], str]:
    """Return the checks that found something, and why the log was refused, if it was."""
    try:
        return [f.check for f in audit(prepare(log, robot, robot.settings), robot, robot.settings)], ""
    except LogError as error:
        return ["refused"], str(error)


def tell(name: str, of: str, honest: Honest) -> Said:
    """Return what is said of a lie in a log."""
    lie = LIES[name]
    log, robot = lie.tell(honest.log, honest.robot)
    found, refusal = checks_of(log, robot)
    named = bool(set(found) & set(lie.checks)) or bool(lie.words and lie.words in refusal)
    wrong = [] if found else wrong_unwarned(log, robot, honest.coulomb)
    return {"lie": name, "log": of, "found": list(dict.fromkeys(found)), "named": named, "wrong": wrong}


def wrong_unwarned(log: RobotLog, robot: Robot, coulomb: dict[str, float]) -> list[str]:
    """Return the joints called identified at a wrong Coulomb friction, if no warning is given at all."""
    try:
        result = identify(log, robot, Settings(method="curve-fit"), force=True)
    except NothingIdentifiedError:
        return []
    wrong = []
    for name, joint in result.joints.items():
        value, true = joint.parameters.get("coulomb"), coulomb.get(name)
        if value is None or true is None or not joint.verdict == value.verdict == "identified":
            continue
        if abs(value.value - true) > max(WRONG * true, SMALL):
            wrong.append(name)
    return [] if result.warnings else wrong


def windows(log: RobotLog, seconds: float, count: int) -> Iterator[RobotLog]:
    """Yield parts of a log of so many seconds, evenly over it."""
    length = round(seconds * (len(log.time) - 1) / (log.time[-1] - log.time[0]))
    for start in np.linspace(0, len(log.time) - length, count).astype(int).tolist():
        yield log.take(slice(start, start + length))


def clean(honest: Honest) -> dict[str, list[int]]:
    """Return how many of the windows of a log have a finding, and how many there are, by their length."""
    found = {"whole": [int(bool(checks_of(honest.log, honest.robot)[0])), 1]}
    for seconds, count in WINDOWS.items():
        each = [bool(checks_of(part, honest.robot)[0]) for part in windows(honest.log, seconds, count)]
        found[f"{seconds:g} s"] = [sum(each), count]
    return found


def table(said: list[Said]) -> str:
    """Return what was said as a Markdown table."""
    lines = [
        f"| {row['lie']} | {row['log']} | {', '.join(f'`{check}`' for check in row['found']) or '-'} "
        f"| {'yes' if row['named'] else 'no'} |"
        for row in said
    ]
    return "\n".join([HEAD, *lines])


def clean_table(found: dict[str, dict[str, list[int]]]) -> str:
    """Return the findings on clean logs as a Markdown table."""
    order = ("whole", "10 s", "2 s", "1 s")
    lines = [
        f"| {name} | " + " | ".join(f"{each[length][0]} of {each[length][1]}" for length in order) + " |"
        for name, each in found.items()
    ]
    return "\n".join([CLEAN_HEAD, *lines])


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--save", type=Path)
    parser.add_argument("--tuning", action="store_true", help="on the logs that thresholds were chosen on")
    arguments = parser.parse_args()
    logs = {"arm": arm(), "humanoid": humanoid(), "turntable": turntable(), "standing": standing()}
    if arguments.tuning:
        logs = tuning()
    said = [tell(name, of, log) for name, lie in LIES.items() for of, log in logs.items() if of in lie.of]
    found = {of: clean(log) for of, log in logs.items()}
    print(table(said), "", clean_table(found), sep="\n")
    print(f"\n{sum(row['named'] for row in said)} of {len(said)} lies named; wrong without a warning: "
          f"{', '.join(row['lie'] for row in said if row['wrong']) or 'none'}")  # fmt: skip
    if arguments.save:
        arguments.save.write_text(json.dumps({"lies": said, "clean": found}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

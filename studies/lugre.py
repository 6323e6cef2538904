"""Measure how well the law "lugre" identifies known bristles.

    python -m studies.lugre --save studies/lugre.json

Levers on drives swing about horizontal axes on a bench under computed torque, which compensates only their Coulomb
friction: friction acts on the motion, and the fit does not know the filter's effect on friction. `DRIVES` levers have
the same friction and follow independent sums of sines. In addition, a humanoid with bristles in its legs walks along a
prescribed motion. Encoder noise is 2e-5 rad, torque noise 0.05 N m; Coulomb friction 1.2 N m, viscous friction
0.3 N m s/rad, Stribeck gain 0.3 at 0.15 rad/s, offset 0.2 N m.

The table contains, for the travel Fc / sigma0, the damping sigma1 and the parameters of steady sliding: the number of
identified joints, the median error, and the number of 95 % intervals that cover the true value. It also contains the
median held-out residual with other laws.
"""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from statistics import median

import numpy as np

from stribeck import Result, Robot, RobotLog, Settings, identify
from stribeck.core.base.typing import Array
from stribeck.core.friction import get_law
from stribeck.simulation.friction import FrictionTruth, Instant, LawFriction, LuGre
from stribeck.simulation.friction.parameters import Parameters
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.robots import MODELS
from stribeck.simulation.run import POSTURES
from stribeck.simulation.sensors.measure import with_noise
from studies.changes import known
from studies.command import Row, command, rounded
from studies.markdown import markdown_table

SEED, DRIVES, SECONDS = 20261123, 5, 20.0
STEADY = {"viscous": 0.3, "coulomb": 1.2, "stribeck_gain": 0.3, "stribeck_velocity": 0.15, "offset": 0.2}
RATE, FINE = 1000.0, 5
"""Rate of the log [Hz], and simulation steps per sample [1]."""
MASS, ARM, INERTIA = 1.0, 0.1, 0.03
"""Lever: mass [kg], length [m], moment of inertia about its axis [kg m^2]."""
STIFF = 20.0
"""Natural frequency of the controllers [rad/s], critically damped."""
LAWS = ("lugre", "stribeck", "coulomb-viscous")
BRISTLES = {
    "LuGre, 300 N m/rad": {**STEADY, "bristle_stiffness": 300.0, "bristle_damping": 2.0},
    "LuGre, 1200 N m/rad": {**STEADY, "bristle_stiffness": 1200.0, "bristle_damping": 0.5},
    "LuGre, 6000 N m/rad": {**STEADY, "bristle_stiffness": 6000.0, "bristle_damping": 0.2},
    "Dahl, 300 N m/rad": {**STEADY, "stribeck_gain": 0.0, "bristle_stiffness": 300.0, "bristle_damping": 0.0},
}
NONE, WALK = "no bristles", "walk, 300 N m/rad"
FRICTIONS = (*BRISTLES, NONE)
SLIDING = ("viscous", "coulomb", "stribeck_gain", "stribeck_velocity")
HEAD = ("friction", "travel", "damping", "steady sliding", "held out [N m]: lugre", *LAWS[1:])


def bench(count: int, folder: Path) -> Robot:
    """Make a robot with `count` levers on one frame."""
    link = '<link name="lever{0}"><inertial><origin xyz="{1} 0 0"/><mass value="{2}"/><inertia ixx="0.01" ixy="0" '
    link += 'ixz="0" iyy="{3}" iyz="0" izz="0.02"/></inertial></link><joint name="drive{0}" type="continuous">'
    link += '<parent link="frame"/><child link="lever{0}"/><axis xyz="0 1 0"/></joint>'
    levers = "".join(link.format(k, ARM, MASS, INERTIA - MASS * ARM**2) for k in range(count))
    (folder / "bench.urdf").write_text(f'<robot name="bench"><link name="frame"/>{levers}</robot>')
    (folder / "bench.toml").write_text('[robot]\nmodel = "bench.urdf"\nbase = "fixed"\n')
    return Robot.from_file(folder / "bench.toml")


def friction_of(names: Sequence[str]) -> FrictionTruth:
    """Assign each kind of friction to `DRIVES` levers."""
    bristles = {names[DRIVES * k + j]: own for k, own in enumerate(BRISTLES.values()) for j in range(DRIVES)}
    sharp = {name: {**STEADY, "exponent": 2.0} for name in names if name not in bristles}
    return FrictionTruth(len(names), [LuGre(names, bristles), LawFriction(names, get_law("stribeck-exponent"), sharp)])


def swung(robot: Robot) -> RobotLog:
    """Simulate the noisy log of levers that follow sines under computed torque."""
    generator, count = np.random.default_rng(SEED), len(robot.joint_names)
    time, step = np.arange(round(SECONDS * RATE * FINE)) / (RATE * FINE), 1 / (RATE * FINE)
    omega = 2 * np.pi * generator.uniform(0.1, 0.8, (5, 1, count))
    size = generator.uniform(0.5, 1.0, (5, 1, count)) * 0.6 / 5  # rad
    phase = omega * time[:, None] + generator.uniform(0, 2 * np.pi, (5, 1, count))
    aim, speed, push = (
        (size * wave).sum(axis=0) for wave in (np.sin(phase), omega * np.cos(phase), -(omega**2) * np.sin(phase))
    )
    friction, position, velocity = friction_of(robot.joint_names), aim[0], speed[0]
    kept = np.empty((2, *aim.shape))
    for k, now in enumerate(time):
        weight = -MASS * 9.81 * ARM * np.cos(position)
        feedback = STIFF**2 * (aim[k] - position) + 2 * STIFF * (speed[k] - velocity)
        torque = INERTIA * (push[k] + feedback) + weight + STEADY["coulomb"] * np.tanh(20 * speed[k])
        damping, rest = friction.before(Instant(float(now), step, position, velocity, torque))
        after = (INERTIA / step * velocity + torque - weight - rest) / (INERTIA / step + damping)
        friction.after(after)
        kept[:, k] = position, torque
        position, velocity = position + step * after, after
    log = RobotLog(
        time=time[::FINE],
        joint_names=robot.joint_names,
        position=kept[0, ::FINE],
        torque=kept[1, ::FINE],
        torque_source=robot.torque_source,
    )
    return with_noise(log, position=2e-5, torque=0.05, seed=SEED + 1)


def walked(robot: Robot) -> RobotLog:
    """Simulate the noisy log of a humanoid's prescribed walk, with bristles in its legs."""
    log, _ = exact_log(robot, get_law("coulomb-viscous"), {}, duration=SECONDS, seed=SEED, posture=POSTURES["toro"])
    torque = bristles_along(log, dict.fromkeys(robot.joint_names, BRISTLES["LuGre, 300 N m/rad"]))
    return with_noise(replace(log, torque=log.torque + torque), position=2e-5, torque=0.05, seed=SEED + 1)


def bristles_along(log: RobotLog, parameters: Parameters) -> Array:
    """Compute the LuGre friction torque along an exact log at `RATE`, shape (T, n)."""
    names, torque = log.joint_names, np.empty_like(log.position)
    friction = FrictionTruth(len(names), [LuGre(names, parameters)])
    ends = known(log.velocity)[np.maximum(np.arange(-1, len(log.time)), 0)]
    for k, position in enumerate(log.position):
        for part in (np.arange(FINE) + 0.5) / FINE:
            now = (1 - part) * ends[k] + part * ends[k + 1]
            friction.before(Instant(float(log.time[k]), 1 / (RATE * FINE), position, now, now))
            torque[k] = friction.after(now)
    return torque


@cache
def identified(walk: bool) -> dict[str, Result]:
    """Identify the friction of the walk or of the levers by the curve fit, with each law."""
    with tempfile.TemporaryDirectory() as folder:
        robot = Robot.from_file(MODELS / "toro.toml") if walk else bench(DRIVES * len(FRICTIONS), Path(folder))
        log = walked(robot) if walk else swung(robot)
        return {law: identify(log, robot, Settings(law=law, method="curve-fit")) for law in LAWS}


def run(friction: str) -> Row:
    """Count identified parameters, compare them with the ground truth, and compare laws on held-out blocks."""
    results = identified(friction == WALK)
    names = list(results["lugre"].joints)
    if friction != WALK:
        first = DRIVES * FRICTIONS.index(friction)
        names = names[first : first + DRIVES]
    joints = [results["lugre"].joints[name] for name in names if results["lugre"].joints[name].parameters]
    truth: Mapping[str, float] = BRISTLES.get("LuGre, 300 N m/rad" if friction == WALK else friction, STEADY)
    if "bristle_stiffness" in truth:
        truth = {**truth, "bristle_travel": truth["coulomb"] / truth["bristle_stiffness"]}

    def of(*parameters: str) -> Row:
        found = [(joint.parameters[name], truth.get(name)) for joint in joints for name in parameters]
        good = [each for each, _ in found if each.verdict == "identified"]
        known = [(each, true) for each, true in found if each.verdict == "identified" and true is not None]
        errors = [100 * abs(each.value - true) / true for each, true in known if true]
        return {
            "of": len(found),
            "identified": len(good),
            "error": rounded(median(errors), 2) if errors else None,
            "holds": sum(each.interval_95[0] <= true <= each.interval_95[1] for each, true in known),
        }

    checks = {law: [result.joints[name].validation for name in names] for law, result in results.items()}
    return {
        "joints": len(joints),
        "travel": of("bristle_travel"),
        "damping": of("bristle_damping"),
        "sliding": of(*SLIDING),
        "held_out": {law: rounded(median([each.rms for each in own if each]), 2) for law, own in checks.items()},
    }


def tables(rows: list[Row]) -> list[str]:
    """Format the table."""
    cells = []
    for row in rows:
        shares = []
        for own in (row["travel"], row["damping"], row["sliding"]):
            count = f"{own['identified']} of {own['of']}"
            shares.append(count if own["error"] is None else f"{count}, {own['error']:g} %, {own['holds']}")
        cells.append((row["friction"], *shares, *(f"{row['held_out'][law]:g}" for law in LAWS)))
    return [markdown_table(HEAD, cells, 4)]


if __name__ == "__main__":
    command(__doc__, [{"friction": friction} for friction in (*FRICTIONS, WALK)], run, tables)

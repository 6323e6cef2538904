"""Sound logs at the edge: robots of grams and of tonnes, joints that stand, no friction or only friction, no noise."""

import json
from pathlib import Path

import numpy as np

from fuzz.damage import Generator, pick
from stribeck.dynamics.rooted import RootMotion, rooted_inverse_dynamics
from stribeck.friction import get_law
from stribeck.log import RobotLog
from stribeck.log.writers import write_log
from stribeck.robot import Robot
from stribeck.typing import Array

RUNS = (
    *(("curve-fit", law) for law in ("coulomb-viscous", "stribeck", "stribeck-exponent", "asymmetric")),
    *(("observer", law) for law in ("coulomb-viscous", "stribeck", "asymmetric")),
    *(("direct", law) for law in ("coulomb-viscous", "asymmetric")),
    *(("whole-log", law) for law in ("auto", "coulomb-viscous", "stribeck")),
    ("ground-reaction", "stribeck"),
)
"""Methods and laws."""
MOTIONS = ("sines", "sines", "sines", "still", "one way", "to and fro", "tiny")
FRICTION = (0.3, 0.3, 0.0, 1e-6, 1e4)
"""Of a joint over the torque that moves it [1]."""


def make(generator: Generator, folder: Path, seeds: Path) -> list[str]:  # noqa: ARG001 - it is made from nothing
    """Write robot and log, and return a run over them."""
    mass, size = 10 ** generator.uniform(-4, 4), 10 ** generator.uniform(-2, 1)
    floating = generator.random() < 0.25
    _write_robot(generator, folder, mass, size, floating)
    robot = Robot.from_file(folder / "robot.toml")
    write_log(_log(generator, robot, size), folder / "log.npz")
    method, law = pick(generator, RUNS)
    words = ["identify", "log.npz", "-r", "robot.toml", "-o", "out", "--force", "--method", method, "--law", law]
    settings = ["block=0.2"] * (generator.random() < 0.8)
    if method == "direct":
        settings += [f"regression={pick(generator, ('ordinary', 'weighted', 'robust'))}"]
    if floating and method != "whole-log":
        settings += ["standing_legs=measured" if method == "ground-reaction" else "standing_legs=true"]
    return words + [word for setting in settings for word in ("--set", setting)]


def inconsistent(command: list[str], folder: Path, seeds: Path) -> bool:  # noqa: ARG001 - of one kind of command
    """Return whether a result has an interval that does not hold its value."""
    found = json.loads((folder / "out/result.json").read_text(encoding="utf-8"))
    parts = [
        part
        for joint in found["joints"].values()
        for part in (*joint["parameters"].values(), *joint["curve"])
        if not (part["standard_error"] >= 0 and part["interval_95"][0] <= part["interval_95"][1])
    ]
    return bool(parts)


def _write_robot(generator: Generator, folder: Path, mass: float, size: float, floating: bool) -> None:
    """Write a chain of two or three joints, one body of which may have no mass; the first one's end may be a foot."""
    joints = int(generator.integers(2, 4))
    without = int(generator.integers(1, joints)) if generator.random() < 0.2 else 0
    text = '<robot name="extreme">' + _link(generator, "base", 10 * mass, size)
    for k in range(1, joints + 1):
        kind = pick(generator, ("revolute", "continuous", "prismatic"))
        reach = 3 * size if kind == "prismatic" else 3.0
        parent = "base" if k == 1 or (floating and k == 2) else f"link{k - 1}"
        x, y, z = generator.permutation([0, 0, 1])
        body = 0.0 if k == without and k < joints and not floating else mass * 10 ** generator.uniform(-1, 0.5)
        text += (
            f'<joint name="joint{k}" type="{kind}"><parent link="{parent}"/><child link="link{k}"/>'
            f'<origin xyz="0 0 {size}"/><axis xyz="{x} {y} {z}"/>'
            f'<limit lower="{-reach}" upper="{reach}" effort="{1e3 * mass * size}" velocity="10"/></joint>'
        ) + _link(generator, f"link{k}", body, size)
    (folder / "model.urdf").write_text(text + "</robot>", encoding="utf-8")
    foot = '[contacts.foot]\nframe = "link1"\n' * floating
    base = "floating" if floating else "fixed"
    (folder / "robot.toml").write_text(f'[robot]\nmodel = "model.urdf"\nbase = "{base}"\n{foot}', encoding="utf-8")


def _link(generator: Generator, name: str, mass: float, size: float) -> str:
    x, y, z = generator.uniform(0.1, 0.3, 3) * mass * size**2
    centre = " ".join(map(str, (size * generator.uniform(-0.5, 0.5, 3)).tolist()))
    inertial = (
        f'<inertial><origin xyz="{centre}"/><mass value="{mass}"/>'
        f'<inertia ixx="{y + z}" ixy="0" ixz="0" iyy="{x + z}" iyz="0" izz="{x + y}"/></inertial>'
    )
    return f'<link name="{name}">{inertial * (mass > 0)}</link>'


def _log(generator: Generator, robot: Robot, size: float) -> RobotLog:
    rate, duration = pick(generator, (50.0, 100.0, 250.0)), pick(generator, (2.0, 4.0))
    time = np.arange(round(rate * duration)) / rate
    speed = 10 ** generator.uniform(-0.5, 0.5) * np.where(robot.prismatic, size, 1.0)
    position, velocity, acceleration = np.stack([_motion(generator, time) for _ in speed], axis=2) * speed
    feet = tuple(robot.contacts)
    root = RootMotion(np.broadcast_to(robot.gravity, (len(time), 3))) if feet else None
    tree = robot.rooted_at(feet[0]) if feet else robot.tree
    wrench, torque = rooted_inverse_dynamics(tree, position, velocity, acceleration, root)
    law = get_law("coulomb-viscous")
    for k, load in enumerate(np.sqrt(np.mean(torque**2, axis=0)).tolist()):
        friction = load * pick(generator, FRICTION) * np.array([0.2 / speed[k], 1.0, 0.1])
        torque[:, k] += law.torque(velocity[:, k], friction)
    noise = pick(generator, (0.0, 1e-4, 0.1)) * np.sqrt(np.mean(torque**2, axis=0))
    torque += noise * generator.normal(size=torque.shape)
    if generator.random() < 0.2:
        torque[:, generator.integers(len(speed))] = pick(generator, (0.0, 1.0))
    step = pick(generator, (0.0, 0.0, 1e-5, 1e-2))
    return RobotLog(
        time=time,
        joint_names=robot.joint_names,
        position=np.round(position / step) * step if step else position,
        torque=torque,
        velocity=velocity if generator.random() < 0.5 else None,
        foot_names=feet,
        contact=np.ones((len(time), 1), dtype=bool) if feet else None,
        foot_wrench=wrench[:, None] if feet else None,
    )


def _motion(generator: Generator, time: Array) -> Array:
    """Return position, velocity and acceleration of a joint whose speed is about one, shape (3, T)."""
    found = np.zeros((3, len(time)))
    match pick(generator, MOTIONS):
        case "still":
            return found
        case "one way":
            return np.stack([time, np.ones_like(time), np.zeros_like(time)])
        case "to and fro":
            half = time % 1 < 0.5
            return np.stack([np.abs(time % 1 - 0.5), np.where(half, -1.0, 1.0), np.zeros_like(time)])
        case motion:
            for omega in 2 * np.pi * generator.uniform(0.2, 2.0, 3):
                phase = omega * time + generator.uniform(0, 2 * np.pi)
                found += 0.6 * np.array([np.sin(phase) / omega, np.cos(phase), -omega * np.sin(phase)])
            return found * (1e-4 if motion == "tiny" else 1.0)

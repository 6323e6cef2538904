"""Robots with closed chains, and exact logs of them: a parallelogram, and a leg whose ankle is moved by two rods."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from stribeck.core.dynamics.loops import closed_log, without_loop_forces
from stribeck.core.dynamics.rooted import RootMotion, rooted_inverse_dynamics
from stribeck.core.friction import get_law
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot

LAW = get_law("coulomb-viscous")
TRUTH = {"viscous": 0.4, "coulomb": 0.9, "offset": 0.1}


def link(name: str, mass: float, centre: str, moments: str = "0.002 0.003 0.001") -> str:
    """Format a link of a URDF."""
    ixx, iyy, izz = moments.split()
    return (
        f'<link name="{name}"><inertial><origin xyz="{centre}"/><mass value="{mass}"/>'
        f'<inertia ixx="{ixx}" ixy="0" ixz="0" iyy="{iyy}" iyz="0" izz="{izz}"/></inertial></link>'
    )


def joint(name: str, parent: str, child: str, axis: str, place: str, kind: str = "continuous") -> str:
    """Format a joint of a URDF."""
    turning = "" if kind == "fixed" else f'<axis xyz="{axis}"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{place}"/>{turning}</joint>'
    )


def frame(name: str, parent: str, place: str) -> str:
    """Format an empty link that is fixed to another."""
    return f'<link name="{name}"/>' + joint(f"{name}_fixed", parent, name, "", place, "fixed")


PARALLELOGRAM = (
    '<robot name="parallelogram"><link name="base"/>'
    + link("crank", 1.5, "0 0 0.2")
    + joint("motor", "base", "crank", "0 1 0", "0 0 0")
    + link("coupler", 2.0, "0.15 0 0.03")
    + joint("upper", "crank", "coupler", "0 1 0", "0 0 0.4")
    + link("rocker", 1.0, "0 0 0.25")
    + joint("lower", "base", "rocker", "0 1 0", "0.3 0 0")
    + frame("coupler_end", "coupler", "0.3 0 0")
    + frame("rocker_end", "rocker", "0 0 0.4")
    + "</robot>"
)
PARALLELOGRAM_FILE = (Path(__file__).parent / "parallelogram.toml").read_text()


def ankle(side: str, y: float) -> str:
    """Format a motor on the shank, its crank, and a rod on a universal joint down to the foot."""
    return (
        link(f"crank_{side}", 0.15, "-0.02 0 0", "1e-4 1e-4 1e-4")
        + joint(f"motor_{side}", "shank", f"crank_{side}", "0 1 0", f"0 {y} -0.1")
        + link(f"cross_{side}", 0.01, "0 0 0", "1e-5 1e-5 1e-5")
        + joint(f"rod_{side}_pitch", f"crank_{side}", f"cross_{side}", "0 1 0", "-0.04 0 0")
        + link(f"rod_{side}", 0.1, "0 0 -0.1", "4e-4 4e-4 1e-5")
        + joint(f"rod_{side}_roll", f"cross_{side}", f"rod_{side}", "1 0 0", "0 0 0")
        + frame(f"rod_{side}_end", f"rod_{side}", "0 0 -0.2")
        + frame(f"foot_{side}", "foot", f"-0.04 {y} 0")
    )


LEG = (
    '<robot name="leg">'
    + link("trunk", 12.0, "0.02 0 0.2", "0.3 0.25 0.1")
    + link("thigh", 3.0, "0 0.01 -0.15", "0.03 0.03 0.005")
    + joint("hip", "trunk", "thigh", "0 1 0", "0 0 0")
    + link("shank", 2.0, "0.01 0 -0.15", "0.02 0.02 0.002")
    + joint("knee", "thigh", "shank", "0 1 0", "0 0 -0.3")
    + link("pitched", 0.05, "0 0 0", "1e-4 1e-4 1e-4")
    + joint("ankle_pitch", "shank", "pitched", "0 1 0", "0 0 -0.3")
    + link("foot", 0.8, "0.03 0 -0.03", "0.002 0.004 0.004")
    + joint("ankle_roll", "pitched", "foot", "1 0 0", "0 0 0")
    + ankle("left", 0.04)
    + ankle("right", -0.04)
    + frame("sole", "foot", "0 0 -0.05")
    + "</robot>"
)
LEG_FILE = (Path(__file__).parent / "leg.toml").read_text()
SOLE = '\n[contacts.foot]\nframe = "sole"\n'


def robot_of(folder: Path, model: str, text: str) -> Robot:
    """Write the files of a robot to a folder and read it."""
    (folder / "model.urdf").write_text(model)
    (folder / "robot.toml").write_text(text)
    return Robot.from_file(folder / "robot.toml")


def leg(folder: Path, base: str) -> Robot:
    """Make the leg, with a fixed trunk or standing on its foot."""
    return robot_of(folder, LEG, LEG_FILE.format(base=base) + SOLE * (base == "floating"))


def loop_log(robot: Robot, duration: float = 8.0, rate: float = 250.0, size: float = 0.3, seed: int = 0) -> RobotLog:
    """Make an exact log with smooth motion of independent joints; the standing foot of a floating robot is flat.

    Friction of `TRUTH` acts only on the independent joints.
    """
    generator = np.random.default_rng(seed)
    time = np.arange(round(duration * rate)) / rate
    motion = np.full((3, len(time), len(robot.joint_names)), np.nan)
    motion[:, :, robot.independent] = 0.0
    for k in robot.independent.tolist():
        for _ in range(3):
            omega, phase = 2 * np.pi * generator.uniform(0.2, 1.2), generator.uniform(0, 6.28)
            part = size / 3 * np.array([1, omega, omega**2])[:, None]
            motion[:, :, k] += part * np.array([np.sin(t := omega * time + phase), np.cos(t), -np.sin(t)])
    feet = tuple(robot.contacts)
    contact = np.ones((len(time), 1), dtype=bool) if feet else None
    log = RobotLog(time=time, joint_names=robot.joint_names, position=motion[0], torque=np.zeros_like(motion[0]))
    log = replace(log, velocity=motion[1], acceleration=motion[2], foot_names=feet, contact=contact)
    log, _ = closed_log(log, robot)
    tree = robot.rooted_at(feet[0]) if feet else robot.tree
    root = RootMotion(np.broadcast_to(robot.gravity, (len(time), 3))) if feet else None
    needed = rooted_inverse_dynamics(tree, log.position, log.velocity, log.acceleration, root)[1]
    torque = without_loop_forces(robot, log.position, needed)
    friction = LAW.torque(log.velocity, np.array([TRUTH[parameter.name] for parameter in LAW.parameters]))
    torque[:, robot.torque_controlled] += friction[:, robot.torque_controlled]
    object.__setattr__(log, "torque", torque)
    return log


MJCF = (Path(__file__).parent / "parallelogram.xml").read_text()

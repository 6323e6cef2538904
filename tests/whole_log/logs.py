"""Exact logs that the tests of the whole log share."""

from dataclasses import replace
from functools import cache

import numpy as np
import pinocchio as pin

from stribeck import Robot
from stribeck.core.friction import get_law
from stribeck.core.log import RobotLog
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.robots import MODELS
from stribeck.simulation.run import POSTURES
from stribeck.simulation.sensors.measure import with_noise

TRUTH = {"viscous": 0.3, "coulomb": 1.2, "stribeck_gain": 0.3, "stribeck_velocity": 0.15, "offset": 0.2, "slope": 50.0}
PLAIN = {name: TRUTH[name] for name in ("viscous", "coulomb", "offset")}


@cache
def read_arm() -> Robot:
    return Robot.from_file(MODELS / "arm.toml")


@cache
def arm_log(duration: float, seed: int = 1, law: str = "stribeck") -> RobotLog:
    """An exact log of the arm, all joints of which have the same friction."""
    truth = {parameter.name: TRUTH[parameter.name] for parameter in get_law(law).parameters}
    friction = dict.fromkeys(read_arm().joint_names, truth)
    return exact_log(read_arm(), get_law(law), friction, duration=duration, seed=seed)[0]


@cache
def walk(name: str, duration: float) -> tuple[Robot, RobotLog]:
    """A biped or a quadruped, and the noisy log of its walk."""
    robot = Robot.from_file(MODELS / {"biped": "robot.toml", "quadruped": "quadruped.toml"}[name])
    joints = [joint for joint in robot.joint_names if joint not in robot.position_controlled]
    friction, law = dict.fromkeys(joints, TRUTH), get_law("stribeck")
    exact, _ = exact_log(robot, law, friction, duration=duration, posture=POSTURES[name], seed=2)
    return robot, with_noise(exact, position=1e-5, torque=0.05, seed=3)


def with_wrong_bodies(robot: Robot) -> Robot:
    """The same robot, believed to be heavier, its centres elsewhere, its moments smaller."""
    model = pin.Model(robot.tree.model)
    for joint in range(1, model.njoints):
        body = model.inertias[joint]
        shift = np.array([0.005, -0.004, 0.003])
        model.inertias[joint] = pin.Inertia(1.05 * body.mass, body.lever + shift, 0.85 * body.inertia)
    return replace(robot, tree=replace(robot.tree, model=model))

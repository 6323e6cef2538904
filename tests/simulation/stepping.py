"""A simple way to move a robot on rigid feet: computed torque about a standing foot, along a smooth reference."""

from functools import cache

import numpy as np
from numpy.polynomial import Polynomial

from stribeck.core.dynamics.rooted import RootMotion, rooted_inverse_dynamics
from stribeck.core.friction import Stribeck
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.simulation.demo import SCENARIO
from stribeck.simulation.friction import FrictionTruth, LawFriction
from stribeck.simulation.prescribed.exact import Truth
from stribeck.simulation.rigid.constrained import BodyState, Support, simulate_constrained
from stribeck.simulation.robots import TORO
from stribeck.simulation.robots.toro import standing_posture
from stribeck.simulation.run import friction_of
from stribeck.simulation.scenario import read_scenario

LEFT, RIGHT = ("left_foot",), ("right_foot",)
STANDING = {0.0: LEFT + RIGHT, 0.2: LEFT, 1.0: LEFT + RIGHT, 1.3: RIGHT, 2.1: LEFT + RIGHT}
SWINGS = {"right": (0.2, 1.0), "left": (1.3, 2.1)}
SWING = {"hip_roll": 0.15, "hip_pitch": -0.4, "hip_yaw": 0.3, "knee": 0.6, "ankle_roll": 0.15, "ankle_pitch": -0.2}
"""How far the joints of the left leg go and come back [rad]; roll and yaw of the right one go the other way."""
BUMP = 64 * Polynomial([0, 1]) ** 3 * Polynomial([1, -1]) ** 3


@cache
def toro() -> Robot:
    return Robot.from_file(TORO)


FRICTION = friction_of(read_scenario(SCENARIO), toro()).parameters
"""In the joints of the legs, Table 6.2."""


def reference(time: float) -> np.ndarray:
    """Return position, velocity and acceleration of the joints, shape (3, n)."""
    joints = toro().joint_names
    motion = np.zeros((3, len(joints)))
    motion[0] = [standing_posture().get(name, 0.0) for name in joints]
    for side, (start, end) in SWINGS.items():
        share, rate = np.clip((time - start) / (end - start), 0.0, 1.0), 1.0 / (end - start)
        bump = np.array([rate**k * BUMP.deriv(k)(share) for k in range(3)])
        for joint, distance in SWING.items():
            sign = -1.0 if side == "right" and joint.endswith(("roll", "yaw")) else 1.0
            motion[:, joints.index(f"{side}_{joint}")] += sign * distance * bump
    return motion


def control(time: float, state: BodyState) -> np.ndarray:
    """Feed back joints, made linear by inverse dynamics about the first standing foot."""
    columns = toro().tree.columns
    q, v = np.empty((2, 1, len(columns)))
    q[0, columns], v[0, columns] = state.configuration[7:], state.velocity[6:]
    position, velocity, acceleration = reference(time)
    a = acceleration + 900.0 * (position - q) + 60.0 * (velocity - v)
    root = RootMotion(toro().gravity[None])
    return rooted_inverse_dynamics(toro().rooted_at(state.feet[0]), q, v, a, root)[1][0, columns]


@cache
def stepping() -> tuple[RobotLog, Truth]:
    """Step on the left foot, then on the right one, with friction in the legs."""
    friction = FrictionTruth(27, [LawFriction(toro().joint_names, Stribeck(), FRICTION)])
    start = np.concatenate([[0, 0, 0, 0, 0, 0, 1], reference(0.0)[0][toro().tree.columns]])
    supports = [Support(*each) for each in STANDING.items()]
    return simulate_constrained(toro(), control, supports, friction, configuration=start, duration=2.4)

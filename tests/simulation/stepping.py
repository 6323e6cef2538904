"""A simple way to move a robot on rigid feet: computed torque about a standing foot, along a smooth reference."""

from functools import cache

import numpy as np
import pinocchio as pin

from stribeck.friction import Stribeck
from stribeck.log import RobotLog
from stribeck.robot import Robot
from stribeck_simulation.demo import SCENARIO
from stribeck_simulation.friction import FrictionTruth, LawFriction
from stribeck_simulation.friction.parameters import Parameters
from stribeck_simulation.prescribed.exact import Truth
from stribeck_simulation.rigid.constrained import BodyState, Support, simulate_constrained
from stribeck_simulation.robots.toro import ROBOT_FILE, standing_posture
from stribeck_simulation.run import friction_of
from stribeck_simulation.scenario import read_scenario

LEFT, RIGHT = ("left_foot",), ("right_foot",)
SUPPORTS = (
    Support(0.0, LEFT + RIGHT),
    Support(0.2, LEFT),
    Support(1.0, LEFT + RIGHT),
    Support(1.3, RIGHT),
    Support(2.1, LEFT + RIGHT),
)
DURATION = 2.4
SWINGS = {"right": (0.2, 1.0), "left": (1.3, 2.1)}
SWING = {"hip_roll": 0.15, "hip_pitch": -0.4, "hip_yaw": 0.3, "knee": 0.6, "ankle_roll": 0.15, "ankle_pitch": -0.2}
"""How far the joints of the left leg go and come back [rad]; roll and yaw of the right one go the other way."""


@cache
def toro() -> Robot:
    return Robot.from_file(ROBOT_FILE)


FRICTION = friction_of(read_scenario(SCENARIO), toro()).parameters
"""In the joints of the legs, Table 6.2."""


def reference(time: float) -> np.ndarray:
    """Return position, velocity and acceleration of the joints, shape (3, n): legs lift by 10 u^3 - 15 u^4 + 6 u^5."""
    joints = toro().joint_names
    motion = np.zeros((3, len(joints)))
    motion[0] = [standing_posture().get(name, 0.0) for name in joints]
    for side, (start, end) in SWINGS.items():
        u = np.clip((time - start) / (end - start), 0.0, 1.0)
        rate = 1.0 / (end - start)
        bump = 64 * np.array(  # u^3 (1 - u)^3 and its derivatives
            [
                u**3 * (1 - u) ** 3,
                rate * 3 * u**2 * (1 - u) ** 2 * (1 - 2 * u),
                rate**2 * 6 * u * (1 - u) * (1 - 5 * u + 5 * u**2),
            ]
        )
        for joint, distance in SWING.items():
            sign = -1.0 if side == "right" and joint.endswith(("roll", "yaw")) else 1.0
            motion[:, joints.index(f"{side}_{joint}")] += sign * distance * bump
    return motion


def expected_friction(velocity: np.ndarray) -> np.ndarray:
    """Return the friction torque of all joints at their reference velocity, with 0.8 of the true friction."""
    friction = np.zeros_like(velocity)
    for joint, named in FRICTION.items():
        column = toro().joint_names.index(joint)
        values = np.array([named[parameter.name] for parameter in Stribeck.parameters])
        friction[column] = 0.8 * Stribeck().torque(velocity[column : column + 1], values)[0]
    return friction


class Stepper:
    """Feedback on joints, made linear by inverse dynamics about the first standing foot, and most of the friction."""

    def __init__(self) -> None:
        self._trees = {
            foot: (toro().rooted_at(foot), toro().rooted_at(foot).model.createData()) for foot in LEFT + RIGHT
        }

    def __call__(self, time: float, state: BodyState) -> np.ndarray:
        tree, data = self._trees[state.feet[0]]
        columns = toro().tree.columns
        q, v = np.empty((2, len(columns)))
        q[columns], v[columns] = state.configuration[7:], state.velocity[6:]
        position, velocity, acceleration = reference(time)
        a = acceleration + 100.0 * (position - q) + 20.0 * (velocity - v)
        at_rest = np.zeros(6)
        full = (
            np.concatenate([start, x[tree.columns]])
            for start, x in zip((pin.neutral(tree.model)[:7], at_rest, at_rest), (q, v, a), strict=True)
        )
        torque = np.empty(len(columns))
        torque[tree.columns] = pin.rnea(tree.model, data, *full)[6:]
        return (torque + expected_friction(velocity))[columns]


def start() -> np.ndarray:
    return np.concatenate([[0, 0, 0, 0, 0, 0, 1], reference(0.0)[0][toro().tree.columns]])


def simulate(
    duration: float = DURATION, paper_literal: bool = False, parameters: Parameters = FRICTION
) -> tuple[RobotLog, Truth]:
    """Step on the left foot, then on the right one, with friction in the legs."""
    friction = FrictionTruth(27, [LawFriction(toro().joint_names, Stribeck(), parameters)])
    return simulate_constrained(
        toro(),
        Stepper(),
        SUPPORTS,
        friction,
        configuration=start(),
        duration=duration,
        paper_literal=paper_literal,
    )


@cache
def stepping(paper_literal: bool = False) -> tuple[RobotLog, Truth]:
    """Return `simulate`'s log and truth; made once."""
    return simulate(paper_literal=paper_literal)

"""Robots that tests share: robots of example-robot-data, and the packaged biped."""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from studies.changes import EXAMPLES as EXAMPLES
from studies.walking_cases import WALKERS

from stribeck.core.base.typing import Array
from stribeck.core.friction import Stribeck
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot, robot_fields
from stribeck.core.settings import RobotFile
from stribeck.simulation.friction import FrictionTruth, LawFriction
from stribeck.simulation.prescribed.exact import Truth, exact_log

CASSIE = Path(__file__).parents[1] / "examples" / "robots" / "cassie" / "cassie.urdf"
SIDES = ("left", "right")
LEGS = ("FL", "FR", "RL", "RR")

STRIBECK = {"viscous": 0.2, "coulomb": 1.0, "stribeck_gain": 0.2, "stribeck_velocity": 0.2}
STRIBECK |= {"offset": 0.3, "slope": 40.0}
"""Parameters of the law "stribeck"."""


def _feet(frame: str, kind: str, names: tuple[str, ...] = SIDES) -> dict[str, dict[str, str]]:
    return {name: {"frame": frame.format(name), "kind": kind} for name in names}


HEAD = {"position_controlled": ["head_1_joint", "head_2_joint"]}
MODELS: dict[str, tuple[str, dict[str, Any], dict[str, dict[str, str]]]] = {
    "talos": ("talos_data/robots/talos_reduced.urdf", HEAD, _feet("{}_sole_link", "surface")),
    "g1": ("g1_description/urdf/g1_29dof_rev_1_0.urdf", {}, _feet("{}_ankle_roll_link", "surface")),
    "go2": ("go2_description/urdf/go2.urdf", {}, _feet("{}_foot", "point", LEGS)),
    "cassie": (str(CASSIE), {}, _feet("{}-foot", "point")),
    "icub": ("icub_description/robots/icub.urdf", {}, _feet("{0[0]}_sole", "surface")),
    "panda": ("panda_description/urdf/panda.urdf", {"base": "fixed"}, {}),
    "ur5": ("ur_description/urdf/ur5_robot.urdf", {"base": "fixed"}, {}),
    "kinova": ("kinova_description/robots/kinova.urdf", {"base": "fixed"}, {}),
}
"""Model file, keys of [robot], and contacts."""

BENT = {"hip": 0.0, "thigh": 0.8, "calf": -1.6}
POSTURES: dict[str, dict[str, float]] = {
    "talos": dict(WALKERS["TALOS"].posture),
    "g1": dict(WALKERS["G1"].posture),
    "go2": {f"{leg}_{part}_joint": angle for leg in LEGS for part, angle in BENT.items()},
}
"""Postures with bent knees and nearly level feet."""


@cache
def example_robot(name: str) -> Robot:
    """Build a robot of example-robot-data; the result is cached."""
    return make_robot(*MODELS[name])


def make_robot(model: str | Path, table: dict[str, Any], contacts: dict[str, dict[str, str]]) -> Robot:
    """Build the robot of a robot file with these tables; `model` is relative to `EXAMPLES`."""
    document = {"robot": {"model": str(model), **table}, "contacts": contacts}
    return Robot(**robot_fields(RobotFile.model_validate(document), EXAMPLES / "robot.toml"))


@cache
def example_log(name: str, duration: float = 5.0, gait: str = "walk", **options: Any) -> tuple[RobotLog, Truth]:
    """Make an exact log of a robot with friction `STRIBECK` in every joint with a torque; each is made once."""
    robot = example_robot(name)
    truth = {joint: STRIBECK for joint in robot.joint_names if joint not in robot.position_controlled}
    return exact_log(robot, Stribeck(), truth, duration=duration, gait=gait, posture=POSTURES.get(name), **options)


@cache
def plain_model(name: str) -> pin.Model:
    """Read the URDF of a robot with Pinocchio, without stribeck."""
    path, table, _ = MODELS[name]
    if table.get("base") == "fixed":
        return pin.buildModelFromUrdf(str(EXAMPLES / path))
    return pin.buildModelFromUrdf(str(EXAMPLES / path), pin.JointModelFreeFlyer())


def plain_configuration(model: pin.Model, robot: Robot, joints: Array, base: Array | None = None) -> Array:
    """Assemble Pinocchio's configuration of one sample: `joints` in robot order, `base` position and quaternion."""
    configuration = pin.neutral(model)
    if base is not None:
        configuration[:7] = base
    for value, name in zip(joints, robot.joint_names, strict=True):
        joint = model.joints[model.getJointId(name)]
        entry = [value] if joint.nq == 1 else [np.cos(value), np.sin(value)]
        configuration[joint.idx_q : joint.idx_q + joint.nq] = entry
    return configuration


def plain_rates(model: pin.Model, robot: Robot, joints: Array, base: Array | None = None) -> Array:
    """Assemble Pinocchio's velocity (or acceleration) of one sample, as in `plain_configuration`."""
    rates = np.zeros(model.nv)
    if base is not None:
        rates[:6] = base
    for value, name in zip(joints, robot.joint_names, strict=True):
        rates[model.joints[model.getJointId(name)].idx_v] = value
    return rates


def leg_friction(robot: Robot, coulomb: float, offset: float = 0.3) -> FrictionTruth:
    """Return friction and an offset [N m] in all leg joints, in the tree's order."""
    names = [str(name) for name in list(robot.tree.model.names)[2:]]
    values = {**STRIBECK, "coulomb": coulomb, "offset": offset}
    legs = {name: values for name in names if any(part in name for part in ("leg_", "hip", "knee", "ankle"))}
    return FrictionTruth(len(names), [LawFriction(names, Stribeck(), legs)])

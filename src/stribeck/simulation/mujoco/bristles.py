"""Bristles of LuGre friction with which a simulation in MuJoCo is stable."""

from collections.abc import Mapping

import numpy as np
import pinocchio as pin

from stribeck.core.robot import Robot
from stribeck.simulation.mujoco.mjcf_of_urdf import LIGHTEST

STEP = 2e-3
"""Simulation step at which LuGre friction is stable, unless its bristles are identified [s]; MuJoCo's default."""


def stable_bristles(robot: Robot, stated: Mapping[str, Mapping[str, float]]) -> dict[str, tuple[float, float, float]]:
    """Compute stiffness, damping and largest stable step [s] of the bristles of each joint with LuGre friction.

    With inertia I, stiffness s and damping d, MuJoCo's explicit step h is stable for h < d / s and h < 2 I / d. Unless
    they are identified, bristles have d / s = 2 `STEP`, d up to I / `STEP`, and travel at least 1 mrad or 1 mm.
    """
    lugre = {name: numbers for name, numbers in stated.items() if numbers.get("tau_s", 0.0) > 0}
    inertia = _smallest_inertia(robot, stated) if lugre else {}
    bristles = {}
    for name, numbers in lugre.items():
        stiffness = numbers.get("sigma_0", min(numbers["tau_s"] / 1e-3, inertia[name] / (2 * STEP**2)))
        damping = numbers.get("sigma_1", 2 * STEP * stiffness)
        bristles[name] = stiffness, damping, min(damping / (2 * stiffness), inertia[name] / damping)
    return bristles


def _smallest_inertia(robot: Robot, stated: Mapping[str, Mapping[str, float]]) -> dict[str, float]:
    """Compute each joint's smallest inertia [kg m^2], [kg] in 20 configurations while all other joints move freely."""
    model, generator = pin.Model(robot.tree.model), np.random.default_rng(0)
    places = {name: model.joints[model.getJointId(name)].idx_v for name in robot.joint_names}
    for name in places.keys() & stated.keys():
        model.armature[places[name]] = stated[name].get("armature", model.armature[places[name]])
    data, largest = model.createData(), np.zeros(model.nv)
    for _ in range(20):
        position = pin.integrate(model, pin.neutral(model), generator.uniform(-np.pi, np.pi, model.nv))
        inverse = pin.computeMinverse(model, data, position)
        largest = np.fmax(largest, np.diag(inverse))
    return {name: float(1 / min(largest[place], 1 / LIGHTEST)) for name, place in places.items()}

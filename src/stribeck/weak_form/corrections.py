"""What errors of the model and of the sensors' calibration would do to the equations: the columns of the corrections.

All are taken at the windows' centres, of the smoothed motion: corrections are small, so that this costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from stribeck.base_motion import standing_root
from stribeck.dynamics import RootMotion, rooted_inverse_dynamics
from stribeck.log import Array
from stribeck.pseudo_inertia import SIZE, carried
from stribeck.robot import Robot
from stribeck.rooting import RootedModel
from stribeck.state import State

TURN = 1e-5
"""Step of the differences [rad] or [m]: rounding and curvature both stay below a part in a million."""


@cache
def _workspace(rooted: RootedModel) -> tuple[pin.Model, pin.Data]:
    model = pin.Model(rooted.model)
    if rooted.floating:
        model.gravity.linear = np.zeros(3)  # it enters as the root's acceleration
    return model, model.createData()


def inertia_columns(
    robot: Robot, rooted: RootedModel, joints: NDArray[np.int64], state: State, root: RootMotion | None
) -> Array:
    """Return the joint torques' derivatives by the bodies' inertial parameters, shape (K, n, 10 bodies).

    The bodies are those of `robot.tree`, each with its parameters in its own joint's frame, whatever foot stands: a
    body that is passed the other way has moved into another frame, which its parameters follow linearly.
    """
    model, data = _workspace(rooted)
    size, columns = rooted.root_size, rooted.columns
    order = size + np.argsort(columns)[joints]
    bodies = range(1, robot.tree.model.njoints)
    places = np.array([rooted.bodies[body][0] - 1 for body in bodies]) if rooted is not robot.tree else None
    raw = np.empty((len(state.position), len(joints), model.njoints - 1, SIZE))
    configuration = pin.neutral(model)
    rates = np.zeros((2, model.nv))
    for k in range(len(raw)):  # Pinocchio has no batched call for it
        configuration[model.nq - len(columns) :] = state.position[k, columns]
        rates[0, size:], rates[1, size:] = state.velocity[k, columns], state.acceleration[k, columns]
        if root is not None:
            rates[1, :3] = -root.gravity[k]
        regressor = pin.computeJointTorqueRegressor(model, data, configuration, rates[0], rates[1])
        raw[k] = regressor[order].reshape(len(joints), -1, SIZE)
    if places is None:
        return raw.reshape(*raw.shape[:2], -1)
    moves = np.stack([carried(rooted.bodies[body][1].homogeneous) for body in bodies])
    return np.asarray(np.einsum("knbp,bpq->knbq", raw[:, :, places], moves).reshape(*raw.shape[:2], -1))


def zero_columns(
    robot: Robot, rooted: RootedModel, joints: NDArray[np.int64], feet: tuple[str, ...], state: State
) -> Array:
    """Return minus the torques' derivatives by joint positions, then by the tilt, shape (K, n, all joints + 3).

    They are what encoders whose zeros are wrong do, and an IMU that is mounted askew (none on a fixed base, or where
    the foot is taken to be level).
    """

    def needed(moved: State) -> Array:
        root = standing_root(robot, feet[0], moved) if robot.base == "floating" else None
        _, torque = rooted_inverse_dynamics(rooted, moved.position, moved.velocity, moved.acceleration, root)
        return torque[:, joints]

    count = state.position.shape[1]
    columns = np.zeros((len(state.position), len(joints), count + 3))
    for k in range(count):
        columns[:, :, k] = _difference(needed, [_with_position(state, k, step) for step in (-TURN, TURN)])
    if state.orientation is not None:
        for axis in range(3):
            moved = [_with_turn(state, axis, step) for step in (-TURN, TURN)]
            columns[:, :, count + axis] = _difference(needed, moved)
    return columns


def _difference(needed: Callable[[State], Array], moved: list[State]) -> Array:
    return (needed(moved[0]) - needed(moved[1])) / (2 * TURN)


def _with_position(state: State, joint: int, step: float) -> State:
    position = state.position.copy()
    position[:, joint] += step
    return replace(state, position=position)


def _with_turn(state: State, axis: int, step: float) -> State:
    """Return the state with the root link turned about one of its own axes."""
    assert state.orientation is not None
    vector, scalar = state.orientation.quaternion[:, :3], state.orientation.quaternion[:, 3:]
    unit = np.eye(3)[axis]
    small = 0.5 * step
    turned = np.hstack([vector + small * (scalar * unit + np.cross(vector, unit)), scalar - small * vector[:, [axis]]])
    return replace(state, orientation=replace(state.orientation, quaternion=turned))

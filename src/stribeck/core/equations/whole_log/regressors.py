"""Regressors Y of the corrections (docs/estimator.md, "Corrections"; Atkeson, An and Hollerbach 1986).

All are taken at the windows' centers, from the smoothed motion: corrections are small, so this costs no accuracy.
"""

from functools import cache

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.dynamics.rooted import RootMotion, model_motion, workspace
from stribeck.core.dynamics.state import State
from stribeck.core.robot import Robot
from stribeck.core.robot.inertial_parameters import SIZE, carried
from stribeck.core.robot.rooting import BASE_FRAME, RootedModel


def inertia_regressors(
    robot: Robot, rooted: RootedModel, rows: IntArray, state: State, root: RootMotion | None
) -> Array:
    """Compute the derivatives of inverse dynamics by the bodies' inertial parameters, shape (K, rows, 10 bodies).

    Rows have the order of `inertia_matrix`: a floating root first, then the robot's joints.

    The bodies are the bodies of `robot.tree`; the parameters refer to the body's joint frame, whichever foot is the
    root. Rerooting changes the frame of some bodies, and their parameters change linearly with it.
    """
    (model, data), motion = workspace(rooted), (state.position, state.velocity, state.acceleration)
    places, moves = _bodies_in(rooted, robot.tree)
    blocks = (rooted.order[rows][:, None] * (model.njoints - 1) + places).ravel()
    slopes = np.empty((len(state.position), len(blocks), SIZE))
    for slope, *args in zip(slopes, *model_motion(rooted, *motion, root), strict=True):  # Pinocchio has no batched call
        regressor = pin.computeJointTorqueRegressor(model, data, *args)
        regressor.reshape(-1, SIZE).take(blocks, axis=0, out=slope, mode="clip")  # unlike "raise", without a copy
    slopes = slopes.reshape(len(slopes), len(rows), -1)
    for body, move in moves.items():
        block = slopes[:, :, SIZE * body : SIZE * (body + 1)]
        block[:] = block @ move
    return slopes


@cache
def _bodies_in(rooted: RootedModel, tree: RootedModel) -> tuple[IntArray, dict[int, Array]]:
    """Map the bodies of the robot's own tree to a rerooted tree, and transform their parameters.

    Only bodies between the two roots change their frame.
    """
    if rooted is tree:
        return np.arange(tree.model.njoints - 1), {}
    homes = [rooted.bodies[body] for body in range(1, tree.model.njoints)]
    moves = {k: carried(pose.homogeneous) for k, (_, pose) in enumerate(homes) if not pose.isIdentity()}
    return np.array([joint - 1 for joint, _ in homes]), moves


def zero_regressors(rooted: RootedModel, rows: IntArray, state: State, root: RootMotion | None) -> Array:
    """Compute minus the rows' derivatives by joint positions, then by the tilt, shape (K, rows, all joints + 3).

    These are the effects of encoder zeros and of the tilt of an IMU. Rows are counted as `inertia_matrix` orders them.

    The joints between a standing foot and the base turn gravity in the foot's frame, as the tilt does: with w the axis
    that a joint turns the base about and e the base's axes, both in the foot's frame, by w x g and -e x g. Contact
    forces, or a root in free fall, take up any other motion of the root.
    """
    (model, data), motion = workspace(rooted), (state.position, state.velocity, state.acceleration)
    size, order, count = rooted.root_size, rooted.order, state.position.shape[1]
    base = model.frames[model.getFrameId(BASE_FRAME)]
    joint, placement = int(base.parentJoint), base.placement.rotation
    slopes = np.empty((len(state.position), model.nv, model.nv))
    lift = np.zeros((len(slopes), model.nv, 3))
    axes = np.zeros((len(slopes), 3, model.nv + 3))
    for k, args in enumerate(zip(*model_motion(rooted, *motion, root), strict=True)):  # Pinocchio has no batched call
        slopes[k], _, inertia = pin.computeRNEADerivatives(model, data, *args)
        if size:
            lift[k], axes[k, :, :-3] = inertia[:, :3], data.J[3:]
            axes[k, :, -3:] = -data.oMi[joint].rotation @ placement
    columns = np.zeros((len(slopes), len(rows), count + 3))
    columns[:, :, :count] = -slopes[:, order[rows, None], order[size:]]
    if size and state.orientation is not None and root is not None:
        turned = [int(model.idx_vs[parent]) for parent in rooted.path_to_root(joint)]
        axes[:, :, np.setdiff1d(np.arange(model.nv), turned)] = 0.0
        used = axes[:, :, [*order[size:], -3, -2, -1]]
        columns += lift[:, order[rows]] @ np.cross(used, root.gravity[:, :, None], axis=1)
    return columns

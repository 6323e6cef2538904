"""Regressors Y of the corrections (docs/estimator.md, "Corrections"; Atkeson, An and Hollerbach 1986).

All are taken at the windows' centers, from the smoothed motion: corrections are small, so this costs no accuracy.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.dynamics.rooted import RootMotion, model_motion, workspace
from stribeck.dynamics.state import State
from stribeck.robot import Robot
from stribeck.robot.inertial_parameters import SIZE, carried
from stribeck.robot.rooting import BASE_FRAME, RootedModel
from stribeck.settings import Settings
from stribeck.whole_log.equations.contact_mode import ContactMode
from stribeck.whole_log.weak_equations import WRENCH_SIZE, CorrectionLayout


def find_corrections(
    robot: Robot,
    names: Sequence[str],
    settings: Settings,
    wrenches: int = 0,
    command_delays: Sequence[tuple[float, float]] = (),
) -> CorrectionLayout:
    """List what is corrected: nothing, inertias and the torques' delay, all sensors' calibration, rotor inertias.

    `names` are joints, then couplings; `wrenches` is the number of wrench sensors. The delays of commands, which come
    with their standard errors [s], are not corrected: they were found before, and only their errors matter.
    """
    asked = settings.fit_armature
    everywhere = asked is True or (asked == "auto" and robot.torque_source != "link_side_sensor")
    rotors = tuple(k for k, name in enumerate(names) if everywhere or (isinstance(asked, list) and name in asked))
    modelled = dict(zip(robot.joint_names, robot.armature.tolist(), strict=True))
    armature = np.array([modelled.get(names[k], 0.0) for k in rotors])
    own = dict(zip(robot.joint_names, command_delays, strict=False))
    late = tuple(own[name][1] for name in names if name in own)
    if settings.corrections == "none":
        return CorrectionLayout(rotors=rotors, armature=armature, command_delays=late)
    bodies, parameters = list(robot.tree.model.names)[1:], list(robot.tree.model.inertias)[1:]
    calibration = settings.corrections == "calibration"
    return CorrectionLayout(
        bodies=tuple(map(str, bodies)),
        inertial_parameters=np.stack([each.toDynamicParameters() for each in parameters]),
        gains=sum(name in robot.joint_names for name in names) if calibration else 0,
        zeros=len(robot.joint_names) if calibration else 0,
        tilts=3 if calibration else 0,
        delays=0 if late else 1 + (calibration and robot.base == "floating"),
        command_delays=late,
        wrenches=wrenches,
        rotors=rotors,
        armature=armature,
        payloads=tuple(payload.mass for payload in robot.payloads),
    )


def correction_regressors(
    layout: CorrectionLayout, mode: ContactMode, state: State, on_joints: Array, torques: Array, wrench: Array | None
) -> Array:
    """Compute the derivatives of the rows by all corrections, shape (K, rows, c), from smoothed signals.

    Parameters
    ----------
    layout
        The corrections.
    mode, state
        Contact mode, and motion at the windows' centers.
    on_joints
        Effect of the friction of joints and couplings on the joints, shape (n, n + couplings).
    torques
        Measured torques [N m] and their time derivatives [N m/s], shape (2, K, n).
    wrench
        Measured wrench on the standing foot [N], [N m], shape (K, 6); None if it is not used.
    """
    robot, turn, acting = mode.robot, state.orientation, mode.on_rows(on_joints)
    own = acting[:, : len(mode.joints)]
    found, root = [], mode.root(state)
    if layout.bodies and robot.loops:
        rows = np.arange(len(mode.rooted.order))
        found.append(mode.used(state.position, inertia_regressors(robot, mode.rooted, rows, state, root)))
    elif layout.bodies:
        found.append(inertia_regressors(robot, mode.rooted, mode.rows, state, root))
    if layout.gains:
        found += [torques[0, :, None] * own, zero_regressors(mode.rooted, mode.rows, state, root)]
    if layout.delays:
        found.append(-(own @ torques[1, :, :, None]))
    if layout.delays > 1:
        turning = np.zeros((len(state.position), 3)) if turn is None else turn.angular_velocity
        found.append(-(found[-2][:, :, -3:] @ turning[:, :, None]))
    if layout.command_delays:
        found.append(torques[1, :, None] * own)
    if layout.wrenches:
        sensors = np.zeros((len(state.position), len(acting), layout.wrenches, WRENCH_SIZE))
        if wrench is not None:
            sensors[:, :6, mode.sensor, :6], sensors[:, :6, mode.sensor, 6] = np.eye(6), wrench
        found.append(sensors.reshape(*sensors.shape[:2], -1))
    if rotors := list(layout.rotors):
        turned = state.acceleration[:, mode.joints] @ on_joints[:, rotors]
        found.append(turned[:, None] * acting[:, rotors])
    return np.concatenate(found, axis=2)


def payload_regressors(robot: Robot, regressors: Array, carried_now: Sequence[bool]) -> Array:
    """Select the derivatives by the payloads' parameters in their links' frames, zero of absent ones."""
    found = np.zeros((*regressors.shape[:2], len(robot.payloads), SIZE))
    for k, payload in enumerate(robot.payloads):
        frame = robot.tree.model.frames[robot.tree.model.getFrameId(payload.link)]
        if carried_now[k]:
            own = regressors[:, :, SIZE * (frame.parentJoint - 1) : SIZE * frame.parentJoint]
            found[:, :, k] = own @ carried(frame.placement.homogeneous)
    return found.reshape(*regressors.shape[:2], -1)


def inertia_regressors(
    robot: Robot, rooted: RootedModel, rows: NDArray[np.int64], state: State, root: RootMotion | None
) -> Array:
    """Compute the derivatives of inverse dynamics by the bodies' inertial parameters, shape (K, rows, 10 bodies).

    Rows have the order of `inertia_matrix`: a floating root first, then the robot's joints.

    The bodies are the bodies of `robot.tree`; the parameters refer to the body's joint frame, whichever foot is the
    root. Rerooting changes the frame of some bodies, and their parameters change linearly with it.
    """
    (model, data), motion = workspace(rooted), (state.position, state.velocity, state.acceleration)
    places, moves = _bodies_in(rooted, robot.tree)
    blocks = (rooted.order[rows][:, None] * (model.njoints - 1) + places).ravel()
    found = np.empty((len(state.position), len(blocks), SIZE))
    for own, *each in zip(found, *model_motion(rooted, *motion, root), strict=True):  # Pinocchio has no batched call
        regressor = pin.computeJointTorqueRegressor(model, data, *each)
        regressor.reshape(-1, SIZE).take(blocks, axis=0, out=own, mode="clip")  # unlike "raise", without a copy
    found = found.reshape(len(found), len(rows), -1)
    for body, move in moves.items():
        block = found[:, :, SIZE * body : SIZE * (body + 1)]
        block[:] = block @ move
    return found


@cache
def _bodies_in(rooted: RootedModel, tree: RootedModel) -> tuple[NDArray[np.int64], dict[int, Array]]:
    """Map the bodies of the robot's own tree to a rerooted tree, and transform their parameters.

    Only bodies between the two roots change their frame.
    """
    if rooted is tree:
        return np.arange(tree.model.njoints - 1), {}
    homes = [rooted.bodies[body] for body in range(1, tree.model.njoints)]
    moves = {k: carried(pose.homogeneous) for k, (_, pose) in enumerate(homes) if not pose.isIdentity()}
    return np.array([joint - 1 for joint, _ in homes]), moves


def zero_regressors(rooted: RootedModel, rows: NDArray[np.int64], state: State, root: RootMotion | None) -> Array:
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
    for k, each in enumerate(zip(*model_motion(rooted, *motion, root), strict=True)):  # Pinocchio has no batched call
        slopes[k], _, inertia = pin.computeRNEADerivatives(model, data, *each)
        if size:
            lift[k], axes[k, :, :-3] = inertia[:, :3], data.J[3:]
            axes[k, :, -3:] = -data.oMi[joint].rotation @ placement
    columns = np.zeros((len(slopes), len(rows), count + 3))
    columns[:, :, :count] = -slopes[:, order[rows, None], order[size:]]
    if size and state.orientation is not None and root is not None:
        turned = [int(model.idx_vs[each]) for each in rooted.path_to_root(joint)]
        axes[:, :, np.setdiff1d(np.arange(model.nv), turned)] = 0.0
        used = axes[:, :, [*order[size:], -3, -2, -1]]
        columns += lift[:, order[rows]] @ np.cross(used, root.gravity[:, :, None], axis=1)
    return columns

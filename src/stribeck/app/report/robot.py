"""Picture of the robot, and the friction that its model states."""

import numpy as np
import pinocchio as pin
from markupsafe import Markup

from stribeck.app.report.page import render
from stribeck.core.base.typing import Array
from stribeck.core.errors import RobotFileError
from stribeck.core.result import Result
from stribeck.core.result.reference import NO_REFERENCE, Reference
from stribeck.core.robot import Robot
from stribeck.design import read_friction


def robot_picture(robot: Robot, result: Result) -> Markup:
    """Draw the joints in the colors of their verdicts, in the middle of their positions in the log.

    An arm, which often moves about its stretched pose, is at three quarters. Joints without positions are at zero, or
    at the nearest limit.
    """
    model, data = robot.tree.model, robot.tree.model.createData()
    pose = np.clip(pin.neutral(model), model.lowerPositionLimit, model.upperPositionLimit)
    for name, joint in result.joints.items():
        if joint.position_range and model.existJointName(name):
            place = model.joints[model.getJointId(name)].idx_q
            pose[place] = np.quantile(joint.position_range, 0.5 if robot.tree.floating else 0.75)
    pin.forwardKinematics(model, data, pose)
    first = 2 if robot.tree.floating else 1
    reach = np.linalg.norm([placement.translation for placement in model.jointPlacements], axis=1).max()
    levers = np.array([2 * inertia.lever for inertia in model.inertias])
    levers *= np.minimum(1.0, reach / np.maximum(np.linalg.norm(levers, axis=1, keepdims=True), 1e-9))
    ends = [data.oMi[k].act(levers[k]) for k in range(first, model.njoints)]
    points = np.array([*(data.oMi[k].translation for k in range(model.njoints)), *ends])
    flat = _projected(points - points[1 if robot.tree.floating else 0], robot.up)
    size = float(np.ptp(flat, axis=0).max()) or 1.0
    flat = (100 / size * (flat - flat.min(axis=0))).round(1)
    lines = [(int(model.parents[k]), k) for k in range(first, model.njoints)]
    limbs = set(range(first, model.njoints)) - set(model.parents)
    lines += [(k, model.njoints + k - first) for k in limbs]
    places = {name: index for index, name in enumerate(result.joints)}
    joints = [(model.names[k], flat[k].tolist()) for k in range(first, model.njoints) if model.names[k] in places]
    segments = [(*flat[a].tolist(), *flat[b].tolist()) for a, b in lines]
    box = [-6, -6, *(flat.max(axis=0) + 12).tolist()]
    return render("robot.html.j2", box=box, lines=segments, drawn=joints, joints=result.joints, places=places)


def _projected(points: Array, up: Array) -> Array:
    """Project points of shape (N, 3) to the right and down as seen from the front and slightly above, shape (N, 2)."""
    ahead = np.eye(3)[0 if abs(up[0]) < 0.9 else 2]
    ahead = ahead - (ahead @ up) * up
    ahead /= np.linalg.norm(ahead)
    left = np.cross(up, ahead)
    cosine, sine = np.cos(0.6), np.sin(0.6)  # angle from the front to the robot's right side [rad], separates limbs
    right, away = cosine * left + sine * ahead, sine * left - cosine * ahead
    return np.column_stack([points @ right, -points @ (up + 0.3 * away)])


def stated_friction(robot: Robot | None, result: Result) -> Reference:
    """Read friction and rotor inertia that the robot's model states; empty without any, or without its file."""
    try:
        stated = read_friction(robot.model_file)[0] if robot else {}
    except (RobotFileError, ImportError):  # a Pinocchio model, a file that has gone, or an MJCF without MuJoCo
        return NO_REFERENCE
    if robot is None or not any(stated.values()):
        return NO_REFERENCE
    curves, parameters = {}, {}
    for name, joint in result.joints.items():
        if (friction := stated.get(name)) and joint.torque_unit is None and joint.parameters:
            velocity = np.linspace(*joint.velocity_range, 101)
            curves[name] = velocity, friction.coulomb * np.sign(velocity) + friction.viscous * velocity
            rotor = float(robot.armature[robot.joint_names.index(name)])
            parameters[name] = {"coulomb": friction.coulomb, "viscous": friction.viscous}
            parameters[name] |= {"armature": rotor} if rotor else {}
    return Reference(name="the model", curves=curves, parameters=parameters)

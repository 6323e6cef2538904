"""Re-root a kinematic tree of joints with one degree of freedom at another body.

A robot that stands on one foot is a fixed-base tree rooted at that foot. Joints between the old root and the foot are
traversed in reverse: with X the placement of a joint in its parent and S its axis, the pose of the parent in the child
is `(X exp(S q))^-1 = exp(-S q) X^-1`, the same joint about -S. Position, velocity and torque keep their signs.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.errors import RobotFileError

BASE_FRAME, WORLD_JOINT = "stribeck_base", "world_joint"
"""Names of the frame at the robot's own root link, and of the free flyer of an MJCF without a free joint."""


@dataclass(frozen=True, eq=False)
class Axis:
    """Axis of a revolute or prismatic joint in the joint's frame."""

    direction: Array  # unit vector, shape (3,)
    prismatic: bool


@dataclass(frozen=True, eq=False)
class RootedModel:
    """Tree of joints with one degree of freedom under a free or fixed root, and the robot columns of its joints.

    Attributes
    ----------
    model
        Pinocchio model. Its first joint is a free flyer at the root frame if `floating`; all others have one degree of
        freedom.
    columns
        Robot column of each joint, in the model's order, shape (n,).
    floating
        Whether the root is free: configuration and velocity then start with 7 and 6 root entries.
    axes
        Axis of each joint, in the model's order.
    bodies
        Bodies of the original tree: original joint -> joint in this model, and pose in the frame of that joint.
    """

    model: pin.Model
    columns: IntArray
    floating: bool
    axes: tuple[Axis, ...]
    bodies: dict[int, tuple[int, pin.SE3]]

    @property
    def root_size(self) -> int:
        """Number of velocity entries of the root, 6 or 0."""
        return 6 if self.floating else 0

    @property
    def order(self) -> IntArray:
        """Indices in the model's velocity of the root and of the joints in robot order, shape (r + n,)."""
        return np.concatenate([np.arange(self.root_size), self.root_size + np.argsort(self.columns)])

    def path_to_root(self, joint: int) -> list[int]:
        """List the joints with one degree of freedom from `joint` up to the root, nearest first."""
        path = []
        while joint > self.floating:
            path.append(joint)
            joint = int(self.model.parents[joint])
        return path

    def in_order(self, attribute: str) -> Array:
        """Sort an attribute of the model's joints in robot order, shape (n,)."""
        values = np.empty(len(self.columns))
        values[self.columns] = getattr(self.model, attribute)[-len(values) :]
        return values

    def axis(self, joint: int) -> Axis:
        """Return the axis of a joint of the model."""
        return self.axes[joint - 1 - self.floating]

    def column(self, joint: int) -> int:
        """Return the robot column of a joint of the model."""
        return int(self.columns[joint - 1 - self.floating])


def is_floating(model: pin.Model) -> bool:
    """Return whether the model's first joint is a free flyer."""
    return model.njoints > 1 and str(model.joints[1].shortname()) == "JointModelFreeFlyer"


def joint_axis(model: pin.Model, joint: int) -> Axis:
    """Find the axis of a joint with one degree of freedom.

    Raises
    ------
    RobotFileError
        If the joint has more degrees of freedom, is a screw, or has no direction.
    """
    joint_model = model.joints[joint]
    kind = joint_model.shortname()
    if joint_model.nv == 1:
        data = joint_model.createData()
        joint_model.calc(data, pin.neutral(model))
        subspace = np.asarray(data.S).reshape(6)
        if not 0 < np.abs(subspace).max() < np.inf:
            raise RobotFileError(
                f"joint '{model.names[joint]}' has no direction; expected an axis of three finite numbers, not all zero"
            )
        linear, angular = subspace[:3], subspace[3:]
        if not np.any(linear):
            return Axis(angular / np.linalg.norm(angular), prismatic=False)
        if not np.any(angular):
            return Axis(linear / np.linalg.norm(linear), prismatic=True)
    raise RobotFileError(
        f"joint '{model.names[joint]}' is a {kind.removeprefix('JointModel')}, which stribeck does not support; "
        "expected a revolute, continuous or prismatic joint, or lock it with [robot] locked"
    )


def is_on_axis(model: pin.Model, frame: pin.Frame) -> bool:
    """Return whether a frame's origin is within a millimeter of the axis of the joint that moves it."""
    joint, place = int(frame.parentJoint), frame.placement.translation
    return joint > 1 and bool(np.linalg.norm(np.cross(place, joint_axis(model, joint).direction)) < 1e-3)


def root_at(model: pin.Model, frame_name: str | None = None) -> RootedModel:
    """Root the tree of `model` at a frame, or keep its root; all joints become plain revolute or prismatic ones.

    Parameters
    ----------
    model
        Fixed or floating model; joints other than a free flyer have one degree of freedom.
    frame_name
        Frame of a floating model. Its body becomes the root, and the root's coordinates become the frame's.

    Raises
    ------
    RobotFileError
        If a joint has more than one degree of freedom.
    """
    floating = is_floating(model)
    base = 1 if floating else 0
    root_body, in_root = base, pin.SE3.Identity()
    if frame_name is not None:
        frame = model.frames[model.getFrameId(frame_name)]
        root_body, in_root = int(frame.parentJoint), frame.placement.inverse()

    rooted = pin.Model()
    rooted.name = model.name
    rooted.gravity = model.gravity
    new_root = rooted.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root_joint") if floating else 0
    placed = {root_body: (new_root, in_root)}  # old body -> new joint, pose in its frame
    columns, axes = [], []

    # Depth first: Pinocchio's recursions require that the joints of a subtree are consecutive.
    pending = _list_edges(model, root_body, base)
    while pending:
        body, joint = pending.pop()
        child = joint if joint != body else int(model.parents[joint])
        if child in placed:
            continue
        parent, pose = placed[body]
        axis = joint_axis(model, joint)
        forward = child == joint
        placement = pose * model.jointPlacements[joint] if forward else pose
        direction = axis.direction if forward else -axis.direction
        kind = pin.JointModelPrismaticUnaligned if axis.prismatic else pin.JointModelRevoluteUnaligned
        new = rooted.addJoint(parent, kind(direction), placement, model.names[joint])
        placed[child] = (new, pin.SE3.Identity() if forward else model.jointPlacements[joint].inverse())
        columns.append(joint - base - 1)
        axes.append(Axis(direction, axis.prismatic))
        pending += _list_edges(model, child, base)

    _move_bodies(model, rooted, placed, base)
    _move_limits(model, rooted, columns, base)
    return RootedModel(rooted, np.array(columns, dtype=np.int64), floating, tuple(axes), placed)


def _move_limits(model: pin.Model, rooted: pin.Model, columns: list[int], base: int) -> None:
    """Copy armature, limits and ranges of the old joints, in the order of the new joints."""
    root = rooted.nv - len(columns)
    of_joints = {name: np.asarray(getattr(model, name))[root:] for name in ("armature", "effortLimit", "velocityLimit")}
    ranges = [position_range(model, base + 1 + column) for column in range(len(columns))]
    of_joints["lowerPositionLimit"], of_joints["upperPositionLimit"] = np.reshape(ranges, (-1, 2)).T
    for name, source in of_joints.items():
        values = np.array(getattr(rooted, name))
        values[len(values) - len(columns) :] = source[columns]
        setattr(rooted, name, values)


def _move_bodies(model: pin.Model, rooted: pin.Model, placed: dict[int, tuple[int, pin.SE3]], base: int) -> None:
    """Move bodies and frames from the old joints to the new ones; `placed` maps each old body to its new place."""
    for body, (joint, pose) in placed.items():
        rooted.appendBodyToJoint(joint, model.inertias[body], pose)
    for frame in model.frames[1:]:
        if int(frame.parentJoint) not in placed:  # of the ground, above a free joint
            continue
        joint, pose = placed[int(frame.parentJoint)]
        if frame.type != pin.FrameType.JOINT:
            rooted.addFrame(pin.Frame(frame.name, joint, 0, pose * frame.placement, frame.type), False)
    if not rooted.existFrame(BASE_FRAME):
        joint, pose = placed[base]
        rooted.addFrame(pin.Frame(BASE_FRAME, joint, 0, pose, pin.FrameType.OP_FRAME), False)


def position_range(model: pin.Model, joint: int) -> tuple[float, float]:
    """Return the lowest and highest position of a joint [rad or m]; infinite for a continuous joint."""
    joint_model = model.joints[joint]
    if joint_model.nq != 1:  # stored as cosine and sine
        return -np.inf, np.inf
    return float(model.lowerPositionLimit[joint_model.idx_q]), float(model.upperPositionLimit[joint_model.idx_q])


def _list_edges(model: pin.Model, body: int, base: int) -> list[tuple[int, int]]:
    """List (body, joint) for the joints between a body and its neighbors, last joint first."""
    joints = (joint for joint in range(base + 1, model.njoints) if body in (joint, int(model.parents[joint])))
    return [(body, joint) for joint in reversed(list(joints))]

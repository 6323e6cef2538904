"""Picture of a simulated walk, from its log and the true path of its base: footprints, center of mass and poses."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.core.robot.kinematics import frame_pose
from stribeck.simulation.robots.sole import Sole

NO_SOLE = Sole.model_construct(half_length=0.0, half_width=0.0)  # a point
"""Sole of a point foot."""


@dataclass(frozen=True, kw_only=True)
class Footprint:
    """Place where a foot stood.

    Attributes
    ----------
    foot
        Name of the contact.
    place
        Middle of the sole in the world [m].
    yaw
        Heading of the foot in the world [rad].
    size
        Length and width of the sole [m]; zeros for a point.
    time
        Time of the touchdown [s].
    """

    foot: str
    place: tuple[float, float]
    yaw: float
    size: tuple[float, float]
    time: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Pose:
    """The robot at one time.

    Attributes
    ----------
    time
        Time of the pose [s].
    segments
        Start and end of each line of the stick figure in the world [m], shape (S, 2, 3).
    configuration
        Position and quaternion xyzw of the root link, then the tree's joints, shape (7 + n,).
    """

    time: float
    segments: Array
    configuration: Array

    @property
    def yaw(self) -> float:
        """Heading of the robot [rad]."""
        turn = Rotation.from_quat(self.configuration[3:7]).as_matrix()
        return float(np.arctan2(turn[1, 0], turn[0, 0]))


@dataclass(frozen=True, eq=False, kw_only=True)
class WalkPicture:
    """Everything that a report draws of a walk.

    Attributes
    ----------
    footprints
        Footprints in the order of the touchdowns.
    com_time, com
        Time [s], shape (N,), and center of mass seen from above [m], shape (N, 2).
    poses
        Poses of one stride.
    segment_names
        Joint or contact to which each line of the stick figure leads, S of them.
    """

    footprints: tuple[Footprint, ...]
    com_time: Array
    com: Array
    poses: tuple[Pose, ...]
    segment_names: tuple[str, ...]


def walk_picture(robot: Robot, log: RobotLog, base_position: Array, soles: Mapping[str, Sole]) -> WalkPicture:
    """Compute the picture of a walk.

    Parameters
    ----------
    robot
        Robot with a floating base.
    log
        Log without noise, with base orientation and contacts.
    base_position
        Position of the root link in the world [m], shape (T, 3).
    soles
        Soles by contact; other contacts are drawn as points.

    Raises
    ------
    SettingsError
        If the robot's base is fixed, or the log has no base orientation or contact.
    """
    if robot.base == "fixed" or log.base_orientation is None or log.contact is None:
        raise SettingsError(
            f"{robot.name}: a walk cannot be drawn; expected a floating base, base_orientation and contact"
        )
    phases = stances(log.time, log.contact)
    model, data = robot.tree.model, robot.tree.model.createData()
    configurations = _configurations(robot, log, base_position)
    poses, names = [], ()
    for row in _pose_rows(phases, base_position):
        pin.forwardKinematics(model, data, configurations[row])
        names, segments = zip(*stick_figure(robot, data, soles), strict=True)
        poses.append(Pose(time=float(log.time[row]), segments=np.array(segments), configuration=configurations[row]))
    footprints = []
    for start, end, foot in phases:  # half way through a stance, where the foot rests
        pin.framesForwardKinematics(model, data, configurations[(start + end) // 2])
        name = log.foot_names[foot]
        pose, sole = data.oMf[model.getFrameId(robot.contacts[name].frame)], soles.get(name, NO_SOLE)
        x, y, _ = pose.act(np.array(sole.centre)).tolist()
        footprints.append(
            Footprint(
                foot=name,
                place=(x, y),
                yaw=float(np.arctan2(pose.rotation[1, 0], pose.rotation[0, 0])),
                size=(2 * sole.half_length, 2 * sole.half_width),
                time=float(log.time[start]),
            )
        )
    points = min(2000, round((log.time[-1] - log.time[0]) / 0.02) + 2, len(log.time))  # one per 20 ms
    rows = np.unique(np.linspace(0, len(log.time) - 1, points).round().astype(np.int64))
    return WalkPicture(
        footprints=tuple(footprints),
        com_time=log.time[rows],
        com=np.array([pin.centerOfMass(model, data, configurations[row])[:2] for row in rows]),
        poses=tuple(poses),
        segment_names=names,
    )


def stances(time: Array, contact: NDArray[np.bool_]) -> list[tuple[int, int, int]]:
    """Find the first and last sample and the foot of each stance, in the order of the touchdowns.

    `contact` has shape (T, feet).

    A contact of less than 50 ms does not count as a stance, and an interruption of less than 100 ms as a swing.
    """
    phases = []
    for foot, flags in enumerate(contact.T):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
        spans = edges.reshape(-1, 2) - [0, 1]
        spans = spans[time[spans[:, 1]] - time[spans[:, 0]] >= 0.05]
        lifted = np.flatnonzero(time[spans[1:, 0]] - time[spans[:-1, 1]] >= 0.1) + 1
        phases += [(int(run[0, 0]), int(run[-1, 1]), foot) for run in np.split(spans, lifted) if len(run)]
    return sorted(phases)


def _pose_rows(phases: list[tuple[int, int, int]], base_position: Array) -> NDArray[np.int64]:
    """Select rows of the longest stride (within 0.1 m) that is nearest to the middle, between touchdowns of a foot.

    If the robot only stands, the poses cover the entire time.
    """
    middle = len(base_position) // 2
    touchdowns = [(start, foot) for start, _, foot in phases if start > 0]
    strides = [
        (start, next_start)
        for k, (start, foot) in enumerate(touchdowns)
        if (next_start := next((later for later, other in touchdowns[k + 1 :] if other == foot), None)) is not None
    ]

    def rank(stride: tuple[int, int]) -> tuple[int, float]:
        way = np.linalg.norm(base_position[stride[1], :2] - base_position[stride[0], :2])
        return -round(float(way) / 0.1), abs(sum(stride) / 2 - middle)

    start, end = min(strides, key=rank, default=(0, len(base_position) - 1))
    poses = 8  # in the strip, over one stride
    return np.linspace(start, end, poses).round().astype(np.int64)


def _configurations(robot: Robot, log: RobotLog, base_position: Array) -> Array:
    """Compute configurations of the tree, shape (T, 7 + n); the log's orientation may refer to another frame."""
    assert log.base_orientation is not None
    in_root, _ = frame_pose(robot.tree, robot.tree.model.getFrameId(robot.base_frame), log.position)
    rotation = Rotation.from_quat(log.base_orientation) * Rotation.from_matrix(in_root).inv()
    return np.hstack([base_position, rotation.as_quat(), log.position[:, robot.tree.columns]])


def stick_figure(robot: Robot, data: pin.Data, soles: Mapping[str, Sole]) -> Iterator[tuple[str, Array]]:
    """Yield the lines of a robot after `pin.forwardKinematics`: joint or contact, start and end [m], shape (2, 3).

    Lines connect joints, lead to the ends of limbs (the center of mass of the last body), and surround soles. Lines
    shorter than 1 mm are omitted.
    """
    model, origin = robot.tree.model, np.zeros(3)
    lines: list[tuple[str, int, Array, Array]] = []
    standing = set()
    for name, contact in robot.contacts.items():
        frame = model.frames[model.getFrameId(contact.frame)]
        standing.add(joint := int(frame.parentJoint))
        sole = soles.get(name, NO_SOLE)
        ahead = np.array([sole.half_length, 0.0, 0.0])
        heel, toe = (frame.placement.act(np.array(sole.centre) + way) for way in (-ahead, ahead))
        lines += [(name, joint, *ends) for ends in ((origin, heel), (heel, toe), (toe, origin))]
    for joint in range(2 if robot.tree.floating else 1, model.njoints):
        placement = model.jointPlacements[joint]  # without the travel of a sliding joint: lines keep their lengths
        lines.append((model.names[joint], int(model.parents[joint]), origin, placement.translation))
        if joint not in standing and joint not in set(model.parents):
            lines.append((model.names[joint], joint, origin, 2 * model.inertias[joint].lever))
    for name, joint, start, end in lines:
        if np.linalg.norm(end - start) > 1e-3:
            yield name, np.array([data.oMi[joint].act(start), data.oMi[joint].act(end)])

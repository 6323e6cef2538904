"""What is drawn of a simulated walk, from its log and the true way of its base."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from stribeck.errors import SettingsError
from stribeck.log import RobotLog
from stribeck.robot import Robot
from stribeck.robot.kinematics import frame_pose
from stribeck.typing import Array
from stribeck_simulation.pictures.render import render_poses
from stribeck_simulation.pictures.stick_figure import NO_SOLE, StickFigure, stick_figure
from stribeck_simulation.pictures.walk import Footprint, Picture, Pose, WalkPicture
from stribeck_simulation.robots.sole import Sole

POSES = 8
"""In the strip: those of one stride."""
SAME_STRIDE = 0.1
"""Strides that differ by less are of one length [m]."""
COM_PERIOD = 0.02
"""Time between two points of the way of the centre of mass [s]."""
MOST_COM_POINTS = 2000
SHORTEST_STANCE = 0.05
"""A foot that stands for less time has only touched the ground [s]."""
SHORTEST_SWING = 0.1
"""A foot that is in the air for less time has only bounced [s]."""

Stance = tuple[int, int, int]
"""First and last sample, and number of the foot."""


def walk_picture(
    robot: Robot, log: RobotLog, base_position: Array, soles: Mapping[str, Sole], *, rendered: bool = False
) -> WalkPicture:
    """Return what a report draws of a walk.

    Parameters
    ----------
    robot
        With a floating base.
    log
        With base orientation and contact, without noise; see `RobotLog`.
    base_position
        Of the root link in the world [m], shape (T, 3).
    soles
        By contact; the other contacts are drawn as points.
    rendered
        Let MuJoCo draw the poses where it can draw without a screen; see `render_poses`.

    Raises
    ------
    SettingsError
        If the robot's base is fixed, or the log has no base orientation or contact.
    """
    if robot.base == "fixed" or log.base_orientation is None or log.contact is None:
        raise SettingsError(
            f"{robot.name}: a walk cannot be drawn; expected a floating base, base_orientation and contact"
        )
    found = stances(log.time, log.contact)
    pose_rows, com_rows = _pose_rows(found, base_position), _com_rows(log.time)
    figure = stick_figure(robot, soles)
    poses = _poses(robot, figure, log.time[pose_rows], _configurations(robot, log, base_position, pose_rows), rendered)
    model, data = robot.tree.model, robot.tree.model.createData()
    # Pinocchio has no batched centre of mass; there are at most MOST_COM_POINTS.
    ways = _configurations(robot, log, base_position, com_rows)
    com = np.array([pin.centerOfMass(model, data, configuration)[:2] for configuration in ways])
    return WalkPicture(
        footprints=tuple(_footprints(robot, log, base_position, found, soles)),
        com_time=log.time[com_rows],
        com=com,
        poses=tuple(poses),
        segment_names=figure.names,
    )


def _poses(robot: Robot, figure: StickFigure, time: Array, configurations: Array, rendered: bool) -> Iterator[Pose]:
    turn = Rotation.from_quat(configurations[:, 3:7]).as_matrix()
    yaw = np.arctan2(turn[:, 1, 0], turn[:, 0, 0])
    drawn = render_poses(robot, configurations, yaw) if rendered else None
    pictures: Sequence[Picture | None] = drawn or [None] * len(time)
    model, data = robot.tree.model, robot.tree.model.createData()
    for k, configuration in enumerate(configurations):
        pin.forwardKinematics(model, data, configuration)
        yield Pose(
            time=float(time[k]),
            segments=figure.at(data),
            place=(float(configuration[0]), float(configuration[1])),
            yaw=float(yaw[k]),
            picture=pictures[k],
        )


def stances(time: Array, contact: NDArray[np.bool_]) -> list[Stance]:
    """Return when which foot stood, from contact flags of shape (T, feet), in the order of the touchdowns."""
    found = []
    for foot, flags in enumerate(contact.T):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
        spans = edges.reshape(-1, 2) - [0, 1]
        spans = spans[time[spans[:, 1]] - time[spans[:, 0]] >= SHORTEST_STANCE]
        lifted = np.flatnonzero(time[spans[1:, 0]] - time[spans[:-1, 1]] >= SHORTEST_SWING) + 1
        found += [(int(run[0, 0]), int(run[-1, 1]), foot) for run in np.split(spans, lifted) if len(run)]
    return sorted(found)


def _pose_rows(found: list[Stance], base_position: Array) -> NDArray[np.int64]:
    """Return rows of one stride, from a foot's touchdown to its next: of the longest ones that in the middle.

    Of all the time, if the robot stands.
    """
    middle = len(base_position) // 2
    touchdowns = [(start, foot) for start, _, foot in found if start > 0]
    strides = [
        (start, next_start)
        for k, (start, foot) in enumerate(touchdowns)
        if (next_start := next((later for later, other in touchdowns[k + 1 :] if other == foot), None)) is not None
    ]

    def rank(stride: tuple[int, int]) -> tuple[int, float]:
        way = np.linalg.norm(base_position[stride[1], :2] - base_position[stride[0], :2])
        return -round(float(way) / SAME_STRIDE), abs(sum(stride) / 2 - middle)

    start, end = min(strides, key=rank, default=(0, len(base_position) - 1))
    return np.linspace(start, end, POSES).round().astype(np.int64)


def _com_rows(time: Array) -> NDArray[np.int64]:
    points = min(MOST_COM_POINTS, round((time[-1] - time[0]) / COM_PERIOD) + 2, len(time))
    return np.unique(np.linspace(0, len(time) - 1, points).round().astype(np.int64))


def _root_poses(robot: Robot, log: RobotLog, base_position: Array, rows: NDArray[np.int64]) -> tuple[Rotation, Array]:
    """Return orientation and position of the root link at these rows; the log's orientation may be another frame's."""
    assert log.base_orientation is not None
    frame = robot.tree.model.getFrameId(robot.base_frame)
    in_root, _ = frame_pose(robot.tree, frame, log.position[rows])
    return Rotation.from_quat(log.base_orientation[rows]) * Rotation.from_matrix(in_root).inv(), base_position[rows]


def _configurations(robot: Robot, log: RobotLog, base_position: Array, rows: NDArray[np.int64]) -> Array:
    """Return configurations of the tree at these rows, shape (rows, 7 + n)."""
    rotation, place = _root_poses(robot, log, base_position, rows)
    return np.hstack([place, rotation.as_quat(), log.position[rows][:, robot.tree.columns]])


def _footprints(
    robot: Robot, log: RobotLog, base_position: Array, found: list[Stance], soles: Mapping[str, Sole]
) -> Iterator[Footprint]:
    """Yield the feet's places half way through each stance, where they rest."""
    rows = np.array([(start + end) // 2 for start, end, _ in found], dtype=np.int64)
    base_turn, base_place = _root_poses(robot, log, base_position, rows)
    for k, (start, _, foot) in enumerate(found):
        name = log.foot_names[foot]
        rotation, translation = robot.foot_pose(name, log.position[rows[k : k + 1]])
        turn = base_turn[k].as_matrix() @ rotation[0]
        sole = soles.get(name, NO_SOLE)
        place = base_place[k] + base_turn[k].apply(translation[0]) + turn @ sole.centre
        yield Footprint(
            foot=name,
            place=(float(place[0]), float(place[1])),
            yaw=float(np.arctan2(turn[1, 0], turn[0, 0])),
            size=(2 * sole.half_length, 2 * sole.half_width),
            time=float(log.time[start]),
        )

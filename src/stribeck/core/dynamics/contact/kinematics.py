"""Standing feet from kinematics: standing feet neither rise above the others nor move relative to them."""

from itertools import combinations, permutations

import numpy as np
import scipy  # its ndimage is slow to import: loaded at its first use

from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.dynamics.contact.phases import Segments, Standing, switch, up_in_base
from stribeck.core.dynamics.state import root_quaternions
from stribeck.core.errors import LogError
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot


def standing_from_kinematics(log: RobotLog, robot: Robot, segments: Segments) -> Standing:
    """Find standing feet, and point feet that may touch the ground without standing, from their motion.

    A foot is in the air while it is clearly higher than the lowest foot. Its swing extends before and after that time,
    as long as the foot moves relative to the feet that are not in the air. If two swings overlap and no foot would
    stand, the time between them is divided in the middle. Point feet slip and sink in while their load builds up: a low
    one that swings may touch. The method assumes level ground and at least one standing foot; stairs, slopes without
    IMU and flight require contact flags or foot forces.

    Raises
    ------
    LogError
        If some feet are points and the log has no base orientation: a few degrees of tilt look like a lifted foot.
    """
    # Foot speed [m/s] below which a foot stands, regardless of the others.
    slowest = 0.02
    feet = tuple(robot.contacts)
    points = [foot for foot in feet if robot.contacts[foot].kind == "point"]
    if points and log.base_orientation is None:
        raise LogError(
            f"{log.path or 'log'}: joint positions do not show whether point feet such as '{points[0]}' stand; "
            "expected a channel contact, foot_wrench or base_orientation"
        )
    standing, airborne = np.ones((2, len(log.time), len(feet)), dtype=bool)
    height, speed = np.zeros((2, len(log.time), len(feet)))
    placed = [(segment, *_place_feet(log.take(segment), robot)) for segment in segments]
    for segment, places, levels, up in placed:
        height[segment] = _compute_heights(places, levels, up)
    rows = np.concatenate([np.r_[segment] for segment in segments])
    # a quarter of the highest lift [m]: play, tilt and uneven ground reach 5 mm; above 20 mm, low steps are missed
    lift = float(np.clip(0.25 * height[rows].max(), 0.005, 0.02))
    for segment, places, levels, _ in placed:
        airborne[segment] = switch(height[segment], lift, lift / 2)
        speed[segment] = _compute_speeds(log.time[segment], places, levels, ~airborne[segment])
    in_air = speed[rows][airborne[rows]]
    threshold = max(slowest, 0.1 * float(np.median(in_air))) if len(in_air) else slowest
    for segment in segments:
        standing[segment] = ~_find_swings(airborne[segment], switch(speed[segment], threshold, threshold / 2))
    touching = ~standing & (height < lift) & [foot in points for foot in feet]
    note = (
        "The log has neither contact flags nor foot forces; by kinematics, feet stand if lifted by less "
        f"than {1000 * lift:.0f} mm and slower than {threshold:.2g} m/s relative to the others, on level ground; "
        "flight is not detected."
    )
    return standing, touching, [note]


def share_at_rest(log: RobotLog, robot: Robot, segments: Segments) -> float | None:
    """Compute how much less the stillest foot moves than its leg [1]: 1 for a foot at rest, 0 for a hung robot.

    A standing sole does not turn, and two standing points keep their distance. Median over time; None if the base
    orientation is missing, the legs hardly move, or wheels turn. In a log of less than 0.15 s feet count as at rest.
    """
    from scipy.spatial.transform import Rotation

    kinds = [contact.kind for contact in robot.contacts.values()]
    if log.base_orientation is None or "wheel" in kinds:
        return None
    if len(log.time) < 2:
        return 1.0
    step = max(1, round(0.05 / float(np.median(np.diff(log.time)))))  # velocities over 50 ms
    rows = np.concatenate([np.arange(segment.start, segment.stop, step) for segment in segments])
    if len(rows) < 3:
        return 1.0
    legs = log.position[rows][:, robot.standing(tuple(robot.contacts))]
    part = log.take(rows)
    turn = Rotation.from_quat(root_quaternions(robot, part.position, part.base_orientation))  # type: ignore[arg-type]
    poses = [robot.foot_pose(foot, part.position) for foot in robot.contacts]
    duration = np.diff(part.time)
    moving = np.abs(np.diff(legs, axis=0)).max(axis=1, initial=0.0) / duration
    rates = []  # of soles [rad/s], and of points divided by the length of their legs [1/s]
    for rotation, _ in (pose for kind, pose in zip(kinds, poses, strict=True) if kind == "surface"):
        orientation = turn * Rotation.from_matrix(rotation)
        rates.append((orientation[:-1].inv() * orientation[1:]).magnitude() / duration)
    points = [place for kind, (_, place) in zip(kinds, poses, strict=True) if kind != "surface"]
    for point, other in combinations(points, 2):
        between = np.diff(turn.apply(point - other), axis=0)
        rates.append(np.linalg.norm(between, axis=1) / np.linalg.norm(point, axis=1)[1:] / duration)
    if not rates or np.median(moving) < 0.05:  # [rad/s]
        return None
    return 1 - float(np.clip(np.median(np.min(rates, axis=0)) / np.median(moving), 0, 1))


def _compute_heights(points: Array, levels: list[Array], up: Array) -> Array:
    """Compute heights above the lowest foot [m], shape (T, feet), in the level frame of the lowest foot."""
    lowest = np.argmin(np.einsum("tfi,ti->tf", points, up), axis=1)
    up = np.stack([level[:, 2] for level in levels], axis=1)[np.arange(len(lowest)), lowest]
    heights = np.asarray(np.einsum("tfi,ti->tf", points, up))
    return np.asarray(heights - np.min(heights, axis=1, keepdims=True))


def _compute_speeds(time: Array, points: Array, levels: list[Array], ground: BoolArray) -> Array:
    """Compute each foot's mean speed relative to the other feet on the ground [m/s], shape (T, feet)."""
    speeds, seen_from = np.zeros(ground.shape), np.zeros(ground.shape)
    if len(time) < 2:
        return speeds
    width = max(1, round(0.02 / float(np.median(np.diff(time)))))  # speeds are averaged over 20 ms
    for foot, other in permutations(range(ground.shape[1]), 2):
        offset = np.einsum("tij,tj->ti", levels[other], points[:, foot] - points[:, other])
        rates = np.gradient(offset, time, axis=0)
        velocity = scipy.ndimage.uniform_filter1d(rates, width, axis=0, mode="nearest")
        speeds[:, foot] += np.linalg.norm(velocity, axis=1) * ground[:, other]
        seen_from[:, foot] += ground[:, other]
    return speeds / np.maximum(seen_from, 1)


def _place_feet(log: RobotLog, robot: Robot) -> tuple[Array, list[Array], Array]:
    """Compute each foot's position relative to the base, (T, feet, 3), and the rotation to its level frame, (T, 3, 3).

    The level frame of a foot does not rotate while the foot stands. The IMU gives the rotation of the base. Without it,
    a standing sole does, because it is level and does not move. The third result is a first guess of the upward
    direction in base coordinates, (T, 3).
    """
    from scipy.spatial.transform import Rotation

    poses = [robot.foot_pose(foot, log.position) for foot in robot.contacts]
    if log.base_orientation is not None:
        turn = Rotation.from_quat(root_quaternions(robot, log.position, log.base_orientation)).as_matrix()
        levels = [np.asarray(turn)] * len(poses)
    else:
        levels = [rotation.transpose(0, 2, 1) for rotation, _ in poses]
    return np.stack([translation for _, translation in poses], axis=1), levels, up_in_base(log, robot)


def _find_swings(airborne: BoolArray, moving: BoolArray) -> BoolArray:
    """Find the feet that swing, shape (T, feet): in the air, or moving just before or after that."""
    swinging = np.empty_like(airborne)
    distance = np.full(airborne.shape, np.inf)
    for foot in range(airborne.shape[1]):
        wide = airborne[:, foot] | moving[:, foot]
        run = np.cumsum(np.diff(wide, prepend=False))
        swinging[:, foot] = wide & np.isin(run, run[airborne[:, foot]])
        if airborne[:, foot].any():
            distance[:, foot] = scipy.ndimage.distance_transform_edt(~airborne[:, foot])
    nowhere_to_stand = swinging.all(axis=1)
    middle = 0.5 * (distance.min(axis=1) + distance.max(axis=1))
    # The feet whose time in the air is farther away stand.
    swinging[nowhere_to_stand] = (distance < middle[:, None])[nowhere_to_stand]
    return swinging

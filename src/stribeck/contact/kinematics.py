"""Standing feet from kinematics: standing feet neither rise above the others nor move relative to them."""

from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np
import scipy  # its ndimage is slow to import: loaded at its first use
from scipy.spatial.transform import Rotation

from stribeck.base.typing import Array, BoolArray
from stribeck.contact.phases import switch, up_in_base
from stribeck.dynamics.state import root_quaternions
from stribeck.errors import LogError
from stribeck.log import RobotLog
from stribeck.robot import Robot

SLOWEST = 0.02
"""Foot speed [m/s] below which a foot stands, regardless of the others."""


def standing_from_kinematics(
    log: RobotLog, robot: Robot, feet: tuple[str, ...], segments: tuple[slice, ...]
) -> tuple[BoolArray, BoolArray, list[str]]:
    """Find standing feet, and point feet that may touch the ground without standing, shape (T, feet) each, and notes.

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
    points = [foot for foot in feet if robot.contacts[foot].kind == "point"]
    if points and log.base_orientation is None:
        raise LogError(
            f"{log.path or 'log'}: joint positions do not show whether point feet such as '{points[0]}' stand; "
            "expected a channel contact, foot_wrench or base_orientation"
        )
    standing, airborne = np.ones((2, len(log.time), len(feet)), dtype=bool)
    height, speed = np.zeros((2, len(log.time), len(feet)))
    placed = {(segment.start, segment.stop): _place_feet(log.take(segment), robot, feet) for segment in segments}
    for (start, stop), foot_places in placed.items():
        height[start:stop] = foot_places.compute_heights()
    rows = np.concatenate([np.r_[segment] for segment in segments])
    # a quarter of the highest lift [m]: play, tilt and uneven ground reach 5 mm; above 20 mm, low steps are missed
    lift = float(np.clip(0.25 * height[rows].max(), 0.005, 0.02))
    for (start, stop), foot_places in placed.items():
        airborne[start:stop] = switch(height[start:stop], lift, lift / 2)
        speed[start:stop] = foot_places.compute_speeds(~airborne[start:stop])
    in_air = speed[rows][airborne[rows]]
    threshold = max(SLOWEST, 0.1 * float(np.median(in_air))) if len(in_air) else SLOWEST
    for segment in segments:
        standing[segment] = ~_find_swings(airborne[segment], switch(speed[segment], threshold, threshold / 2))
    touching = ~standing & (height < lift) & [foot in points for foot in feet]
    note = (
        "The log has neither contact flags nor foot forces; by kinematics, feet stand if lifted by less "
        f"than {1000 * lift:.0f} mm and slower than {threshold:.2g} m/s relative to the others, on level ground; "
        "flight is not detected."
    )
    return standing, touching, [note]


def share_at_rest(log: RobotLog, robot: Robot, feet: tuple[str, ...], segments: tuple[slice, ...]) -> float | None:
    """Compute how much less the stillest foot moves than its leg [1]: 1 for a foot at rest, 0 for a hung robot.

    A standing sole does not turn, and two standing points keep their distance. Median over time; None if the base
    orientation is missing, the legs hardly move, or wheels turn. In a log of less than 0.15 s feet count as at rest.
    """
    if log.base_orientation is None or "wheel" in {robot.contacts[foot].kind for foot in feet}:
        return None
    if len(log.time) < 2:
        return 1.0
    step = max(1, round(0.05 / float(np.median(np.diff(log.time)))))  # velocities over 50 ms
    rows = np.concatenate([np.arange(segment.start, segment.stop, step) for segment in segments])
    if len(rows) < 3:
        return 1.0
    legs = log.position[rows][:, robot.standing(feet)]
    part = log.take(rows)
    turn = Rotation.from_quat(root_quaternions(robot, part.position, part.base_orientation))  # type: ignore[arg-type]
    poses = [robot.foot_pose(foot, part.position) for foot in feet]
    duration = np.diff(part.time)
    moving = np.abs(np.diff(legs, axis=0)).max(axis=1, initial=0.0) / duration
    rates = []  # of soles [rad/s], and of points divided by the length of their legs [1/s]
    for rotation, _ in (pose for foot, pose in zip(feet, poses, strict=True) if robot.contacts[foot].kind == "surface"):
        own = turn * Rotation.from_matrix(rotation)
        rates.append((own[:-1].inv() * own[1:]).magnitude() / duration)
    points = [place for foot, (_, place) in zip(feet, poses, strict=True) if robot.contacts[foot].kind != "surface"]
    for one, other in combinations(points, 2):
        between = np.diff(turn.apply(one - other), axis=0)
        rates.append(np.linalg.norm(between, axis=1) / np.linalg.norm(one, axis=1)[1:] / duration)
    if not rates or np.median(moving) < 0.05:  # [rad/s]
        return None
    return 1 - float(np.clip(np.median(np.min(rates, axis=0)) / np.median(moving), 0, 1))


@dataclass(frozen=True, eq=False)
class _FootPlaces:
    """Feet of a segment: positions relative to the base, and for each foot the rotation from the base to a level frame.

    The level frame of a foot does not rotate while the foot stands.
    """

    time: Array  # [s], (T,)
    points: Array  # [m], (T, feet, 3)
    levels: list[Array]  # one per foot, (T, 3, 3)
    up: Array  # first guess, in base coordinates, (T, 3)

    def compute_heights(self) -> Array:
        """Compute heights above the lowest foot [m], shape (T, feet), in the level frame of the lowest foot."""
        lowest = np.argmin(np.einsum("tfi,ti->tf", self.points, self.up), axis=1)
        up = np.stack([level[:, 2] for level in self.levels], axis=1)[np.arange(len(lowest)), lowest]
        heights = np.asarray(np.einsum("tfi,ti->tf", self.points, up))
        return np.asarray(heights - np.min(heights, axis=1, keepdims=True))

    def compute_speeds(self, ground: BoolArray) -> Array:
        """Compute each foot's mean speed relative to the other feet on the ground [m/s], shape (T, feet)."""
        speeds, seen_from = np.zeros(ground.shape), np.zeros(ground.shape)
        if len(self.time) < 2:
            return speeds
        width = max(1, round(0.02 / float(np.median(np.diff(self.time)))))  # speeds are averaged over 20 ms
        for foot, other in permutations(range(ground.shape[1]), 2):
            offset = np.einsum("tij,tj->ti", self.levels[other], self.points[:, foot] - self.points[:, other])
            velocity = scipy.ndimage.uniform_filter1d(
                np.gradient(offset, self.time, axis=0), width, axis=0, mode="nearest"
            )
            speeds[:, foot] += np.linalg.norm(velocity, axis=1) * ground[:, other]
            seen_from[:, foot] += ground[:, other]
        return speeds / np.maximum(seen_from, 1)


def _place_feet(log: RobotLog, robot: Robot, feet: tuple[str, ...]) -> _FootPlaces:
    """Compute positions of the feet and level frames.

    The IMU gives the rotation of the base. Without it, a standing sole does, because it is level and does not move.
    """
    poses = [robot.foot_pose(foot, log.position) for foot in feet]
    points = np.stack([translation for _, translation in poses], axis=1)
    up = up_in_base(log, robot)
    if log.base_orientation is not None:
        turn = Rotation.from_quat(root_quaternions(robot, log.position, log.base_orientation)).as_matrix()
        levels = [np.asarray(turn)] * len(feet)
    else:
        levels = [rotation.transpose(0, 2, 1) for rotation, _ in poses]
    return _FootPlaces(log.time, points, levels, up)


def _find_swings(airborne: BoolArray, moving: BoolArray) -> BoolArray:
    """Find the feet that swing, shape (T, feet): in the air, or moving just before or after that."""
    swinging = np.empty_like(airborne)
    distance = np.full(airborne.shape, np.inf)
    for foot in range(airborne.shape[1]):
        swinging[:, foot] = _select_runs(airborne[:, foot] | moving[:, foot], airborne[:, foot])
        if airborne[:, foot].any():
            distance[:, foot] = scipy.ndimage.distance_transform_edt(~airborne[:, foot])
    nowhere_to_stand = swinging.all(axis=1)
    middle = 0.5 * (distance.min(axis=1) + distance.max(axis=1))
    # The feet whose time in the air is farther away stand.
    swinging[nowhere_to_stand] = (distance < middle[:, None])[nowhere_to_stand]
    return swinging


def _select_runs(wide: BoolArray, core: BoolArray) -> BoolArray:
    """Select the runs of `wide` that overlap `core`."""
    run = np.cumsum(np.diff(wide, prepend=False))
    return wide & np.isin(run, run[core])

"""A robot as a stick figure: lines from joint to joint, to the ends of its limbs, and around its soles."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from stribeck.robot import Robot
from stribeck.typing import Array
from stribeck_simulation.robots.sole import Sole

SHORTEST = 1e-3
"""Shorter lines are left out [m]."""

NO_SOLE = Sole((0.0, 0.0, 0.0), 0.0, 0.0)
"""Of a foot that is a point."""

Line = tuple[str, int, Array, int, Array]
"""Name, then joint and point in that joint's frame [m] of its start and of its end."""


@dataclass(frozen=True, eq=False)
class StickFigure:
    """Lines whose ends are fixed to the bodies of a rooted tree.

    Attributes
    ----------
    names
        Joint or contact that each line leads to.
    joints
        Of the tree's model, of each line's start and end, shape (S, 2).
    points
        In the frames of those joints [m], shape (S, 2, 3).
    """

    names: tuple[str, ...]
    joints: NDArray[np.int64]
    points: Array

    def at(self, data: pin.Data) -> Array:
        """Return the lines in the world after `pin.forwardKinematics`, shape (S, 2, 3) [m]."""
        rotation = np.array([pose.rotation for pose in data.oMi])
        translation = np.array([pose.translation for pose in data.oMi])
        turned = np.einsum("skij,skj->ski", rotation[self.joints], self.points)
        return np.asarray(turned + translation[self.joints])


def stick_figure(robot: Robot, soles: Mapping[str, Sole]) -> StickFigure:
    """Return the stick figure of a robot; contacts without a sole are points."""
    lines = [line for line in _lines(robot, soles) if _long(line)]
    names, starts, start_points, ends, end_points = zip(*lines, strict=True)
    points = np.stack([np.array(start_points), np.array(end_points)], axis=1)
    return StickFigure(names, np.array([starts, ends], dtype=np.int64).T, points)


def _long(line: Line) -> bool:
    _, start, start_point, end, end_point = line
    return start != end or float(np.linalg.norm(end_point - start_point)) > SHORTEST


def _lines(robot: Robot, soles: Mapping[str, Sole]) -> Iterator[Line]:
    model, origin = robot.tree.model, np.zeros(3)
    first = 2 if robot.tree.floating else 1
    standing = set()
    for name, contact in robot.contacts.items():
        frame = model.frames[model.getFrameId(contact.frame)]
        joint = int(frame.parentJoint)
        standing.add(joint)
        sole = soles.get(name, NO_SOLE)
        ahead = np.array([sole.half_length, 0.0, 0.0])
        heel, toe = (frame.placement.act(np.array(sole.centre) + way) for way in (-ahead, ahead))
        for start, end in ((origin, heel), (heel, toe), (toe, origin)):
            yield name, joint, start, joint, end
    for joint in range(first, model.njoints):
        parent, placement = int(model.parents[joint]), model.jointPlacements[joint]
        # In the parent's frame, so that a line keeps its length; a sliding joint's own way is not drawn.
        yield model.names[joint], parent, origin, parent, placement.translation.copy()
        if joint not in standing and joint not in set(model.parents):
            # The centre of mass of a limb's last body is about half way to its end.
            yield model.names[joint], joint, origin, joint, 2 * model.inertias[joint].lever

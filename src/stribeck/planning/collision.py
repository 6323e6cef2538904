"""How near the bodies of a robot come to each other, by the collision geometry of its URDF."""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from stribeck.robot import Robot, read_robot_file
from stribeck.typing import Array

CLEARANCE = 0.02
"""Least distance of bodies [m]: calibration and compliance move them by some millimetres."""


@dataclass(frozen=True, eq=False)
class SelfCollision:
    """Bodies that may collide: all pairs but neighbours, and those that are near each other in the posture already.

    `columns` is the robot's joint of each of the model's, shape (m,), -1 of one that is locked, at `locked`.
    """

    model: pin.Model
    geometry: pin.GeometryModel
    columns: Array
    locked: Array

    def nearest(self, position: Array) -> tuple[float, str]:
        """Return the least distance [m] over some positions of the joints, shape (T, n), and which bodies have it."""
        data, places = self.model.createData(), pin.GeometryData(self.geometry)
        least, pair = np.inf, -1
        for row in position:
            pin.updateGeometryPlacements(self.model, data, self.geometry, places, self._configuration(row))
            for k in range(len(self.geometry.collisionPairs)):
                distance = pin.computeDistance(self.geometry, places, k).min_distance
                if distance < least:
                    least, pair = float(distance), k
        return least, self._names(pair) if pair >= 0 else ""

    def _names(self, pair: int) -> str:
        own, objects = self.geometry.collisionPairs[pair], self.geometry.geometryObjects
        names = [self.model.frames[objects[k].parentFrame].name for k in (own.first, own.second)]
        return " and ".join(names)

    def _configuration(self, row: Array) -> Array:
        configuration = pin.neutral(self.model)
        for joint in range(1, self.model.njoints):
            column = int(self.columns[joint - 1])
            value = row[column] if column >= 0 else self.locked[joint - 1]
            first, size = self.model.joints[joint].idx_q, self.model.joints[joint].nq
            configuration[first : first + size] = value if size == 1 else (np.cos(value), np.sin(value))
        return np.asarray(configuration)


def load_self_collision(robot: Robot, posture: Array) -> tuple[SelfCollision | None, list[str]]:
    """Return what may collide, None if the model says nothing of it, and notes on what is left out."""
    path = Path(robot.model_path)
    if path.suffix != ".urdf":
        return None, [f"self-collision is not checked: {path.name} is no URDF"]
    model = pin.buildModelFromUrdf(str(path))
    try:
        geometry = pin.buildGeomFromUrdf(model, str(path), pin.GeometryType.COLLISION, package_dirs=_packages(path))
    except ValueError as error:
        missing = " ".join(str(error).split())[:160]
        return None, [f"self-collision is not checked: the geometry of {path.name} cannot be read ({missing})"]
    if len(geometry.geometryObjects) < 2:
        return None, [f"self-collision is not checked: {path.name} has no collision geometry"]
    for each in geometry.geometryObjects:
        if hasattr(each.geometry, "buildConvexHull"):
            each.geometry.buildConvexHull(True, "Qt")
            each.geometry = each.geometry.convex
    _pair(model, geometry)
    file = Path(robot.path)
    locked = read_robot_file(file).robot.locked if file.suffix == ".toml" and file.is_file() else {}
    names = [str(model.names[joint]) for joint in range(1, model.njoints)]
    columns = np.array([robot.joint_names.index(name) if name in robot.joint_names else -1 for name in names])
    found = SelfCollision(model, geometry, columns, np.array([locked.get(name, 0.0) for name in names]))
    near = _leave_out_near(found, posture)
    note = [f"these bodies are near each other in the posture, and are not checked: {'; '.join(near)}"] if near else []
    return found, note


def _packages(path: Path) -> list[str]:
    """Return folders that may hold the packages that a model names: those above it, and ROS's."""
    return [str(folder) for folder in path.resolve().parents] + os.environ.get("ROS_PACKAGE_PATH", "").split(":")


def _pair(model: pin.Model, geometry: pin.GeometryModel) -> None:
    """Make pairs of all bodies but those of one joint and of its parent."""
    geometry.removeAllCollisionPairs()
    objects = geometry.geometryObjects
    for first in range(len(objects)):
        for second in range(first + 1, len(objects)):
            one, other = objects[first].parentJoint, objects[second].parentJoint
            if one != other and model.parents[one] != other and model.parents[other] != one:
                geometry.addCollisionPair(pin.CollisionPair(first, second))


def _leave_out_near(found: SelfCollision, posture: Array) -> list[str]:
    """Leave out pairs that are nearer than the clearance in the posture; return their names."""
    data, places = found.model.createData(), pin.GeometryData(found.geometry)
    pin.updateGeometryPlacements(found.model, data, found.geometry, places, found._configuration(posture))
    pairs = range(len(found.geometry.collisionPairs))
    near = [k for k in pairs if pin.computeDistance(found.geometry, places, k).min_distance < CLEARANCE]
    names = [found._names(k) for k in near]
    for pair in [found.geometry.collisionPairs[k].copy() for k in near]:
        found.geometry.removeCollisionPair(pair)
    return list(dict.fromkeys(names))

"""Distances between the bodies of a robot, from the collision geometry of its URDF or MJCF."""

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array
from stribeck.core.robot import Robot, read_robot_file
from stribeck.core.robot.rooting import is_floating
from stribeck.core.robot.xml_file import read_xml

CLEARANCE = 0.02
"""Minimum distance of bodies [m]; calibration and compliance move them by some millimeters."""


@dataclass(frozen=True, eq=False)
class SelfCollision:
    """Pairs of bodies that may collide.

    `columns` contains the robot's joint for each velocity of the model, shape (m,); -1 for joints locked at `locked`.
    """

    model: pin.Model
    geometry: pin.GeometryModel
    columns: Array
    locked: Array

    def nearest(self, position: Array) -> tuple[float, str]:
        """Find the least distance [m] over some positions of the joints, shape (T, n), and its pair of bodies."""
        if not len(self.geometry.collisionPairs):
            return np.inf, ""
        least = [(float(row.min()), int(np.argmin(row))) for row in self.distances(position)]
        distance, pair = min(least)
        return distance, self.names([pair])[0]

    def distances(self, position: Array) -> Iterable[Array]:
        """Yield the distances of all pairs [m] at each position of the joints."""
        data, places = self.model.createData(), pin.GeometryData(self.geometry)
        for row in position:
            values = np.where(self.columns >= 0, row[self.columns], self.locked)
            configuration = pin.integrate(self.model, pin.neutral(self.model), values)
            pin.computeDistances(self.model, data, self.geometry, places, configuration)
            yield np.array([result.min_distance for result in places.distanceResults])

    def names(self, numbers: Iterable[int]) -> list[str]:
        """Name the bodies of pairs."""
        objects, pairs = self.geometry.geometryObjects, [self.geometry.collisionPairs[k] for k in numbers]
        return [" and ".join(_body(self.model, objects[k]) for k in (pair.first, pair.second)) for pair in pairs]


def load_self_collision(robot: Robot, posture: Array) -> tuple[SelfCollision | None, list[str]]:
    """Load the bodies that may collide, None if the model has none, and notes on bodies that are not checked.

    All pairs are checked except neighbors, and bodies that are near each other in the posture.
    """
    path = Path(robot.model_path)
    if not robot.model_path:
        return None, ["self-collision is not checked: the robot is a Pinocchio model without a file"]
    try:
        model, geometry = _read(path)
    except (ValueError, RuntimeError) as error:
        missing = " ".join(str(error).split())[:160]
        return None, [f"self-collision is not checked: the geometry of {path.name} cannot be read ({missing})"]
    if len(geometry.geometryObjects) < 2:
        return None, [f"self-collision is not checked: {path.name} has no collision geometry"]
    notes = _make_convex(model, geometry)
    geometry.addAllCollisionPairs()
    for pair in [pair.copy() for pair in geometry.collisionPairs]:
        first, second = (geometry.geometryObjects[k].parentJoint for k in (pair.first, pair.second))
        if first in (second, model.parents[second]) or second == model.parents[first]:
            geometry.removeCollisionPair(pair)
    file = Path(robot.path)
    locked = read_robot_file(file).robot.locked if file.suffix == ".toml" and file.is_file() else {}
    columns, rest = np.full(model.nv, -1), np.zeros(model.nv)
    for name, joint in zip(model.names, model.joints, strict=True):
        if joint.nv == 1:
            columns[joint.idx_v] = robot.joint_names.index(name) if name in robot.joint_names else -1
            rest[joint.idx_v] = locked.get(name, 0.0)
    collision = SelfCollision(model, geometry, columns, rest)
    near = np.flatnonzero(next(iter(collision.distances(posture[None]))) < CLEARANCE)
    if len(near):
        together = "; ".join(dict.fromkeys(collision.names(near.tolist())))
        notes.append(f"these bodies are near each other in the posture, and are not checked: {together}")
    for pair in [geometry.collisionPairs[k].copy() for k in near.tolist()]:
        geometry.removeCollisionPair(pair)
    return collision, notes


def _read(path: Path) -> tuple[pin.Model, pin.GeometryModel]:
    """Read a model file and its collision geometry, without the world around a base that moves."""
    if read_xml(path).kind == "mjcf":
        model = pin.buildModelFromMJCF(str(path))
        geometry = pin.buildGeomFromMJCF(model, str(path), pin.GeometryType.COLLISION)
        for name in [geom.name for geom in geometry.geometryObjects if is_floating(model) and geom.parentJoint == 0]:
            geometry.removeGeometryObject(name)
        return model, geometry
    model = pin.buildModelFromUrdf(str(path))
    # folders that may contain the packages that a model names: those above it, and ROS's
    packages = [str(folder) for folder in path.resolve().parents] + os.environ.get("ROS_PACKAGE_PATH", "").split(":")
    return model, pin.buildGeomFromUrdf(model, str(path), pin.GeometryType.COLLISION, package_dirs=packages)


def _body(model: pin.Model, geom: pin.GeometryObject) -> str:
    return str(model.frames[geom.parentFrame].name)


def _make_convex(model: pin.Model, geometry: pin.GeometryModel) -> list[str]:
    """Replace meshes by convex hulls, flat ones by boxes; remove those without a shape. Return notes."""
    notes, broken = [], []
    for geom in geometry.geometryObjects:
        if not hasattr(geom.geometry, "buildConvexHull"):
            continue
        vertices, body = np.asarray(geom.geometry.vertices()), _body(model, geom)
        if len(vertices) == 0 or not np.isfinite(vertices).all():
            broken.append(geom.name)
            notes.append(f"a collision mesh of {body} is not checked: it has vertices that are not finite, or none")
            continue
        centred = vertices - vertices.mean(axis=0)
        axes = np.linalg.eigh(centred.T @ centred)[1]
        low, high = (vertices @ axes).min(axis=0), (vertices @ axes).max(axis=0)
        if (high - low).min() > 1e-6 * (high - low).max():  # Coal crashes on convex hulls of flatter meshes
            geom.geometry.buildConvexHull(True, "Qt")
            geom.geometry = geom.geometry.convex
            continue
        notes.append(f"a collision mesh of {body} is flat: its bounding box is checked instead of its convex hull")
        geom.geometry = coal.Box(*np.maximum(high - low, 1e-6))
        geom.placement = geom.placement * pin.SE3(axes * np.linalg.det(axes), axes @ (low + high) / 2)
    for name in broken:
        geometry.removeGeometryObject(name)
    return notes

"""Distances between the bodies of a robot, from the collision geometry of its URDF or MJCF."""

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array
from stribeck.core.dynamics.rooted import model_motion, workspace
from stribeck.core.robot import Robot
from stribeck.core.robot.rooting import RootedModel
from stribeck.core.robot.xml_file import read_xml

CLEARANCE = 0.02
"""Minimum distance of bodies [m]; calibration and compliance move them by some millimeters."""


@dataclass(frozen=True, eq=False)
class SelfCollision:
    """Pairs of bodies of a robot that may collide."""

    tree: RootedModel
    geometry: pin.GeometryModel

    def nearest(self, position: Array) -> tuple[float, str]:
        """Find the least distance [m] over some positions of the joints, shape (T, n), and its pair of bodies."""
        if not len(self.geometry.collisionPairs):
            return np.inf, ""
        least = [(float(row.min()), int(np.argmin(row))) for row in self.distances(position)]
        distance, pair = min(least)
        return distance, self.names([pair])[0]

    def distances(self, position: Array) -> Iterable[Array]:
        """Yield the distances of all pairs [m] at each position of the joints."""
        (model, data), places = workspace(self.tree), pin.GeometryData(self.geometry)
        still = np.zeros_like(position)
        for configuration in model_motion(self.tree, position, still, still, None)[0]:
            pin.computeDistances(model, data, self.geometry, places, configuration)
            yield np.array([result.min_distance for result in places.distanceResults])

    def names(self, numbers: Iterable[int]) -> list[str]:
        """Name the bodies of pairs."""
        objects, pairs = self.geometry.geometryObjects, [self.geometry.collisionPairs[k] for k in numbers]
        bodies = [self.tree.model.frames[geom.parentFrame].name for geom in objects]
        return [f"{bodies[pair.first]} and {bodies[pair.second]}" for pair in pairs]


def load_self_collision(robot: Robot, posture: Array) -> tuple[SelfCollision | None, list[str]]:
    """Load the bodies that may collide, None if the model has none, and notes on bodies that are not checked.

    All pairs are checked except neighbors, and bodies that are near each other in the posture.
    """
    path = Path(robot.model_path)
    if not robot.model_path:
        return None, ["self-collision is not checked: the robot is a Pinocchio model without a file"]
    try:
        geometry = _read(path, robot.tree)
    except (ValueError, RuntimeError) as error:
        missing = " ".join(str(error).split())[:160]
        return None, [f"self-collision is not checked: the geometry of {path.name} cannot be read ({missing})"]
    if len(geometry.geometryObjects) < 2:
        return None, [f"self-collision is not checked: {path.name} has no collision geometry"]
    model, notes = robot.tree.model, _make_convex(robot.tree.model, geometry)
    geometry.addAllCollisionPairs()
    for pair in [pair.copy() for pair in geometry.collisionPairs]:
        first, second = (geometry.geometryObjects[k].parentJoint for k in (pair.first, pair.second))
        if first in (second, model.parents[second]) or second == model.parents[first]:
            geometry.removeCollisionPair(pair)
    collision = SelfCollision(robot.tree, geometry)
    near = np.flatnonzero(next(iter(collision.distances(posture[None]))) < CLEARANCE).tolist()
    together = "; ".join(dict.fromkeys(collision.names(near)))
    notes += [f"these bodies are near each other in the posture, and are not checked: {together}"] * bool(near)
    for pair in [geometry.collisionPairs[k].copy() for k in near]:
        geometry.removeCollisionPair(pair)
    return collision, notes


def _read(path: Path, tree: RootedModel) -> pin.GeometryModel:
    """Read the collision geometry of a model file, without the world around a base that moves."""
    if read_xml(path).kind == "mjcf":
        return _read_mjcf(path, tree)
    # folders that may contain the packages that a model names: those above it, and ROS's
    packages = [str(folder) for folder in path.resolve().parents] + os.environ.get("ROS_PACKAGE_PATH", "").split(":")
    return pin.buildGeomFromUrdf(tree.model, str(path), pin.GeometryType.COLLISION, package_dirs=packages)


def _read_mjcf(path: Path, tree: RootedModel) -> pin.GeometryModel:
    """Read the geoms that collide as MuJoCo compiles them."""
    from mujoco import mjtGeom

    from stribeck.core.robot.mjcf import compile_mjcf

    compiled, geometry, model = compile_mjcf(path), pin.GeometryModel(), tree.model
    meshes = [*np.split(compiled.mesh_vert.astype(np.float64), compiled.mesh_vertadr)[1:], np.zeros((0, 3))]
    frames = {frame.name: k for k, frame in enumerate(model.frames) if frame.type == pin.FrameType.BODY}
    frames |= {} if tree.floating else {"world": 0}
    for geom in map(compiled.geom, np.flatnonzero(compiled.geom_contype | compiled.geom_conaffinity)):
        frame = frames.get(compiled.body(int(geom.bodyid[0])).name)
        shape = _shape(mjtGeom(geom.type[0]).name.removeprefix("mjGEOM_"), geom.size, meshes[geom.dataid[0]])
        if frame is not None and shape is not None:
            carrier = model.frames[frame]
            pose = carrier.placement * pin.XYZQUATToSE3(np.array([*geom.pos, *geom.quat[1:], geom.quat[0]]))
            geometry.addGeometryObject(pin.GeometryObject(str(geom.id), carrier.parentJoint, frame, pose, shape))
    return geometry


def _shape(kind: str, size: Array, vertices: Array) -> coal.CollisionGeometry | None:
    """Make the shape of a geom; None for height fields and signed distances."""
    x, y = size[:2]
    shapes = {"SPHERE": (coal.Sphere, x), "CAPSULE": (coal.Capsule, x, 2 * y), "CYLINDER": (coal.Cylinder, x, 2 * y)}
    shapes |= {"BOX": (coal.Box, 2 * size), "ELLIPSOID": (coal.Ellipsoid, size), "MESH": (coal.BVHModelOBBRSS,)}
    shapes["PLANE"] = coal.Halfspace, np.eye(3)[2], 0.0
    make, *sizes = shapes.get(kind, (lambda: None,))
    shape = make(*sizes)
    if kind == "MESH":
        shape.beginModel(0, len(vertices))
        shape.addVertices(vertices)
        shape.endModel()
    return shape


def _make_convex(model: pin.Model, geometry: pin.GeometryModel) -> list[str]:
    """Replace meshes by convex hulls, flat ones by boxes; remove those without a shape. Return notes."""
    notes, broken = [], []
    for geom in geometry.geometryObjects:
        if not hasattr(geom.geometry, "buildConvexHull"):
            continue
        vertices, body = np.asarray(geom.geometry.vertices()), model.frames[geom.parentFrame].name
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

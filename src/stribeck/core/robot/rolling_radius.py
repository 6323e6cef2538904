"""Radius of ball feet and wheels, from the collision geometry of a model."""

from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element

import coal
import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.robot.xml_file import read_xml


def rolling_radius(path: Path, frame: str, kind: str = "point", *, meshes: bool = False) -> float:
    """Find the radius [m] of a wheel's cylinder or sphere, or of a ball around a point; 0 if missing.

    `path` is the file of the model, and `frame` a link, body or site. `kind` is "point" or "wheel".
    With `meshes`, a mesh that is nearly a ball counts as well.
    """
    rolling = ("cylinder", "sphere")[kind == "point" :]
    sizes = [(size, place) for shape, size, place in _shapes(path, frame, meshes=meshes) if shape in rolling]
    near = [size for size, place in sizes if kind == "wheel" or _is_center(place, size)]
    return round(max(near, default=0.0), 4)


def ball_beside(path: Path, frame: str) -> tuple[float, Array] | None:
    """Find the radius [m] and center [m] of a link's only sphere, relative to a frame that is not at its center."""
    balls = [(size, place) for shape, size, place in _shapes(path, frame, meshes=False) if shape == "sphere"]
    alone = balls and all(np.linalg.norm(place - balls[0][1]) < 1e-3 for _, place in balls)  # one may be visual
    return balls[0] if alone and not _is_center(balls[0][1], balls[0][0]) else None


def _is_center(place: Array, radius: float) -> bool:
    """Whether a frame's distance from the center of a ball is below half of the radius."""
    return bool(np.linalg.norm(place) < 0.5 * radius)


def _shapes(path: Path, frame: str, *, meshes: bool) -> list[tuple[str, float, Array]]:
    """List kinds, radii [m] and places [m] of the collision shapes of a link, body or site's body."""
    if not path.is_file():  # a model in memory
        return []
    xml = read_xml(path)
    if xml.kind == "mjcf":
        from stribeck.core.robot.mjcf import shapes_around  # MuJoCo is slow to import

        return shapes_around(path, frame)
    link = next((link for link in xml.root.iter("link") if link.get("name") == frame), xml.root)
    return list(_shapes_of_link(path, link, meshes=meshes))


def _shapes_of_link(path: Path, link: Element, *, meshes: bool) -> Iterator[tuple[str, float, Array]]:
    """Yield kind, radius [m] and place [m] of a URDF link's shapes."""
    for collision in link.findall("collision"):
        origin = collision.find("origin")
        place = _numbers("0 0 0" if origin is None else origin.get("xyz", "0 0 0"))
        for shape in collision.findall("geometry/*"):
            yield shape.tag, float(shape.get("radius", "0")), place
            if meshes and shape.tag == "mesh":
                size, off_center = _ball_of_mesh(path, shape)
                yield "sphere", size, place + off_center


def _ball_of_mesh(path: Path, mesh: Element) -> tuple[float, Array]:
    """Fit a sphere to a mesh: its radius [m], 0 if the mesh is missing or no ball, and its center, shape (3,)."""
    name = mesh.get("filename", "").removeprefix("package://").removeprefix("file://")
    file = next((folder / name for folder in path.resolve().parents if name and (folder / name).is_file()), None)
    if file is None:
        return 0.0, np.zeros(3)
    try:
        points = np.asarray(coal.MeshLoader().load(str(file), _numbers(mesh.get("scale") or "1 1 1")).vertices())
    except (ValueError, RuntimeError):  # other formats than the loader's
        return 0.0, np.zeros(3)
    *center, rest = np.linalg.lstsq(np.column_stack([2 * points, np.ones(len(points))]), (points**2).sum(axis=1))[0]
    radius = float(np.sqrt(max(rest + np.dot(center, center), 0.0)))
    uneven = np.std(np.linalg.norm(points - center, axis=1))
    return (radius if uneven < 0.06 * radius else 0.0), np.array(center)  # [1], meshes of balls are that round


def _numbers(text: str) -> Array:
    return np.array([float(word) for word in text.split()])

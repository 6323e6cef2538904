"""Radius of ball feet and wheels, from the collision geometry of a model."""

from pathlib import Path
from xml.etree.ElementTree import Element

import coal
import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.robot.xml_file import read_xml

ROUND = 0.06
"""Largest deviation of a ball's mesh from a sphere [1], root mean square, relative to its radius."""


def rolling_radius(path: Path, frame: str, kind: str = "point", *, meshes: bool = False) -> float:
    """Find the radius [m] of a wheel's cylinder or sphere, or of a ball around a point; 0 if missing.

    `path` is the file of the model, and `frame` a link, body or site. `kind` is "point" or "wheel".
    With `meshes`, a mesh that is nearly a ball counts as well.
    """
    if not path.is_file():  # a model in memory
        return 0.0
    root = read_xml(path).root
    owners = [element for element in root.iter() if element.tag in ("link", "body")]
    sites = {site.get("name"): (owner, _place(site)) for owner in owners for site in owner.findall("site")}
    owner, center = sites.get(frame) or (next((e for e in owners if e.get("name") == frame), root), np.zeros(3))
    shapes = [(geom.get("type", "sphere"), geom.get("size", "0"), _place(geom)) for geom in owner.findall("geom")]
    for collision in owner.findall("collision"):
        origin = collision.find("origin")
        place = np.zeros(3) if origin is None else _place(origin)
        for shape in collision.findall("geometry/*"):
            shapes.append((shape.tag, shape.get("radius", "0"), place))
            if meshes and shape.tag == "mesh":
                size, off_center = _ball_of_mesh(path, shape)
                shapes.append(("sphere", str(size), place + off_center))
    rolling = ("cylinder", "sphere")[kind == "point" :]
    sizes = [(float(size.split()[0]), place) for shape, size, place in shapes if shape in rolling]
    near = [size for size, place in sizes if kind == "wheel" or np.linalg.norm(place - center) < 0.5 * size]
    return round(max(near, default=0.0), 4)


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
    return (radius if uneven < ROUND * radius else 0.0), np.array(center)


def _place(element: Element) -> Array:
    """Read a position [m] from an MJCF element or a URDF origin."""
    return _numbers(element.get("pos") or element.get("xyz") or "0 0 0")


def _numbers(text: str) -> Array:
    return np.array([float(word) for word in text.split()])

"""A robot's URDF as a complete MJCF: every link a body, with its inertia, joint, limits, shapes and meshes.

MuJoCo reads URDF itself, but takes the root link into the world, and writes numbers with six digits. Here the root of a
floating robot gets a free joint, and all digits stay. Joints are in Pinocchio's order: by name below each link.
"""

import os
from dataclasses import dataclass, field
from pathlib import Path
from xml.dom.minidom import Document, Element
from xml.etree.ElementTree import Element as Source

import numpy as np
import pinocchio as pin

from stribeck.errors import SettingsError
from stribeck.export.document import remove, set_numbers
from stribeck.robot.xml_file import read_xml
from stribeck.typing import Array

KINDS = {"revolute": "hinge", "continuous": "hinge", "prismatic": "slide"}
"""Joint of URDF -> of MJCF; fixed links are bodies without a joint."""

STL_HEAD, STL_FACE, MOST_FACES = 84, 50, 200_000
"""Bytes of a binary STL's head and of each face, and the faces that MuJoCo reads of a mesh [1]."""

ROUNDING = 1e-12
"""Of principal moments over the largest [1]."""


def mjcf_of_urdf(path: Path, folder: Path, *, floating: bool) -> tuple[Document, Element, list[str]]:
    """Return the document and its root, for a file in the folder, and lines on what it leaves out.

    Raises
    ------
    SettingsError
        If the robot has what MJCF cannot hold: a planar joint, a free one below the root, or a free link "world".
    """
    source = read_xml(path).root
    document = Document()
    root = _add(document, "mujoco", model=source.get("name") or path.stem)
    _add(root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false")
    writer = _Writer(path, folder, source, _add(root, "asset"))
    children = {joint.find("child").get("link") for joint in writer.joints}  # type: ignore[union-attr]
    base = next(name for name in writer.links if name not in children)
    world = _add(root, "worldbody")
    if floating and base == "world":
        raise SettingsError(f"{path}: the root link is called 'world', as MuJoCo's own; rename it to export to mjcf")
    if base == "world":
        writer.fill(world, base)
    else:
        body = _add(world, "body", name=base)
        if floating:
            _add(body, "freejoint", name="root")
        writer.fill(body, base)
    writer.couple(_add(root, "equality"))
    if not writer.asset.childNodes:
        remove(writer.asset)
    notes = [f"The root link {base} moves freely."] if floating else []
    if writer.left_out:
        notes.append(f"Left out, as no such file is here that MuJoCo reads: {', '.join(writer.left_out)}.")
    _indent(root, "\n")
    return document, root, notes


@dataclass(eq=False)
class _Writer:
    """Writes links as bodies.

    Attributes
    ----------
    path, folder
        The URDF, and the folder of the MJCF.
    source
        The URDF's root element.
    asset
        Element that holds meshes.
    meshes
        File and scale -> name.
    left_out
        File names of meshes that cannot be had.
    """

    path: Path
    folder: Path
    source: Source
    asset: Element
    meshes: dict[tuple[Path, str], str] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.links = {str(link.get("name")): link for link in self.source.findall("link")}
        self.joints = sorted(self.source.findall("joint"), key=lambda joint: str(joint.get("name")))
        self.colours = {
            str(material.get("name")): material.find("color").get("rgba", "")  # type: ignore[union-attr]
            for material in self.source.iter("material")
            if material.find("color") is not None
        }

    def joints_below(self, link: str) -> list[Source]:
        """Return the joints whose parent is a link."""
        return [joint for joint in self.joints if joint.find("parent").get("link") == link]  # type: ignore[union-attr]

    def fill(self, body: Element, link: str) -> None:
        """Put a link's inertia and shapes, and the bodies below it, into its body."""
        self._inertial(body, self.links[link])
        for tag in ("visual", "collision"):
            for shape in self.links[link].findall(tag):
                self._geom(body, shape)
        for joint in self.joints_below(link):
            child = str(joint.find("child").get("link"))  # type: ignore[union-attr]
            below = _add(body, "body", name=child)
            _place(below, joint)
            self._joint(below, joint)
            self.fill(below, child)

    def couple(self, equality: Element) -> None:
        """Couple the joints that mimic others; the element goes if there are none."""
        moving = {joint.get("name") for joint in self.joints if joint.get("type") in KINDS}
        for joint in self.joints:
            mimic = joint.find("mimic")
            if mimic is not None and {joint.get("name"), mimic.get("joint")} <= moving:
                coupling = _add(equality, "joint", joint1=str(joint.get("name")), joint2=str(mimic.get("joint")))
                numbers = [float(mimic.get("offset", "0")), float(mimic.get("multiplier", "1")), 0.0, 0.0, 0.0]
                set_numbers(coupling, polycoef=np.array(numbers))
        if not equality.childNodes:
            remove(equality)

    def _joint(self, body: Element, joint: Source) -> None:
        kind, name = str(joint.get("type")), str(joint.get("name"))
        if kind == "fixed":
            return
        if kind == "floating" and body.parentNode.tagName == "worldbody":  # type: ignore[union-attr]
            _add(body, "freejoint", name=name)
            return
        if kind not in KINDS:
            raise SettingsError(f"{self.path}: joint '{name}' is {kind}, which MJCF has not there; export to urdf")
        own = _add(body, "joint", name=name, type=KINDS[kind])
        axis = _numbers(joint.find("axis"), "xyz", "1 0 0")
        set_numbers(own, axis=axis / np.linalg.norm(axis))
        limit, dynamics = joint.find("limit"), joint.find("dynamics")
        if limit is not None and kind != "continuous":
            set_numbers(own, range=np.array([float(limit.get(end, "0")) for end in ("lower", "upper")]))
        effort = float(limit.get("effort", "0")) if limit is not None else 0.0
        if effort > 0:
            set_numbers(own, actuatorfrcrange=np.array([-effort, effort]))
        if dynamics is not None:
            damping, friction = (float(dynamics.get(word, "0")) for word in ("damping", "friction"))
            set_numbers(own, damping=damping, frictionloss=friction)

    def _inertial(self, body: Element, link: Source) -> None:
        """Write a link's inertia, zero where none is stated: Pinocchio's reader of MJCF wants one of each body."""
        if body.tagName == "worldbody":
            return
        own, inertial = _add(body, "inertial"), link.find("inertial")
        stated = Source("inertial") if inertial is None else inertial
        turn, place = _pose(stated)
        axes = ("xx", "yy", "zz", "xy", "xz", "yz")
        xx, yy, zz, xy, xz, yz = (_numbers(stated.find("inertia"), f"i{pair}", "0")[0] for pair in axes)
        moments, principal = np.linalg.eigh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
        moments[np.abs(moments) < ROUNDING * np.abs(moments).max()] = 0.0
        _orient(own, turn @ principal * np.linalg.det(principal))
        mass = float(_numbers(stated.find("mass"), "value", "0")[0])
        set_numbers(own, pos=place, mass=mass, diaginertia=moments)

    def _geom(self, body: Element, shape: Source) -> None:
        """Write a shape; what is only seen touches nothing."""
        of = next(iter(shape.find("geometry") or []), None)
        if of is None:
            return
        geom = _add(body, "geom", type=of.tag)
        if of.tag == "box":
            set_numbers(geom, size=0.5 * _numbers(of, "size", "0 0 0"))
        elif of.tag in ("cylinder", "capsule"):
            set_numbers(geom, size=np.array([float(of.get("radius", "0")), 0.5 * float(of.get("length", "0"))]))
        elif of.tag == "sphere":
            set_numbers(geom, size=float(of.get("radius", "0")))
        elif of.tag == "mesh" and (mesh := self._mesh(of)):
            geom.setAttribute("mesh", mesh)
        else:
            remove(geom)
            return
        _place(geom, shape)
        if shape.tag == "visual":
            for name, value in (("contype", "0"), ("conaffinity", "0"), ("group", "1")):
                geom.setAttribute(name, value)
            material = shape.find("material")
            if material is not None and (colour := self.colours.get(str(material.get("name")))):
                geom.setAttribute("rgba", colour)

    def _mesh(self, mesh: Source) -> str:
        """Return the name of a mesh, "" if MuJoCo cannot read it here."""
        name, scale = mesh.get("filename", ""), mesh.get("scale", "1 1 1")
        file = self._found(name)
        if file is None:
            self.left_out += [name] if name not in self.left_out else []
            return ""
        if (file, scale) not in self.meshes:
            own = self.meshes[file, scale] = f"{file.stem}_{len(self.meshes)}"
            _add(self.asset, "mesh", name=own, file=Path(os.path.relpath(file, self.folder)).as_posix(), scale=scale)
        return self.meshes[file, scale]

    def _found(self, name: str) -> Path | None:
        """Return a mesh's file; packages are sought in the folders above the URDF's."""
        scheme, _, rest = name.rpartition("://")
        folders = [self.path.parent, *(self.path.resolve().parents if scheme in ("package", "model") else [])]
        for compiler in self.source.iterfind("mujoco/compiler"):
            folders.append(self.path.parent / compiler.get("meshdir", ""))
        places = [folder / each for folder in folders for each in (rest, Path(rest).name)]
        return next((place.resolve() for place in places if place.is_file() and _readable(place)), None)


def _readable(file: Path) -> bool:
    """Return whether MuJoCo reads a mesh: OBJ, MSH, and binary STL that is not too large."""
    if file.suffix.lower() != ".stl":
        return file.suffix.lower() in (".obj", ".msh")
    with file.open("rb") as stream:
        count = int.from_bytes(stream.read(STL_HEAD)[-4:], "little")
    return 0 < count <= MOST_FACES and file.stat().st_size == STL_HEAD + STL_FACE * count


def _add(parent: Element | Document, tag: str, **attributes: str) -> Element:
    """Return a new last child."""
    document = parent if isinstance(parent, Document) else parent.ownerDocument
    assert document is not None
    new = document.createElement(tag)
    for name, value in attributes.items():
        new.setAttribute(name, value)
    parent.appendChild(new)
    return new


def _indent(element: Element, line_end: str) -> None:
    """Put each element on a line of its own."""
    document, inner = element.ownerDocument, line_end + "  "
    assert document is not None
    for child in [node for node in element.childNodes if isinstance(node, Element)]:
        element.insertBefore(document.createTextNode(inner), child)
        _indent(child, inner)
    if element.childNodes:
        element.appendChild(document.createTextNode(line_end))


def _place(element: Element, source: Source) -> None:
    """Let an element be where the <origin> of another says."""
    turn, place = _pose(source)
    set_numbers(element, pos=place)
    _orient(element, turn)


def _orient(element: Element, turn: Array) -> None:
    x, y, z, w = pin.Quaternion(turn).coeffs()
    set_numbers(element, quat=np.array([w, x, y, z]))


def _pose(source: Source) -> tuple[Array, Array]:
    """Return orientation, shape (3, 3), and place [m], shape (3,), of an element's <origin>."""
    origin = source.find("origin")
    return pin.rpy.rpyToMatrix(*_numbers(origin, "rpy", "0 0 0")), _numbers(origin, "xyz", "0 0 0")


def _numbers(source: Source | None, name: str, usual: str) -> Array:
    return np.array([float(word) for word in (usual if source is None else source.get(name, usual)).split()])

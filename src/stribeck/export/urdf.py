"""A URDF with other inertias and other joint friction."""

from collections.abc import Collection
from pathlib import Path
from xml.dom.minidom import Document, Element

import numpy as np

from stribeck.export.document import child, children, document_text, moved, read_document, set_numbers
from stribeck.export.forms import plain
from stribeck.export.links import LinkInertia
from stribeck.export.target import Request, Target


def urdf_text(request: Request) -> str:
    """Return the robot's URDF with links and joints changed."""
    document, _ = changed_document(request)
    return document_text(document, request.lines)


def changed_document(request: Request, words: Collection[str] = ("friction", "damping")) -> tuple[Document, Element]:
    """Return the robot's URDF with links and joints changed, and its root; `words` are those of <dynamics>."""
    document, root = read_document(request.model)
    for link in children(root, "link"):
        if link.getAttribute("name") in request.links:
            _set_inertia(child(link, "inertial"), request.links[link.getAttribute("name")])
    for joint in children(root, "joint"):
        if terms := request.joints.get(joint.getAttribute("name")):
            stated = {name: value for name, (value, _) in terms.stated.items() if name in words}
            if stated:
                set_numbers(child(joint, "dynamics"), **stated)
    _move_files(root, request.model.parent, request.folder)
    return document, root


TARGET = Target(
    title="URDF: friction, damping",
    forms={"plain": plain(coulomb="friction", viscous="damping")},
    suffix=".urdf",
    text=urdf_text,
    models=("urdf",),
)


def _set_inertia(inertial: Element, link: LinkInertia) -> None:
    set_numbers(child(inertial, "mass"), value=link.mass)
    set_numbers(child(inertial, "origin"), xyz=link.centre, rpy=np.zeros(3))
    rows, axes = link.inertia, "xyz"
    entries = {f"i{axes[i]}{axes[j]}": float(rows[i, j]) for i in range(3) for j in range(i, 3)}
    set_numbers(child(inertial, "inertia"), **entries)


def _move_files(root: Element, source: Path, folder: Path) -> None:
    """Let paths of meshes and textures lead where they led; those with a scheme, as package://, stay.

    Where MuJoCo's extension of URDF names a folder of meshes, or drops the folders of paths, that folder moves.
    """
    compilers = [own for extension in children(root, "mujoco") for own in children(extension, "compiler")]
    strips = any(compiler.getAttribute("strippath") == "true" for compiler in compilers)
    places = [compiler for compiler in compilers if compiler.hasAttribute("meshdir")] or compilers[-1:] * strips
    for compiler in places:
        compiler.setAttribute("meshdir", moved(compiler.getAttribute("meshdir"), source, folder))
    if places and not strips:
        return  # file names are relative to that folder
    for tag in ("mesh", "texture"):
        for element in root.getElementsByTagName(tag):
            name = element.getAttribute("filename")
            if name and "://" not in name:
                element.setAttribute("filename", moved(name, source, folder))

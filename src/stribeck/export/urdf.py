"""A URDF with other inertias and other joint friction."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from xml.dom.minidom import Document, Element

import numpy as np

from stribeck.export.document import child, children, moved, read_document, set_numbers
from stribeck.export.joints import JointTerms
from stribeck.export.links import LinkInertia

TERMS = {"coulomb": "friction", "viscous": "damping"}
"""How URDF calls what it has a place for; no rotor inertia is among it."""


def changed_urdf(
    path: Path, links: Mapping[str, LinkInertia], joints: Mapping[str, JointTerms], folder: Path
) -> Document:
    """Return a URDF file's document with links and joints changed, for a file in another folder."""
    document, root = read_document(path)
    for link in children(root, "link"):
        if link.getAttribute("name") in links:
            _set_inertia(child(link, "inertial"), links[link.getAttribute("name")])
    for joint in children(root, "joint"):
        terms = joints.get(joint.getAttribute("name"))
        if terms is not None:
            set_numbers(child(joint, "dynamics"), **{name: value for name, (value, _) in terms.stated.items()})
    _move_files(root, path.parent, folder)
    return document


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

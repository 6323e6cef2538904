"""An SDF with other inertias and other joint friction."""

from pathlib import Path
from xml.dom.minidom import Element

from stribeck.export.document import child, children, document_text, moved, read_document, remove, set_text, text_of
from stribeck.export.forms import plain
from stribeck.export.links import LinkInertia
from stribeck.export.target import Request, Target


def sdf_text(request: Request) -> str:
    """Return the robot's SDF with links and joints changed."""
    document, root = read_document(request.model)
    (model,) = root.getElementsByTagName("model")
    for link in children(model, "link"):
        if link.getAttribute("name") in request.links:
            _set_inertia(child(link, "inertial"), request.links[link.getAttribute("name")])
    for joint in children(model, "joint"):
        if terms := request.joints.get(joint.getAttribute("name")):
            dynamics = child(child(joint, "axis"), "dynamics")
            for word, (value, _) in terms.stated.items():
                set_text(child(dynamics, word), value)
    _move_files(root, request.model.parent, request.folder)
    return document_text(document, request.lines)


TARGET = Target(
    title="SDF: friction, damping",
    forms={"plain": plain(coulomb="friction", viscous="damping")},
    suffix=".sdf",
    text=sdf_text,
    models=("sdf",),
)


def _set_inertia(inertial: Element, link: LinkInertia) -> None:
    for pose in children(inertial, "pose"):
        remove(pose)  # with all that it says of its numbers
    set_text(child(inertial, "pose"), *link.centre.tolist(), 0.0, 0.0, 0.0)
    set_text(child(inertial, "mass"), link.mass)
    moments, axes = child(inertial, "inertia"), "xyz"
    for i in range(3):
        for j in range(i, 3):
            set_text(child(moments, f"i{axes[i]}{axes[j]}"), float(link.inertia[i, j]))


def _move_files(root: Element, source: Path, folder: Path) -> None:
    """Let paths of meshes and textures lead where they led; those with a scheme, as model://, stay."""
    for tag in ("uri", "normal_map", "albedo_map"):
        for element in root.getElementsByTagName(tag):
            name = text_of(element)
            if name and "://" not in name:
                set_text(element, moved(name, source, folder))

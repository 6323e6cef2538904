"""The robot's model again, with other inertias, joint friction and rotor inertias: URDF, URDF for Drake, and MJCF."""

from collections.abc import Collection, Iterator
from pathlib import Path
from xml.dom.minidom import Document, Element, Text

import numpy as np
import pinocchio as pin

from stribeck.export.document import (
    add,
    child,
    children,
    document_text,
    moved,
    read_document,
    remove,
    root_of,
    set_numbers,
)
from stribeck.export.mjcf_of_urdf import mjcf_of_urdf
from stribeck.export.target import Request
from stribeck.robot.model_file import kind_of


def urdf_text(request: Request) -> str:
    """Return the robot's URDF with links and joints changed."""
    return document_text(_changed_urdf(request, ("friction", "damping")), request.lines)


def drake_text(request: Request) -> str:
    """Return the robot's URDF with links and joints changed, and transmissions with the rotor inertias.

    Drake's MultibodyPlant has no dry friction of joints (1.51 warns of a URDF's `friction`, and ignores it), so that
    the damping is the nearest to all of the friction, up to the log's top speed.
    """
    document = _changed_urdf(request, ("damping",))
    root = root_of(document)
    root.setAttribute("xmlns:drake", "http://drake.mit.edu")
    for joint in children(root, "joint"):
        name = joint.getAttribute("name")
        stated = request.joints[name].stated if name in request.joints else {}
        if "damping" in stated and child(joint, "dynamics").hasAttribute("friction"):
            child(joint, "dynamics").removeAttribute("friction")  # is in the damping
        if "rotor_inertia" in stated:
            _set_rotor(root, name, stated["rotor_inertia"][0])
    return document_text(document, request.lines)


def mjcf_text(request: Request) -> str:
    """Return the robot's MJCF with bodies and joints changed; included files are put in their place.

    If the robot's model is URDF, it becomes an MJCF first.
    """
    notes: list[str] = []
    if kind_of(request.model) == "urdf":
        document, notes = mjcf_of_urdf(request.model, request.folder, floating=request.robot.base == "floating")
        root = root_of(document)
    else:
        document, root = read_document(request.model)
        _include(root, request.model.parent)
        _move_mjcf_files(root, request.model.parent, request.folder)
    for world in children(root, "worldbody"):
        for name, body in _bodies(world, ""):
            if name in request.links:
                _set_mjcf_inertia(child(body, "inertial"), request.links[name])
            for joint in children(body, "joint"):
                if terms := request.joints.get(joint.getAttribute("name")):
                    _set_mjcf_friction(root, joint, {word: value for word, (value, _) in terms.stated.items()})
    for compiler in children(root, "compiler") if request.links else []:
        if compiler.getAttribute("inertiafromgeom") == "true":
            compiler.setAttribute("inertiafromgeom", "auto")  # stated inertias count instead of the shapes'
    return document_text(document, [*request.lines, *notes])


def _changed_urdf(request: Request, words: Collection[str]) -> Document:
    """Return the robot's URDF with links and joints changed; `words` are attributes of <dynamics>."""
    document, root = read_document(request.model)
    for link in children(root, "link"):
        if new := request.links.get(link.getAttribute("name")):
            _set_urdf_inertia(child(link, "inertial"), new)
    for joint in children(root, "joint"):
        if terms := request.joints.get(joint.getAttribute("name")):
            stated = {name: value for name, (value, _) in terms.stated.items() if name in words}
            if stated:
                set_numbers(child(joint, "dynamics"), **stated)
    _move_urdf_files(root, request.model.parent, request.folder)
    return document


def _set_urdf_inertia(inertial: Element, link: pin.Inertia) -> None:
    set_numbers(child(inertial, "mass"), value=float(link.mass))
    set_numbers(child(inertial, "origin"), xyz=link.lever, rpy=np.zeros(3))
    entries = {f"i{'xyz'[i]}{'xyz'[j]}": float(link.inertia[i, j]) for i in range(3) for j in range(i, 3)}
    set_numbers(child(inertial, "inertia"), **entries)


def _move_urdf_files(root: Element, source: Path, folder: Path) -> None:
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
    for element in [*root.getElementsByTagName("mesh"), *root.getElementsByTagName("texture")]:
        name = element.getAttribute("filename")
        if name and "://" not in name:
            element.setAttribute("filename", moved(name, source, folder))


def _set_rotor(root: Element, joint: str, inertia: float) -> None:
    """State a rotor inertia as it is felt at the joint, with a gear ratio of one."""
    actuator = child(_transmission(root, joint), "actuator")
    if not actuator.hasAttribute("name"):
        actuator.setAttribute("name", joint)
    set_numbers(child(actuator, "drake:rotor_inertia"), value=inertia)
    set_numbers(child(actuator, "drake:gear_ratio"), value=1.0)


def _transmission(root: Element, joint: str) -> Element:
    """Return the transmission of a joint, of the one type that Drake reads; append one if there is none."""
    for transmission in children(root, "transmission"):
        nodes = [node for own in children(transmission, "type") for node in own.childNodes]
        kinds = [node.data.strip() for node in nodes if isinstance(node, Text)]
        simple = any(kind.endswith("SimpleTransmission") for kind in kinds)
        if simple and joint in [own.getAttribute("name") for own in children(transmission, "joint")]:
            return transmission
    transmission = add(root, "transmission", name=f"rotor of {joint}")
    child(transmission, "joint").setAttribute("name", joint)
    own = child(transmission, "type")
    own.appendChild(own.ownerDocument.createTextNode("SimpleTransmission"))  # type: ignore[union-attr]
    return transmission


def _set_mjcf_friction(root: Element, joint: Element, numbers: dict[str, float]) -> None:
    """Give a joint its friction, LuGre's (Canudas de Wit et al. 1995) by a passive motor.

    The motor's steady torque is (tau_c + (tau_s - tau_c) exp(-(v / omega_s)^2)) sign(v), and it holds at rest. Unless
    the log shows the bristles, they bend by 1 mrad or 1 mm before they slip, and their damping is 1 ms of their
    stiffness: that keeps a joint at rest, and lets a simulator step by 1 to 2 ms.
    """
    own = [numbers.pop(name, 0.0) for name in ("tau_c", "tau_s", "omega_s")]
    stiffness = numbers.pop("sigma_0", own[1] / 1e-3)
    damping = numbers.pop("sigma_1", stiffness * 1e-3)
    if own[1] > 0:
        name = joint.getAttribute("name")
        motor = {"name": f"friction of {name}", "joint": name, "input": "none", "motorconst": "0 0"}
        lugre = np.array([stiffness, damping, *own])
        set_numbers(add(child(root, "actuator"), "dcmotor", **motor), resistance=1.0, lugre=lugre)
        numbers["frictionloss"] = 0.0
    set_numbers(joint, **numbers)


def _include(parent: Element, folder: Path) -> None:
    """Put the content of included files in the place of each <include>; all paths are relative to the main file."""
    for element in [node for node in parent.childNodes if isinstance(node, Element)]:
        if element.tagName == "include":
            _, included = read_document(folder / element.getAttribute("file"))
            _include(included, folder)
            for node in list(included.childNodes):
                parent.insertBefore(node, element)
            remove(element)
        else:
            _include(element, folder)


def _bodies(parent: Element, name: str) -> Iterator[tuple[str, Element]]:
    """Yield the bodies below an element with Pinocchio's names: one without a name has its parent's and "Bis"."""
    for body in children(parent, "body"):
        own = body.getAttribute("name") or f"{name}Bis"
        yield own, body
        yield from _bodies(body, own)


def _set_mjcf_inertia(inertial: Element, link: pin.Inertia) -> None:
    for name in ("quat", "axisangle", "xyaxes", "zaxis", "euler", "diaginertia"):  # must not stand next to a matrix
        if inertial.hasAttribute(name):
            inertial.removeAttribute(name)
    entries = link.inertia[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)]
    set_numbers(inertial, pos=link.lever, mass=float(link.mass), fullinertia=entries)


def _move_mjcf_files(root: Element, source: Path, folder: Path) -> None:
    """Let the folders of meshes and textures be the same, seen from another folder."""
    if source.resolve() == folder.resolve():
        return
    compilers = children(root, "compiler") or [child(root, "compiler")]
    stated = [(compiler, name) for compiler in compilers for name in ("assetdir", "meshdir", "texturedir")]
    stated = [(compiler, name) for compiler, name in stated if compiler.hasAttribute(name)]
    for compiler, name in stated:
        compiler.setAttribute(name, moved(compiler.getAttribute(name), source, folder))
    if "assetdir" not in [name for _, name in stated]:
        compilers[-1].setAttribute("assetdir", moved("", source, folder))

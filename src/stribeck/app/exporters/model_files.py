"""Robot models with changed inertias, joint friction and rotor inertias: URDF, URDF for Drake, and MJCF."""

import os
import re
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from xml.dom.minidom import Document, Element, Text, parse, parseString

import numpy as np
import pinocchio as pin

from stribeck.app.exporters.targets import Request
from stribeck.app.exporters.text_files import SOLREFFRICTION
from stribeck.core.base.typing import Array
from stribeck.core.robot.xml_file import read_xml
from stribeck.simulation import expanded_mjcf, mjcf_of_urdf, stable_bristles


def urdf_text(request: Request) -> str:
    """Format the robot's URDF with the changed links and joints."""
    return _text(_changed_urdf(request, ("friction", "damping")), request.lines)


def drake_text(request: Request) -> str:
    """Format the robot's URDF with the changed links and joints, and transmissions with the rotor inertias.

    Drake's MultibodyPlant has no dry joint friction (1.51 warns about a URDF's `friction` and ignores it). The damping
    approximates all of the friction up to the log's top speed.
    """
    root = _changed_urdf(request, ("damping",))
    root.setAttribute("xmlns:drake", "http://drake.mit.edu")
    for joint in _children(root, "joint"):
        name = joint.getAttribute("name")
        stated = request.numbers(name)
        if "damping" in stated and _child(joint, "dynamics").hasAttribute("friction"):
            _child(joint, "dynamics").removeAttribute("friction")  # included in the damping
        if "rotor_inertia" in stated:
            actuator = _child(_transmission(root, name), "actuator")
            actuator.setAttribute("name", actuator.getAttribute("name") or name)
            _set_numbers(_child(actuator, "drake:rotor_inertia"), value=stated["rotor_inertia"])
            _set_numbers(_child(actuator, "drake:gear_ratio"), value=1.0)  # the inertia is on the joint side
    return _text(root, request.lines)


def mjcf_text(request: Request) -> str:
    """Format the robot's MJCF with the changed bodies and joints; included files are inlined.

    A URDF is converted to MJCF first, and generated bodies are written out.
    """
    from stribeck.core.robot.mjcf import generates  # MuJoCo is slow to import

    notes: list[str] = []
    xml = read_xml(request.robot.model_file)
    if xml.kind == "urdf":
        text, notes = mjcf_of_urdf(request.robot.model_file, request.folder, floating=request.robot.base == "floating")
        root = _root(parseString(text))  # nosec B318
    else:
        root = _read(request.robot.model_file)
        if generates(xml):
            root = _root(parseString(expanded_mjcf(request.robot.model_file)))  # nosec B318
            request.lines.append(
                "Generated bodies are written out: this is MuJoCo's own text of the model, in six digits."
            )
        _include(root, request.robot.model_file.parent)
        _move_mjcf_files(root, request.robot.model_file.parent, request.folder)
    stated = {name: terms.numbers for name, terms in request.joints.items()}
    bristles = stable_bristles(request.robot, stated)
    bodies = [body for world in _children(root, "worldbody") for body in world.getElementsByTagName("body")]
    for number, body in enumerate(bodies, 1):
        name = body.getAttribute("name") or f"body{number}"  # as the reader names it
        if name in request.links:
            _set_mjcf_inertia(_child(body, "inertial"), request.links[name])
        for place, joint in enumerate(_children(body, "joint")):
            if (joint_name := joint.getAttribute("name") or f"{name}_joint{place}") in stated:
                _set_mjcf_friction(root, joint, stated[joint_name], bristles.get(joint_name))
    for name, coupling in request.result.couplings.items():
        if name in stated:
            tendon = _add(_child(root, "tendon"), "fixed", name=f"friction of {name}")
            for part, coefficient in coupling.joints.items():
                _set_numbers(_add(tendon, "joint", joint=part), coef=coefficient)
            _set_mjcf_friction(root, tendon, stated[name], None)
    for compiler in _children(root, "compiler") if request.links else []:
        if compiler.getAttribute("inertiafromgeom") == "true":
            compiler.setAttribute("inertiafromgeom", "auto")  # use stated inertias instead of the shapes'
    if bristles:
        step = 1e3 * min(bristle[2] for bristle in bristles.values())
        notes.append(f"LuGre friction is stable at steps of {step:.2g} ms and less; `--friction plain` at all steps.")
    return _text(root, [*request.lines, *notes])


MODELS = {"urdf": urdf_text, "drake": drake_text, "mjcf": mjcf_text}
"""Functions that format a robot's model, by target."""


def _changed_urdf(request: Request, words: Collection[str]) -> Element:
    """Parse the robot's URDF and change its links and joints; `words` are attributes of <dynamics>."""
    root = _read(request.robot.model_file)
    for link in _children(root, "link"):
        if new := request.links.get(link.getAttribute("name")):
            inertial = _child(link, "inertial")
            _set_numbers(_child(inertial, "mass"), value=float(new.mass))
            _set_numbers(_child(inertial, "origin"), xyz=new.lever, rpy=np.zeros(3))
            entries = {f"i{'xyz'[i]}{'xyz'[j]}": float(new.inertia[i, j]) for i in range(3) for j in range(i, 3)}
            _set_numbers(_child(inertial, "inertia"), **entries)
    for joint in _children(root, "joint"):
        stated = request.numbers(joint.getAttribute("name"))
        if numbers := {word: value for word, value in stated.items() if word in words}:
            _set_numbers(_child(joint, "dynamics"), **numbers)
    _move_urdf_files(root, request.robot.model_file.parent, request.folder)
    return root


def _move_urdf_files(root: Element, source: Path, folder: Path) -> None:
    """Adapt relative paths of meshes and textures to the new folder; paths with a scheme such as package:// stay.

    A folder of meshes named by MuJoCo's URDF extension is adapted instead.
    """
    compilers = [compiler for extension in _children(root, "mujoco") for compiler in _children(extension, "compiler")]
    strips = any(compiler.getAttribute("strippath") == "true" for compiler in compilers)
    places = [compiler for compiler in compilers if compiler.hasAttribute("meshdir")] or compilers[-1:] * strips
    for compiler in places:
        compiler.setAttribute("meshdir", _moved(compiler.getAttribute("meshdir"), source, folder))
    if places and not strips:
        return  # file names are relative to that folder
    for element in [*root.getElementsByTagName("mesh"), *root.getElementsByTagName("texture")]:
        name = element.getAttribute("filename")
        if name and "://" not in name:
            element.setAttribute("filename", _moved(name, source, folder))


def _transmission(root: Element, joint: str) -> Element:
    """Find the joint's transmission of the type that Drake reads, or append one."""
    for transmission in _children(root, "transmission"):
        nodes = [node for element in _children(transmission, "type") for node in element.childNodes]
        kinds = [node.data.strip() for node in nodes if isinstance(node, Text)]
        simple = any(kind.endswith("SimpleTransmission") for kind in kinds)
        if simple and joint in [element.getAttribute("name") for element in _children(transmission, "joint")]:
            return transmission
    transmission = _add(root, "transmission", name=f"rotor of {joint}")
    _child(transmission, "joint").setAttribute("name", joint)
    _child(transmission, "type").appendChild(_document(root).createTextNode("SimpleTransmission"))
    return transmission


def _set_mjcf_friction(
    root: Element, joint: Element, numbers: Mapping[str, float], bristles: tuple[float, float, float] | None
) -> None:
    """Write the friction of a joint; LuGre friction (Canudas de Wit et al. 1995) as a passive motor.

    Plain friction acts as soon as the time step allows. By default, a joint with little inertia needs a high speed
    until it has all of its Coulomb friction. The motor's steady torque is
    (tau_c + (tau_s - tau_c) exp(-(v / omega_s)^2)) sign(v), and it holds at rest.
    """
    attributes = {name: value for name, value in numbers.items() if name in ("frictionloss", "damping", "armature")}
    if bristles:
        name = joint.getAttribute("name")
        motor = {"name": f"friction of {name}", "joint": name, "input": "none", "motorconst": "0 0"}
        lugre = np.array([*bristles[:2], *(numbers[word] for word in ("tau_c", "tau_s", "omega_s"))])
        _set_numbers(_add(_child(root, "actuator"), "dcmotor", **motor), resistance=1.0, lugre=lugre)
    if bristles or "tau_s" in numbers:
        attributes["frictionloss"] = 0.0
    if attributes.get("frictionloss"):
        _set_numbers(joint, solreffriction=np.array(SOLREFFRICTION))
    _set_numbers(joint, **attributes)


def _include(parent: Element, folder: Path) -> None:
    """Replace each <include> by the content of its file; all paths are relative to the main file."""
    for element in [node for node in parent.childNodes if isinstance(node, Element)]:
        if element.tagName == "include":
            included = _read(folder / element.getAttribute("file"))
            _include(included, folder)
            for node in list(included.childNodes):
                parent.insertBefore(node, element)
            parent.removeChild(element)
        else:
            _include(element, folder)


def _set_mjcf_inertia(inertial: Element, link: pin.Inertia) -> None:
    for name in ("quat", "axisangle", "xyaxes", "zaxis", "euler", "diaginertia"):  # not allowed next to a matrix
        if inertial.hasAttribute(name):
            inertial.removeAttribute(name)
    entries = link.inertia[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)]
    _set_numbers(inertial, pos=link.lever, mass=float(link.mass), fullinertia=entries)


def _move_mjcf_files(root: Element, source: Path, folder: Path) -> None:
    """Adapt the folders of meshes and textures to another folder."""
    if source.resolve() == folder.resolve():
        return
    compilers = _children(root, "compiler") or [_child(root, "compiler")]
    for name in ("assetdir", "meshdir", "texturedir"):
        stated = [compiler for compiler in compilers if compiler.hasAttribute(name)]
        for compiler in stated or compilers[-1:] * (name == "assetdir"):
            compiler.setAttribute(name, _moved(compiler.getAttribute(name), source, folder))


def _read(path: Path) -> Element:
    """Parse a well-formed file and return its root element, comments included."""
    read_xml(path)  # refuses a missing file, deep nesting, and entities
    return _root(parse(str(path)))  # nosec B318


def _root(document: Document) -> Element:
    assert document.documentElement is not None
    return document.documentElement


def _document(element: Element) -> Document:
    assert element.ownerDocument is not None
    return element.ownerDocument


def _text(root: Element, comment: Iterable[str]) -> str:
    """Format a document below a comment."""
    lines = [re.sub("[^\t\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", " ", line) for line in comment]  # not in XML
    head = ["<!--", *("  " + re.sub("-(?=-)", "- ", line) for line in lines), "-->"]  # two hyphens would end it
    parts = (node.toxml() for node in _document(root).childNodes)
    return "\n".join(['<?xml version="1.0" encoding="utf-8"?>', *head, *parts]) + "\n"


def _children(parent: Element, tag: str) -> list[Element]:
    """List an element's direct children with a tag, also within an MJCF's <frame>."""
    nodes = [node for node in parent.childNodes if isinstance(node, Element) and node.tagName in (tag, "frame")]
    return [child for node in nodes for child in ([node] if node.tagName == tag else _children(node, tag))]


def _child(parent: Element, tag: str) -> Element:
    """Find the first direct child with a tag, or insert one before the others."""
    if children := _children(parent, tag):
        return children[0]
    first = parent.firstChild
    new = parent.insertBefore(_document(parent).createElement(tag), first)
    if isinstance(first, Text) and not first.data.strip():
        parent.insertBefore(_document(parent).createTextNode(first.data), new)
    return new


def _add(parent: Element, tag: str, **attributes: str) -> Element:
    """Append a new child."""
    new = parent.appendChild(_document(parent).createElement(tag))
    for name, value in attributes.items():
        new.setAttribute(name, value)
    return new


def _set_numbers(element: Element, **attributes: float | Array) -> None:
    """Set attributes to numbers with all digits."""
    for name, value in attributes.items():
        element.setAttribute(name, " ".join(map(repr, np.atleast_1d(value).tolist())))


def _moved(path: str, source: Path, target: Path) -> str:
    """Convert a path relative to the folder `source` to one relative to the folder `target`."""
    if Path(path).is_absolute() or source.resolve() == target.resolve():
        return path
    return Path(os.path.relpath((source / path).resolve(), target.resolve())).as_posix()

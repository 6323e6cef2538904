"""An MJCF with other inertias, joint friction and rotor inertias; of a URDF, made from it."""

from collections.abc import Iterator
from pathlib import Path
from xml.dom.minidom import Element

import numpy as np

from stribeck.export.document import child, children, document_text, moved, read_document, remove, set_numbers
from stribeck.export.forms import plain, stribeck
from stribeck.export.links import LinkInertia
from stribeck.export.mjcf_of_urdf import mjcf_of_urdf
from stribeck.export.mujoco_ranges import mujoco_ranges
from stribeck.export.target import Request, Target
from stribeck.robot.model_file import kind_of

BREAKAWAY, BRISTLE_TIME = 1e-3, 1e-3
"""How far LuGre's bristles bend before they slip [rad], [m], and their damping over their stiffness [s].

Unless the log shows them; a thousandth keeps a joint at rest and lets a simulator step by 1 to 2 ms.
"""

ORIENTATIONS = ("quat", "axisangle", "xyaxes", "zaxis", "euler", "diaginertia")
"""What an inertial may state and must not beside the whole matrix."""


def mjcf_text(request: Request) -> str:
    """Return the robot's MJCF with bodies and joints changed; included files are put in their place.

    Of a robot whose model is URDF, the MJCF is made of that.
    """
    if kind_of(request.model) == "urdf":
        floating = request.robot.base == "floating"
        document, root, notes = mjcf_of_urdf(request.model, request.folder, floating=floating)
    else:
        document, root = read_document(request.model)
        notes = []
        _include(root, request.model.parent)
        _move_files(root, request.model.parent, request.folder)
    for world in children(root, "worldbody"):
        for name, body in _bodies(world, ""):
            if name in request.links:
                _set_inertia(child(body, "inertial"), request.links[name])
            for joint in children(body, "joint"):
                if terms := request.joints.get(joint.getAttribute("name")):
                    _set_friction(root, joint, {name: value for name, (value, _) in terms.stated.items()})
    if request.links:
        _state_inertias(root)
    return document_text(document, [*request.lines, *notes])


TARGET = Target(
    title="MuJoCo: frictionloss or LuGre, damping, armature",
    forms={
        "plain": plain(coulomb="frictionloss", viscous="damping", armature="armature"),
        "lugre": stribeck(
            coulomb="tau_c",
            static="tau_s",
            stribeck_velocity="omega_s",
            viscous="damping",
            bristle_stiffness="sigma_0",
            bristle_damping="sigma_1",
            armature="armature",
        ),
    },
    suffix=".xml",
    text=mjcf_text,
    ranges=mujoco_ranges,
    models=("mjcf", "urdf"),
)


def _set_friction(root: Element, joint: Element, numbers: dict[str, float]) -> None:
    """Give a joint its friction, LuGre's (Canudas de Wit et al. 1995) by a passive motor.

    The motor's steady torque is (tau_c + (tau_s - tau_c) exp(-(v / omega_s)^2)) sign(v), and it holds at rest.
    """
    own = [numbers.pop(name, 0.0) for name in ("tau_c", "tau_s", "omega_s")]
    stiffness = numbers.pop("sigma_0", own[1] / BREAKAWAY)
    damping = numbers.pop("sigma_1", stiffness * BRISTLE_TIME)
    if own[1] > 0:
        motor = root.ownerDocument.createElement("dcmotor")  # type: ignore[union-attr]
        name = joint.getAttribute("name")
        for key, text in {"name": f"friction of {name}", "joint": name, "input": "none", "motorconst": "0 0"}.items():
            motor.setAttribute(key, text)
        set_numbers(motor, resistance=1.0, lugre=np.array([stiffness, damping, *own]))
        child(root, "actuator").appendChild(motor)
        numbers["frictionloss"] = 0.0
    set_numbers(joint, **numbers)


def _include(parent: Element, folder: Path) -> None:
    """Put what included files hold in the place of each <include>; all paths are relative to the main file."""
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


def _set_inertia(inertial: Element, link: LinkInertia) -> None:
    for name in ORIENTATIONS:
        if inertial.hasAttribute(name):
            inertial.removeAttribute(name)
    rows, columns = (0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)
    set_numbers(inertial, pos=link.centre, mass=link.mass, fullinertia=link.inertia[rows, columns])


def _state_inertias(root: Element) -> None:
    """Let stated inertias count where the file would take those of the shapes instead."""
    for compiler in children(root, "compiler"):
        if compiler.getAttribute("inertiafromgeom") == "true":
            compiler.setAttribute("inertiafromgeom", "auto")


def _move_files(root: Element, source: Path, folder: Path) -> None:
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

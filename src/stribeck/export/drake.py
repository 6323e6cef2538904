"""A URDF as Drake reads it: joint damping, and rotor inertias in transmissions.

Drake's MultibodyPlant has no dry friction of joints (1.51 says so of a URDF's `friction`, and ignores it), so that the
damping is the nearest to all of the friction, up to the log's top speed.
"""

from xml.dom.minidom import Element

from stribeck.export.document import child, children, document_text, set_numbers, set_text, text_of
from stribeck.export.forms import viscous
from stribeck.export.target import Request, Target
from stribeck.export.urdf import changed_document

NAMESPACE = "http://drake.mit.edu"


def drake_text(request: Request) -> str:
    """Return the robot's URDF with links and joints changed, and transmissions with the rotor inertias."""
    document, root = changed_document(request, words=("damping",))
    root.setAttribute("xmlns:drake", NAMESPACE)
    for joint in children(root, "joint"):
        if terms := request.joints.get(joint.getAttribute("name")):
            if "damping" in terms.stated and child(joint, "dynamics").hasAttribute("friction"):
                child(joint, "dynamics").removeAttribute("friction")  # is in the damping
            if "rotor_inertia" in terms.stated:
                _set_rotor(root, joint.getAttribute("name"), terms.stated["rotor_inertia"][0])
    return document_text(document, request.lines)


TARGET = Target(
    title="Drake: URDF with damping and rotor inertias",
    forms={"viscous": viscous(viscous="damping", armature="rotor_inertia")},
    suffix=".urdf",
    text=drake_text,
    models=("urdf",),
)


def _set_rotor(root: Element, joint: str, inertia: float) -> None:
    """State a rotor inertia as it is felt at the joint, so that the gear ratio is one."""
    actuator = child(_transmission(root, joint), "actuator")
    if not actuator.hasAttribute("name"):
        actuator.setAttribute("name", joint)
    set_numbers(child(actuator, "drake:rotor_inertia"), value=inertia)
    set_numbers(child(actuator, "drake:gear_ratio"), value=1.0)


def _transmission(root: Element, joint: str) -> Element:
    """Return the transmission of a joint, of the one type that Drake reads; it is made where there is none."""
    for transmission in children(root, "transmission"):
        simple = any(text_of(own).endswith("SimpleTransmission") for own in children(transmission, "type"))
        if simple and joint in [own.getAttribute("name") for own in children(transmission, "joint")]:
            return transmission
    document = root.ownerDocument
    assert document is not None
    transmission = document.createElement("transmission")
    root.appendChild(transmission)
    transmission.setAttribute("name", f"rotor of {joint}")
    child(transmission, "joint").setAttribute("name", joint)
    set_text(child(transmission, "type"), "SimpleTransmission")
    return transmission

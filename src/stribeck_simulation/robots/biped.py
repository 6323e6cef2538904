"""The biped that comes with stribeck: a table of solids, and the URDF that is made of it.

23 joints, 60 kg, 1.64 m; every part is a solid box or cylinder, so its inertia follows from mass and size. The right
side is the mirror image of the left one. `python -m stribeck_simulation.robots.biped` writes `models/biped.urdf` anew.
"""

from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

MODELS = Path(__file__).parent / "models"
"""Folder of the packaged model and its robot file."""

Vector = tuple[float, float, float]
AXES = {"roll": "1 0 0", "pitch": "0 1 0", "yaw": "0 0 1"}


@dataclass(frozen=True)
class Part:
    """A link, and the joint on which it hangs.

    Attributes
    ----------
    joint
        Name of the joint, and of the link that it moves.
    parent
        Link it hangs on.
    axis
        "roll", "pitch" or "yaw".
    origin
        Joint in the parent's frame [m].
    limits
        Lowest and highest position [rad], then effort [N m] and speed [rad/s].
    mass
        [kg]
    size
        Box: length along x, y and z [m]; cylinder: radius and length along z [m].
    centre
        Of the solid in the joint's frame [m].
    """

    joint: str
    parent: str
    axis: str
    origin: Vector
    limits: tuple[float, float, float, float]
    mass: float
    size: Vector | tuple[float, float]
    centre: Vector


LEG = (
    Part("hip_roll", "pelvis", "roll", (0, 0.09, -0.06), (-0.6, 0.6, 150, 6), 1.2, (0.10, 0.08, 0.08), (-0.02, 0, 0)),
    Part("hip_pitch", "hip_roll", "pitch", (0, 0, 0), (-1.8, 0.8, 150, 6), 1.0, (0.05, 0.08), (0, 0.01, 0)),
    Part("hip_yaw", "hip_pitch", "yaw", (0, 0, 0), (-0.8, 0.8, 150, 6), 5.5, (0.06, 0.30), (0.01, 0, -0.18)),
    Part("knee", "hip_yaw", "pitch", (0, 0, -0.38), (0.0, 2.4, 150, 8), 3.2, (0.045, 0.30), (0.01, 0, -0.17)),
    Part("ankle_pitch", "knee", "pitch", (0, 0, -0.38), (-1.2, 0.8, 80, 8), 0.6, (0.06, 0.06, 0.05), (0, 0, 0)),
    Part("ankle_roll", "ankle_pitch", "roll", (0, 0, 0), (-0.5, 0.5, 80, 8), 1.1, (0.22, 0.10, 0.04), (0.04, 0, -0.06)),
)
ARM = (
    Part("shoulder_pitch", "waist", "pitch", (0, 0.21, 0.34), (-2.5, 2.5, 60, 8), 0.9, (0.08, 0.08, 0.08), (0, 0, 0)),
    Part("shoulder_roll", "shoulder_pitch", "roll", (0, 0.02, 0), (-1.8, 1.8, 60, 8), 0.7, (0.04, 0.08), (0, 0, -0.03)),
    Part("shoulder_yaw", "shoulder_roll", "yaw", (0, 0, 0), (-1.6, 1.6, 60, 8), 1.6, (0.04, 0.22), (0, 0, -0.15)),
    Part("elbow", "shoulder_yaw", "pitch", (0, 0, -0.27), (-2.2, 0.0, 60, 8), 1.4, (0.035, 0.26), (0.01, 0, -0.13)),
)
TRUNK = (
    Part("waist", "pelvis", "yaw", (0, 0, 0.10), (-1.0, 1.0, 100, 6), 14.1, (0.20, 0.34, 0.36), (0, 0, 0.20)),
    Part("neck_yaw", "waist", "yaw", (0, 0, 0.40), (-1.2, 1.2, 10, 6), 0.5, (0.03, 0.06), (0, 0, 0.02)),
    Part(
        "neck_pitch", "neck_yaw", "pitch", (0, 0, 0.05), (-0.6, 0.8, 10, 6), 3.0, (0.18, 0.15, 0.19), (0.02, 0, 0.095)
    ),
)
PELVIS_MASS, PELVIS_SIZE = 8.0, (0.16, 0.26, 0.16)
"""[kg], [m]; centred on the root link's origin."""
SOLE: Vector = (0.04, 0.0, -0.08)
"""Sole in the frame of the last ankle joint [m]."""


def mirrored(part: Part, side: str) -> Part:
    """Return a left part under the name of its side; for the right side reflected in the plane y = 0."""
    sign = 1.0 if side == "left" else -1.0
    low, high, effort, speed = part.limits
    if side == "right" and part.axis != "pitch":
        low, high = -high, -low
    parent = part.parent if part.parent in ("pelvis", "waist") else f"{side}_{part.parent}"
    return Part(
        f"{side}_{part.joint}",
        parent,
        part.axis,
        (part.origin[0], sign * part.origin[1], part.origin[2]),
        (low, high, effort, speed),
        part.mass,
        part.size,
        (part.centre[0], sign * part.centre[1], part.centre[2]),
    )


def biped_parts() -> list[Part]:
    """Return the 23 parts beside the pelvis, parents first."""
    sides = [mirrored(part, side) for side in ("left", "right") for part in LEG]
    arms = [mirrored(part, side) for side in ("left", "right") for part in ARM]
    return [*sides, TRUNK[0], *arms, *TRUNK[1:]]


def biped_urdf() -> str:
    """Return the text of the biped's URDF."""
    root = ElementTree.Element("robot", name="biped")
    _add_link(root, "pelvis", PELVIS_MASS, PELVIS_SIZE, (0, 0, 0))
    for part in biped_parts():
        _add_link(root, part.joint + "_link", part.mass, part.size, part.centre)
        joint = _add_joint(root, part.joint, "revolute", part.parent, part.joint, part.origin)
        ElementTree.SubElement(joint, "axis", xyz=AXES[part.axis])
        keys = ("lower", "upper", "effort", "velocity")
        limits = {key: f"{value:g}" for key, value in zip(keys, part.limits, strict=True)}
        ElementTree.SubElement(joint, "limit", limits)
    for side in ("left", "right"):
        ElementTree.SubElement(root, "link", name=f"{side}_sole_link")
        _add_joint(root, f"{side}_sole", "fixed", f"{side}_ankle_roll", f"{side}_sole", SOLE)
    ElementTree.indent(root)
    comment = "<!-- Made by stribeck_simulation.robots.biped: solid boxes and cylinders. -->\n"
    return '<?xml version="1.0"?>\n' + comment + ElementTree.tostring(root, encoding="unicode") + "\n"


def solid_inertia(mass: float, size: Vector | tuple[float, float]) -> Vector:
    """Return the principal moments of a solid box, or of a cylinder along z, about its centre [kg m^2]."""
    if len(size) == 2:
        radius, length = size
        across = mass * (3 * radius**2 + length**2) / 12
        return across, across, mass * radius**2 / 2
    x, y, z = size
    return mass * (y**2 + z**2) / 12, mass * (x**2 + z**2) / 12, mass * (x**2 + y**2) / 12


def _add_link(
    root: ElementTree.Element, name: str, mass: float, size: Vector | tuple[float, float], centre: Vector
) -> None:
    link = ElementTree.SubElement(root, "link", name=name)
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "origin", xyz=_text(centre))
    ElementTree.SubElement(inertial, "mass", value=f"{mass:g}")
    moments = dict(zip(("ixx", "iyy", "izz"), solid_inertia(mass, size), strict=True))
    products = dict.fromkeys(("ixy", "ixz", "iyz"), "0")
    ElementTree.SubElement(inertial, "inertia", {key: f"{value:.9g}" for key, value in moments.items()} | products)
    visual = ElementTree.SubElement(link, "visual")
    ElementTree.SubElement(visual, "origin", xyz=_text(centre))
    geometry = ElementTree.SubElement(visual, "geometry")
    if len(size) == 2:
        ElementTree.SubElement(geometry, "cylinder", radius=f"{size[0]:g}", length=f"{size[1]:g}")
    else:
        ElementTree.SubElement(geometry, "box", size=_text(size))


def _add_joint(
    root: ElementTree.Element, name: str, kind: str, parent: str, child: str, origin: Vector
) -> ElementTree.Element:
    joint = ElementTree.SubElement(root, "joint", name=name, type=kind)
    ElementTree.SubElement(joint, "parent", link=parent if parent == "pelvis" else parent + "_link")
    ElementTree.SubElement(joint, "child", link=child + "_link")
    ElementTree.SubElement(joint, "origin", xyz=_text(origin))
    return joint


def _text(vector: Vector) -> str:
    return " ".join(f"{value + 0.0:g}" for value in vector)


if __name__ == "__main__":
    (MODELS / "biped.urdf").write_text(biped_urdf(), encoding="utf-8")

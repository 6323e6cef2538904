"""The TORO-like humanoid as a table: 27 joints, 79.2 kg, 1.74 m.

Joints, their order, limits of torque, speed and range, total mass and height follow Table 4.1, Fig. 4.1 and section 4.1
of Egle 2021. DLR's dimensions and inertias are not public, therefore lengths follow human proportions (hip at 0.90 m,
thigh and shank 0.40 m, shoulder at 1.40 m), and masses follow drive sizes (about 2.5 kg for a hip unit, 1 to 2 kg for
an arm unit). Each link consists of a few solids with constant density, which determine its inertia. The drive of the
ankle's pitch is at the knee, as in TORO. Rotor inertia is omitted, because a torque sensor behind the gear does not
measure it.

The right side is the mirror image of the left one. Every joint frame has the root's axes in the zero position: x
forward, y left, z up; the root is the pelvis, its origin midway between the hips.
"""

from dataclasses import dataclass, replace

Vector = tuple[float, float, float]

ROLL, PITCH, YAW = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
FLEXION = (0.0, -1.0, 0.0)
"""Axis of the elbow, which only bends forward."""
SIDES = ("left", "right")
CENTRAL = ("pelvis", "waist", "neck_yaw", "neck_pitch")
"""Links without a side."""


@dataclass(frozen=True)
class Drive:
    """Motor and gear of Table 4.1: largest torque at the joint [N m], and largest speed [deg/s]."""

    effort: float
    speed: float


ILM85_160 = Drive(176, 110)
ILM85_100 = Drive(130, 176)
ILM70 = Drive(100, 157)
ILM50 = Drive(40, 120)
MS106T = Drive(8.4, 270)


@dataclass(frozen=True)
class Solid:
    """A solid with constant density.

    Attributes
    ----------
    mass
        Mass [kg].
    size
        Box: lengths along x, y and z [m]; cylinder: radius and length [m]; ball: radius [m].
    centre
        Center in the link's frame [m].
    axis
        Axis of a cylinder: "x", "y" or "z".
    """

    mass: float
    size: Vector | tuple[float, float] | tuple[float]
    centre: Vector = (0.0, 0.0, 0.0)
    axis: str = "z"


@dataclass(frozen=True)
class Link:
    """A link and the joint that moves it.

    Attributes
    ----------
    name
        Name of the joint and of its body.
    parent
        Name of the parent link.
    axis
        Axis of the joint as a unit vector.
    origin
        Position of the joint in the parent's frame [m].
    range
        Lowest and highest position [deg].
    drive
        Limits of torque and speed.
    solids
        Solids that make up the link.
    """

    name: str
    parent: str
    axis: Vector
    origin: Vector
    range: tuple[float, float]
    drive: Drive
    solids: tuple[Solid, ...]


PELVIS = (Solid(7.0, (0.16, 0.20, 0.16), (-0.02, 0.0, 0.06)),)
"""The root link."""

# The printed range of the hip's roll has a wrong sign ("±45 ± 90"); this table uses 90 degrees outward, 45 inward.
# fmt: off
LEG = (
    Link("hip_roll", "pelvis", ROLL, (0.0, 0.10, 0.0), (-45, 90), ILM85_160,
         (Solid(2.6, (0.055, 0.11), (-0.07, 0, 0), "x"),)),
    Link("hip_pitch", "hip_roll", PITCH, (0.0, 0.0, 0.0), (-115, 90), ILM70,
         (Solid(2.2, (0.05, 0.10), (0, 0.03, 0), "y"),)),
    Link("hip_yaw", "hip_pitch", YAW, (0.0, 0.0, 0.0), (-120, 120), ILM70,
         (Solid(2.2, (0.05, 0.12), (0, 0, -0.10)), Solid(2.4, (0.055, 0.22), (0, 0, -0.27)))),
    Link("knee", "hip_yaw", PITCH, (0.0, 0.0, -0.40), (-105, 105), ILM85_100,
         (Solid(1.6, (0.05, 0.09), (-0.02, 0, -0.05), "y"), Solid(2.3, (0.045, 0.32), (0.01, 0, -0.20)))),
    Link("ankle_roll", "knee", ROLL, (0.0, 0.0, -0.40), (-19.5, 19.5), ILM50,
         (Solid(0.7, (0.03, 0.08), (0, 0, 0), "x"),)),
    Link("ankle_pitch", "ankle_roll", PITCH, (0.0, 0.0, 0.0), (-45, 45), ILM85_100,
         (Solid(0.6, (0.03, 0.06), (0, 0, -0.03), "y"), Solid(1.0, (0.20, 0.10, 0.03), (0.03, 0, -0.085)))),
)
ARM = (
    Link("shoulder_1", "waist", PITCH, (0.0, 0.17, 0.36), (-120, 120), ILM70,
         (Solid(2.0, (0.05, 0.10), (0, 0.02, 0), "y"),)),
    Link("shoulder_2", "shoulder_1", ROLL, (0.0, 0.07, 0.0), (-15, 180), ILM70,
         (Solid(1.8, (0.05, 0.10), (0, 0, 0), "x"),)),
    Link("shoulder_3", "shoulder_2", YAW, (0.0, 0.0, 0.0), (-105, 105), ILM50,
         (Solid(1.8, (0.045, 0.22), (0, 0, -0.16)),)),
    Link("elbow", "shoulder_3", FLEXION, (0.0, 0.0, -0.30), (0, 148), ILM50,
         (Solid(1.4, (0.04, 0.12), (0, 0, -0.05)),)),
    Link("wrist_1", "elbow", YAW, (0.0, 0.0, -0.12), (-145, 118), ILM50,
         (Solid(0.9, (0.035, 0.12), (0, 0, -0.07)),)),
    Link("wrist_2", "wrist_1", PITCH, (0.0, 0.0, -0.14), (-105, 105), ILM50,
         (Solid(0.6, (0.05,), (0, 0, -0.07)),)),
)
WAIST = Link("waist", "pelvis", YAW, (0.0, 0.0, 0.14), (-120, 120), ILM70,
             (Solid(14.0, (0.20, 0.26, 0.30), (0.0, 0, 0.26)), Solid(7.0, (0.12, 0.24, 0.26), (-0.15, 0, 0.26))))
NECK = (
    Link("neck_yaw", "waist", YAW, (0.02, 0.0, 0.42), (-90, 90), MS106T,
         (Solid(0.6, (0.03, 0.06), (0, 0, 0.02)),)),
    Link("neck_pitch", "neck_yaw", PITCH, (0.0, 0.0, 0.06), (-30, 90), MS106T,
         (Solid(2.4, (0.16, 0.16, 0.20), (0.02, 0, 0.12)),)),
)
# fmt: on
FOOT_SIZE = (0.20, 0.10)
"""Length and width of the sole's box [m]."""
SOLE: Vector = (0.03, 0.0, -0.10)
"""Middle of the sole in the frame of the last ankle joint [m]."""


def on_side(link: Link, side: str) -> Link:
    """Name a left link by its side; for the right side, mirror it at the plane y = 0."""
    parent = link.parent if link.parent in CENTRAL else f"{side}_{link.parent}"
    link = replace(link, name=f"{side}_{link.name}", parent=parent)
    if side == "left":
        return link
    low, high = link.range
    return replace(
        link,
        origin=_reflected(link.origin),
        range=(low, high) if link.axis in (PITCH, FLEXION) else (-high, -low),
        solids=tuple(replace(solid, centre=_reflected(solid.centre)) for solid in link.solids),
    )


def toro_links() -> list[Link]:
    """List the 27 links except the pelvis, parents first: right leg, left leg, then the upper body."""
    legs = [on_side(link, side) for side in ("right", "left") for link in LEG]
    arms = [on_side(link, side) for side in ("right", "left") for link in ARM]
    return [*legs, WAIST, *arms, *NECK]


def standing_posture() -> dict[str, float]:
    """Return joint positions [rad] with bent knees, level feet and hanging arms; all other joints are at zero."""
    leg = {"hip_pitch": -0.35, "knee": 0.70, "ankle_pitch": -0.35}
    arm = {"shoulder_1": 0.15, "shoulder_2": 0.15, "elbow": 0.50}
    posture = {f"{side}_{joint}": value for side in SIDES for joint, value in {**leg, **arm}.items()}
    return {**posture, "right_shoulder_2": -arm["shoulder_2"]}


def _reflected(point: Vector) -> Vector:
    return (point[0], -point[1], point[2])

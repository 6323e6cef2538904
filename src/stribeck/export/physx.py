"""Joint friction of PhysX: its parameters in SI units, and the attributes of a USD joint."""

import json
import math

from stribeck.export.forms import plain
from stribeck.export.ranges import ranges_json
from stribeck.export.target import Request, Target

PARAMETERS = ("staticFrictionEffort", "dynamicFrictionEffort", "viscousFrictionCoefficient")
"""Of PxJointFrictionParams (PhysX 5.6 and newer)."""

PER_DEGREE = math.pi / 180
"""USD has velocities of revolute joints in degrees per second, PhysX in radians per second [rad/deg]."""


def physx_text(request: Request) -> str:
    """Return the file: by joint what PhysX takes, in SI units, and what a USD prim of the joint has."""
    prismatic = dict(zip(request.robot.joint_names, request.robot.prismatic, strict=True))
    joints = {}
    for name, terms in request.joints.items():
        numbers = {word: value for word, (value, _) in terms.stated.items()}
        axis = "linear" if prismatic[name] else "angular"
        friction = {word: numbers[word] for word in PARAMETERS if word in numbers}
        joints[name] = {
            **({"PxJointFrictionParams": friction} if friction else {}),
            **({"armature": numbers["armature"]} if "armature" in numbers else {}),
            "usd": {"apiSchemas": [f"PhysxJointAxisAPI:{axis}"], **_attributes(numbers, axis)},
        }
    return json.dumps({"about": request.lines, "robot": request.result.robot, "joints": joints}, indent=2) + "\n"


TARGET = Target(
    title="PhysX: joint friction of articulations, and the attributes of USD, as JSON",
    forms={
        "plain": plain(
            static="staticFrictionEffort",
            coulomb="dynamicFrictionEffort",
            viscous="viscousFrictionCoefficient",
            armature="armature",
        )
    },
    suffix=".json",
    text=physx_text,
    ranges=ranges_json,
)


def _attributes(numbers: dict[str, float], axis: str) -> dict[str, float]:
    """Return the attributes of PhysxJointAxisAPI, of a stage in metres and kilograms."""
    scales = {"viscousFrictionCoefficient": PER_DEGREE} if axis == "angular" else {}
    return {f"physxJointAxis:{axis}:{word}": value * scales.get(word, 1.0) for word, value in numbers.items()}

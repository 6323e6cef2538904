"""A Python module that gives a robot in Newton what was found of its joints: a builder's robot, or one in USD."""

from stribeck.export.forms import plain
from stribeck.export.python_text import docstring, joints_text
from stribeck.export.ranges import ranges_json
from stribeck.export.target import Request, Target

MODULE = '''
import math

{joints}
"""Joint -> what was found, in SI units."""


def set_friction(builder):
    """Give the joints of a newton.ModelBuilder (Newton 1.8) their friction, damping and armature, by their names.

    Of a robot that was added several times, each gets them.
    """
    names = [label.rsplit("/", 1)[-1] for label in builder.joint_label]
    for name, found in JOINTS.items():
        if name not in names:
            raise ValueError(f"the builder has no joint '{{name}}'; it has {{', '.join(dict.fromkeys(names))}}")
        for joint in (k for k, own in enumerate(names) if own == name):
            at = builder.joint_qd_start[joint]
            for word, value in found.items():
                getattr(builder, f"joint_{{word}}")[at] = value


def author_friction(stage):
    """Give the joints of a USD stage the attributes of NewtonJointAPI, by the names of their prims.

    The stage is in metres and kilograms; `newton:damping` of a revolute joint is per degree.
    """
    from pxr import Sdf, Tf

    joints = [prim for prim in stage.Traverse() if prim.GetTypeName().endswith("Joint")]
    for name, found in JOINTS.items():
        prims = [prim for prim in joints if prim.GetName() in (name, Tf.MakeValidIdentifier(name))]
        if not prims:
            there = ", ".join(prim.GetName() for prim in joints)
            raise ValueError(f"the stage has no joint '{{name}}'; it has {{there}}")
        for prim in prims:
            prim.AddAppliedSchema("NewtonJointAPI")
            for word, value in found.items():
                per_degree = word == "damping" and prim.GetTypeName() == "PhysicsRevoluteJoint"
                attribute = prim.CreateAttribute(f"newton:{{word}}", Sdf.ValueTypeNames.Float)
                attribute.Set(math.radians(value) if per_degree else value)
'''


def newton_text(request: Request) -> str:
    """Return the module."""
    return docstring(request.lines) + MODULE.format(joints=joints_text(request.joints))


TARGET = Target(
    title="Newton: friction, damping, armature of a builder's joints, or of USD's",
    forms={"plain": plain(coulomb="friction", viscous="damping", armature="armature")},
    suffix=".py",
    text=newton_text,
    ranges=ranges_json,
)

"""A Python module that gives an entity of Genesis the friction and rotor inertias that were found."""

from stribeck.export.forms import plain
from stribeck.export.python_text import docstring, joints_text
from stribeck.export.ranges import ranges_json
from stribeck.export.target import Request, Target

MODULE = '''
{joints}
"""Joint -> what was found, in SI units."""


def set_friction(entity):
    """Give the joints of an entity their frictionloss, damping and armature, after `scene.build()`."""
    for name, found in JOINTS.items():
        at = entity.get_joint(name).dofs_idx_local
        for word, value in found.items():
            getattr(entity, f"set_dofs_{{word}}")([value], at)
'''


def genesis_text(request: Request) -> str:
    """Return the module."""
    return docstring(request.lines) + MODULE.format(joints=joints_text(request.joints))


TARGET = Target(
    title="Genesis: frictionloss, damping, armature of an entity",
    forms={"plain": plain(coulomb="frictionloss", viscous="damping", armature="armature")},
    suffix=".py",
    text=genesis_text,
    ranges=ranges_json,
)

"""A Python module that gives a Pinocchio model the friction and rotor inertias that were found."""

from stribeck.export.forms import plain
from stribeck.export.python_text import docstring, joints_text
from stribeck.export.target import Request, Target

MODULE = '''
{joints}
"""Joint -> what was found, in SI units."""


def set_friction(model):
    """Give the joints of a pinocchio.Model (Pinocchio 4) their dry friction, damping and armature, by their names.

    Pinocchio's `crba`, `rnea` and `aba` take the armature in; dry friction and damping are for its constraint solvers
    and for simulators that read them from the model.
    """
    for name in JOINTS:
        if not model.existJointName(name):
            raise ValueError(f"the model has no joint '{{name}}'; it has {{', '.join(list(model.names)[1:])}}")
    for name, found in JOINTS.items():
        at = model.joints[model.getJointId(name)].idx_v
        if "friction" in found:
            model.lowerDryFrictionLimit[at] = -found["friction"]
            model.upperDryFrictionLimit[at] = found["friction"]
            model.damping[at] = found["damping"]
        if "armature" in found:
            model.armature[at] = found["armature"]
'''


def pinocchio_text(request: Request) -> str:
    """Return the module."""
    return docstring(request.lines) + MODULE.format(joints=joints_text(request.joints))


TARGET = Target(
    title="Pinocchio: dry friction limits, damping, armature of a model",
    forms={"plain": plain(coulomb="friction", viscous="damping", armature="armature")},
    suffix=".py",
    text=pinocchio_text,
)

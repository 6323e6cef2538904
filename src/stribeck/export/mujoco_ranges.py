"""A Python module of ranges by degree of freedom, for MuJoCo, MJX and Playground."""

from collections.abc import Mapping

from stribeck.export.python_text import dictionary_text, docstring
from stribeck.export.ranges import JointRanges

MODULE = '''
{ranges}
"""Joint -> field of the model -> lowest and highest value, in SI units."""


def bounds(model):
    """Return field -> lowest and highest value of each degree of freedom, shape (nv,), of a mujoco.MjModel.

    Where there is no range both are what the model has. A randomisation in JAX draws between them, for as many models
    as it likes, and replaces the fields of its mjx.Model.
    """
    fields = sorted({{field for found in RANGES.values() for field in found}})
    ends = {{field: (getattr(model, field).copy(), getattr(model, field).copy()) for field in fields}}
    for name, found in RANGES.items():
        at = model.joint(name).dofadr[0]
        for field, values in found.items():
            for end, value in zip(ends[field], values):
                end[at] = value
    return ends


def randomize(model, generator):
    """Draw the numbers of a mujoco.MjModel in place, each by itself, with a generator of NumPy."""
    import mujoco

    for field, (low, high) in bounds(model).items():
        getattr(model, field)[:] = generator.uniform(low, high)
    mujoco.mj_setConst(model, mujoco.MjData(model))
'''


def mujoco_ranges(lines: list[str], joints: Mapping[str, JointRanges]) -> str:
    """Return the module."""
    fields = {name: {f"dof_{word}": ends for word, ends in own.numbers.items()} for name, own in joints.items()}
    return docstring(lines) + MODULE.format(ranges=dictionary_text("RANGES", fields))

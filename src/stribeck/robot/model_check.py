"""Compares what Pinocchio read from a model file with what the file says.

Pinocchio's MJCF reader drops bodies inside `<frame>` without a word, loops are opened, and coupled joints become
independent: each is found, here by parsing the file a second time, in `mjcf_check` by compiling it with MuJoCo.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pinocchio as pin

from stribeck.errors import RobotFileError
from stribeck.typing import Array

ROUNDING, LEAST = 1e-3, 1e-9
"""By how much moments of inertia may miss what a rigid body has: relative, and below zero [kg m^2]; digits are few."""
RELATIVE_TOLERANCE = 1e-5
"""Largest relative difference of mass and inertia matrix that counts as equal; model files have six digits."""


def check_finite(path: Path, model: pin.Model) -> None:
    """Refuse a model with a pose or an inertia that is not a number, or is infinite.

    Raises
    ------
    RobotFileError
        Naming the joint behind which it is.
    """
    for joint in range(model.njoints):
        numbers = [model.jointPlacements[joint].homogeneous, model.inertias[joint].matrix()]
        if not all(np.isfinite(matrix).all() for matrix in numbers):
            raise RobotFileError(
                f"{path}: pose or inertia of joint '{model.names[joint]}' holds a value that is not finite; "
                "expected plain numbers"
            )


def check_inertias(name: str, model: pin.Model, lines: Mapping[str, str] | None = None) -> list[str]:
    """Return warnings: a body whose inertia no rigid body can have, a joint that moves neither mass nor inertia.

    `lines` says in which line of the file each link of impossible inertia is; only what a joint carries as a whole
    changes its torque.
    """
    warnings = []
    impossible = []
    for joint in range(1, model.njoints):
        inertia = model.inertias[joint]
        if inertia.mass < 0 or not is_possible(inertia.inertia):
            own = [frame.name for frame in model.frames if frame.parentJoint == joint and frame.name in (lines or {})]
            links = ", ".join(f"link '{link}' in {lines[link]}" for link in own) if lines else ""
            impossible.append(f"{model.names[joint]} ({links})" if links else str(model.names[joint]))
    if impossible:
        warnings.append(
            f"{name}: no rigid body has the inertia given for what these joints carry: {', '.join(impossible)}"
        )
    matrix = pin.crba(model, model.createData(), pin.neutral(model))
    empty = [
        str(model.names[joint])
        for joint in range(1, model.njoints)
        if model.joints[joint].nv == 1 and matrix[model.joints[joint].idx_v, model.joints[joint].idx_v] <= 0
    ]
    if empty:
        warnings.append(f"{name}: these joints move neither mass nor inertia: {', '.join(empty)}")
    return warnings


def is_possible(moments: Array) -> bool:
    """Return whether moments of inertia, shape (3, 3), are positive semidefinite and obey the triangle inequality."""
    least, middle, most = np.linalg.eigvalsh(moments)
    return bool(least >= -LEAST and least + middle >= most * (1 - ROUNDING))


def require_same_joints(path: Path, expected: set[str], model: pin.Model) -> None:
    """Refuse a model whose joints are not those of its file."""
    read = {
        str(model.names[joint])
        for joint in range(1, model.njoints)
        if model.joints[joint].nv == 1 or str(model.names[joint]) in expected
    }
    missing, extra = sorted(expected - read), sorted(read - expected)
    if missing or extra:
        found = " and ".join(
            part
            for part in (
                f"lost joint(s) {', '.join(missing)}" if missing else "",
                f"made up joint(s) {', '.join(extra)}" if extra else "",
            )
            if part
        )
        hint = "; move bodies out of <frame> elements and give each body one joint" if path.suffix != ".urdf" else ""
        raise RobotFileError(f"{path}: Pinocchio {found} when it read the model{hint}")


def require_same_mass(path: Path, expected: float, model: pin.Model) -> None:
    """Refuse a model whose mass is not that of its file [kg]."""
    read = sum(inertia.mass for inertia in model.inertias)
    if not abs(read - expected) <= RELATIVE_TOLERANCE * max(abs(expected), 1e-9):
        raise RobotFileError(
            f"{path}: Pinocchio read a mass of {read:.6g} kg where the file has {expected:.6g} kg; "
            "some body was dropped or counted twice"
        )

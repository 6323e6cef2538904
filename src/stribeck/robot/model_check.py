"""Compares what Pinocchio read from a model file with what the file says.

Pinocchio's MJCF reader drops bodies inside `<frame>` without a word, loops are opened, and coupled joints become
independent: each is found, here by parsing the file a second time, in `mjcf_check` by compiling it with MuJoCo.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from stribeck.errors import RobotFileError

RELATIVE_TOLERANCE = 1e-5
"""Largest relative difference of mass and inertia matrix that counts as equal; model files have six digits."""


def check_urdf_links(path: Path) -> None:
    """Refuse a URDF whose joints name links that it does not define, or that has no name.

    Raises
    ------
    RobotFileError
        Naming the joint and the link.
    """
    root = ElementTree.parse(path).getroot()
    links = {link.get("name") for link in root.findall("link")}
    if not root.get("name"):
        raise RobotFileError(f'{path}: the <robot> element has no name; write <robot name="...">')
    for joint in root.findall("joint"):
        for end in ("parent", "child"):
            element = joint.find(end)
            link = element.get("link") if element is not None else None
            if link not in links:
                raise RobotFileError(
                    f"{path}: joint '{joint.get('name')}' has the {end} link '{link}', which the file does not define; "
                    f'add <link name="{link}"/> or remove the joint'
                )


def check_urdf(path: Path, model: pin.Model) -> list[str]:
    """Compare joints and total mass with the URDF's own text, and return warnings.

    Raises
    ------
    RobotFileError
        If joints or mass differ.
    """
    root = ElementTree.parse(path).getroot()
    moving = {
        str(joint.get("name"))
        for joint in root.findall("joint")
        if joint.get("type") not in ("fixed", "floating", "planar")
    }
    require_same_joints(path, moving, model)
    mass = sum(float(element.get("value", "nan")) for element in root.findall("link/inertial/mass"))
    require_same_mass(path, mass, model)
    coupled = [name for name in moving if root.find(f"joint[@name='{name}']/mimic") is not None]
    warnings = []
    if coupled:
        warnings.append(f"{path.name}: mimic joints are taken as independent: {', '.join(sorted(coupled))}")
    return warnings + check_inertias(path.name, model)


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


def check_inertias(name: str, model: pin.Model) -> list[str]:
    """Return warnings: a body whose inertia no rigid body can have, a joint that moves neither mass nor inertia."""
    warnings = []
    impossible = []
    for joint in range(1, model.njoints):
        inertia = model.inertias[joint]
        moments = np.linalg.eigvalsh(inertia.inertia)
        if inertia.mass < 0 or moments[0] < -1e-9 or moments[0] + moments[1] < moments[2] * (1 - 1e-3):
            impossible.append(str(model.names[joint]))
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

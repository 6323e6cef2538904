"""Compares what Pinocchio read from a model file with what the file says.

Pinocchio's MJCF reader drops bodies inside `<frame>` without a word, loops are opened, and coupled joints become
independent: each is found here, by parsing the file a second time or by compiling it with MuJoCo.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from warnings import catch_warnings, simplefilter
from xml.etree import ElementTree

import mujoco
import numpy as np
import pinocchio as pin

from stribeck.errors import RobotFileError
from stribeck.rooting import is_floating

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
    _require_same_joints(path, moving, model)
    mass = sum(float(element.get("value", "nan")) for element in root.findall("link/inertial/mass"))
    _require_same_mass(path, mass, model)
    coupled = [name for name in moving if root.find(f"joint[@name='{name}']/mimic") is not None]
    warnings = []
    if coupled:
        warnings.append(f"{path.name}: mimic joints are taken as independent: {', '.join(sorted(coupled))}")
    return warnings + check_inertias(path.name, model)


@contextmanager
def _quiet_mujoco() -> Iterator[None]:
    """Keep MuJoCo's warnings from becoming Python's, and from a MUJOCO_LOG.TXT in the working folder.

    What they are about, masses too small to simulate and NaN in the file, is found and said by the checks here.
    """
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        with catch_warnings():
            simplefilter("ignore", UserWarning)
            yield
    finally:
        mujoco.set_mju_user_warning(before)


@_quiet_mujoco()
def check_mjcf(path: Path, model: pin.Model) -> list[str]:
    """Compile the file with MuJoCo, compare joints, mass and inertia matrix, and return warnings.

    Raises
    ------
    RobotFileError
        If MuJoCo cannot compile the file, or the two read different robots from it.
    """
    compiled = _compile_mjcf(path)
    hinges = [
        joint
        for joint in range(compiled.njnt)
        if int(compiled.jnt_type[joint]) in (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    ]
    names = [compiled.joint(joint).name for joint in hinges]
    if not all(names):
        raise RobotFileError(f"{path}: {names.count('')} joint(s) have no name; give every <joint> a name")
    _require_same_joints(path, set(names), model)
    _require_same_mass(path, float(compiled.body_mass.sum()), model)
    theirs = [int(compiled.jnt_dofadr[joint]) for joint in hinges]
    ours = [int(model.joints[model.getJointId(name)].idx_v) for name in names]
    if is_floating(model):  # both have a free joint first; upright, world and body coordinates are the same
        theirs, ours = [*range(6), *theirs], [*range(6), *ours]
    difference = _inertia_difference(compiled, model, hinges, names, theirs, ours)
    if not difference <= RELATIVE_TOLERANCE:
        raise RobotFileError(
            f"{path}: Pinocchio's joint-space inertia matrix differs from MuJoCo's by {difference:.2g} relative; "
            "simplify the model (<compiler> without eulerseq, balanceinertia and boundinertia) or use its URDF"
        )
    warnings = check_inertias(path.name, model)
    if compiled.neq:
        warnings.append(f"{path.name}: {compiled.neq} equality constraint(s) are left out: the tree alone is modelled")
    return warnings


def _compile_mjcf(path: Path) -> mujoco.MjModel:
    """Compile with MuJoCo; where meshes are missing, without them if every moving body states its inertia."""
    try:
        return mujoco.MjSpec.from_file(str(path)).compile()
    except ValueError:
        pass
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        for geom in list(spec.geoms):
            if geom.type in (mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_HFIELD, mujoco.mjtGeom.mjGEOM_SDF):
                spec.delete(geom)
        for asset in [*spec.meshes, *spec.hfields, *spec.skins]:
            spec.delete(asset)
        return spec.compile()
    except ValueError as error:
        raise RobotFileError(f"{path}: MuJoCo cannot compile this model: {' '.join(str(error).split())}") from error


def _inertia_difference(
    compiled: mujoco.MjModel,
    model: pin.Model,
    hinges: list[int],
    names: list[str],
    theirs: list[int],
    ours: list[int],
) -> float:
    """Return the largest relative difference of the two joint-space inertia matrices at a few configurations."""
    data, mujoco_data = model.createData(), mujoco.MjData(compiled)
    generator = np.random.default_rng(0)
    worst = 0.0
    for _ in range(3):
        configuration = pin.neutral(model)
        mujoco_data.qpos[:] = compiled.qpos0
        if is_floating(model):
            mujoco_data.qpos[3:7] = 1, 0, 0, 0
        for joint, name in zip(hinges, names, strict=True):
            value = generator.uniform(-1.0, 1.0)
            joint_model = model.joints[model.getJointId(name)]
            entry = [value] if joint_model.nq == 1 else [np.cos(value), np.sin(value)]
            configuration[joint_model.idx_q : joint_model.idx_q + joint_model.nq] = entry
            mujoco_data.qpos[compiled.jnt_qposadr[joint]] = value
        mujoco.mj_forward(compiled, mujoco_data)
        full = np.zeros((compiled.nv, compiled.nv))
        mujoco.mj_fullM(compiled, mujoco_data, full)
        reference = full[np.ix_(theirs, theirs)]
        matrix = pin.crba(model, data, configuration)
        matrix = np.triu(matrix) + np.triu(matrix, 1).T
        difference = np.abs(matrix[np.ix_(ours, ours)] - reference).max(initial=0.0)
        worst = float(np.maximum(worst, difference / np.abs(reference).max(initial=1e-12)))
    return worst


def check_sdf(model: pin.Model) -> list[str]:
    """Return warnings about a model built from SDF; its reader keeps every link by construction."""
    return check_inertias(model.name, model)


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


def _require_same_joints(path: Path, expected: set[str], model: pin.Model) -> None:
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


def _require_same_mass(path: Path, expected: float, model: pin.Model) -> None:
    read = sum(inertia.mass for inertia in model.inertias)
    if not abs(read - expected) <= RELATIVE_TOLERANCE * max(abs(expected), 1e-9):
        raise RobotFileError(
            f"{path}: Pinocchio read a mass of {read:.6g} kg where the file has {expected:.6g} kg; "
            "some body was dropped or counted twice"
        )

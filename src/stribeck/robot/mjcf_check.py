"""Compares what Pinocchio read from an MJCF file with what MuJoCo reads from it.

A file of its own, since MuJoCo is slow to import and only these robots need it.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from warnings import catch_warnings, simplefilter

import mujoco
import numpy as np
import pinocchio as pin

from stribeck.errors import RobotFileError
from stribeck.robot.model_check import RELATIVE_TOLERANCE, check_inertias, require_same_joints, require_same_mass
from stribeck.robot.rooting import is_floating


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
def check_mjcf(path: Path, compiled: mujoco.MjModel, model: pin.Model) -> list[str]:
    """Compare joints, mass and inertia matrix with those that MuJoCo reads, and return warnings.

    Raises
    ------
    RobotFileError
        If the two read different robots from the file.
    """
    hinges = [
        joint
        for joint in range(compiled.njnt)
        if int(compiled.jnt_type[joint]) in (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    ]
    names = [compiled.joint(joint).name for joint in hinges]
    if not all(names):
        raise RobotFileError(f"{path}: {names.count('')} joint(s) have no name; give every <joint> a name")
    require_same_joints(path, set(names), model)
    require_same_mass(path, float(compiled.body_mass.sum()), model)
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
    return check_inertias(path.name, model)


def add_loop_frames(path: Path, compiled: mujoco.MjModel, model: pin.Model) -> list[str]:
    """Add frames where `<connect>` holds bodies together, and say how to use them, and what is left out otherwise.

    Those of equality NAME are NAME.1 and NAME.2, in the place of a missing name stands its number.
    """
    if not compiled.neq:
        return []
    pairs = []
    for k in range(compiled.neq):
        of_bodies = int(compiled.eq_objtype[k]) == int(mujoco.mjtObj.mjOBJ_BODY)
        if int(compiled.eq_type[k]) != int(mujoco.mjtEq.mjEQ_CONNECT) or not of_bodies:
            continue
        name = compiled.equality(k).name or f"equality_{k}"
        for place, body in enumerate((int(compiled.eq_obj1id[k]), int(compiled.eq_obj2id[k]))):
            anchor = pin.SE3(np.eye(3), np.array(compiled.eq_data[k, 3 * place : 3 * place + 3]))
            carrier = model.frames[model.getFrameId(compiled.body(body).name, pin.FrameType.BODY)] if body else None
            joint, placement = (carrier.parentJoint, carrier.placement * anchor) if carrier else (0, anchor)
            model.addFrame(pin.Frame(f"{name}.{place + 1}", joint, 0, placement, pin.FrameType.OP_FRAME), False)
        pairs.append(f"['{name}.1', '{name}.2']")
    cure = f"; [[robot.loops]] frames = {' and '.join(pairs)} close it" if pairs else ""
    return [f"{path.name}: {compiled.neq} equality constraint(s) are left out: the tree alone is modelled{cure}"]


@_quiet_mujoco()
def compile_mjcf(path: Path) -> mujoco.MjModel:
    """Compile with MuJoCo; where meshes are missing, without them if every moving body states its inertia.

    Raises
    ------
    RobotFileError
        If MuJoCo cannot compile the file.
    """
    try:
        return _compiled(path, with_meshes=True)
    except ValueError:
        pass
    try:
        return _compiled(path, with_meshes=False)
    except (ValueError, mujoco.FatalError) as error:
        raise RobotFileError(f"{path}: MuJoCo cannot compile this model: {' '.join(str(error).split())}") from error


def _compiled(path: Path, *, with_meshes: bool) -> mujoco.MjModel:
    spec = mujoco.MjSpec.from_file(str(path))
    spec.memory = spec.njmax = spec.nconmax = spec.nstack = -1  # nothing is simulated
    spec.nuserdata = 0
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT) | int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    if not with_meshes:
        for geom in list(spec.geoms):
            if geom.type in (mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_HFIELD, mujoco.mjtGeom.mjGEOM_SDF):
                spec.delete(geom)
        for asset in [*spec.meshes, *spec.hfields, *spec.skins]:
            spec.delete(asset)
    return spec.compile()


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

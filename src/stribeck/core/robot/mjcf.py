"""Check an MJCF file, and compare Pinocchio's model with MuJoCo's.

Only robots with MJCF models import MuJoCo, because that is slow.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from warnings import catch_warnings, simplefilter
from xml.etree.ElementTree import Element

import mujoco
import numpy as np
import pinocchio as pin

from stribeck.core.base.files import read_text
from stribeck.core.errors import RobotFileError
from stribeck.core.robot.model_check import RELATIVE_TOLERANCE, check_inertias, require_same_joints, require_same_mass
from stribeck.core.robot.rooting import is_floating
from stribeck.core.robot.xml_file import XmlFile, read_xml, require_few

MOST_FILES, LARGEST_COUNT = 100, 5000
"""Largest number of files of a model, and largest value [1] of attributes that count pixels, samples and the like."""


def check_file(xml: XmlFile) -> None:
    """Refuse elements in a file and its includes that make native readers hang, crash or drop numbers.

    Raises
    ------
    RobotFileError
        Names the element and its line.
    """
    files = list(_with_included(xml))
    require_few(files)
    compilers = [compiler for file in files for compiler in file.root.iter("compiler")]
    names = ("assetdir", "meshdir", "texturedir")
    folders = [xml.path.parent / compiler.get(name, "") for compiler in compilers for name in names]
    for file in files:
        read_text(file.path, "an MJCF model", RobotFileError)  # MuJoCo ignores the encoding
        for element in file.root.iter():
            _check_element(file, element)
            _refuse_pipes(file, element, [xml.path.parent, file.path.parent, *folders])


def _with_included(xml: XmlFile) -> Iterator[XmlFile]:
    """Yield a file and all files that it includes, each once."""
    pending, seen = [xml], {xml.path.resolve()}
    while pending:
        file = pending.pop()
        yield file
        for include in file.root.iter("include"):
            name = include.get("file") or ""
            for path in (xml.path.parent / name, file.path.parent / name):
                if name and path.exists() and path.resolve() not in seen:
                    if len(seen) >= MOST_FILES:
                        file.refuse(include, f"includes file number {MOST_FILES + 1}; expected at most {MOST_FILES}")
                    seen.add(path.resolve())
                    pending.append(read_xml(path))


def _check_element(xml: XmlFile, element: Element) -> None:
    counting = {"nrow", "ncol", "width", "height", "nsample", "nkey", "num", "resolution", "params"}
    # Attributes with poses and masses of bodies; MuJoCo reads `nan` as a missing number.
    measuring = {
        *("pos", "quat", "axisangle", "xyaxes", "zaxis", "euler", "axis", "ref", "armature"),
        *("mass", "diaginertia", "fullinertia", "density", "size", "fromto"),
    }
    tag = element.tag
    if tag in ("replicate", "composite", "flexcomp", "attach", "model"):  # a <model> could include itself
        xml.refuse(element, f"<{tag}> generates bodies, which Pinocchio does not read; write out the bodies")
    for name, text in element.items():
        counts = name in counting or name.startswith("nuser_") or (tag, name) == ("numeric", "size")
        measures = tag in ("body", "frame", "inertial", "joint", "geom") and name in measuring
        if not counts and not measures:
            continue
        values = xml.numbers(element, text, len(text.split()), f"{name} of <{tag}>")
        if counts and max(values, default=0.0) > LARGEST_COUNT:
            xml.refuse(element, f"{name} of <{tag}> is {text[:60]}; expected at most {LARGEST_COUNT}")
        if name in ("mass", "diaginertia", "density", "armature") and min(values, default=0.0) < 0:
            xml.refuse(element, f"{name} of <{tag}> is {text}; expected zero or more")


def _refuse_pipes(xml: XmlFile, element: Element, folders: list[Path]) -> None:
    """Refuse named pipes and devices as meshes or textures, because reading them would never end."""
    paths = [Path(text) for name, text in element.items() if name.startswith("file") and text]
    for candidate in (folder / path for folder in folders for file in paths for path in (file, Path(file.name))):
        if candidate.exists() and not candidate.is_file() and not candidate.is_dir():
            xml.refuse(element, f"<{element.tag}> names {candidate}, a pipe, a device or a socket; expected a file")


@contextmanager
def quiet_mujoco() -> Iterator[None]:
    """Silence MuJoCo's warnings, which would become Python warnings and a MUJOCO_LOG.TXT in the working folder.

    They concern masses too small to simulate and NaN in the file; the checks here detect both.
    """
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        with catch_warnings():
            simplefilter("ignore", UserWarning)
            yield
    finally:
        mujoco.set_mju_user_warning(before)


@quiet_mujoco()
def check_mjcf(path: Path, compiled: mujoco.MjModel, model: pin.Model) -> list[str]:
    """Compare joints, mass and inertia matrix with MuJoCo's, and collect warnings.

    Raises
    ------
    RobotFileError
        If Pinocchio and MuJoCo read different robots from the file.
    """
    kinds = {int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)}
    joints = [joint for joint in map(compiled.joint, range(compiled.njnt)) if int(joint.type[0]) in kinds]
    names = [joint.name for joint in joints]
    if not all(names):
        raise RobotFileError(f"{path}: {names.count('')} joint(s) have no name; give every <joint> a name")
    require_same_joints(path, set(names), model)
    require_same_mass(path, float(compiled.body_mass.sum()), model)
    difference = _inertia_difference(compiled, model, names)
    if not difference <= RELATIVE_TOLERANCE:
        raise RobotFileError(
            f"{path}: Pinocchio's joint-space inertia matrix differs from MuJoCo's by {difference:.2g} relative; "
            "simplify the model (<compiler> without eulerseq, balanceinertia and boundinertia) or use its URDF"
        )
    return check_inertias(path.name, model, {})


def _inertia_difference(compiled: mujoco.MjModel, model: pin.Model, names: list[str]) -> float:
    """Compute the largest relative difference of the two joint-space inertia matrices at three configurations."""
    data, simulated = model.createData(), mujoco.MjData(compiled)
    generator = np.random.default_rng(0)
    root = range(6 if is_floating(model) else 0)  # if upright, its world and body coordinates agree
    theirs = [*root, *(int(compiled.joint(name).dofadr[0]) for name in names)]
    ours = [*root, *(int(model.joints[model.getJointId(name)].idx_v) for name in names)]
    places = [int(compiled.joint(name).qposadr[0]) for name in names]
    worst = 0.0
    for _ in range(3):
        positions = np.zeros(model.nv)
        positions[ours[len(root) :]] = values = generator.uniform(-1.0, 1.0, len(names))
        configuration = pin.integrate(model, pin.neutral(model), positions)
        simulated.qpos[:] = compiled.qpos0
        if root:
            simulated.qpos[3:7] = 1, 0, 0, 0
        simulated.qpos[places] = values
        mujoco.mj_forward(compiled, simulated)
        full = np.zeros((compiled.nv, compiled.nv))
        mujoco.mj_fullM(compiled, simulated, full)
        reference = full[np.ix_(theirs, theirs)]
        matrix = pin.crba(model, data, configuration)
        matrix = np.triu(matrix) + np.triu(matrix, 1).T
        difference = np.abs(matrix[np.ix_(ours, ours)] - reference).max(initial=0.0)
        worst = float(np.maximum(worst, difference / np.abs(reference).max(initial=1e-12)))
    return worst


def add_loop_frames(path: Path, compiled: mujoco.MjModel, model: pin.Model) -> list[str]:
    """Add frames where `<connect>` joins bodies, and describe how to use them.

    The frames of equality NAME are NAME.1 and NAME.2; without a name, its number is used.
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
    remedy = f"; to close the loops, set [[robot.loops]] frames = {' and '.join(pairs)}" if pairs else ""
    return [f"{path.name}: {compiled.neq} equality constraint(s) are ignored: only the tree is modeled{remedy}"]


@quiet_mujoco()
def compile_mjcf(path: Path) -> mujoco.MjModel:
    """Compile a model with MuJoCo; if meshes are missing, without them, provided that all moving bodies state inertias.

    Raises
    ------
    RobotFileError
        If MuJoCo cannot compile the file.
    """
    try:
        return _compile(path, with_meshes=True)
    except ValueError:
        pass
    try:
        return _compile(path, with_meshes=False)
    except (ValueError, mujoco.FatalError) as error:
        raise RobotFileError(f"{path}: MuJoCo cannot compile this model: {' '.join(str(error).split())}") from error


def _compile(path: Path, *, with_meshes: bool) -> mujoco.MjModel:
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

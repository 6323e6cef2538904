"""Check an MJCF file by line, and compare what Pinocchio read from it with what MuJoCo reads.

Only robots with MJCF models need MuJoCo, which is slow to import.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from warnings import catch_warnings, simplefilter
from xml.etree.ElementTree import Element

import mujoco
import numpy as np
import pinocchio as pin

from stribeck.base.files import read_text
from stribeck.errors import RobotFileError
from stribeck.robot.model_check import RELATIVE_TOLERANCE, check_inertias, require_same_joints, require_same_mass
from stribeck.robot.rooting import is_floating
from stribeck.robot.xml_file import XmlFile, read_xml, require_few

MOST_FILES, LARGEST_COUNT = 100, 5000
"""Largest number of files of a model, and of what MuJoCo makes as many of as the file asks: pixels, samples [1]."""
COUNTS = {"nrow", "ncol", "width", "height", "nsample", "nkey", "num", "resolution", "params"}
MEASURES = {
    *("pos", "quat", "axisangle", "xyaxes", "zaxis", "euler", "axis", "ref", "armature"),
    *("mass", "diaginertia", "fullinertia", "density", "size", "fromto"),
}
"""Attributes with the places and masses of bodies; MuJoCo takes `nan` for a missing number."""


def check_file(xml: XmlFile) -> None:
    """Refuse what would make native readers hang or crash, or drop a number, in the file and those that it includes.

    Raises
    ------
    RobotFileError
        Naming the element and its line.
    """
    files = list(_with_included(xml))
    require_few(files)
    compilers = [compiler for file in files for compiler in file.root.iter("compiler")]
    names = ("assetdir", "meshdir", "texturedir")
    folders = [xml.path.parent / compiler.get(name, "") for compiler in compilers for name in names]
    for file in files:
        read_text(file.path, "an MJCF model", RobotFileError)  # MuJoCo takes bytes as they are, whatever the encoding
        for element in file.root.iter():
            _check_element(file, element)
            _refuse_pipes(file, element, [xml.path.parent, file.path.parent, *folders])


def _with_included(xml: XmlFile) -> Iterator[XmlFile]:
    """Yield a file and all that it includes, each once."""
    pending, seen = [xml], {xml.path.resolve()}
    while pending:
        file = pending.pop()
        yield file
        for include in file.root.iter("include"):
            name = include.get("file") or ""
            for path in (xml.path.parent / name, file.path.parent / name):
                if name and path.exists() and path.resolve() not in seen:
                    if len(seen) >= MOST_FILES:
                        file.refuse(include, f"includes the {MOST_FILES + 1}th file; expected {MOST_FILES} at most")
                    seen.add(path.resolve())
                    pending.append(read_xml(path))


def _check_element(xml: XmlFile, element: Element) -> None:
    tag = element.tag
    if tag in ("replicate", "composite", "flexcomp", "attach", "model"):  # <model> may even name its own file
        xml.refuse(element, f"<{tag}> makes bodies that Pinocchio does not read; write the bodies themselves")
    for name, text in element.items():
        counts = name in COUNTS or name.startswith("nuser_") or (tag, name) == ("numeric", "size")
        measures = tag in ("body", "frame", "inertial", "joint", "geom") and name in MEASURES
        if not counts and not measures:
            continue
        values = xml.numbers(element, text, len(text.split()), f"{name} of <{tag}>")
        if counts and max(values, default=0.0) > LARGEST_COUNT:
            xml.refuse(element, f"{name} of <{tag}> is {text[:60]}; expected {LARGEST_COUNT} at most")
        if name in ("mass", "diaginertia", "density", "armature") and min(values, default=0.0) < 0:
            xml.refuse(element, f"{name} of <{tag}> is {text}; expected zero or more")


def _refuse_pipes(xml: XmlFile, element: Element, folders: list[Path]) -> None:
    """Refuse named pipes and devices as meshes, textures and the like: reading them would never end."""
    paths = [Path(text) for name, text in element.items() if name.startswith("file") and text]
    for candidate in (folder / path for folder in folders for own in paths for path in (own, Path(own.name))):
        if candidate.exists() and not candidate.is_file() and not candidate.is_dir():
            xml.refuse(element, f"<{element.tag}> names {candidate}, which is a pipe, a device or a socket")


@contextmanager
def quiet_mujoco() -> Iterator[None]:
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


@quiet_mujoco()
def check_mjcf(path: Path, compiled: mujoco.MjModel, model: pin.Model) -> list[str]:
    """Compare joints, mass and inertia matrix with those that MuJoCo reads, and collect warnings.

    Raises
    ------
    RobotFileError
        If the two read different robots from the file.
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
    """Return the largest relative difference of the two joint-space inertia matrices at a few configurations."""
    data, simulated = model.createData(), mujoco.MjData(compiled)
    generator = np.random.default_rng(0)
    root = range(6 if is_floating(model) else 0)  # upright, world and body coordinates of the free joint are the same
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


@quiet_mujoco()
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

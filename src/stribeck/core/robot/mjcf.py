"""Check an MJCF file, and build Pinocchio's model from MuJoCo's.

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
from numpy.typing import NDArray

from stribeck.core.base.files import read_text
from stribeck.core.base.typing import Array
from stribeck.core.errors import RobotFileError
from stribeck.core.robot.rooting import WORLD_JOINT
from stribeck.core.robot.xml_file import MOST_ELEMENTS, MOST_JOINTS, XmlFile, read_xml

MOST_FILES, LARGEST_COUNT = 100, 5000
"""Largest number of files of a model, and of its bodies and joints, pixels, samples and the like [1]."""
GENERATING = ("replicate", "attach", "composite", "flexcomp")
"""Elements that generate bodies."""
FREE, BALL = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_BALL)


def check_file(xml: XmlFile) -> None:
    """Refuse elements in a file and its includes that make native readers hang, crash or drop numbers.

    Raises
    ------
    RobotFileError
        Names the element and its line.
    """
    parts = _parts(xml)
    files = list({file.path: file for _, file in parts}.values())
    compilers = [entry for file in files for compiler in file.root.iter("compiler") for entry in compiler.items()]
    names = {text for key, text in compilers if key.endswith("dir")}
    folders = [file.path.parent / name for file in files for name in names | {""}]
    for file in files:
        read_text(file.path, "an MJCF model", RobotFileError)  # MuJoCo ignores the encoding
        for element in file.root.iter():
            _check_element(file, element)
            _refuse_pipes(file, element, folders)
    _require_few(xml, parts)


def generates(xml: XmlFile) -> bool:
    """Return whether a file or one of its parts contains elements that generate bodies."""
    return any(file.root.find(f".//{tag}") is not None for _, file in _parts(xml) for tag in GENERATING)


def _parts(xml: XmlFile) -> list[tuple[Element, XmlFile]]:
    """List a file and those that it includes or attaches, each with the element that names it; each is read once."""
    files, parts = {xml.path.resolve(): xml}, [(Element("mujoco"), xml)]
    for file in (pending := [xml]):
        for element in (e for e in file.root.iter() if e.tag in ("include", "model") and e.get("file")):
            paths = {folder / element.get("file", "") for folder in (xml.path.parent, file.path.parent)}
            for path in {path.resolve() for path in paths if path.exists()}:
                if path not in files:
                    if len(files) >= MOST_FILES:
                        file.refuse(element, f"includes file number {MOST_FILES + 1}; expected at most {MOST_FILES}")
                    pending.append(files.setdefault(path, read_xml(path)))
                parts.append((element, files[path]))
    return parts


def _require_few(xml: XmlFile, parts: list[tuple[Element, XmlFile]]) -> None:
    """Refuse more bodies and joints than a scene has, such as those of a file that attaches itself."""
    pending, elements, generated = [(xml, xml.root, 1.0)], 0, 0.0
    while pending:
        file, element, copies = pending.pop()
        if element.tag in GENERATING:
            copies *= float(np.prod([max(float(word), 1.0) for word in element.get("count", "1").split()]))
        elements, generated = elements + 1, generated + copies * (element.tag in ("body", "joint", *GENERATING))
        if generated > LARGEST_COUNT or elements + len(pending) > MOST_ELEMENTS:
            file.refuse(element, f"the model has too many bodies; expected at most {LARGEST_COUNT} bodies and joints")
        pending += [(file, child, copies) for child in element]
        names = (element.get("model"), None) * (element.tag == "attach")
        for owner, part in parts:
            attached = owner.tag == "model" and owner.get("name") in names
            pending += [(part, part.root, copies)] * (attached or owner is element)


def _check_element(xml: XmlFile, element: Element) -> None:
    counting = {"nrow", "ncol", "width", "height", "nsample", "nkey", "num", "resolution", "params", "count"}
    # Attributes with poses and masses of bodies; MuJoCo reads `nan` as a missing number.
    poses, masses = "pos quat axisangle xyaxes zaxis euler axis ref fromto", "mass density diaginertia fullinertia"
    measuring = {*poses.split(), *masses.split(), "size", "armature", "offset"}
    for name, text in element.items():
        counts = name in counting or name.startswith("nuser_") or (element.tag, name) == ("numeric", "size")
        measures = element.tag in ("body", "frame", "inertial", "joint", "geom", "replicate") and name in measuring
        if not counts and not measures:
            continue
        values = xml.numbers(element, text, len(text.split()), f"{name} of <{element.tag}>")
        if counts and max(values, default=0.0) > LARGEST_COUNT:
            xml.refuse(element, f"{name} of <{element.tag}> is {text[:60]}; expected at most {LARGEST_COUNT}")
        if name in ("mass", "diaginertia", "density", "armature") and not all(0 <= value < 1e9 for value in values):
            xml.refuse(element, f"{name} of <{element.tag}> is {text}; expected zero or more, less than 1e9")


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


def build_model(compiled: mujoco.MjModel, root: pin.JointModelFreeFlyer | None) -> tuple[pin.Model, list[str]]:
    """Build Pinocchio's model from MuJoCo's, whose positions it keeps; also list the objects that are left out.

    Objects are mocap bodies, trees without a hinge or slide that has a name, and trees on free joints if another tree
    has more of them. With `root`, a free flyer connects a robot without a free joint to the world. Joints without names
    are named after their bodies. Vertices of soft parts of the robot are fixed.
    """
    model, named = pin.Model(), _named_joints(compiled)
    objects = _objects(compiled, named)
    kept = named | ~np.isin(compiled.jnt_bodyid, np.append(compiled.flex_vertbodyid, compiled.flex_nodebodyid))
    model.name = compiled.names.partition(b"\0")[0].decode()
    bodies = [number for number in range(1, compiled.nbody) if int(compiled.body_rootid[number]) not in objects]
    places = {0: (0, pin.SE3.Identity(), 0)}  # joint of each body, its pose there, and its frame
    if root and FREE not in compiled.jnt_type[np.isin(compiled.jnt_bodyid, bodies)]:
        above = model.addJoint(0, root, pin.SE3.Identity(), WORLD_JOINT)
        first = compiled.body(bodies[0])  # its frame is the root's, as if it had a free joint
        places[0] = above, _pose(first.pos, first.quat).inverse(), int(model.addJointFrame(above))
    for number in bodies:
        body = compiled.body(number)
        joint, pose, frame = places[int(body.parentid[0])]
        pose = pose * _pose(body.pos, body.quat)
        if model.njoints > MOST_JOINTS:
            raise ValueError(f"the robot has more than {MOST_JOINTS} joints")
        for place, k in enumerate(np.flatnonzero(kept & (compiled.jnt_bodyid == number)).tolist()):
            anchor, kind = _pose(compiled.jnt_pos[k], np.eye(4)[0]), int(compiled.jnt_type[k])
            label = compiled.joint(k).name or f"{body.name}_{'free' if kind == FREE else f'joint{place}'}"
            joint = _add_joint(model, compiled, k, label, joint, pose * anchor)
            frame, pose = int(model.addJointFrame(joint, frame)), anchor.inverse()
        inertia = _pose(body.ipos, body.iquat).act(pin.Inertia(float(body.mass[0]), np.zeros(3), np.diag(body.inertia)))
        frame = int(model.addFrame(pin.Frame(body.name, joint, frame, pose, pin.FrameType.BODY, inertia)))
        for site in (compiled.site(s) for s in np.flatnonzero(compiled.site_bodyid == number) if compiled.site(s).name):
            at = pose * _pose(site.pos, site.quat)
            model.addFrame(pin.Frame(site.name, joint, frame, at, pin.FrameType.OP_FRAME), False)
        places[number] = joint, pose, frame
    return model, [compiled.body(number).name for number in sorted(objects)]


def _named_joints(compiled: mujoco.MjModel) -> NDArray[np.bool_]:
    """Select the hinges and slides that have names, shape (njnt,), all of them if none has one."""
    moving = np.asarray(compiled.jnt_type > BALL)
    named = moving & np.array([bool(compiled.joint(k).name) for k in range(compiled.njnt)], dtype=bool)
    return named if named.any() else moving


def _objects(compiled: mujoco.MjModel, named: NDArray[np.bool_]) -> set[int]:
    """Find the top bodies that are not part of the robot."""
    tree = compiled.body_rootid[compiled.jnt_bodyid]
    loose = {*tree[compiled.jnt_type == FREE].tolist(), *np.flatnonzero(compiled.body_mocapid >= 0).tolist()}
    robot = int(np.argmax(sizes := np.bincount(tree[named], minlength=compiled.nbody)))
    kept = {robot} if robot in loose else set(np.flatnonzero(sizes).tolist()) - loose
    return (loose | set(tree.tolist())) - kept if named.any() else loose


def _add_joint(model: pin.Model, compiled: mujoco.MjModel, k: int, name: str, parent: int, pose: pin.SE3) -> int:
    """Add a joint of the compiled model with its limits and rotor, and return its number."""
    kind = int(compiled.jnt_type[k])
    if kind in (FREE, BALL):
        joint = pin.JointModelFreeFlyer() if kind == FREE else pin.JointModelSpherical()
        return int(model.addJoint(parent, joint, pin.SE3.Identity() if kind == FREE else pose, name))
    axis, slides = compiled.jnt_axis[k].copy(), kind == int(mujoco.mjtJoint.mjJNT_SLIDE)
    back = -float(compiled.qpos0[compiled.jnt_qposadr[k]]) * axis
    pose = pose * (pin.SE3(np.eye(3), back) if slides else pin.SE3(pin.exp3(back), np.zeros(3)))
    joint = (pin.JointModelPrismaticUnaligned if slides else pin.JointModelRevoluteUnaligned)(axis)
    limits = compiled.jnt_range[k] if compiled.jnt_limited[k] else (-np.inf, np.inf)
    effort = compiled.jnt_actfrcrange[k, 1] if compiled.jnt_actfrclimited[k] else np.inf
    number = int(model.addJoint(parent, joint, pose, name, *np.array([[effort], [np.inf], *([x] for x in limits)])))
    model.armature[model.joints[number].idx_v] = compiled.dof_armature[compiled.jnt_dofadr[k]]
    return number


def _pose(place: Array, turn: Array) -> pin.SE3:
    """Make a pose from a place and a quaternion (w, x, y, z)."""
    return pin.XYZQUATToSE3(np.concatenate([place, turn[1:], turn[:1]]))


def add_loop_frames(path: Path, compiled: mujoco.MjModel, model: pin.Model) -> list[str]:
    """Add frames where `<connect>` joins bodies of the robot, and describe how to use them.

    The frames of equality NAME are NAME.1 and NAME.2; without a name, its number is used.
    """
    connects = compiled.eq_type == int(mujoco.mjtEq.mjEQ_CONNECT)
    connects &= compiled.eq_objtype == int(mujoco.mjtObj.mjOBJ_BODY)
    objects = [k for k in range(1, compiled.nbody) if not model.existFrame(compiled.body(k).name, pin.FrameType.BODY)]
    connects &= ~np.isin([compiled.eq_obj1id, compiled.eq_obj2id], objects).any(axis=0)
    pairs, count = [], np.count_nonzero(compiled.eq_type < int(mujoco.mjtEq.mjEQ_FLEX))
    for k in np.flatnonzero(connects).tolist():
        name = compiled.equality(k).name or f"equality_{k}"
        for place, body in enumerate((int(compiled.eq_obj1id[k]), int(compiled.eq_obj2id[k]))):
            anchor = pin.SE3(np.eye(3), np.array(compiled.eq_data[k, 3 * place : 3 * place + 3]))
            carrier = model.frames[model.getFrameId(compiled.body(body).name, pin.FrameType.BODY) if body else 0]
            at, label = carrier.placement * anchor, f"{name}.{place + 1}"
            model.addFrame(pin.Frame(label, carrier.parentJoint, 0, at, pin.FrameType.OP_FRAME), False)
        pairs.append(f"['{name}.1', '{name}.2']")
    remedy = f"; to close the loops, set [[robot.loops]] frames = {' and '.join(pairs)}" if pairs else ""
    return [f"{path.name}: {count} equality constraint(s) are ignored: only the tree is modeled{remedy}"] * bool(count)


def shapes_around(path: Path, frame: str) -> list[tuple[str, float, Array]]:
    """List kinds, first sizes [m] and places [m] of the geoms of a body, relative to it or to a site of it."""
    compiled = compile_mjcf(path)
    data, site = mujoco.MjData(compiled), mujoco.mj_name2id(compiled, int(mujoco.mjtObj.mjOBJ_SITE), frame)
    mujoco.mj_kinematics(compiled, data)
    body = mujoco.mj_name2id(compiled, int(mujoco.mjtObj.mjOBJ_BODY), frame)
    body, at = (int(compiled.site_bodyid[site]), data.site(site)) if site >= 0 else (body, data.body(max(body, 0)))
    geoms = np.flatnonzero(compiled.geom_bodyid == body)
    places = (data.geom_xpos[geoms] - at.xpos) @ at.xmat.reshape(3, 3)
    kinds = [mujoco.mjtGeom(kind).name[7:].lower() for kind in compiled.geom_type[geoms]]  # mjGEOM_
    return list(zip(kinds, compiled.geom_size[geoms, 0].tolist(), places, strict=True))


@quiet_mujoco()
def compile_mjcf(path: Path) -> mujoco.MjModel:
    """Compile a model with MuJoCo; if meshes are missing, without them, provided that all moving bodies state inertias.

    Raises
    ------
    RobotFileError
        If MuJoCo cannot compile the file.
    """
    for with_meshes in (True, False):
        try:
            return _compile(path, with_meshes=with_meshes)
        except (ValueError, mujoco.FatalError) as error:
            words = " ".join(str(error).split())
    raise RobotFileError(f"{path}: MuJoCo cannot compile this model: {words}")


def _compile(path: Path, *, with_meshes: bool) -> mujoco.MjModel:
    spec = read_spec(path)
    spec.memory, spec.njmax, spec.nconmax, spec.nstack, spec.nuserdata = -1, -1, -1, -1, 0  # nothing is simulated
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT) | int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    if not with_meshes:
        for geom in list(spec.geoms):
            if geom.type in (mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_HFIELD, mujoco.mjtGeom.mjGEOM_SDF):
                spec.delete(geom)
        for asset in [*spec.meshes, *spec.hfields, *spec.skins]:
            spec.delete(asset)
    return spec.compile()


def read_spec(path: Path) -> mujoco.MjSpec:
    """Read a model, and name the bodies that have no name."""
    spec = mujoco.MjSpec.from_file(str(path))
    for k, body in enumerate(spec.bodies):
        body.name = body.name or f"body{k}"
    return spec

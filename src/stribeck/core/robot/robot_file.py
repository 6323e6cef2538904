"""Fields of `Robot`: read a robot file (TOML) or a model, and check joints and frames against the model."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pinocchio as pin
from pydantic import ValidationError

from stribeck.core.base.checked_table import describe
from stribeck.core.base.files import read_text
from stribeck.core.base.toml import parse_toml
from stribeck.core.base.typing import Array, TorqueSource
from stribeck.core.errors import RobotFileError, did_you_mean
from stribeck.core.robot.model_file import joint_names, load_model, lock_joints, take_model
from stribeck.core.robot.packages import model_path
from stribeck.core.robot.rolling_radius import ball_beside
from stribeck.core.robot.rooting import BASE_FRAME, RootedModel, is_floating, is_on_axis, joint_axis, root_at
from stribeck.core.settings import ContactTable, RobotFile, RobotTable

ARMATURE_ADVICE = {
    "link_side_sensor": "a torque sensor behind the gear does not measure the rotor; set [robot] armature to 0 for "
    "those joints if the model's armature is the rotor's",
    "motor_side_sensor": "a torque sensor between motor and gear does not measure the rotor; set "
    "[robot] armature to the inertia of the gear for those joints if the model's armature includes the rotor",
}
"""Advice about an armature in the model, for torque sources that do not measure the rotor's inertia."""


@dataclass(frozen=True)
class Contact:
    """Frame that can stand on the ground.

    A `surface` constrains six degrees of freedom, a `point` three: it is the center of a ball that rolls on the ground,
    with a `radius` [m], `given`, or found from model and log. A frame beside its ball is replaced by the ball's center;
    `ball` is the model's radius then [m]. A `wheel` with a radius rolls like a ball,
    and turns about its `axle`, a unit vector in the frame; without one, it does not constrain the base.
    """

    name: str
    frame: str
    kind: Literal["surface", "point", "wheel"] = "surface"
    radius: float = 0.0
    axle: tuple[float, ...] = ()
    given: bool = True
    ball: float = 0.0

    @property
    def size(self) -> int:
        """Number of constraints."""
        return 6 if self.kind == "surface" else 3


def read_robot_file(path: Path) -> RobotFile:
    """Parse and validate a robot file.

    Raises
    ------
    RobotFileError
        If it is missing, is not TOML, or has a wrong key or value.
    """
    if path.suffix.lower() in (".urdf", ".xml", ".mjcf"):
        raise RobotFileError(f"{path} is a robot model, not a robot file. Create one: stribeck init {path} LOG")
    text = read_text(path, "a robot file (TOML)", RobotFileError)
    try:
        document = parse_toml(text)
    except ValueError as error:
        raise RobotFileError(f"{path}: is not TOML: {error}") from error
    return validated(document, path)


def open_questions(path: Path) -> list[str]:
    """Describe the questions that `stribeck init` left open in a robot file; empty if there is none."""
    lines = read_text(path, "a robot file (TOML)", RobotFileError).splitlines()
    places = [number for number, line in enumerate(lines, 1) if line.startswith("# TODO:")]
    if not places:
        return []
    many = "a question is" if len(places) == 1 else f"{len(places)} questions are"
    first = lines[places[0] - 1].removeprefix("# TODO:").strip()
    return [
        f"{path}: {many} open, marked TODO in line {', '.join(map(str, places))} ({first[:60].rstrip()} ...); answer "
        "them and delete these comments"
    ]


def validated(document: dict[str, Any], path: Path) -> RobotFile:
    """Validate the content of a robot file; the error names the wrong key."""
    try:
        return RobotFile.model_validate(document)
    except ValidationError as error:
        raise RobotFileError(f"{path}: {describe(error, RobotFile)}") from error


def robot_fields(file: RobotFile, path: Path, loaded: tuple[pin.Model, list[str]] | None = None) -> dict[str, Any]:
    """Build the fields of `Robot` from a validated robot file; the model's path is relative to `path`.

    `loaded` is a model in memory with its warnings, instead of the model file.

    Raises
    ------
    RobotFileError
        If the model cannot be read, or lacks joints or frames that the file names.
    """
    table = file.robot
    tree, contacts, warnings, file_of_model = _build_tree(file, path, loaded)
    names = [str(tree.model.names[joint]) for joint in range(1 + tree.floating, tree.model.njoints)]
    joints = [names[k] for k in np.argsort(tree.columns)]  # columns are joints of the original model
    measured = [name for name in joints if name not in table.position_controlled]
    frames = [frame for frame in tree.model.frames if frame.type == pin.FrameType.BODY]
    links = [str(frame.name) for frame in frames if frame.parentJoint]  # the base carries its payload without a joint
    _require([payload.link for payload in table.payload], links, f"{path}: [[robot.payload]]", "moving links", "link")
    for name in table.motors:
        _require([name], measured, f"{path}: [robot.motors.{name}]")
    delays = _by_joint(table.command_delay, measured, f"{path}: [robot] command_delay")
    if table.torque_source in ARMATURE_ADVICE and np.any(tree.model.armature):
        warnings.append(
            f"the dynamics include an armature although torque_source is '{table.torque_source}': "
            + ARMATURE_ADVICE[table.torque_source]
        )
    return {
        "name": table.name or str(tree.model.name),
        "tree": tree,
        "joint_names": tuple(joints),
        "position_controlled": (*table.position_controlled, *table.passive),
        "passive": tuple(table.passive),
        "loops": tuple(table.loops),
        "payloads": tuple(table.payload),
        "contacts": contacts,
        "base_frame": table.base_frame or BASE_FRAME,
        "gravity": np.array(table.gravity),
        "torque_source": table.torque_source,
        "motors": table.motors,
        "command_gains": _sort_gains(table, joints, measured, f"{path}: [robot]"),
        "command_delay": None if table.command_delay is None else _sorted(delays, joints),
        "couplings": _check_couplings(table, joints, measured, f"{path}: [[robot.couplings]]"),
        "bare": frozenset(name for each in table.couplings if not each.own_friction for name in each.joints),
        "known_rotors": frozenset(table.armature),
        "log_table": file.log,
        "settings": file.identify,
        "warnings": tuple(warnings),
        "path": "" if loaded else str(path),
        "model_path": "" if loaded else str(file_of_model),
    }


def model_fields(
    model: str | Path | pin.Model,
    base: Literal["floating", "fixed"] | None,
    contacts: Mapping[str, str | Mapping[str, str]],
    torque_source: TorqueSource,
    position_controlled: Sequence[str],
    gravity: Sequence[float],
) -> dict[str, Any]:
    """Build the fields of `Robot` from a model without a robot file: `Robot.from_model`."""
    loaded = None
    if isinstance(model, pin.Model):
        path, loaded = Path(str(model.name)), take_model(model, base)
        base = "floating" if is_floating(loaded[0]) else "fixed"
    else:
        path = model_path(str(model), Path())
        if base is None and not contacts:
            raise RobotFileError(
                f'{path}: a model does not state whether its base moves; pass base="fixed" for an arm on a table, '
                'or base="floating" for a robot that walks'
            )
    feet = {name: {"frame": foot} if isinstance(foot, str) else dict(foot) for name, foot in contacts.items()}
    table = {
        "model": path.name,
        "base": base or "floating",
        "torque_source": torque_source,
        "position_controlled": list(position_controlled),
        "gravity": list(gravity),
    }
    return robot_fields(validated({"robot": table, "contacts": feet}, path), path, loaded)


def _build_tree(
    file: RobotFile, path: Path, loaded: tuple[pin.Model, list[str]] | None
) -> tuple[RootedModel, dict[str, Contact], list[str], Path]:
    """Build tree and contacts; also return warnings and the path of the model."""
    table = file.robot
    try:
        file_of_model = path if loaded else model_path(table.model, path.parent)
    except RobotFileError as error:
        raise RobotFileError(f"{path}: [robot] model = {error}") from error
    model, warnings = loaded or load_model(file_of_model, table.base, loops=bool(table.loops))
    model = _with_roles(model, table, f"{path}: [robot]")
    contacts = _build_contacts(file, model, path, Path() if loaded else file_of_model)
    model.gravity.linear = np.array(table.gravity)
    try:
        tree = root_at(model)
    except RobotFileError as error:
        raise RobotFileError(f"{path}: {error}") from error
    if not any(inertia.mass > 0 or np.any(inertia.inertia) for inertia in list(tree.model.inertias)[1:]):
        raise RobotFileError(
            f"{file_of_model}: no moving link has a mass; expected the masses and inertias of the links"
        )
    return tree, contacts, warnings, file_of_model


def _require(
    names: Iterable[str], known: Sequence[str], where: str, kind: str = "torque-controlled joints", what: str = "joint"
) -> None:
    """Refuse the first joint or link that is not among the known ones."""
    for name in names:
        if name not in known:
            expected = f"one of the {kind} {', '.join(known)}{did_you_mean(name, known)}"
            raise RobotFileError(f"{where} names {what} '{name}'; expected {expected}")


def _with_roles(model: pin.Model, table: RobotTable, where: str) -> pin.Model:
    """Lock joints, set armatures, and check all joint names in `[robot]`."""
    _require(table.locked, joint_names(model), f"{where} locked", "joints")
    model = lock_joints(model, table.locked)
    joints = joint_names(model)
    for key in ("position_controlled", "armature", "passive"):
        _require(getattr(table, key), joints, f"{where} {key}", "joints")
    armature = np.array(model.armature)
    for name, value in table.armature.items():
        armature[model.joints[model.getJointId(name)].idx_v] = value
    model.armature = armature
    if not joints:
        raise RobotFileError(f"{where} locked leaves no joint; expected at least one revolute or prismatic joint")
    return model


def _build_contacts(file: RobotFile, model: pin.Model, path: Path, model_file: Path) -> dict[str, Contact]:
    """Build the contacts by name, and check all frame names in the file."""
    frames = {str(frame.name) for frame in model.frames} - {"universe"}
    wanted = [(f"[contacts.{name}] frame", contact.frame) for name, contact in file.contacts.items()]
    wanted += [("[robot] base_frame", file.robot.base_frame)] if file.robot.base_frame else []
    wanted += [("[[robot.loops]] frames, one of which", frame) for loop in file.robot.loops for frame in loop.frames]
    for key, frame in wanted:
        if frame not in frames:
            raise RobotFileError(
                f"{path}: {key} = '{frame}' is not in the model; it has {', '.join(sorted(frames))}"
                f"{did_you_mean(frame, frames)}"
            )
    return {name: _build_contact(name, contact, model, model_file) for name, contact in file.contacts.items()}


def _build_contact(name: str, table: ContactTable, model: pin.Model, model_file: Path) -> Contact:
    """Build a contact; a frame is added at the center of a ball, and of a wheel: it touches below its center of mass.

    A wheel whose joint is locked, so that its frame is not on the axis of a joint, does not show how it rolls.
    """
    frames = (k for k, body in enumerate(model.frames) if body.name == table.frame and body.type != pin.FrameType.JOINT)
    place = next(frames, 0)
    if table.kind == "point":
        point = Contact(name, table.frame, table.kind, table.radius or 0.0, given=table.radius is not None)
        if table.radius == 0 or not (ball := ball_beside(model_file, table.frame)):
            return point
        at = model.frames[place].placement * pin.SE3(np.eye(3), ball[1])
        return replace(point, frame=_add_center(model, place, at), ball=ball[0])
    if not table.radius or not is_on_axis(model, model.frames[place]):
        return Contact(name, table.frame, table.kind)
    joint = int(model.frames[place].parentJoint)
    axle = joint_axis(model, joint).direction
    center = pin.SE3(np.eye(3), axle * (axle @ model.inertias[joint].lever))
    return Contact(name, _add_center(model, place, center), table.kind, table.radius, tuple(axle.tolist()))


def _add_center(model: pin.Model, place: int, center: pin.SE3) -> str:
    """Add the center of a frame's ball or wheel, relative to the frame's joint, and return the new frame's name."""
    frame = model.frames[place]
    model.addFrame(pin.Frame(f"{frame.name} center", frame.parentJoint, place, center, pin.FrameType.OP_FRAME))
    return f"{frame.name} center"


def _by_joint(value: float | dict[str, float] | None, measured: Sequence[str], where: str) -> dict[str, float]:
    """Expand a setting of torque-controlled joints to {joint: value}."""
    values = value if isinstance(value, dict) else {} if value is None else dict.fromkeys(measured, value)
    _require(values, measured, where)
    return values


def _sort_gains(
    table: RobotTable, joints: Sequence[str], measured: Sequence[str], where: str
) -> tuple[Array, Array] | None:
    """Sort kp and kd in the order of the joints, shape (n,) each; None unless commands are the torque source.

    An unknown kp is NaN, an unknown kd 0.
    """
    if table.torque_source != "command":
        return None
    kp, kd = (_by_joint(getattr(table, key), measured, f"{where} {key}") for key in ("kp", "kd"))
    if lone := [name for name in kd if name not in kp]:
        raise RobotFileError(f"{where} kp has no value for joint '{lone[0]}'; kd requires it")
    return _sorted(dict.fromkeys(measured, np.nan) | kp, joints), _sorted(kd, joints)


def _sorted(by_joint: dict[str, float], joints: Sequence[str]) -> Array:
    return np.array([by_joint.get(name, 0.0) for name in joints])


def _check_couplings(
    table: RobotTable, joints: Sequence[str], measured: Sequence[str], where: str
) -> dict[str, dict[str, float]]:
    """Check the couplings, and collect their coefficients by name."""
    coefficients: dict[str, dict[str, float]] = {}
    for coupling in table.couplings:
        name = coupling.label
        _require(coupling.joints, measured, f"{where} '{name}'")
        if name in coefficients or name in joints:
            raise RobotFileError(f"{where} '{name}' has the name of another coupling or joint; give it another 'name'")
        coefficients[name] = coupling.joints
    return coefficients

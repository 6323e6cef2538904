"""Models in MJCF: conversion of a URDF, one body per link with joint and shapes, and stable bristles of LuGre friction.

MuJoCo reads the URDF. MuJoCo's own writer rounds to six digits and requires valid meshes and inertias; this conversion
keeps all digits. Joints are in Pinocchio's order: by name below each link.
"""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError
from stribeck.core.robot import Robot
from stribeck.core.robot.model_check import check_urdf
from stribeck.core.robot.xml_file import read_xml

LIGHTEST = 1e-6
"""Mass [kg] and moments of inertia [kg m^2] of moving links without, which MuJoCo refuses."""
STEP = 2e-3
"""Simulation step at which LuGre friction is stable, unless its bristles are identified [s]; MuJoCo's default."""


def mjcf_of_urdf(path: Path, folder: Path, *, floating: bool) -> tuple[str, list[str]]:
    """Convert a URDF to the text of an MJCF for a folder, with notes on omitted parts.

    Raises
    ------
    SettingsError
        If MuJoCo is not installed, or the robot has a planar joint, a free joint below the root or a free link "world".
    """
    xml = read_xml(path)
    check_urdf(xml)  # removes repeated elements, which MuJoCo refuses
    source = xml.root
    base, left_out = _prepare(path, source)
    if floating and base == "world":
        raise SettingsError(f"{path}: the root link has the name 'world', which MuJoCo reserves; rename the link")
    spec = _spec(path, source)
    root = Element("mujoco", model=source.get("name") or path.stem)
    _add(root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false")
    asset = _add(root, "asset")
    for mesh in spec.meshes:
        file = Path(os.path.relpath(mesh.file, folder)).as_posix()
        _add(asset, "mesh", name=mesh.name, file=file, scale=mesh.scale)
    world = _add(root, "worldbody")
    _fill(world, spec.worldbody)
    light = [body.get("name", "") for body in world.iter("body") if body.find("joint") is not None and _is_light(body)]
    if floating:
        world[-1].insert(0, Element("freejoint", name="root"))
    equality = _add(root, "equality")
    for coupling in spec.equalities:
        _add(equality, "joint", joint1=coupling.name1, joint2=coupling.name2, polycoef=coupling.data[:5])
    for element in (asset, equality):
        if not len(element):
            root.remove(element)
    notes = [f"The root link {base} moves freely."] if floating else []
    if light:
        notes.append(f"Raised to {LIGHTEST:g} kg or kg m^2, because MuJoCo requires inertia: links {', '.join(light)}.")
    if left_out:
        notes.append(f"Omitted, because MuJoCo cannot read these meshes: {', '.join(left_out)}.")
    indent(root)
    return tostring(root, encoding="unicode"), notes


def _is_light(body: Element) -> bool:
    """Check that a moving body and its first fixed bodies have no inertia, and raise the body's inertia."""
    root, *fixed = [body, *(below for below in body.findall("body") if below.find("joint") is None)]
    values = [
        [float(word) for name in ("mass", "diaginertia") for word in inertial.get(name, "").split()]
        for inertial in (element.find("inertial") for element in (root, *fixed))
        if inertial is not None
    ]
    if any(min(numbers) > 0 for numbers in values):
        return False
    inertial = root.find("inertial")
    assert inertial is not None  # _add_inertial writes one per body
    inertial.set("mass", str(max(values[0][0], LIGHTEST)))
    inertial.set("diaginertia", " ".join(str(max(value, LIGHTEST)) for value in values[0][1:]))
    return True


def _prepare(path: Path, source: Element) -> tuple[str, list[str]]:
    """Sort a URDF's joints and resolve its meshes; return the root link and the missing meshes."""
    joints = sorted(source.findall("joint"), key=lambda joint: str(joint.get("name")))
    ends = {end: [str(joint.find(end).get("link")) for joint in joints] for end in ("parent", "child")}  # type: ignore[union-attr]
    for joint, parent in zip(joints, ends["parent"], strict=True):
        kind = joint.get("type")
        if kind not in ("revolute", "continuous", "prismatic", "fixed") and (kind, parent) != ("floating", "world"):
            raise SettingsError(f"{path}: joint '{joint.get('name')}' is {kind}, which MJCF lacks; export to urdf")
        source.remove(joint)
        source.append(joint)
    folders = [path.parent / compiler.get("meshdir", "") for compiler in source.iterfind("mujoco/compiler")]
    for extension in source.findall("mujoco"):
        source.remove(extension)
    SubElement(SubElement(source, "mujoco"), "compiler", fusestatic="false", discardvisual="false", strippath="false")
    left_out = []
    for link in source.findall("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            for mesh in shape.iterfind("geometry/mesh"):
                name = mesh.get("filename", "")
                file = _found(name, [path.parent, *folders], path)
                mesh.set("filename", str(file))
                if file is None:
                    link.remove(shape)
                    left_out.append(name)
    base = next(name for link in source.findall("link") if (name := str(link.get("name"))) not in ends["child"])
    return base, list(dict.fromkeys(left_out))


def _spec(path: Path, source: Element) -> Any:
    """Read a URDF with MuJoCo."""
    try:
        import mujoco

        from stribeck.core.robot.mjcf import quiet_mujoco
    except ModuleNotFoundError as error:
        raise SettingsError(f"{path}: MJCF needs MuJoCo: pip install 'stribeck[simulation]'") from error
    try:
        with quiet_mujoco():
            return mujoco.MjSpec.from_string(tostring(source, encoding="unicode"))
    except ValueError as error:
        detail = " ".join(str(error).split())[:200]
        raise SettingsError(f"{path}: MuJoCo cannot read this URDF ({detail}); export to urdf") from error


def _found(name: str, folders: list[Path], path: Path) -> Path | None:
    """Find a mesh file that MuJoCo can read; packages are searched in the folders above the URDF."""
    scheme, _, rest = name.rpartition("://")
    folders = [*folders, *(path.resolve().parents if scheme in ("package", "model") else [])]
    places = [folder / tail for folder in folders for tail in (rest, Path(rest).name)]
    return next((place.resolve() for place in places if place.is_file() and _readable(place)), None)


def _readable(file: Path) -> bool:
    """Check that MuJoCo reads a mesh: OBJ, MSH, or binary STL of at most 200,000 faces."""
    if file.suffix.lower() != ".stl":
        return file.suffix.lower() in (".obj", ".msh")
    with file.open("rb") as stream:
        count = int.from_bytes(stream.read(84)[-4:], "little")
    return 0 < count <= 200_000 and file.stat().st_size == 84 + 50 * count


def _fill(element: Element, body: Any) -> None:
    """Write a body's shapes and its child bodies, each with inertia and joint."""
    for geom in body.geoms:
        kind = geom.type.name.removeprefix("mjGEOM_").lower()
        size = (
            {"mesh": geom.meshname} if kind == "mesh" else {"size": geom.size[: {"sphere": 1, "box": 3}.get(kind, 2)]}
        )
        shape = _add(element, "geom", type=kind, **size, pos=geom.pos, quat=geom.quat)
        if geom.group == 1:  # seen only
            shape.attrib |= {"contype": "0", "conaffinity": "0", "group": "1", "rgba": _text(geom.rgba)}
    for below in body.bodies:
        child = _add(element, "body", name=below.name, pos=below.pos, quat=below.quat)
        for joint in below.joints:
            _add_joint(child, joint)
        _add_inertial(child, below)
        _fill(child, below)


def _add_joint(body: Element, joint: Any) -> None:
    kind = joint.type.name.removeprefix("mjJNT_").lower()
    if kind == "free":
        _add(body, "freejoint", name=joint.name)
        return
    numbers = {"range": joint.range, "actuatorfrcrange": joint.actfrcrange}
    numbers |= {"damping": np.ravel(joint.damping)[:1], "frictionloss": np.array([joint.frictionloss])}
    stated = {name: value for name, value in numbers.items() if value.any()}
    _add(body, "joint", name=joint.name, type=kind, axis=joint.axis / np.linalg.norm(joint.axis), **stated)


def _add_inertial(element: Element, body: Any) -> None:
    """Write a body's inertia, zero if missing, because Pinocchio's MJCF reader requires one per body."""
    xx, yy, zz, xy, xz, yz = np.nan_to_num(body.fullinertia)
    moments, axes = np.linalg.eigh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    moments[np.abs(moments) < 1e-12 * np.abs(moments).max()] = 0.0  # rounding
    turn = pin.Quaternion(*body.iquat) * pin.Quaternion(axes * np.linalg.det(axes))
    place = {"quat": np.roll(turn.coeffs(), 1), "pos": np.nan_to_num(body.ipos)}
    _add(element, "inertial", **place, mass=np.array([body.mass]), diaginertia=moments)


def _add(parent: Element, tag: str, **attributes: str | Array) -> Element:
    texts = {name: value if isinstance(value, str) else _text(value) for name, value in attributes.items()}
    return SubElement(parent, tag, texts)


def _text(numbers: Array) -> str:
    """Format numbers with all digits, colors in single precision."""
    return " ".join(str(number) for number in numbers)


def stable_bristles(robot: Robot, stated: Mapping[str, Mapping[str, float]]) -> dict[str, tuple[float, float, float]]:
    """Compute stiffness, damping and largest stable step [s] of the bristles of each joint with LuGre friction.

    With inertia I, stiffness s and damping d, MuJoCo's explicit step h is stable for h < d / s and h < 2 I / d. Unless
    they are identified, bristles have d / s = 2 `STEP`, d up to I / `STEP`, and travel at least 1 mrad or 1 mm.
    """
    lugre = {name: numbers for name, numbers in stated.items() if numbers.get("tau_s", 0.0) > 0}
    inertia = _smallest_inertia(robot, stated) if lugre else {}
    bristles = {}
    for name, numbers in lugre.items():
        stiffness = numbers.get("sigma_0", min(numbers["tau_s"] / 1e-3, inertia[name] / (2 * STEP**2)))
        damping = numbers.get("sigma_1", 2 * STEP * stiffness)
        bristles[name] = stiffness, damping, min(damping / (2 * stiffness), inertia[name] / damping)
    return bristles


def _smallest_inertia(robot: Robot, stated: Mapping[str, Mapping[str, float]]) -> dict[str, float]:
    """Compute each joint's smallest inertia [kg m^2], [kg] in 20 configurations while all other joints move freely."""
    model, generator = pin.Model(robot.tree.model), np.random.default_rng(0)
    places = {name: model.joints[model.getJointId(name)].idx_v for name in robot.joint_names}
    for name in places.keys() & stated.keys():
        model.armature[places[name]] = stated[name].get("armature", model.armature[places[name]])
    data, largest = model.createData(), np.zeros(model.nv)
    for _ in range(20):
        position = pin.integrate(model, pin.neutral(model), generator.uniform(-np.pi, np.pi, model.nv))
        inverse = pin.computeMinverse(model, data, position)
        largest = np.fmax(largest, np.diag(inverse))
    return {name: float(1 / min(largest[place], 1 / LIGHTEST)) for name, place in places.items()}

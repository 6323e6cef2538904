"""MuJoCo model of a robot: its model file with box soles on hard ground."""

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError
from stribeck.core.robot import Robot
from stribeck.simulation.robots.sole import Sole, sole_under

PHYSICS_STEP = 0.00025
"""Default step of the physics [s]."""
SOLE_THICKNESS = 0.02
"""Thickness of box soles [m]."""


@dataclass(frozen=True, eq=False)
class Body:
    """A compiled robot on the ground, and the indices of its rooted tree's joints.

    Attributes
    ----------
    model
        Model of MuJoCo; `qpos` and `qvel` start with the free joint's entries.
    position_index, velocity_index
        Entries of the tree's joints in `qpos` and `qvel`, in the tree's order, shape (n,).
    torque_limit
        Largest torque of each joint in the tree's order [N m], infinite if the model has no limit, shape (n,).
    soles
        Soles by contact.
    feet
        MuJoCo body of each contact, shape (feet,).
    contact_poses
        Rotation and translation of each contact's frame in its MuJoCo body.
    """

    model: mujoco.MjModel
    position_index: NDArray[np.int64]
    velocity_index: NDArray[np.int64]
    torque_limit: Array
    soles: dict[str, Sole]
    feet: NDArray[np.int64]
    contact_poses: list[tuple[Array, Array]]


def compile_body(robot: Robot, soles: Mapping[str, Sole] | None = None, step: float = PHYSICS_STEP) -> Body:
    """Compile a floating robot with box soles on flat ground; remove its other shapes, damping and friction.

    Parameters
    ----------
    robot
        Robot from a robot file.
    soles
        Soles of contacts whose foot has no simple shape in the model; they override the model.
    step
        Integration step [s].

    Raises
    ------
    SettingsError
        If the joints of robot and model file differ, or a foot has no sole.
    """
    spec = _read(robot)
    _set_physics(spec, step)
    bare = spec.compile()
    position_index, velocity_index = _joint_entries(robot, bare)
    limit = _torque_limit(bare)[velocity_index]
    known, feet, poses = dict(soles or {}), [], []
    for name, contact in robot.contacts.items():
        rotation, translation, body = _contact_pose(robot, bare, contact.frame)
        if name not in known:
            known[name] = sole_under(bare, body, rotation, translation, f"{robot.path}: contact '{name}'")
        feet.append(body)
        poses.append((rotation, translation))
    for geom in spec.geoms:  # shapes remain, because a body's inertia may depend on them
        geom.contype = geom.conaffinity = 0
    for name, body, (rotation, translation) in zip(robot.contacts, feet, poses, strict=True):
        _add_sole(spec, str(bare.body(body).name), known[name], rotation, translation)
    ground = spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0, 0, 1), contype=2, conaffinity=1)
    _set_contact(ground)
    model = spec.compile()
    model.dof_frictionloss[:] = model.dof_damping[:] = 0.0  # the simulator adds all friction
    model.jnt_stiffness[:] = 0.0
    model.dof_armature[velocity_index] = robot.tree.model.armature[6:]
    return Body(model, position_index, velocity_index, limit, known, np.array(feet), poses)


def _read(robot: Robot) -> mujoco.MjSpec:
    """Read the model file without meshes; a URDF's root gets a free joint before MuJoCo fuses it to the world."""
    spec = mujoco.MjSpec.from_file(robot.model_path)
    spec.compiler.fusestatic = False
    for geom in list(spec.geoms):
        if geom.type in (mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_HFIELD, mujoco.mjtGeom.mjGEOM_SDF):
            spec.delete(geom)
    for asset in [*spec.meshes, *spec.hfields]:
        spec.delete(asset)
    root = spec.worldbody.first_body()
    if not any(joint.type == mujoco.mjtJoint.mjJNT_FREE for joint in root.joints):
        root.add_freejoint()
    return spec


def _set_physics(spec: mujoco.MjSpec, step: float) -> None:
    spec.option.timestep = step
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10.0  # prevents standing feet from creeping
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_ISLAND  # one robot is one island


def _joint_entries(robot: Robot, model: mujoco.MjModel) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    names = [str(name) for name in list(robot.tree.model.names)[2:]]
    hinges = {str(model.joint(joint).name) for joint in range(model.njnt) if model.jnt_type[joint] >= 2}
    if set(names) != hinges:
        raise SettingsError(
            f"{robot.path}: the contact simulator needs every joint of the model; "
            f"the robot file locks {', '.join(sorted(hinges - set(names)))}"
        )
    joints = [model.joint(name).id for name in names]
    return model.jnt_qposadr[joints].astype(np.int64), model.jnt_dofadr[joints].astype(np.int64)


def _torque_limit(model: mujoco.MjModel) -> Array:
    """Find the largest torque of each degree of freedom, shape (nv,)."""
    limit = np.full(model.nv, np.inf)
    for joint in range(model.njnt):
        if model.jnt_actfrclimited[joint]:
            limit[model.jnt_dofadr[joint]] = np.abs(model.jnt_actfrcrange[joint]).min()
    return limit


def _contact_pose(robot: Robot, model: mujoco.MjModel, frame: str) -> tuple[Array, Array, int]:
    """Compute the pose of a contact's frame in the MuJoCo body that its joint moves, and that body."""
    tree = robot.tree.model
    placed = tree.frames[tree.getFrameId(frame)]
    joint = model.joint(str(tree.names[placed.parentJoint]))
    return np.array(placed.placement.rotation), np.array(placed.placement.translation), int(joint.bodyid[0])


def _add_sole(spec: mujoco.MjSpec, body: str, sole: Sole, rotation: Array, translation: Array) -> None:
    centre = np.add(sole.centre, (0, 0, SOLE_THICKNESS / 2))
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(rotation).ravel())
    geom = spec.body(body).add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=(sole.half_length, sole.half_width, SOLE_THICKNESS / 2),
        pos=translation + rotation @ centre,
        quat=quaternion,
        contype=1,
        conaffinity=2,
        mass=0.0,
    )
    _set_contact(geom)


def _set_contact(geom: mujoco.MjsGeom) -> None:
    geom.condim, geom.priority = 3, 2
    geom.friction[0] = 0.9
    # `solref`: time constant [s] and damping ratio of a contact; with MuJoCo's default, the stance foot rocks
    geom.solref[:2] = (0.001, 1.0)
    geom.solimp[:] = (0.99, 0.999, 0.0005, 0.5, 2.0)  # `solimp` of a contact

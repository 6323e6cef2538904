"""The joint friction of an MJCF, from MuJoCo's own reading of it; a file of its own, since MuJoCo is slow to import."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from stribeck.replay.model_friction import JointFriction
from stribeck.robot.mjcf_check import compile_mjcf

LUGRE = slice(3, 6)
"""Coulomb and static friction and Stribeck velocity, among a motor's parameters of its bias."""


def read_mjcf_friction(path: Path) -> tuple[dict[str, JointFriction], list[str]]:
    """Return the friction of each joint: `frictionloss`, `damping` and the steady friction of LuGre's motors.

    A motor at gear g turns g times as fast as its joint, which feels g times its torque.
    """
    model = compile_mjcf(path)
    found, notes = {}, []
    for joint in range(model.njnt):
        if int(model.jnt_type[joint]) not in (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)):
            continue
        dof, name = int(model.jnt_dofadr[joint]), model.joint(joint).name
        coulomb, viscous = float(model.dof_frictionloss[dof]), float(model.dof_damping[dof])
        motors = [motor for motor in range(len(model.actuator_trntype)) if _drives(model, motor, joint)]
        viscous += sum(float(model.actuator_damping[k] * model.actuator_gear[k, 0] ** 2) for k in motors)
        lugre = [k for k in motors if int(model.actuator_biastype[k]) == int(mujoco.mjtBias.mjBIAS_DCMOTOR)]
        lugre = [k for k in lugre if model.actuator_biasprm[k, LUGRE.start + 1] > 0]
        rise, velocity = 0.0, 1.0
        for k in lugre[:1]:
            gear = abs(float(model.actuator_gear[k, 0]))
            slow, static, own = (float(value) for value in model.actuator_biasprm[k, LUGRE])
            coulomb, rise, velocity = coulomb + gear * slow, gear * (static - slow), own / gear
        found[name] = JointFriction(coulomb=coulomb, viscous=viscous, rise=rise, stribeck_velocity=velocity)
        notes += [f"joint '{name}': {what}, which is left out" for what in _others(model, joint, dof, len(lugre))]
    return found, notes + _of_tendons(model)


def _drives(model: mujoco.MjModel, motor: int, joint: int) -> bool:
    return bool(
        int(model.actuator_trntype[motor]) == int(mujoco.mjtTrn.mjTRN_JOINT)
        and model.actuator_trnid[motor, 0] == joint
        and model.actuator_gear[motor, 0]
    )


def _others(model: mujoco.MjModel, joint: int, dof: int, motors: int) -> list[str]:
    """Return what else acts on a joint without being told to."""
    others = []
    if np.any(model.jnt_stiffness[joint]):
        others.append("a spring (stiffness)")
    if np.any(model.dof_dampingpoly[dof]):
        others.append("damping that is not linear")
    if motors > 1:
        others.append(f"the friction of {motors - 1} more LuGre motor(s)")
    return others


def _of_tendons(model: mujoco.MjModel) -> list[str]:
    acting = [model.tendon_frictionloss, model.tendon_damping, model.tendon_stiffness]
    count = sum(bool(any(np.any(values[k]) for values in acting)) for k in range(model.ntendon))
    return [f"{count} tendon(s) with friction, damping or stiffness are left out"] if count else []

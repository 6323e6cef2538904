"""Joint friction stated in an MJCF, read by MuJoCo; a separate file, because MuJoCo is slow to import."""

from pathlib import Path

import mujoco
import numpy as np

from stribeck.core.robot.mjcf import compile_mjcf
from stribeck.design.replaying.other_model import Coupling, JointFriction, StatedFriction


def read_mjcf_friction(path: Path) -> StatedFriction:
    """Read the friction of each joint: `frictionloss`, `damping` and the steady friction of LuGre motors.

    The friction of a fixed tendon, which acts on a sum of joint speeds, becomes a coupling. A motor with gear ratio g
    has g times the speed of its joint, and its torque counts g times on the joint.
    """
    model = compile_mjcf(path)
    frictions, notes = {}, []
    on_joints = (model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_JOINT)) & (model.actuator_gear[:, 0] != 0)
    gears = np.abs(model.actuator_gear[:, 0])
    for joint in range(model.njnt):
        if int(model.jnt_type[joint]) not in (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)):
            continue
        dof, name = int(model.jnt_dofadr[joint]), model.joint(joint).name
        coulomb, viscous = float(model.dof_frictionloss[dof]), float(model.dof_damping[dof])
        motors = np.flatnonzero(on_joints & (model.actuator_trnid[:, 0] == joint))
        viscous += float(model.actuator_damping[motors] @ gears[motors] ** 2)
        dc_motors = motors[model.actuator_biastype[motors] == int(mujoco.mjtBias.mjBIAS_DCMOTOR)]
        lugre = dc_motors[model.actuator_biasprm[dc_motors, 4] > 0]  # static friction
        rise, velocity = 0.0, 1.0
        for gear, parameters in zip(gears[lugre[:1]].tolist(), model.actuator_biasprm[lugre[:1]].tolist(), strict=True):
            slow, static, speed = parameters[3:6]
            coulomb, rise, velocity = coulomb + gear * slow, gear * (static - slow), speed / gear
        frictions[name] = JointFriction(coulomb=coulomb, viscous=viscous, rise=rise, stribeck_velocity=velocity)
        others = {
            "a spring (stiffness)": np.any(model.jnt_stiffness[joint]),
            "damping that is not linear": np.any(model.dof_dampingpoly[dof]),
            f"the friction of {len(lugre) - 1} more LuGre motor(s)": len(lugre) > 1,
        }
        notes += [f"joint '{name}': {what}, which is left out" for what, acts in others.items() if acts]
    couplings, more = _of_tendons(model)
    return frictions, couplings, notes + more


def _of_tendons(model: mujoco.MjModel) -> tuple[dict[str, Coupling], list[str]]:
    """Read the friction and coefficients of fixed tendons, with notes on omitted parts of tendons."""
    tendons, omitted = {}, 0
    for tendon in range(model.ntendon):
        first = int(model.tendon_adr[tendon])
        wraps = range(first, first + int(model.tendon_num[tendon]))
        coulomb, viscous = float(model.tendon_frictionloss[tendon]), float(model.tendon_damping[tendon])
        fixed = all(int(model.wrap_type[k]) == int(mujoco.mjtWrap.mjWRAP_JOINT) for k in wraps)
        omitted += bool(np.any(model.tendon_stiffness[tendon]) or (not fixed and (coulomb or viscous)))
        if fixed and (coulomb or viscous):
            coefficients = {model.joint(int(model.wrap_objid[k])).name: float(model.wrap_prm[k]) for k in wraps}
            name = model.tendon(tendon).name or f"tendon {tendon}"
            tendons[name] = coefficients, JointFriction(coulomb=coulomb, viscous=viscous)
    return tendons, [f"{omitted} tendon(s) with stiffness, or spatial ones with friction, are left out"] * bool(omitted)

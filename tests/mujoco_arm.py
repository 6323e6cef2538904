"""Log of an arm with three joints, simulated with MuJoCo alone, whose friction is known."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

STEP = 2.5e-4
"""Time step of the simulation [s]."""
JOINTS = ("shoulder 1", "elbow 2", "wrist 3")
COULOMB, VISCOUS = np.array([1.5, 0.8, 0.4]), np.array([0.6, 0.3, 0.2])
"""Friction [N m], [N m s/rad]."""


def friction(velocity: np.ndarray, gain: float = 0.0, stribeck_velocity: float = 0.1) -> np.ndarray:
    """Compute the ground truth for velocities, shape (..., 3)."""
    height = 1 + gain * np.exp(-((velocity / stribeck_velocity) ** 2))
    return COULOMB * np.tanh(60.0 * velocity) * height + VISCOUS * velocity


def urdf(again: str = "", products: str = 'ixy="0" ixz="0" iyz="0"', tool: str = "", limit: str = "") -> str:
    """Make the arm's URDF; the arguments put faults into it."""
    links, joints = '<link name="base link"/>', ""
    for k, (name, axis) in enumerate(zip(JOINTS, ("0 1 0", "1 0 0", "0 1 0"), strict=True)):
        parent = f"link {k}" if k else "base link"
        links += (
            f'<link name="link {k + 1}"><inertial><origin xyz="0 0.02 0.2"/>{again}<mass value="{3 - k}"/>'
            f'<inertia ixx="0.03" {products} iyy="0.03" izz="0.01"/></inertial></link>'
        )
        joints += (
            f'<joint name="{name}" type="continuous"><origin xyz="0 0 0.4"/>{again}<parent link="{parent}"/>'
            f'<child link="link {k + 1}"/><axis xyz="{axis}"/>{limit}</joint>'
        )
    return f'<robot name="arm">{links}{joints}{tool}</robot>'


def record(
    speed: Sequence[float], seconds: float = 10.0, motors: np.ndarray | None = None, **law: float
) -> dict[str, np.ndarray]:
    """Record the arm at 200 Hz while its joints follow sums of sines with these largest speeds [rad/s].

    The friction acts on the speeds of the joints, or of `motors`, which are sums of them (one per column).
    """
    motors = np.eye(3) if motors is None else motors
    spec = mujoco.MjSpec.from_string(urdf())
    spec.option.timestep = STEP
    for name in JOINTS:
        spec.joint(name).armature = 0.05
    arm = spec.compile()
    data, time = mujoco.MjData(arm), np.arange(0, seconds, STEP)
    omega = np.random.default_rng(0).uniform(1.5, 5.0, (4, 3))
    goal = np.sum(np.sin(omega * time[:, None, None]) / omega, axis=1) * np.array(speed) / 3
    rows = []
    for target in goal:
        mujoco.mj_step1(arm, data)
        torque = 200 * (target - data.qpos) - 20 * data.qvel + data.qfrc_bias
        data.qfrc_applied[:] = torque - motors @ friction(motors.T @ data.qvel, **law)
        rows.append([data.qpos.copy(), data.qvel.copy(), torque])
        mujoco.mj_step2(arm, data)
    every = round(0.005 / STEP)
    position, velocity, torque = np.swapaxes(np.array(rows)[::every], 0, 1)
    noise = np.random.default_rng(1).normal(size=torque.shape)
    return {"time": time[::every], "position": position, "velocity": velocity, "torque": torque + 0.02 * noise}


def with_force(log: dict[str, np.ndarray], span: tuple[float, float], force: Sequence[float], link: int = 3) -> None:
    """Add the torques that resist a force [N] 0.25 m after a link's joint in a span of a log [s]."""
    arm = mujoco.MjSpec.from_string(urdf()).compile()
    data, jacobian = mujoco.MjData(arm), np.zeros((3, 3))
    for row in np.flatnonzero((log["time"] >= span[0]) & (log["time"] < span[1])):
        data.qpos[:] = log["position"][row]
        mujoco.mj_kinematics(arm, data)
        mujoco.mj_comPos(arm, data)
        body = arm.body(f"link {link}").id
        mujoco.mj_jac(arm, data, jacobian, None, data.xpos[body] + data.xmat[body].reshape(3, 3) @ [0, 0, 0.25], body)
        log["torque"][row] -= jacobian.T @ force


def with_other_model(log: dict[str, np.ndarray], mass: float = 0.0, tilt: float = 0.0) -> None:
    """Add the torques that a mass [kg] at the last link, or a base tilted about its x axis [rad], needs in a log."""
    spec = mujoco.MjSpec.from_string(urdf())
    added = spec.body(f"link {len(JOINTS)}").add_body(pos=[0, 0.02, 0.1])
    added.mass, added.inertia, added.explicitinertial = max(mass, 1e-9), [1e-9] * 3, True
    models = [mujoco.MjSpec.from_string(urdf()).compile(), spec.compile()]
    models[1].opt.gravity = [0, 9.81 * np.sin(tilt), -9.81 * np.cos(tilt)]
    datas = [mujoco.MjData(model) for model in models]
    acceleration = np.gradient(log["velocity"], log["time"], axis=0)
    for row, motion in enumerate(zip(log["position"], log["velocity"], acceleration, strict=True)):
        for model, data in zip(models, datas, strict=True):
            data.qpos[:], data.qvel[:], data.qacc[:] = motion
            mujoco.mj_inverse(model, data)
        log["torque"][row] += datas[1].qfrc_inverse - datas[0].qfrc_inverse


def write_case(folder: Path, log: Mapping[str, Any], text: str = "") -> None:
    """Write a log with the arm's model and robot file; `text` has further keys of [robot], or others than usual."""
    np.savez(folder / "log.npz", **{"joint_names": np.array(JOINTS), **log})
    (folder / "arm.urdf").write_text(urdf())
    usual = {"base": '"fixed"', "torque_source": '"motor_current"'}
    lines = "".join(f"{key} = {value}\n" for key, value in usual.items() if key not in text)
    (folder / "robot.toml").write_text(f'[robot]\nmodel = "arm.urdf"\n{lines}{text}')

"""Logs of position commands, simulated with MuJoCo alone: a hobby arm, and a quadruped that is clamped or walks.

The drives compute

    torque = kp (command - position) - kd velocity,

where a command acts `latency` seconds after it was logged, until the next one does.
"""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from mujoco import rollout

from stribeck.core.base.typing import Array

STEP = 2.5e-4
"""Time step of the simulation [s]."""
TICK = 2 * np.pi / 4096
"""Resolution of a hobby servo's encoder [rad]."""
MODELS = Path(__file__).parents[1] / "benchmarks/contest/models"
ARM, QUADRUPED = MODELS / "hobby-arm.urdf", MODELS / "quadruped.xml"
ARM_GAINS = {"pan": 21.5, "lift": 20.5, "elbow": 18.0, "wrist_pitch": 14.8, "wrist_roll": 13.0, "gripper": 12.0}
"""kp of the arm's drives [N m/rad]."""
LEGS = ("FL", "FR", "RL", "RR")
LEG_JOINTS = tuple(f"{leg}_{part}_joint" for leg in LEGS for part in ("hip", "thigh", "calf"))


@dataclass(frozen=True)
class Drive:
    """A joint's drive and ground truth.

    Attributes
    ----------
    coulomb, viscous
        Friction [N m], [N m s/rad].
    armature
        Rotor inertia behind the gear [kg m²].
    kp, kd
        Gains [N m/rad], [N m s/rad].
    latency
        Time from a command's stamp until the drive acts on it [s].
    effort
        Torque limit [N m]; 0 for none.
    """

    coulomb: float
    viscous: float
    armature: float
    kp: float
    kd: float
    latency: float
    effort: float = 0.0


def arm_drives(seed: int, latency: float, kd: float = 0.1) -> dict[str, Drive]:
    """Draw drives as hobby servos have them."""
    generator, found = np.random.default_rng([seed, 1]), {}
    for joint, kp in ARM_GAINS.items():
        coulomb, viscous, armature = generator.uniform((0.05, 0.35, 0.02), (0.12, 0.65, 0.03)).tolist()
        found[joint] = Drive(coulomb, viscous, armature, kp, kd, latency)
    return found


def leg_drives(seed: int, latency: float, kp: float = 30.0, kd: float = 0.7) -> dict[str, Drive]:
    """Draw quasi-direct drives; those of the calves have a larger gear ratio."""
    generator, found = np.random.default_rng([seed, 1]), {}
    for joint in LEG_JOINTS:
        coulomb, viscous, armature = generator.uniform((0.15, 0.06, 0.009), (0.3, 0.14, 0.013)).tolist()
        ratio = 1.5 if "calf" in joint else 1.0
        found[joint] = Drive(ratio * coulomb, ratio * viscous, ratio**2 * armature, kp, kd, latency)
    return found


def with_drives(path: Path, drives: Mapping[str, Drive], clamped: bool = True) -> mujoco.MjSpec:
    """Load a model and give its joints position actuators and friction."""
    spec = mujoco.MjSpec.from_file(str(path))
    spec.option.timestep, spec.option.integrator = STEP, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    if clamped:
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
        for base in [joint for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE]:
            spec.delete(base)
    for name, drive in drives.items():
        joint = spec.joint(name)
        joint.limited = joint.actfrclimited = 0
        joint.armature, joint.frictionloss, joint.damping = drive.armature, drive.coulomb, [drive.viscous, 0, 0]
        joint.solimp_friction, joint.solref_friction = [0.99, 0.999, 0.001, 0.5, 2], [0.001, 1]
        actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_position(kp=drive.kp, kv=drive.kd)
        actuator.forcelimited, actuator.forcerange = int(drive.effort > 0), [-drive.effort, drive.effort]
    return spec


def multisine(
    generator: np.random.Generator,
    time: Array,
    center: Sequence[float],
    amplitude: Sequence[float],
    band: tuple[float, float],
) -> Array:
    """Draw smooth motions [rad], shape (T, n): sums of six sines in a band [Hz], started within a second."""
    tones = (6, len(center))
    frequency = generator.uniform(*band, tones)
    phase = generator.uniform(0, 2 * np.pi, tones)
    share = generator.uniform(0.4, 1, tones) / np.sqrt(frequency)
    wave = np.sum(share * np.sin(2 * np.pi * frequency * time[:, None, None] + phase), axis=1)
    wave *= amplitude / np.abs(wave).max(axis=0)
    found: Array = center + np.clip(time, 0, 1)[:, None] ** 2 * wave
    return found


def acting(command: Array, drives: Mapping[str, Drive], hold: float, steps: int) -> Array:
    """Find the command [rad] on which each drive acts in each step, shape (steps, n)."""
    latency = np.array([drive.latency for drive in drives.values()])
    row = np.floor((np.arange(steps)[:, None] * STEP - latency) / hold + 1e-6).astype(int)
    found: Array = command[np.clip(row, 0, len(command) - 1), np.arange(command.shape[1])]
    return found


def follow(model: mujoco.MjModel, command: Array, drives: Mapping[str, Drive], hold: float) -> tuple[Array, Array]:
    """Simulate a clamped robot and return positions [rad] and velocities [rad/s] of all steps."""
    steps = round(len(command) * hold / STEP)
    data, kind = mujoco.MjData(model), mujoco.mjtState.mjSTATE_FULLPHYSICS
    data.qpos[:] = command[0]
    start = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, start, kind)
    states, _ = rollout.rollout(model, [data], start[None], acting(command, drives, hold, steps)[None])
    states = np.vstack([start, states[0, :-1]])[:, 1:]  # without the time
    return states[:, : model.nq], states[:, model.nq :]


def arm_log(
    drives: Mapping[str, Drive], seed: int, seconds: float, policy: float = 50.0, rate: float | None = None
) -> dict[str, Array]:
    """Simulate the hobby arm, which a policy [Hz] commands, and log it at that rate or another one [Hz]."""
    generator = np.random.default_rng(seed)
    sent = np.arange(round(seconds * policy)) / policy
    center, amplitude = (0, -0.3, 0.6, 0.3, 0, 0.4), (1.2, 0.9, 0.9, 1.0, 1.6, 1.2)
    command = np.round(multisine(generator, sent, center, amplitude, (0.08, 0.7)) / TICK) * TICK
    log = logged(ARM, command, drives, policy, rate or policy)
    noise = 0.005 * generator.standard_normal(log["position"].shape)
    return log | {"position": np.round(log["position"] / TICK) * TICK, "velocity": log["velocity"] + noise}


def clamped_log(
    drives: Mapping[str, Drive], seed: int, seconds: float, policy: float = 50.0, rate: float = 200.0
) -> dict[str, Array]:
    """Simulate the clamped quadruped, whose legs swing as a policy [Hz] commands, and log it at a rate [Hz]."""
    generator = np.random.default_rng(seed)
    sent = np.arange(round(seconds * policy)) / policy
    command = multisine(generator, sent, (0.0, 0.8, -1.6) * 4, (0.45, 0.7, 0.6) * 4, (0.15, 1.6))
    log = logged(QUADRUPED, command, drives, policy, rate)
    noise = generator.standard_normal((2, *log["position"].shape))
    return log | {"position": log["position"] + 1.5e-4 * noise[0], "velocity": log["velocity"] + 0.02 * noise[1]}


def logged(path: Path, command: Array, drives: Mapping[str, Drive], policy: float, rate: float) -> dict[str, Array]:
    """Log a clamped robot at a rate [Hz] without noise; `desired_position` is the last command that was sent."""
    position, velocity = follow(with_drives(path, drives).compile(), command, drives, 1 / policy)
    time = np.arange(round(len(command) / policy * rate)) / rate
    rows = np.round(time / STEP).astype(int)
    sent = np.floor(time * policy + 1e-6).astype(int)
    return {"time": time, "position": position[rows], "velocity": velocity[rows], "desired_position": command[sent]}


def write_robot(folder: Path, path: Path, drives: Mapping[str, Drive], keys: Sequence[str] = ("kp", "kd")) -> None:
    """Copy the model of a clamped robot and write its robot file, with these gains."""
    shutil.copy(path, folder / path.name)
    lines = ["[robot]", f'model = "{path.name}"', 'base = "fixed"', 'torque_source = "command"']
    for key in keys:
        values = ", ".join(f"{joint} = {getattr(drive, key)}" for joint, drive in drives.items())
        lines.append(f"{key} = {{ {values} }}")
    (folder / "robot.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")

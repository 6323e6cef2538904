"""Logs with known friction of quadrupeds on ball feet, simulated by MuJoCo without any part of this package.

Feet stand and swing around their places below the hips, by inverse kinematics, while the base sways, travels and turns.
A seed draws friction of joints and ground, masses, payload, slope and motion; a robot that falls gets another draw.
Sizes scale with the robot's weight times the length of its legs, 50 N m for a Go2.
"""

import json
import xml.etree.ElementTree as ET
from itertools import count
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import tomlkit
from scipy.spatial.transform import Rotation

from stribeck.core.base.typing import Array
from stribeck.core.robot.packages import model_path

ROBOTS = {
    "go2": ("package:go2", 0.8, 1, 0.022),
    "a1": ("package:a1", 0.8, 1, 0.02),
    "b1": ("package:b1", 0.8, 1, 0.04),
    "anymal": ("package:anymal_c_simple_description/anymal", 0.5, -1, 0.03),
    "hyq": ("package:hyq_no_sensors", 0.7, -1, 0.022),
    "solo12": ("package:solo12", 0.8, -1, 0.016),
}
"""Model, angle of the front thighs [rad], sign of that of the hind thighs, and radius of feet without a ball [m]."""
GAITS = {
    "trot": (2.0, 0.6, (0.0, 0.5, 0.5, 0.0)),
    "pace": (2.4, 0.6, (0.0, 0.5, 0.0, 0.5)),
    "walk": (1.0, 0.76, (0.5, 0.0, 0.75, 0.25)),
    "pronk": (2.9, 1.0, (0.0, 0.0, 0.0, 0.0)),
    "squat": (1.0, 1.0, (0.0, 0.0, 0.0, 0.0)),
}
"""Frequency with legs of 0.3 m [Hz], share of stance, and phases of the front left, front right and hind feet."""
STEP, EVERY, START, END, GRAVITY = 2.5e-4, 8, 2.5, 24.5, 9.81
"""Physics step [s], steps per sample, times of the first and the last sample [s], and gravity [m/s^2]."""


class Quadruped:
    """A robot with drawn friction, masses, payload and ground, and goals of its joints for one gait."""

    def __init__(self, robot: str, gait: str, rng: np.random.Generator) -> None:
        name, bend, hind, radius = ROBOTS[robot]
        root, places = ET.parse(model_path(name, Path())).getroot(), dict[str, str]()
        for link in root.iter("link"):
            for shape in link.findall("collision") + link.findall("visual"):
                ball, origin = shape.find("geometry/sphere"), shape.find("origin")
                if ball is not None and shape.tag == "collision":
                    radius = float(ball.get("radius", radius))
                    places[link.get("name", "")] = "0 0 0" if origin is None else origin.get("xyz", "0 0 0")
                link.remove(shape)
        limits = {"fusestatic": "false", "balanceinertia": "true", "boundmass": "1e-6", "boundinertia": "1e-9"}
        ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", limits)
        spec = mujoco.MjSpec.from_string(ET.tostring(root, encoding="unicode"))
        spec.option.timestep, spec.option.integrator = STEP, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        self.weight = GRAVITY * sum(body.mass for body in spec.bodies)
        (trunk := spec.worldbody.first_body()).add_freejoint()
        ground = {"friction": [rng.uniform(0.5, 1.0), 0.02, 0.001], "solref": [rng.uniform(0.005, 0.015), 1]}
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[50, 50, 0.1], **ground)
        self.feet = [body.name for body in spec.bodies if body.name.lower().endswith("foot")]
        for foot in self.feet:
            place = [float(number) for number in places.get(foot, "0 0 0").split()]
            geom = {"name": foot, "type": mujoco.mjtGeom.mjGEOM_SPHERE, "size": [radius, 0, 0], "mass": 0}
            spec.body(foot).add_geom(pos=place, **geom, **ground)
        if payload := max(0.0, rng.uniform(-0.1, 0.15)) * self.weight / GRAVITY:
            box = trunk.add_body(name="payload", pos=[rng.uniform(-0.1, 0.1), 0, 0.1])
            box.mass, box.inertia, box.explicitinertial = payload, [0.003 * payload] * 3, True
        self.joints = [joint.name for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_HINGE]
        for name in self.joints:
            spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT).set_to_motor()
        self.model = model = spec.compile()
        self.data, self.mirror, n = mujoco.MjData(model), mujoco.MjData(model), len(self.joints)
        self.goal, self.rate, self.speed = np.zeros(n), np.zeros(n), np.zeros(6)
        x, y, _ = self.kinematics()[0].T
        self.feet = [self.feet[k] for k in np.lexsort((y < 0, x < 0))]
        self.legs = [np.flatnonzero(np.any(jacobian, axis=0)) for jacobian in self.kinematics()[1]]
        for leg, sign in zip(self.legs, (1, 1, hind, hind), strict=True):
            self.goal[leg] = 0.0, sign * bend, -2 * sign * bend
        self.below, _ = self.kinematics()
        self.length = -float(np.mean(self.below[:, 2]))
        self.size, self.pause = self.weight * self.length, np.sqrt(self.length / GRAVITY)
        factors = 1 + 0.03 * rng.standard_normal((model.nbody, 1))
        model.body_mass[:], model.body_inertia[:] = model.body_mass * factors[:, 0], model.body_inertia * factors
        model.dof_frictionloss[6:] = self.size * np.exp(rng.uniform(np.log(0.004), np.log(0.015), n))
        model.dof_damping[6:] = self.size * rng.uniform(0.0008, 0.0025, n)
        model.dof_armature[6:] = self.size * rng.uniform(0.00018, 0.00035, n)
        model.dof_solref[6:, :2] = 0.001, 1  # the default of 20 ms weakens friction
        angles = np.radians(rng.uniform(-4, 4, 2)) * (gait in ("trot", "walk"))
        self.slope = Rotation.from_euler("XY", angles).as_matrix()
        model.opt.gravity[:] = -GRAVITY * self.slope[2]
        self.data.qpos[:] = 0, 0, self.length + radius, 1, 0, 0, 0, *self.goal
        self.gait, (frequency, self.stance, self.phases) = gait, GAITS[gait]
        self.frequency = frequency * np.sqrt(0.3 / self.length) * rng.uniform(0.85, 1.15)
        self.place, self.left = self.below.copy(), self.below.copy()
        sway = np.array([0.12, 0.1, 0.14, 0.15, 0.12, 0.2] if gait == "squat" else [0.04, 0.04, 0.04, 0.06, 0.06, 0.04])
        self.sway = sway * rng.uniform(0.5, 1.0, 6) * np.repeat([self.length, 1.0], 3)
        self.slow, self.shift = rng.uniform(0.3, 1.0, 6), rng.uniform(0, 2 * np.pi, 6)
        self.travel = rng.uniform(-1, 1, 3) * [0.12, 0.04, 0.1] * np.sqrt(GRAVITY * self.length) * (self.stance < 1)
        self.lift = rng.uniform(0.12, 0.25) * self.length

    def kinematics(self) -> tuple[Array, Array]:
        """Compute the feet relative to the base at the goal, shape (4, 3), and their Jacobians, shape (4, 3, n)."""
        self.mirror.qpos[:] = 0, 0, 0, 1, 0, 0, 0, *self.goal
        mujoco.mj_kinematics(self.model, self.mirror)
        mujoco.mj_comPos(self.model, self.mirror)
        jacobian = np.zeros((4, 3, self.model.nv))
        for own, foot in zip(jacobian, self.feet, strict=True):
            mujoco.mj_jacGeom(self.model, self.mirror, own, None, self.model.geom(foot).id)
        return np.array([self.mirror.geom(foot).xpos for foot in self.feet]), jacobian[:, :, 6:]

    def advance(self, t: float, turn: Array) -> Array:
        """Move the goal by one sample, and compute torques that carry the weight, shape (n,)."""
        dt, grow = STEP * EVERY, min(1.0, t / START)
        angles = Rotation.from_matrix(turn).as_euler("ZYX")
        travel = self.travel * (1 + 0.6 * np.sin(0.5 * t + self.shift[:3])) * grow
        pull = travel[:2] + travel[2] * self.below[:, 1::-1] * np.array([-1, 1])
        self.speed += (self.data.qvel[:6] - self.speed) * dt / 0.03  # an unfiltered loop oscillates
        error = Rotation.from_euler("Z", -angles[0]).apply(self.speed[:3])[:2] - travel[:2]
        swing = (np.add(self.phases, self.frequency * t) % 1 - self.stance) / max(1 - self.stance, 1e-9)
        stands, share = (swing <= 0)[:, None], np.maximum(swing, 0.0)[:, None]
        self.place[:, :2] -= pull * dt
        self.left = np.where(stands, self.place, self.left)
        landing = self.below[:, :2] + 0.5 * self.stance / self.frequency * pull + 0.4 * self.pause * error
        ahead = share**2 * (3 - 2 * share) * (landing - self.left[:, :2])
        lift = grow * self.lift * np.sin(np.pi * share) ** 2 - self.length
        self.place = np.hstack([np.where(stands, self.place[:, :2], self.left[:, :2] + ahead), lift])
        body = grow * self.sway * np.sin(2 * np.pi * self.slow * t + self.shift)
        level = 0.4 * (body[3:5] - angles[:0:-1]) * (self.gait != "squat")
        if self.gait == "pronk":
            beat = 2 * np.pi * self.frequency
            body[:3] -= *0.4 * self.pause * error, -grow * GRAVITY / beat**2 * np.sin(beat * t)
            level -= 0.1 * self.pause * self.speed[3:5]
        base = Rotation.from_euler("ZYX", [body[5], *(body[3:5] + level)[::-1]]).as_matrix()
        wanted, before = (self.place - body[:3]) @ base, self.goal.copy()
        for _ in range(3):
            feet, jacobian = self.kinematics()
            for own, missing in zip(jacobian, wanted - feet, strict=True):
                self.goal += own.T @ np.linalg.solve(own @ own.T + 1e-5 * self.length**2 * np.eye(3), missing)
        self.rate = (self.goal - before) / dt
        arms = np.vstack([np.ones(4), (feet - self.mirror.subtree_com[1])[:, :2].T]) * stands.T
        loads = np.maximum(np.linalg.pinv(arms, 1e-2) @ [self.weight, 0, 0], 0.0)
        return np.asarray(-np.einsum("f,i,fij->j", loads, turn[2], jacobian))

    def stands(self) -> list[bool]:
        """Find the feet that carry more than 3 % of the weight."""
        load, wrench = np.zeros(self.model.ngeom), np.zeros(6)
        for k, contact in enumerate(self.data.contact):
            mujoco.mj_contactForce(self.model, self.data, k, wrench)
            load[contact.geom] += wrench[0]
        return [bool(load[self.model.geom(foot).id] > 0.03 * self.weight) for foot in self.feet]

    def run(self) -> dict[str, Any]:
        """Simulate the channels of a log; nothing if the robot falls."""
        data, turn, rows = self.data, np.zeros(9), []
        for step in range(round(END / STEP)):
            late = step % EVERY
            if not late:
                mujoco.mju_quat2Mat(turn, data.qpos[3:7])
                ahead = self.advance(step * STEP, turn.reshape(3, 3))
                if data.qpos[2] < 0.5 * self.length or turn[8] < 0.8:
                    return {}
            goal = self.goal + (late / EVERY - 1) * STEP * EVERY * self.rate
            torque = 1.7 * (goal - data.qpos[7:]) + 0.045 * (self.rate - data.qvel[6:])
            data.ctrl[:] = np.clip(self.size * torque + ahead, -1.4 * self.size, 1.4 * self.size)
            if not late and step * STEP >= START:
                base = Rotation.from_matrix(self.slope @ turn.reshape(3, 3)).as_quat()
                state = step * STEP, data.qpos[7:], data.ctrl, base, data.qvel[3:6], self.stands()
                rows.append([np.array(channel) for channel in state])
            mujoco.mj_step(self.model, data)
        names = ("time", "position", "torque", "base_orientation", "angular_velocity", "contact")
        return {name: np.array(channel) for name, channel in zip(names, zip(*rows, strict=True), strict=True)}


def simulate(folder: Path, robot: str, gait: str, seed: str) -> None:
    """Write log.npz, truth.json with each joint's Coulomb [N m] and viscous friction [N m s/rad], and robot.toml."""
    log, attempts = dict[str, Any](), count()
    while not log:
        rng = np.random.default_rng([int(seed), next(attempts), *map(ord, robot + gait)])
        own = Quadruped(robot, gait, rng)
        log = own.run()
    for name, noise in (("position", 2e-5), ("torque", 0.001 * own.size), ("angular_velocity", 0.002)):
        log[name] += noise * rng.standard_normal(log[name].shape)
    folder.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(folder / "log.npz", joint_names=own.joints, foot_names=own.feet, **log)
    coulomb, viscous, armature = (
        dict(zip(own.joints, values[6:].tolist(), strict=True))
        for values in (own.model.dof_frictionloss, own.model.dof_damping, own.model.dof_armature)
    )
    truth = {joint: {"coulomb": coulomb[joint], "viscous": viscous[joint]} for joint in own.joints}
    (folder / "truth.json").write_text(json.dumps(truth), encoding="utf-8")
    table = {"model": ROBOTS[robot][0], "base": "floating", "torque_source": "motor_side_sensor", "armature": armature}
    feet = {foot: {"frame": foot, "kind": "point"} for foot in own.feet}
    (folder / "robot.toml").write_text(tomlkit.dumps({"robot": table, "contacts": feet}), encoding="utf-8")

"""Logs of robots whose feet do not step, simulated with MuJoCo alone; each function returns the ground truth."""

import mujoco
import numpy as np
from tests.commanded import STEP, multisine
from tests.measured import compiled, record

ARM = ("shoulder", "shoulder_roll", "elbow")
UPPER = ["waist", *(f"{side}_{part}" for side in ("left", "right") for part in ARM)]
POSTURE = {"hip": -0.3, "knee": 0.6, "ankle": -0.3, "elbow": -0.6}
POSTURE |= {"left_shoulder_roll": 0.4, "right_shoulder_roll": -0.4}


def humanoid_model():
    """Build a humanoid with five joints in each leg, a waist, and three joints in each arm."""
    spec = mujoco.MjSpec()
    spec.modelname = "humanoid"

    def link(parent, name, axis, place, mass, size, reach):
        body = parent.add_body(name=name.replace("_joint", ""), pos=place)
        body.add_joint(name=name, axis=axis, range=[-170, 170], limited=True)
        inertia = mass / 12 * (np.sum(np.square(size)) - np.square(size))
        body.mass, body.ipos, body.inertia, body.explicitinertial = mass, reach, inertia, True
        return body

    pelvis = spec.worldbody.add_body(name="pelvis", pos=[0, 0, 1])
    pelvis.add_freejoint(name="root")
    pelvis.mass, pelvis.ipos, pelvis.inertia, pelvis.explicitinertial = 6.0, [0, 0, 0], [0.04, 0.03, 0.05], True
    pelvis.add_site(name="imu")
    pelvis.add_site(name="hook", pos=[0, 0, 0.2])
    trunk = link(pelvis, "waist", [0, 0, 1], [0, 0, 0.08], 9.0, [0.2, 0.3, 0.4], [0, 0, 0.2])
    for side, sign in (("left", 1), ("right", -1)):
        upper = link(pelvis, f"{side}_hip_roll", [1, 0, 0], [0, 0.1 * sign, -0.05], 1.0, [0.1, 0.1, 0.1], [0, 0, 0])
        thigh = link(upper, f"{side}_hip", [0, 1, 0], [0, 0, 0], 3.0, [0.1, 0.1, 0.35], [0, 0, -0.15])
        shank = link(thigh, f"{side}_knee", [0, 1, 0], [0, 0, -0.35], 2.0, [0.08, 0.08, 0.35], [0, 0, -0.15])
        ankle = link(shank, f"{side}_ankle", [0, 1, 0], [0, 0, -0.35], 0.3, [0.05, 0.05, 0.05], [0, 0, 0])
        foot = link(ankle, f"{side}_ankle_roll", [1, 0, 0], [0, 0, 0], 0.8, [0.2, 0.1, 0.04], [0.03, 0, -0.03])
        for x in (-0.08, 0.14):
            for y in (-0.05, 0.05):
                foot.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.005, 0, 0], pos=[x, y, -0.05], mass=0)
    for side, sign in (("left", 1), ("right", -1)):
        size, reach = [0.1, 0.1, 0.1], [0, 0.04 * sign, 0]
        arm = link(trunk, f"{side}_shoulder", [0, 1, 0], [0, 0.2 * sign, 0.35], 0.8, size, reach)
        arm = link(arm, f"{side}_shoulder_roll", [1, 0, 0], [0, 0.05 * sign, 0], 1.5, [0.08, 0.08, 0.3], [0, 0, -0.12])
        link(arm, f"{side}_elbow", [0, 1, 0], [0, 0, -0.28], 1.2, [0.06, 0.06, 0.3], [0, 0.01, -0.12])
    return spec


def still_humanoid(folder, kind, seed=1, seconds=10.0, rate=500.0):
    """Write a log and robot file of a humanoid that stands, squats ("squat") or hangs ("hung")."""
    rng, spec = np.random.default_rng(seed), humanoid_model()
    (folder / "humanoid.xml").write_text(spec.to_xml())
    names = [joint.name for joint in spec.joints if joint.name != "root"]
    friction = rng.uniform(0.5, 1.0, len(names)), rng.uniform(0.1, 0.3, len(names))
    hung = kind == "hung"
    if hung:
        spec.worldbody.add_site(name="gantry", pos=[0, 0, 1.2])
        spec.add_tendon(name="rope", range=[0, 0.02], limited=True).wrap_site("gantry")
        spec.tendon("rope").wrap_site("hook")
    else:
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[2, 2, 1])

    def drive(actuator, name):
        kp = 150.0 if name in UPPER else 3000.0
        actuator.set_to_position(kp=kp, kv=0.04 * kp)

    model = compiled(spec, rng, STEP, names, friction, 0.02, drive)
    time = np.arange(0, seconds + 2, STEP)
    posture = np.array([sum(angle for part, angle in POSTURE.items() if name.endswith(part)) for name in names])
    share = np.array([0.15 if name == "waist" else 0.8 if name in UPPER else 0.15 * hung for name in names])
    command = multisine(rng, time, posture, share, (0.15, 0.6))
    if kind == "squat":
        dip = multisine(rng, time, [0.2], [0.25], (0.15, 0.5)) * np.clip(time, 0, 1)[:, None]
        bent = {"hip": -1, "knee": 2, "ankle": -1}
        command += dip * [bent.get(name.split("_", 1)[-1], 0) for name in names]
    place = [0, 0, 1.0 if hung else 0.796, 1, 0, 0, 0, *posture]
    flags, feet = np.full((len(time), 2), not hung), ("left", "right")
    record(folder, model, rng, names, place, command, rate, foot_names=np.array(feet), contact=flags)
    listed = "".join(f'[contacts.{foot}]\nframe = "{foot}_ankle_roll"\n' for foot in feet)
    (folder / "robot.toml").write_text(f'[robot]\nmodel = "humanoid.xml"\ntorque_source = "motor_current"\n{listed}')
    return dict(zip(names, zip(*friction, strict=True), strict=True))

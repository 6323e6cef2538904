"""Logs of robots that roll, with MuJoCo alone: quadrupeds on wheels or ball feet, and a base with a six-joint arm."""

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation
from tests.commanded import LEGS, QUADRUPED, multisine
from tests.measured import compiled, record
from tests.trotting import HIPS, OUTER, SIDES, leg_angles

STEP, RADIUS, WIDE, HEIGHT = 5e-4, 0.086, 0.06, 0.3
"""Time step [s]; radius of wheels, distance of their plane from the leg's, height of the base above the axles [m]."""
ARM = {"pan": ([0, 0, 1], [0.1, 0, 0.1]), "lift": ([0, 1, 0], [0, 0, 0.1]), "elbow": ([0, 1, 0], [0, 0, 0.3])} | {
    "wrist": ([1, 0, 0], [0, 0, 0.2]),
    "pitch": ([0, 1, 0], [0, 0, 0.1]),
    "roll": ([0, 0, 1], [0, 0, 0.1]),
}
"""Axis and place of each joint."""


def rolling_model(legs, wheels):
    """Build a robot whose wheels are at the ends of its legs, or on its base; or a quadruped on ball feet."""
    spec = mujoco.MjSpec.from_file(str(QUADRUPED))
    spec.delete(spec.geoms[0])
    for leg, hip, side in zip(LEGS, HIPS, SIDES, strict=True):
        if not wheels:
            spec.site(leg).name = f"{leg}_foot"
            continue
        spec.delete(spec.geom(leg))
        spec.delete(spec.site(leg))
        if not legs:
            spec.delete(spec.body(f"{leg}_hip"))
        parent, place = (spec.body(f"{leg}_calf"), [0, 0, -0.213]) if legs else (spec.body("trunk"), [*hip[:2], -0.1])
        wheel = parent.add_body(name=f"{leg}_wheel", pos=place)
        wheel.add_joint(name=f"{leg}_wheel_joint", axis=[0, 1, 0])
        wheel.mass, wheel.inertia, wheel.ipos = 0.6, [1.5e-3, 2.5e-3, 1.5e-3], [0, WIDE * side, 0]
        wheel.explicitinertial = True
        turned, cylinder = [0.5**0.5, 0.5**0.5, 0, 0], mujoco.mjtGeom.mjGEOM_CYLINDER
        wheel.add_geom(type=cylinder, size=[RADIUS, 0.02, 0], mass=0, pos=wheel.ipos, quat=turned)
    body = spec.body("trunk")
    for name, (axis, place) in ({} if legs else ARM).items():
        body = body.add_body(name=name, pos=place, mass=0.4, ipos=[0.02, 0.02, 0.05], inertia=[3e-3, 3e-3, 1e-3])
        body.explicitinertial = True
        body.add_joint(name=f"{name}_joint", axis=axis)
    for joint in spec.joints:
        if joint.name != "base" and "wheel" not in joint.name:
            joint.range, joint.limited = [-175, 175], True
    return spec


def rolling_robot(folder, legs, seed=1, seconds=25.0, rate=250.0, ahead=0.0, wheels=True):
    """Write the model and a log of a robot whose trunk or arm moves while it drives or stands; return the truth."""
    rng, spec = np.random.default_rng(seed), rolling_model(legs, wheels)
    radius, wide = (RADIUS, WIDE) if wheels else (0.022, 0.01)
    (folder / "rover.xml").write_text(spec.to_xml())
    names = [joint.name for joint in spec.joints if joint.name != "base"]
    driven = np.array(["wheel" in name for name in names])
    friction = rng.uniform(0.2, 0.4, len(names)), rng.uniform(0.03, 0.15, len(names))
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1])

    def drive(actuator, name):
        actuator.set_to_velocity(kv=6.0) if "wheel" in name else actuator.set_to_position(kp=250.0, kv=8.0)

    model = compiled(spec, rng, STEP, names, friction, 0.01, drive)
    time = np.arange(0, seconds + 2, STEP)
    forward, turn = wheels * multisine(rng, time, [ahead, 0], [0.8, 0.3], (0.03, 0.2)).T
    command = np.zeros((len(time), len(names)))
    if legs:
        lean = multisine(rng, time, [0] * 5, [0.12, 0.12, 0.03, 0.03, 0.05], (0.1, 0.5))
        level = Rotation.from_euler("xy", lean[:, :2]).inv()
    else:
        command[:, ~driven] = multisine(rng, time, [0, 0.3, 0.8, 0, 0.3, 0], [1.5, 0.8, 0.8, 1.5, 1, 1.5], (0.1, 0.6))
    for leg, hip, side in zip(LEGS, HIPS, SIDES, strict=True):
        speed = forward - turn * (hip[1] + side * (OUTER + wide))
        if legs:
            along = multisine(rng, time, [0], [0.03 * wheels], (0.1, 0.4))[:, 0]
            place = [hip[0] + along - lean[:, 2], hip[1] + side * (OUTER + wide) - lean[:, 3], -HEIGHT - lean[:, 4]]
            foot = level.apply(np.transpose(place)) - hip - [0, side * WIDE * wheels, 0]
            angles = np.array([leg_angles(each, side) for each in foot[::20]])
            for part, angle in zip(("hip", "thigh", "calf"), angles.T, strict=True):
                command[:, names.index(f"{leg}_{part}_joint")] = np.interp(time, time[::20], angle)
            speed = speed + np.gradient(along - lean[:, 2], STEP)
        if wheels:
            command[:, names.index(f"{leg}_wheel_joint")] = speed / RADIUS
    place = [0, 0, radius + (HEIGHT if legs else 0.1), 1, 0, 0, 0, *np.where(driven, 0, command[0])]
    record(folder, model, rng, names, place, command, rate)
    return dict(zip(names, zip(*friction, strict=True), strict=True))

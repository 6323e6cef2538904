"""Generate the TORO-like humanoid as an MJCF file that both Pinocchio and MuJoCo load.

`python -m stribeck.simulation.robots.toro.model` writes `models/toro.xml`. MuJoCo computes the inertias of the links
from their solids and writes them to the file, so that all readers use the same numbers.
"""

import mujoco
import numpy as np

from stribeck.simulation.robots import TORO_MODEL
from stribeck.simulation.robots.toro.table import FOOT_SIZE, PELVIS, SIDES, SOLE, Solid, toro_links

FOOT_THICKNESS = 0.03
"""Size of the sole's box [m]."""


def toro_mjcf() -> str:
    """Format the text of the model file."""
    spec = mujoco.MjSpec()
    spec.modelname = "toro-like"
    spec.compiler.degree = False
    spec.compiler.saveinertial = True
    spec.option.timestep = 0.00025  # of the physics [s]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    # impratio [1]: stiffness of friction relative to the normal force, which prevents creeping feet
    spec.option.impratio = 10.0
    pelvis = spec.worldbody.add_body(name="pelvis")
    pelvis.add_freejoint(name="root")
    pelvis.add_site(name="imu", size=[0.01] * 3)
    _add_solids(pelvis, PELVIS)
    bodies = {"pelvis": pelvis}
    for link in toro_links():
        body = bodies[link.parent].add_body(name=link.name + "_link", pos=link.origin)
        body.add_joint(
            name=link.name,
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=link.axis,
            range=np.radians(link.range),
            actfrcrange=(-link.drive.effort, link.drive.effort),
        )
        _add_solids(body, link.solids)
        bodies[link.name] = body
    for side in SIDES:
        _add_sole(bodies[f"{side}_ankle_pitch"], side)
    for link in toro_links():
        motor = spec.add_actuator(name=link.name, target=link.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.ctrlrange, motor.ctrllimited = (-link.drive.effort, link.drive.effort), True
    spec.compile()
    return str(spec.to_xml())


def _add_solids(body: mujoco.MjsBody, solids: tuple[Solid, ...]) -> None:
    """Add visible solids with mass, but without contact, to a body."""
    kinds = {1: mujoco.mjtGeom.mjGEOM_SPHERE, 2: mujoco.mjtGeom.mjGEOM_CYLINDER, 3: mujoco.mjtGeom.mjGEOM_BOX}
    for solid in solids:
        size = np.zeros(3)
        size[: len(solid.size)] = solid.size
        if len(solid.size) == 3:
            size /= 2
        elif len(solid.size) == 2:
            size[1] /= 2
        body.add_geom(
            type=kinds[len(solid.size)],
            size=size,
            pos=solid.centre,
            quat=_along(solid.axis),
            mass=solid.mass,
            contype=0,
            conaffinity=0,
            group=1,
            # colours of boxes and of cylinders, red, green, blue, alpha
            rgba=(0.75, 0.78, 0.82, 1.0) if len(solid.size) == 3 else (0.25, 0.30, 0.38, 1.0),
        )


def _along(axis: str) -> tuple[float, float, float, float]:
    """Compute the quaternion wxyz that turns z onto an axis."""
    half = np.sqrt(0.5)
    return {"x": (half, 0.0, half, 0.0), "y": (half, -half, 0.0, 0.0), "z": (1.0, 0.0, 0.0, 0.0)}[axis]


def _add_sole(foot: mujoco.MjsBody, side: str) -> None:
    """Add the massless contact box and the frame of its sole to a foot."""
    foot.add_geom(
        name=f"{side}_sole",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=(FOOT_SIZE[0] / 2, FOOT_SIZE[1] / 2, FOOT_THICKNESS / 2),
        pos=(SOLE[0], SOLE[1], SOLE[2] + FOOT_THICKNESS / 2),
        mass=0,
        group=3,
        condim=3,
        # sliding [1], torsional [m] and rolling [m]; with three-dimensional contacts only the first acts
        friction=(0.9, 0.005, 0.0001),
        # time constant [s] and damping ratio of the contact: MuJoCo's default is soft enough for the foot to rock
        solref=(0.001, 1.0),
        solimp=(0.99, 0.999, 0.0005, 0.5, 2.0),
        priority=1,
    )
    foot.add_site(name=f"{side}_sole", pos=SOLE, size=[0.01] * 3)


if __name__ == "__main__":  # writes the model file
    TORO_MODEL.write_text(toro_mjcf(), encoding="utf-8")

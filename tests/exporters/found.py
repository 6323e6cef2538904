"""Results as a whole log would give them, of any robot, and the robot that they describe."""

import importlib.util
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pinocchio as pin
from tests.models import EXAMPLES, MODELS
from tests.result import made

from stribeck.core.estimator.model.bodies import bodies_of
from stribeck.core.result import BodyCorrection, Corrections, JointResult, LogSummary, Result
from stribeck.core.robot import Robot
from stribeck.core.settings import Priors
from stribeck.simulation.robots import MODELS as PACKAGED
from stribeck.simulation.robots import TORO

FRICTION = {"viscous": (0.3, "N m s/rad"), "coulomb": (1.2, "N m"), "offset": (-0.4, "N m")}
UNITS = {"viscous": "N m s/rad", "coulomb": "N m", "stribeck_velocity": "rad/s", "offset": "N m", "armature": "kg m^2"}


def joint_result(parameters: dict[str, tuple[float, str]], weak: tuple[str, ...] = ()) -> JointResult:
    """Return what a log says of a joint: parameters with units, some of them weak."""
    estimates = {
        name: replace(made.estimate(value, 0.01, "weak" if name in weak else "identified"), unit=unit)
        for name, (value, unit) in parameters.items()
    }
    verdict = "not excited" if not parameters else "weak" if weak else "identified"
    return made.joint(estimates, verdict=verdict, reason="", samples=9, reversals=9)


def joint(law: str = "auto", **values: float) -> JointResult:
    """Return what a log says of a joint whose parameters have these values."""
    return replace(joint_result({name: (value, UNITS.get(name, "1")) for name, value in values.items()}), law=law)


def of_joint(own: JointResult, folder: Path, robot: str = "arm") -> tuple[Result, Robot, str]:
    """Return a result of only a robot's first joint, the robot, and the joint's name."""
    result, machine = of_joints(folder, own, robot=robot)
    return result, machine, machine.joint_names[0]


def of_joints(folder: Path, *own: JointResult, robot: str = "arm") -> tuple[Result, Robot]:
    """Return a result of only a robot's first joints, and the robot."""
    machine, _ = robot_of(robot, folder)
    joints = dict(zip(machine.joint_names, own, strict=False))
    return replace(found_in(machine, own[0].law or "coulomb-viscous")[0], joints=joints, corrections=None), machine


def robot_of(name: str, folder: Path) -> tuple[Robot, str]:
    """Return a robot, read from a file in the folder, and its format."""
    packaged = {"toro": TORO, "arm": PACKAGED / "arm.toml", "biped": PACKAGED / "robot.toml"}
    packaged["quadruped"] = PACKAGED / "quadruped.toml"
    path = folder / "robot.toml"
    if name in packaged:
        text = packaged[name].read_text().replace('model = "', f'model = "{PACKAGED}/')
    else:
        model, keys, _ = MODELS[name]
        text = f'[robot]\nmodel = "{EXAMPLES / model}"\nbase = "{keys.get("base", "floating")}"\n'
        if name == "g1":
            text += "locked = { waist_roll_joint = 0.1, left_wrist_roll_joint = -0.4 }\n"
    path.write_text(text)
    return Robot.from_file(path), "mjcf" if name == "toro" else "urdf"


def module(path: Path) -> ModuleType:
    """Import a module that was written, whatever its suffix."""
    path = path.rename(path.with_suffix(".py"))
    spec = importlib.util.spec_from_file_location(path.stem, path)
    own = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(own)
    return own


def found_in(robot: Robot, law: str = "coulomb-viscous", seed: int = 0) -> tuple[Result, Robot]:
    """Return a result with every body changed as much as a whole log believes possible, and the robot as changed."""
    model = pin.Model(robot.tree.model)
    generator = np.random.default_rng(seed)
    before = np.stack([model.inertias[joint].toDynamicParameters() for joint in range(1, model.njoints)])
    change = bodies_of(before, Priors()).corrections(generator.normal(size=before.shape))
    bodies = {}
    for joint, (old, new) in enumerate(zip(before, before + change, strict=True), start=1):
        if old[0] > 0:
            model.inertias[joint] = pin.Inertia.FromDynamicParameters(new)
            bodies[str(model.names[joint])] = _correction(robot.tree.model.inertias[joint], model.inertias[joint])
    result = Result(
        robot=robot.name,
        log=LogSummary(path="walks/walk.npz", sha256="", duration=1.0, rate=1e3, samples_used=9),
        law=law,
        method="whole-log",
        joints={name: joint_result(FRICTION) for name in robot.joint_names},
        stribeck="0",
        corrections=Corrections(chi_square=1.0, bodies=bodies),
    )
    return result, replace(robot, tree=replace(robot.tree, model=model))


def _correction(before: pin.Inertia, after: pin.Inertia) -> BodyCorrection:
    pair = (before, after)
    lower = np.array([0, 1, 1, 2, 2, 2]), np.array([0, 0, 1, 0, 1, 2])  # Ixx, Ixy, Iyy, Ixz, Iyz, Izz
    return BodyCorrection(
        mass=(float(before.mass), float(after.mass)),
        mass_error=0.1,
        centre_of_mass=tuple(tuple(body.lever.tolist()) for body in pair),  # type: ignore[arg-type]
        centre_of_mass_error=(0.1, 0.1, 0.1),
        inertia=tuple(tuple(body.inertia[lower].tolist()) for body in pair),  # type: ignore[arg-type]
        known=0.5,
    )

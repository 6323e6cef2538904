"""Results as a whole log would give them, of any robot, and the robot that they describe."""

from dataclasses import replace

import numpy as np
import pinocchio as pin

from stribeck.identification.whole_log.model.bodies import bodies_of
from stribeck.result import BodyCorrection, Corrections, JointResult, LogSummary, ParameterEstimate, Result
from stribeck.robot import Robot
from stribeck.settings import Priors

FRICTION = {"viscous": (0.3, "N m s/rad"), "coulomb": (1.2, "N m"), "offset": (-0.4, "N m")}


def joint_result(parameters: dict[str, tuple[float, str]], weak: tuple[str, ...] = ()) -> JointResult:
    """Return what a log says of a joint: parameters with units, some of them weak."""
    estimates = {
        name: ParameterEstimate(
            value=value,
            standard_error=0.01,
            interval_95=(value - 0.02, value + 0.02),
            unit=unit,
            verdict="weak" if name in weak else "identified",
        )
        for name, (value, unit) in parameters.items()
    }
    verdict = "not excited" if not parameters else "weak" if weak else "identified"
    return JointResult(
        parameters=estimates, verdict=verdict, reason="", samples=9, velocity_range=(-1.0, 1.0), reversals=9
    )


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
        warnings=[],
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

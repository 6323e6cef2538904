"""The demonstration: a humanoid with known friction walks in the contact simulator, and its sensors are logged."""

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.friction import FrictionLaw, get_law
from stribeck.core.result import Result
from stribeck.core.result.reference import Reference
from stribeck.simulation.files import write_simulated
from stribeck.simulation.friction.parameters import Parameters
from stribeck.simulation.robots import MODELS, TORO, TORO_MODEL
from stribeck.simulation.run import run_scenario
from stribeck.simulation.scenario import read_scenario

NEAR = (1e-4, 0.1)
"""Range of the additional velocities near rest, relative to the largest speed [1]."""


def truth_reference(result: Result, law: FrictionLaw, parameters: Parameters) -> Reference:
    """Build the reference that the report shows next to a result.

    Parameters
    ----------
    result
        Result with the velocity range of each joint.
    law, parameters
        Simulated friction; parameters are compared if the same law was fitted.
    """
    curves = {}
    for joint, values in parameters.items():
        if joint in result.joints and any(result.joints[joint].velocity_range):
            velocity = _velocities(*result.joints[joint].velocity_range)
            ordered = np.array([values[parameter.name] for parameter in law.parameters])
            curves[joint] = (velocity, law.torque(velocity, ordered))
    known = {joint: dict(values) for joint, values in parameters.items()} if law.name == result.law else {}
    return Reference(name="the simulated truth", curves=curves, parameters=known)


def _velocities(low: float, high: float) -> Array:
    """Compute the velocities of a truth curve from low to high, denser near zero [rad/s]."""
    reach = max(abs(low), abs(high))
    near = np.geomspace(NEAR[0] * reach, NEAR[1] * reach, 60)
    velocities = np.concatenate([np.linspace(low, high, 201), -near, near, [0.0]])
    return np.unique(velocities[(velocities >= low) & (velocities <= high)])


SCENARIO = MODELS / "demo.toml"
"""Scenario of the demonstration."""
FILES = ("scenario.toml", "robot.toml", TORO_MODEL.name, "log.npz", "log.truth.npz")
"""Files of the demonstration."""


@dataclass(frozen=True, eq=False)
class Demo:
    """Files of a demonstration, true friction law, and parameters by joint and name."""

    robot_file: Path
    log: Path
    law: FrictionLaw
    parameters: Parameters


def make_demo(folder: Path, progress: Callable[[float], None] = lambda _: None, *, scenario: Path = SCENARIO) -> Demo:
    """Simulate the walk of the humanoid, and write its files to an existing folder.

    Parameters
    ----------
    folder
        Output folder for `FILES`.
    progress
        Callback `progress(fraction)`.
    scenario
        Scenario file; by default the packaged humanoid in the contact simulator.
    """
    for source, name in ((scenario, "scenario.toml"), (TORO, "robot.toml"), (TORO_MODEL, TORO_MODEL.name)):
        shutil.copyfile(source, folder / name)
    chosen = read_scenario(folder / "scenario.toml")
    result = run_scenario(chosen, folder, progress)
    write_simulated(result.log, result.truth, folder / "log.npz")
    return Demo(
        robot_file=folder / "robot.toml",
        log=folder / "log.npz",
        law=get_law(chosen.friction.law),
        parameters=result.truth.parameters,
    )

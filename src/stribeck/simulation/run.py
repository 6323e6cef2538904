"""Run a scenario: the robot, its measured log, and the ground truth."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pinocchio as pin

from stribeck.core.errors import SettingsError
from stribeck.core.friction import FrictionLaw, LawWithState, get_law
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.simulation.friction import Backlash, Drift, FrictionEffect, FrictionTruth, LawFriction, Load, LuGre
from stribeck.simulation.prescribed.exact import Truth, exact_log
from stribeck.simulation.robots import MODELS
from stribeck.simulation.scenario import FrictionTable, Named, Scenario, by_joint
from stribeck.simulation.sensors.measure import measure, sensors_for
from stribeck.simulation.sensors.profiles import PROFILES
from stribeck.simulation.walking.ideal import simulate_ideal_walk
from stribeck.simulation.walking.simulate import Conditions, simulate_walk

PACKAGED = {"toro": "toro.toml", "biped": "robot.toml", "quadruped": "quadruped.toml", "arm": "arm.toml"}
"""Robots that come with stribeck, by name."""
_BENT = {"hip_pitch": -0.3, "knee": 0.6, "ankle_pitch": -0.3}
_HUMANOID = {f"{side}_{joint}": value for side in ("left", "right") for joint, value in _BENT.items()}
POSTURES: dict[str, Named] = {
    "toro": _HUMANOID,
    "biped": _HUMANOID,
    "quadruped": {
        f"{end}_{side}_{joint}": value
        for end in ("front", "rear")
        for side in ("left", "right")
        for joint, value in (("hip", 0.0), ("thigh", 0.8), ("knee", -1.6))
    },
}
"""Standing postures of packaged robots [rad]."""


@dataclass(frozen=True, eq=False)
class Simulated:
    """Result of a scenario: the robot, its log from the sensors, and the ground truth."""

    robot: Robot
    log: RobotLog
    truth: Truth


def run_scenario(
    scenario: Scenario, folder: Path = Path(), progress: Callable[[float], None] = lambda _: None
) -> Simulated:
    """Simulate a scenario; the result is reproducible, bit for bit.

    Parameters
    ----------
    scenario
        Content of a scenario file.
    folder
        Folder that the robot file's path is relative to.
    progress
        Callback `progress(fraction)`.

    Raises
    ------
    StribeckError
        If the scenario does not fit the robot, or the robot falls.
    """
    robot = Robot.from_file(robot_file(scenario, folder))
    posture = POSTURES.get(scenario.robot, {}) | scenario.posture
    if scenario.simulator == "exact":
        return _exact(scenario, robot, posture)
    if [contact.kind for contact in robot.contacts.values()] != ["surface", "surface"]:
        raise SettingsError(
            f"scenario: the simulator '{scenario.simulator}' lets a robot walk on two contacts of kind 'surface', "
            f"which {robot.name} does not have; take the simulator 'exact'"
        )
    walk, friction, soles = scenario.walk, friction_of(scenario, robot), scenario.soles
    if scenario.simulator == "mujoco":
        conditions = Conditions(
            friction=friction,
            state=scenario.state,
            profile=PROFILES[scenario.sensors],
            seed=scenario.seed,
            pushes=scenario.push,
            believed=believed_model(robot, scenario.model_error, scenario.seed) if scenario.model_error else None,
            soles=soles,
            physics_step=scenario.physics_step,
        )
        result = simulate_walk(robot, walk, posture, conditions, progress)
        return Simulated(robot, result.log, result.truth)
    if scenario.push or scenario.model_error:
        raise SettingsError(
            f"scenario: the simulator '{scenario.simulator}' is ideal; pushes and model_error are for 'mujoco'"
        )
    literal = scenario.simulator == "constrained-paper"
    result = simulate_ideal_walk(robot, walk, posture, friction, soles=soles, paper_literal=literal, progress=progress)
    return _measured(robot, result.log, result.truth, scenario)


def robot_file(scenario: Scenario, folder: Path) -> Path:
    """Find the robot file of a scenario, whose path may be relative to a folder."""
    return MODELS / PACKAGED[scenario.robot] if scenario.robot in PACKAGED else folder / scenario.robot


def friction_of(scenario: Scenario, robot: Robot) -> FrictionTruth:
    """Build the friction that a simulator puts into the joints, in the tree's order.

    Raises
    ------
    SettingsError
        If a pattern names no joint, or a parameter is unknown, missing or out of bounds.
    """
    table = scenario.friction
    joints = tuple(robot.joint_names[column] for column in robot.tree.columns)
    effects: list[FrictionEffect] = []
    if table.joints:
        drift = Drift(table.drift.ratios, table.drift.time_constant) if table.drift else None
        parameters = by_joint(table.joints, table.common, joints, "[friction.joints]")
        effects.append(LawFriction(joints, law_of(table), parameters, drift))
    for name, effect in (("lugre", LuGre), ("backlash", Backlash), ("load", Load)):
        if patterns := getattr(table, name):
            effects.append(effect(joints, by_joint(patterns, {}, joints, f"[friction.{name}]")))
    return FrictionTruth(len(joints), effects)


def law_of(table: FrictionTable) -> FrictionLaw:
    """Build the law of `[friction.joints]`.

    Raises
    ------
    SettingsError
        If the law does not exist or has a state.
    """
    law = get_law(table.law)
    if isinstance(law, LawWithState):
        raise SettingsError(
            f"[friction] law is '{table.law}', whose state needs the table [friction.{table.law}]; "
            "expected a law of velocity"
        )
    return law


def believed_model(robot: Robot, error: float, seed: int) -> pin.Model:
    """Scale each body's mass and inertia by a random factor within 1 ± `error`, for the controller's model."""
    model = pin.Model(robot.tree.model)
    generator = np.random.default_rng([seed, 1])
    for joint in range(1, model.njoints):
        inertia = model.inertias[joint]
        factor = float(generator.uniform(1 - error, 1 + error))
        model.inertias[joint] = pin.Inertia(factor * inertia.mass, inertia.lever, factor * inertia.inertia)
    return model


def _exact(scenario: Scenario, robot: Robot, posture: Named) -> Simulated:
    """Build an exact log from a prescribed random motion of an arm, a quadruped or a humanoid."""
    table = scenario.friction
    if scenario.walk or scenario.push or table.drift or table.lugre or table.backlash or table.load:
        raise SettingsError(
            "scenario: the simulator 'exact' prescribes a random motion; it takes gait, duration and "
            "[friction.joints], no [[walk]], [[push]], drift, lugre, backlash or load"
        )
    parameters = by_joint(table.joints, table.common, robot.joint_names, "[friction.joints]")
    motion = scenario.model_dump(include={"duration", "rate", "seed", "gait"})
    log, truth = exact_log(robot, law_of(table), parameters, posture=posture, **motion)
    return _measured(robot, log, truth, scenario)


def _measured(robot: Robot, log: RobotLog, truth: Truth, scenario: Scenario) -> Simulated:
    """Add sensor errors to an exact log; ideal sensors keep its exact velocity and acceleration."""
    truth = replace(truth, foot_wrench=log.foot_wrench)
    if scenario.sensors != "ideal":
        log = measure(log, sensors_for(log, PROFILES[scenario.sensors], scenario.seed))
    return Simulated(robot, log, truth)

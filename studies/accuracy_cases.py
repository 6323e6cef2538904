"""Robots, walks and errors of the accuracy study: three humanoids, three walks each, eleven cases."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin

from stribeck import Robot
from stribeck.core.base.typing import Array
from stribeck.core.friction import get_law
from stribeck.core.log import RobotLog
from stribeck.simulation.run import Simulated
from stribeck.simulation.scenario import FrictionTable, Scenario
from stribeck.simulation.sensors.measure import with_noise
from stribeck.simulation.walking.footsteps import Push, Steps
from studies.changes import with_model
from studies.kept_walks import FOLDER, kept_walk
from studies.walking_cases import JOINTS, WALKERS

LAW = "stribeck"
NAMES = tuple(parameter.name for parameter in get_law(LAW).parameters)

COMMON = {"viscous": 0.2, "stribeck_gain": 0.2, "stribeck_velocity": 0.2, "slope": 40.0}
"""Friction parameters that all leg joints share."""

LEVELS = {
    "TORO-like": WALKERS["TORO-like"].friction,
    "TALOS": {f"leg_*_{k}_joint": level for k, level in enumerate((0.75, 1.0, 0.75, 1.0, 0.2, 0.1), 1)},
    "G1": {f"*_{joint}_joint": level if "ankle" in joint else level / 2 for joint, level in JOINTS.items()},
}
"""Coulomb friction and offset [N m] of leg joints, by robot and pattern. The G1 weighs half as much as the others."""

SECONDS = 44.0
"""Duration of the steps of one walk [s]."""

DOUBLE_SUPPORT = 0.2
"""Duration of the double support in each step [s]."""


def steps_for(seconds: float, single_support: float, double_support: float, **kind: Any) -> Steps:
    """Compute how many steps fit into a walk [s], and describe them."""
    count = round(seconds / (single_support + double_support))
    return Steps(count=count, single_support=single_support, double_support=double_support, **kind)


def _ways(single_support: float, forward: dict[str, float], sideways: dict[str, float]) -> dict[str, Steps]:
    """Describe three walks: straight on, to the left and to the right."""
    right = sideways | {"sideways": -sideways["sideways"]}
    kinds = {"straight": forward, "left": sideways, "right": right}
    return {way: steps_for(SECONDS, single_support, DOUBLE_SUPPORT, **kind) for way, kind in kinds.items()}


WALKS = {
    "TORO-like": _ways(0.8, {"forward": 0.3}, {"sideways": 0.25, "width": 0.16}),
    "TALOS": _ways(0.8, {"forward": 0.3}, {"sideways": 0.2}),
    "G1": _ways(0.6, {"forward": 0.2, "width": 0.16}, {"sideways": 0.1, "width": 0.12}),
}
"""Walks by robot and name. No joint reaches a mechanical stop."""


@dataclass(frozen=True)
class Case:
    """Errors of one case: encoder noise [rad], torque noise [N m], a wrong model, wrong sensor calibration.

    Harder cases scale all six friction parameters of every joint by random factors, whose logarithms have the standard
    deviation `differing`, or keep only a `share` of every walk.
    """

    encoder: float = 0.0
    torque: float = 0.0
    wrong_model: bool = False
    wrong_calibration: bool = False
    differing: float = 0.0
    share: float = 1.0

    @property
    def harder(self) -> bool:
        """Whether joints differ, or walks are short."""
        return self.differing > 0 or self.share < 1


CASES = {
    "clean": Case(),
    "A": Case(2e-5, 0.1),
    "B": Case(1e-4, 0.3),
    "A, wrong model": Case(2e-5, 0.1, True),
    "B, wrong model": Case(1e-4, 0.3, True),
    "A, wrong model and calibration": Case(2e-5, 0.1, True, True),
    "A, joints differ": Case(2e-5, 0.1, differing=0.3),
    "B, joints differ": Case(1e-4, 0.3, differing=0.3),
    "A, wrong model and calibration, joints differ": Case(2e-5, 0.1, True, True, differing=0.3),
    "A, 45 s in all": Case(2e-5, 0.1, share=1 / 3),
    "B, 45 s in all": Case(1e-4, 0.3, share=1 / 3),
}


def exact_walks(
    name: str, walks: Mapping[str, Steps] | None = None, pushes: Mapping[str, list[Push]] | None = None
) -> list[Simulated]:
    """Load or simulate walks of a robot with perfect sensors, by default `WALKS`, and keep them under its name."""
    robot_file = FOLDER / f"{name}.toml"
    robot_file.parent.mkdir(parents=True, exist_ok=True)
    robot_file.write_text(WALKERS[name].robot_file, encoding="utf-8")
    found = []
    for way, steps in (walks or WALKS[name]).items():
        scenario = walk_scenario(name, [steps], robot_file.name, (pushes or {}).get(way, []))
        found.append(kept_walk(f"{name}-{way}", scenario, FOLDER))
    return found


def walk_scenario(name: str, walk: list[Steps], robot_file: str, push: Sequence[Push] = ()) -> Scenario:
    """Build the scenario of one walk of a robot."""
    friction = {pattern: {"coulomb": level, "offset": level} for pattern, level in LEVELS[name].items()}
    return Scenario(
        robot=robot_file,
        posture=dict(WALKERS[name].posture),
        soles=dict(WALKERS[name].soles),
        walk=walk,
        push=list(push),
        friction=FrictionTable(common=COMMON, joints=friction),
    )


def as_walked(walks: list[Simulated], case: Case, seed: int) -> list[Simulated]:
    """Change walks with perfect sensors to the friction and the duration of a case.

    The ground truth of a shortened walk still refers to the entire walk.
    """
    if case.differing:
        generator = np.random.default_rng([seed, 3])
        factors = np.exp(case.differing * generator.standard_normal((len(walks[0].truth.parameters), len(NAMES))))
        walks = [with_factors(walk, factors) for walk in walks]
    rows = slice(round(case.share * len(walks[0].log.time)))
    return [replace(walk, log=walk.log.take(rows)) for walk in walks]


def with_factors(walk: Simulated, factors: Array) -> Simulated:
    """Multiply the friction parameters by factors, shape (joints, p); the motor torques change by as much."""
    velocity = np.gradient(walk.log.position, walk.log.time, axis=0)
    torque, parameters = walk.log.torque.copy(), {}
    for (joint, known), each in zip(walk.truth.parameters.items(), factors, strict=True):
        column, values = walk.log.joint_names.index(joint), np.array([known[name] for name in NAMES])
        before, after = (get_law(LAW).torque(velocity[:, column], these) for these in (values, values * each))
        torque[:, column] += after - before
        parameters[joint] = dict(zip(NAMES, (values * each).tolist(), strict=True))
    friction = walk.truth.friction_torque + torque - walk.log.torque
    truth = replace(walk.truth, parameters=parameters, friction_torque=friction)
    return replace(walk, log=replace(walk.log, torque=torque), truth=truth)


def wrong_model(robot: Robot, seed: int) -> Robot:
    """Perturb the model that the estimators get; its bodies remain physically possible."""
    generator = np.random.default_rng([seed, 1])

    def change(model: pin.Model) -> None:
        for joint in range(1, model.njoints):
            body = model.inertias[joint]
            moments, axes = np.linalg.eigh(body.inertia)
            wrong = moments * generator.uniform(0.8, 1.2, 3)
            while 2 * wrong.max() > wrong.sum():
                wrong = moments * generator.uniform(0.8, 1.2, 3)
            shift = generator.standard_normal(3)
            lever = body.lever + generator.uniform(0.005, 0.010) * shift / np.linalg.norm(shift)
            mass = body.mass * generator.uniform(0.95, 1.05)
            model.inertias[joint] = pin.Inertia(mass, lever, axes @ np.diag(wrong) @ axes.T)

    return with_model(robot, change)


def measured(log: RobotLog, case: Case, seed: int, number: int) -> RobotLog:
    """Add the sensor errors of a case to a walk; calibration errors are the same in all walks.

    The log contains contact flags but no foot wrenches. The simulated wrenches are exact, and would identify inertias
    that encoders and torque sensors cannot.
    """
    log = replace(log, foot_wrench=None)
    log = with_noise(log, position=case.encoder, torque=case.torque, seed=10 * seed + number)
    if case.wrong_calibration:
        generator = np.random.default_rng([seed, 2])
        joints = len(log.joint_names)
        gains, zeros = 0.01 * generator.standard_normal(joints), 2e-3 * generator.standard_normal(joints)
        log = replace(log, torque=log.torque * (1 + gains), position=log.position + zeros)
    return log

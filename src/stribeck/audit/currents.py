"""Torque per ampere of each joint from gravity, if no torque constant is given.

A current is regressed on the model's static torque and everything else that it may include:

    i = (tau_gravity + b (tau - tau_gravity)) / k + friction + rotor inertia + error,  k [N m/A]

Only gravity determines k: inertias, which are known less well than weights, have a separate factor b. The interval of
k includes the uncertainty of weights, by models drawn from the priors of bodies.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from stribeck.audit.evidence import Evidence, gather
from stribeck.audit.motion import gravity_torques
from stribeck.audit.regression import FEWEST, effective_share, friction_shapes, without
from stribeck.base.finding import Finding, listed
from stribeck.base.typing import Array
from stribeck.errors import LogError
from stribeck.friction_torque.preparation import PreparedLog, log_names
from stribeck.robot import Robot
from stribeck.settings import Priors, Settings

WIDEST = 0.05
"""Largest relative half-width of a gain's 95 % interval [1]."""
MODELS = 20
"""Models drawn [1]; they determine the uncertainty of gravity within a sixth."""


@dataclass(frozen=True)
class Gain:
    """Torque per ampere and half of its 95 % interval [N m/A]; `why` it is unknown, or an empty text."""

    value: float
    half_width: float
    unknown: str = ""

    def __str__(self) -> str:
        return f"{self.value:.4g} ± {self.half_width:.1g} N m/A"


def torques_of_currents(
    prepared: Sequence[PreparedLog], robot: Robot, settings: Settings
) -> tuple[list[PreparedLog], list[Finding], dict[str, float]]:
    """Convert currents to torques; return the logs, a finding, and each gain's relative standard error.

    Raises
    ------
    LogError
        If gravity does not determine the torque per ampere of a joint.
    """
    joints = prepared[0].log.in_amperes
    if not joints:
        return list(prepared), [], {}
    models = [robot, *(_drawn(robot, settings.priors, seed) for seed in range(MODELS))]
    logs = [
        (evidence, np.stack([gravity_torques(evidence, model, robot.gravity[None])[..., 0] for model in models]))
        for evidence in (gather(part, robot, settings) for part in prepared)
    ]
    known = [robot.joint_names[column] for column in robot.torque_controlled]
    gains = {name: _gain(logs, known.index(name)) for name in joints}
    found = listed([f"{name} {gain}" for name, gain in gains.items() if not gain.unknown])
    if unknown := {name: gain for name, gain in gains.items() if gain.unknown}:
        first = next(iter(unknown))
        raise LogError(
            f"{log_names(prepared)[0]}: the torques are currents, and gravity does not determine the torque per ampere "
            f"of {listed([f'{name} ({gain.unknown})' for name, gain in unknown.items()])}. Set torque_constant and "
            f"ratio in [robot.motors.{first}]" + (f". Determined: {found}" if found else "")
        )
    factors = np.array([gains[name].value if name in gains else 1.0 for name in robot.joint_names])
    converted = [
        replace(part, log=replace(part.log, torque=part.log.torque * factors, in_amperes=())) for part in prepared
    ]
    finding = Finding.of("torque-constant", joints, evidence=found)
    return converted, [finding], {name: gain.half_width / gain.value / 2 for name, gain in gains.items()}


def _drawn(robot: Robot, priors: Priors, seed: int) -> Robot:
    """Draw masses and centers of mass of a robot's bodies from their priors."""
    generator = np.random.default_rng(seed)
    model = pin.Model(robot.tree.model)
    for body in range(1, model.njoints):
        given = model.inertias[body]
        mass = max(given.mass * (1 + priors.mass * generator.standard_normal()), 0.0)
        lever = given.lever + priors.centre_of_mass * generator.standard_normal(3)
        model.inertias[body] = pin.Inertia(mass, lever, given.inertia)
    return replace(robot, tree=replace(robot.tree, model=model))


def _gain(logs: Sequence[tuple[Evidence, Array]], k: int) -> Gain:
    """Estimate the torque per ampere of torque-controlled joint k from all logs together.

    Each log comes with static torques of the model and of the drawn models, shape (1 + MODELS, B, k). Samples slower
    than 2 % of the top speed are ignored, because friction is undetermined at rest.
    """
    parts, gravities, currents, runs = [], [], [], []
    for number, (evidence, models) in enumerate(logs):
        static = models[0]
        if not evidence.moves(k):
            continue
        fast = np.abs(evidence.velocity[:, k]) > max(0.01, 0.02 * float(evidence.top_speed[k]))
        rows = np.isfinite(evidence.model[:, k]) & np.isfinite(static[:, k]) & fast
        shapes = np.column_stack([friction_shapes(evidence, k, rows), (evidence.model - static)[rows, k]])
        parts.append(shapes)
        gravities.append(models[:, rows, k])
        currents.append(evidence.torque[rows, k])
        runs.append(evidence.run[rows] + 1_000_000 * number)
    if sum(map(len, currents)) < FEWEST:
        return Gain(0.0, 0.0, "too little motion")
    (gravity, *drawn), current, run = np.concatenate(gravities, axis=1), np.concatenate(currents), np.concatenate(runs)
    shapes = np.concatenate(parts)
    own, left = without(shapes, gravity, current)
    power = float(own @ own)
    varies = f"gravity varies by {gravity.std():.2g} N m"
    if power <= 0.2**2 * float(np.sum((gravity - gravity.mean()) ** 2)) or power < 1e-12 * len(gravity):
        return Gain(0.0, 0.0, varies)
    slope = float(own @ left) / power  # [A/(N m)]
    error = left - slope * own
    independent = effective_share(own, error, run)
    freedom = max(1.0, len(error) * independent - shapes.shape[1] - 1)
    deviation = float(np.sqrt(float(error @ error) / freedom / power))
    if slope < 0 and -slope > 2 * deviation / WIDEST:
        return Gain(0.0, 0.0, "current opposes gravity: set its scale in [log.torque] to -1")
    if slope <= 0 or 2 * deviation > WIDEST * slope:
        near = f", {1 / slope:.3g} N m/A within {200 * deviation / slope:.0f} %" if slope > 2 * deviation else ""
        return Gain(0.0, 0.0, varies + near)
    of_model = float(np.std(np.array(drawn) @ own / power))
    if 2 * of_model > 0.25:
        return Gain(0.0, 0.0, f"{varies}, uncertain by {200 * of_model:.0f} % because of the model's weights")
    return Gain(1 / slope, 2 / slope * float(np.hypot(deviation / slope, of_model)))

"""How much torque an ampere makes in each joint, from gravity, where no torque constant is given.

A current is regressed on the model's static torque beside all else that it may be of:

    i = (tau_gravity + b (tau - tau_gravity)) / k + friction + rotor inertia + error,  k [N m/A]

so that gravity alone says what k is: inertias, which are known less well than weights, have a factor b of their own.
How well weights are known is what the priors of bodies say: k's interval has what models drawn from them differ by.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from stribeck.audit.cures import listed
from stribeck.audit.evidence import STILL, Evidence, gather
from stribeck.audit.regression import FEWEST, effective_share, friction_shapes
from stribeck.dynamics.loops import without_loop_forces
from stribeck.dynamics.rooted import rooted_inverse_dynamics
from stribeck.dynamics.state import Orientation, State, root_quaternions
from stribeck.errors import LogError
from stribeck.finding import Finding
from stribeck.friction_torque.contact_modes import ContactMode, contact_root
from stribeck.preparation import PreparedLog, log_names
from stribeck.robot import Robot
from stribeck.settings import Priors, Settings
from stribeck.typing import Array

WIDEST = 0.05
"""Half of a gain's 95 % interval over the gain [1] from which it is not known."""
LEAST_SWING = 0.2
"""Share of gravity's variation [1] that friction and motion could not make: less says little of weight."""
FARTHEST = 0.25
"""The same of the part that the model's weights have in it: so far off a parameter counts as wrong."""
MODELS = 20
"""Models drawn [1], which say how well gravity is known to within a sixth."""
AT_REST = 0.02
"""Of the top speed [1]: slower joints may stick, and their friction be anything."""


@dataclass(frozen=True)
class Gain:
    """Torque of an ampere [N m/A], and half of its 95 % interval; why it is not known, "" if it is."""

    value: float
    half_width: float
    unknown: str = ""

    def __str__(self) -> str:
        return f"{self.value:.4g} +- {self.half_width:.1g} N m/A"


def torques_of_currents(
    prepared: Sequence[PreparedLog], robot: Robot, settings: Settings
) -> tuple[list[PreparedLog], list[Finding], dict[str, float]]:
    """Return the logs with torques in the place of currents, what was found, and each gain's relative standard error.

    Raises
    ------
    LogError
        If gravity does not say how much torque a joint's ampere makes.
    """
    joints = prepared[0].log.in_amperes
    if not joints:
        return list(prepared), [], {}
    models = [robot, *(_drawn(robot, settings.priors, seed) for seed in range(MODELS))]
    logs = [
        (evidence, np.stack([_static_torque(evidence, model) for model in models]))
        for evidence in (gather(part, robot, settings) for part in prepared)
    ]
    known = [robot.joint_names[column] for column in robot.torque_controlled]
    gains = {name: _gain(logs, known.index(name)) for name in joints}
    found = listed([f"{name} {gain}" for name, gain in gains.items() if not gain.unknown])
    if unknown := {name: gain for name, gain in gains.items() if gain.unknown}:
        first = next(iter(unknown))
        raise LogError(
            f"{log_names(prepared)[0]}: the torques are currents, and gravity does not say how much torque an ampere "
            f"makes in {listed([f'{name} ({gain.unknown})' for name, gain in unknown.items()])}; expected "
            f"[robot.motors.{first}] torque_constant and ratio" + (f"; found were {found}" if found else "")
        )
    factors = np.array([gains[name].value if name in gains else 1.0 for name in robot.joint_names])
    converted = [
        replace(part, log=replace(part.log, torque=part.log.torque * factors, in_amperes=())) for part in prepared
    ]
    finding = Finding(
        check="torque-constant",
        channel="torque",
        text=f"the torques are currents, and gravity says how much torque an ampere makes: {found} (95 %, if the "
        "model's weights are as right as [identify.priors] say); all friction is as far off as this factor, which the "
        "intervals heed",
        cure="give what is known as [robot.motors.<joint>] torque_constant and ratio",
        joints=joints,
    )
    return converted, [finding], {name: gain.half_width / gain.value / 2 for name, gain in gains.items()}


def _drawn(robot: Robot, priors: Priors, seed: int) -> Robot:
    """Return a robot whose bodies have other masses and centres of mass, drawn from their priors."""
    generator = np.random.default_rng(seed)
    model = pin.Model(robot.tree.model)
    for body in range(1, model.njoints):
        given = model.inertias[body]
        mass = max(given.mass * (1 + priors.mass * generator.standard_normal()), 0.0)
        lever = given.lever + priors.centre_of_mass * generator.standard_normal(3)
        model.inertias[body] = pin.Inertia(mass, lever, given.inertia)
    return replace(robot, tree=replace(robot.tree, model=model))


def _static_torque(evidence: Evidence, robot: Robot) -> Array:
    """Return a robot's torques at rest in the postures of the bins, shape (B, k)."""
    log = evidence.prepared.log
    found = np.full(evidence.model.shape, np.nan)
    for number, name in enumerate(evidence.support_names):
        bins = np.flatnonzero(evidence.support == number)
        rows = evidence.rows[bins]
        if not len(rows):
            continue
        position = log.position[rows]
        rest, turn = np.zeros_like(position), None
        if robot.base == "floating" and log.base_orientation is not None:
            still = np.zeros((len(rows), 3))
            turn = Orientation(root_quaternions(robot, position, log.base_orientation[rows]), still, still)
        feet = tuple(foot for foot in name.split("+") if foot)
        tree, root = contact_root(robot, ContactMode(feet, feet[0] if feet else ""), State(position, rest, rest, turn))
        needed = rooted_inverse_dynamics(tree, position, rest, rest, root)[1]
        found[bins] = without_loop_forces(robot, position, needed)[:, robot.torque_controlled]
    return found


def _gain(logs: Sequence[tuple[Evidence, Array]], k: int) -> Gain:
    """Return the torque of an ampere in torque-controlled joint k, from all logs together.

    Each comes with static torques of the model and of those drawn, shape (1 + MODELS, B, k).
    """
    parts, gravities, currents, runs = [], [], [], []
    for number, (evidence, models) in enumerate(logs):
        static = models[0]
        if not evidence.moves(k):
            continue
        fast = np.abs(evidence.velocity[:, k]) > max(STILL, AT_REST * float(evidence.top_speed[k]))
        rows = np.isfinite(evidence.model[:, k]) & np.isfinite(static[:, k]) & fast
        shapes = np.column_stack([friction_shapes(evidence, k, rows), (evidence.model - static)[rows, k]])
        parts.append(shapes)
        gravities.append(models[:, rows, k])
        currents.append(evidence.torque[rows, k])
        runs.append(evidence.run[rows] + 1_000_000 * number)
    if sum(map(len, currents)) < FEWEST:
        return Gain(0.0, 0.0, "it hardly moves")
    (gravity, *drawn), current, run = np.concatenate(gravities, axis=1), np.concatenate(currents), np.concatenate(runs)
    shapes = np.concatenate(parts)
    basis = np.linalg.qr(shapes / np.maximum(np.linalg.norm(shapes, axis=0), 1e-12))[0]
    own, left = gravity - basis @ (basis.T @ gravity), current - basis @ (basis.T @ current)
    power = float(own @ own)
    varies = f"gravity varies by {gravity.std():.2g} N m"
    if power <= LEAST_SWING**2 * float(np.sum((gravity - gravity.mean()) ** 2)) or power < 1e-12 * len(gravity):
        return Gain(0.0, 0.0, varies)
    slope = float(own @ left) / power  # [A/(N m)]
    error = left - slope * own
    independent = effective_share(own, error, run)
    freedom = max(1.0, len(error) * independent - shapes.shape[1] - 1)
    deviation = float(np.sqrt(float(error @ error) / freedom / power))
    if slope < 0 and -slope > 2 * deviation / WIDEST:
        return Gain(0.0, 0.0, "it runs against gravity: set [log.torque] scale to -1 there")
    if slope <= 0 or 2 * deviation > WIDEST * slope:
        near = f", {1 / slope:.3g} N m/A within {200 * deviation / slope:.0f} %" if slope > 2 * deviation else ""
        return Gain(0.0, 0.0, varies + near)
    of_model = float(np.std(np.array(drawn) @ own / power))
    if 2 * of_model > FARTHEST:
        return Gain(0.0, 0.0, f"{varies}, known within {200 * of_model:.0f} % by the model's weights")
    return Gain(1 / slope, 2 / slope * float(np.hypot(deviation / slope, of_model)))

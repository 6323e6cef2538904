"""Torques of logs whose source is a current or a command.

Torque constants, or kp of drives, that the robot file lacks are found from gravity. A current, or the deflection of a
command, is regressed on the model's static torque and everything else that it may include:

    u = (tau_gravity + b (tau - tau_gravity)) / k + friction + rotor inertia + error,  k [N m/A], [N m/rad]

Only gravity determines k: inertias, which are known less well than weights, have a separate factor b. The interval of
k includes the uncertainty of weights, by models drawn from the priors of bodies.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from stribeck.check.audit.evidence import LEAST_BINS, AuditData, gather
from stribeck.check.audit.motion import gravity_torques
from stribeck.check.audit.regression import friction_shapes, regress
from stribeck.core.base.finding import Finding, listed
from stribeck.core.base.typing import Array
from stribeck.core.equations.friction_torque.preparation import Logs, PreparedLog, log_names
from stribeck.core.errors import LogError
from stribeck.core.robot import Robot
from stribeck.core.settings import Priors, Settings

WIDEST = 0.05
"""Largest relative half-width of a gain's 95 % interval [1]."""
MODELS = 20
"""Models drawn [1]; they determine the uncertainty of gravity within a sixth."""


@dataclass(frozen=True)
class Gain:
    """Torque per unit of the channel, N m/A or N m/rad, and half of its 95 % interval; a reason if it is unknown.

    An unknown gain is a rough one: fits need torques, and their results are divided by it.
    """

    value: float
    half_width: float = 0.0
    unknown: str = ""


def find_gains(prepared: Logs, robot: Robot, settings: Settings) -> dict[str, Gain]:
    """Estimate the torque constants, or kp, that the robot file lacks, by joint.

    Raises
    ------
    LogError
        If the torque of a joint has the wrong sign.
    """
    models = [robot, *(_drawn(robot, settings.priors, seed) for seed in range(MODELS))]
    logs = [
        (evidence, np.stack([gravity_torques(evidence, model, robot.gravity[None])[..., 0] for model in models]))
        for evidence in (gather(part, robot, settings) for part in prepared)
    ]
    joints, rough = logs[0][0].joints, prepared[0].log.unscaled
    gains = {name: _gain(logs, joints.index(name), factor) for name, factor in rough.items()}
    rough_ones = [gain for gain in gains.values() if np.isfinite(gain.value)]
    sure = [gain for gain in rough_ones if not gain.unknown]
    usual = float(np.median([gain.value for gain in sure or rough_ones] or [1.0]))
    gains = {name: gain if np.isfinite(gain.value) else replace(gain, value=usual) for name, gain in gains.items()}
    if turned := [name for name, gain in gains.items() if gain.value < 0]:
        channel = "torque" if prepared[0].log.command is None else "desired_position"
        raise LogError(
            f"{log_names(prepared)[0]}: the torque of {listed(turned)} opposes gravity; "
            f"set its scale in [log.{channel}] to -1"
        )
    return gains


def with_gains(part: PreparedLog, gains: Mapping[str, Gain], *, rough: bool) -> PreparedLog:
    """Multiply the channel of joints by their gains; `rough` keeps all of them listed as unscaled."""
    log = part.log
    table = {name: gains[name] for name in log.unscaled}
    factors = np.array([table[name].value / log.unscaled[name] if name in table else 1.0 for name in log.joint_names])
    kept = {name: gain.value for name, gain in table.items() if rough or gain.unknown}
    channels = {key: getattr(log, key) for key in ("torque", "command", "feedback")}
    scaled = {key: values * factors for key, values in channels.items() if values is not None}
    return replace(part, log=replace(log, **scaled, unscaled=kept))


def gain_findings(gains: Mapping[str, Gain], unit: str) -> list[Finding]:
    """Report the gains that were found, and the joints whose friction stays in the channel's unit, "A" or "rad"."""
    known = {name: gain for name, gain in gains.items() if not gain.unknown}
    unknown = {name: f" ({gain.unknown})" for name, gain in gains.items() if gain.unknown}
    checks = ("torque-constant", "torque-constant.unknown") if unit == "A" else ("command-gain", "command-gain.unknown")
    evidence = listed([f"{name} {gain.value:.4g} ± {gain.half_width:.1g} N m/{unit}" for name, gain in known.items()])
    findings = [Finding.of(checks[0], list(known), evidence=evidence)] if known else []
    return [*findings, Finding.of(checks[1], unknown)] if unknown else findings


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


def _gain(logs: Sequence[tuple[AuditData, Array]], k: int, factor: float) -> Gain:
    """Estimate the gain of torque-controlled joint k, whose channel is multiplied by a factor, from all logs together.

    Each log comes with static torques of the model and of the drawn models, shape (1 + MODELS, B, k). Samples slower
    than 2 % of the top speed are ignored, because friction is undetermined at rest.
    """
    parts = []
    for number, (evidence, static) in enumerate(logs):
        fast = np.abs(evidence.velocity[:, k]) > max(0.01, 0.02 * float(evidence.top_speed[k]))
        rows = np.isfinite(evidence.model[:, k]) & np.isfinite(static[0, :, k]) & fast
        if evidence.moves(k):
            torques = static[:, rows, k].T, evidence.model[rows, k], evidence.torque[rows, k] / factor
            parts.append((friction_shapes(evidence, k, rows), *torques, evidence.run[rows] + 1_000_000 * number))
    if sum(len(run) for *_, run in parts) < LEAST_BINS:
        return Gain(np.nan, unknown="too little motion")
    shapes, static, model, channel, run = map(np.concatenate, zip(*parts, strict=True))
    gravity, *drawn = static.T
    slope, deviation, load, _ = regress(np.column_stack([shapes, model - gravity]), gravity, channel, run)
    varies = f"gravity varies by {round(float(gravity.std()), 6):.2g} N m"
    if float(load @ load) <= max(0.2**2 * float(np.sum((gravity - gravity.mean()) ** 2)), 1e-12 * len(gravity)):
        slope = 0.0
    if slope < 0 and -slope > 2 * deviation / WIDEST:
        return Gain(1 / slope)
    if slope > 0 and 2 * deviation <= WIDEST * slope:
        of_model = float(np.std(np.array(drawn) @ load / (load @ load)))
        if 2 * of_model <= 0.25:
            return Gain(1 / slope, 2 / slope * float(np.hypot(deviation / slope, of_model)))
        varies += f", uncertain by {200 * of_model:.0f} % because of the model's weights"
    elif slope <= 2 * deviation:  # inertia gives a rough factor
        slope, deviation, *_ = regress(shapes[:, :-1], model, channel, run)
    return Gain(1 / slope if slope > 2 * deviation else np.nan, unknown=varies)

"""Friction from ground reactions: standing legs by measured wrenches, and a check of swinging legs against them.

After Hashlamon and Erbatur 2016; docs/other-methods.md has the equations.
"""

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from stribeck.core.base.finding import Finding
from stribeck.core.base.typing import Array
from stribeck.core.dynamics.contact.mode import ContactMode
from stribeck.core.equations.friction_torque.foot_wrenches import require_wrenches
from stribeck.core.equations.friction_torque.preparation import Logs, PreparedLog, Progress
from stribeck.core.errors import SettingsError
from stribeck.core.friction import LAWS, FrictionLaw
from stribeck.core.identify.contract import SHARED, Fitted, FrictionTorque, Method
from stribeck.core.judgement.curve import ROUNDING
from stribeck.core.judgement.curve_fit.problem import FitProblem, joint_problem
from stribeck.core.judgement.joint_fit import JointFit
from stribeck.core.log.storage import allocate
from stribeck.core.result.samples import MOST_KEPT, FrictionSamples
from stribeck.core.robot import Robot
from stribeck.core.robot.kinematics import joint_torque_of_wrench
from stribeck.core.settings import Settings
from stribeck.paper.curve_fit import method as curve_fit
from stribeck.paper.curve_fit.prediction import predict


def find(
    prepared: Logs, robot: Robot, law: FrictionLaw, settings: Settings, torque: FrictionTorque, progress: Progress
) -> Fitted:
    """Run the curve fit on friction torques from the wrenches, and compare swinging with standing legs."""
    if robot.base == "fixed":
        raise SettingsError(
            "method 'ground-reaction' finds the friction of legs that stand, and [robot] base is 'fixed'; "
            "expected a floating base, or method whole-log or curve-fit"
        )
    for part in prepared:
        require_wrenches(part.log, robot)
    logs, notes, unknown = zip(*(_zeroed(part, robot) for part in prepared), strict=True)
    fitted = curve_fit.find(logs, robot, law, settings, torque, progress)
    swings = _swings(fitted.fits, torque(logs, robot, settings).samples, robot, law, settings)
    without_zero = dict.fromkeys(foot for of_log in unknown for foot in of_log)
    shown = {joint: f"{joint} ({text})" for joint, (text, _) in swings.items()}
    note = f"friction of swinging legs relative to the same legs standing: {', '.join(shown.values())}"
    differing = [joint for joint, (_, differs) in swings.items() if differs]
    evidence = ", ".join(shown[joint] for joint in differing)
    differs = [Finding.of("swing-differs", differing, evidence=evidence)] if differing else []
    return replace(
        fitted,
        findings=[*fitted.findings, *_without_zero(without_zero, logs[0].log.position, robot), *differs],
        notes=[*(note for of_log in notes for note in of_log), *([note] if swings else [])],
    )


def _zeroed(part: PreparedLog, robot: Robot) -> tuple[PreparedLog, list[str], list[str]]:
    """Subtract the zeros of the wrench sensors from a log, with a note on each, and list feet without a known zero.

    The sensor of a swinging foot measures its zero and the weight of the part of the foot below the sensor.
    """
    log, wrench = part.log, part.log.foot_wrench
    assert wrench is not None
    zeros, notes, unknown = np.zeros(wrench.shape[1:]), [], []
    stride = -(-len(wrench) // MOST_KEPT)
    for foot in robot.contacts:
        column = log.foot_names.index(foot)
        swings = [
            wrench[phase.first : phase.last : stride, column]
            for phase in part.support.phases
            if foot not in phase.feet and phase.kind != "touching"
        ]
        felt = np.concatenate([np.zeros((0, 6)), *swings])
        if not len(felt):
            unknown.append(foot)
            continue
        zeros[column] = np.median(felt, axis=0)
        force, moment = (", ".join(f"{value:.3g}" for value in half) for half in np.split(zeros[column], 2))
        notes.append(f"the wrench on '{foot}' reads {force} N and {moment} N m while it swings: taken off as its zero")
    if not zeros.any():
        return part, [], unknown
    less = allocate(wrench.shape)
    np.subtract(wrench, zeros, out=less)
    return replace(part, log=replace(log, foot_wrench=less)), notes, unknown


def _swings(
    fits: Mapping[str, JointFit], samples: FrictionSamples, robot: Robot, law: FrictionLaw, settings: Settings
) -> dict[str, tuple[str, bool]]:
    """Compare the friction of each leg joint while swinging and while standing; see `_compared`."""
    feet = [tuple(name.split("+")) for name in samples.support_names]
    swings = np.array([ContactMode(robot, names).swinging[robot.torque_controlled] for names in feet])[samples.support]
    parts = [replace(samples, usable=samples.usable & rows) for rows in (swings, ~swings)]
    comparisons = {}
    for joint, fit in fits.items():
        swung, stood = (joint_problem(part, joint, law, settings) for part in parts)
        moves = all(len(part.velocity) and _rms(part.friction_torque) > ROUNDING for part in (swung, stood))
        if moves and len(np.unique(swung.block)) > 3:  # fewer give no useful standard error
            comparisons[joint] = _compared(fit, swung, stood)
    return comparisons


def _compared(fit: JointFit, swung: FitProblem, stood: FitProblem) -> tuple[str, bool]:
    """Regress the friction while swinging on the friction while standing, and test whether gain and offset differ.

    Gain and offset of the fitted law, Phi = (R_fit(v), 1), are estimated from standing samples, theta = A^-1 b with
    A = A_0 + Phi^T Phi, b = A_0 (1, 0) + Phi^T R and A_0 the information of one block with fully correlated errors.
    Swinging friction is regressed on the prediction; standard errors use the differences between swings.
    """
    standing, swinging = (
        np.column_stack([predict(part, fit.values), np.ones(len(part.velocity))]) for part in (stood, swung)
    )
    of_a_block = len(standing) / len(np.unique(stood.block)) * fit.rms**2
    square = _rms(stood.friction_torque) ** 2
    prior = np.diag([1.0, 1.0 / square]) * max(of_a_block, 1e-12 * square)  # avoids a singular matrix for an exact fit
    learnt = np.linalg.solve(prior + standing.T @ standing, prior[0] + standing.T @ stood.friction_torque)
    predicted = np.column_stack([swinging @ learnt, np.ones(len(swinging))])
    inverse = np.linalg.pinv(predicted.T @ predicted)
    factor, shift = inverse @ predicted.T @ swung.friction_torque
    scores = predicted * (swung.friction_torque - predicted @ [factor, shift])[:, None]
    starts = np.flatnonzero(np.diff(swung.block, prepend=-1))
    errors = np.sqrt(np.sum((np.add.reduceat(scores, starts) @ inverse) ** 2, axis=0))
    off = (np.abs([factor - 1, shift]) - 2.0 * errors) / [1.0, _rms(swung.friction_torque)]
    return f"{factor:.2f} times and {shift:+.2g} N m", bool((off > 0.5).any())


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _without_zero(feet: Collection[str], position: Array, robot: Robot) -> list[Finding]:
    """Report unknown sensor zeros, and their effect on friction at the mean posture."""
    if not feet:
        return []
    posture, levers = np.tile(position.mean(axis=0), (3, 1)), []
    for foot in feet:
        frame = robot.tree.model.getFrameId(robot.contacts[foot].frame)
        levers.append(np.linalg.norm(joint_torque_of_wrench(robot.tree, frame, posture, np.eye(3, 6)), axis=0).max())
    return [Finding.of("wrench-zero", feet=", ".join(feet), lever=max(levers))]


GROUND_REACTION = Method(
    name="ground-reaction",
    uses=(SHARED - {"standing_legs"}) | {"loss", "averaged_law", "holdout"},
    laws=LAWS,
    defaults=lambda _: {"law": "stribeck", "standing_legs": "measured"},
    find=find,
)

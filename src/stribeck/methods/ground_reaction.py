"""Friction from ground reactions: standing legs by measured wrenches, swinging ones by a model that follows them.

After Hashlamon and Erbatur 2016; docs/ground-reaction.md has the equations.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from stribeck.errors import SettingsError
from stribeck.finding import Finding
from stribeck.friction import LAWS, FrictionLaw
from stribeck.friction_torque.foot_wrenches import require_wrenches
from stribeck.friction_torque.stream import swinging_joints
from stribeck.friction_torque.thinning import MOST_KEPT
from stribeck.identification.curve_fit.fit import fit_law
from stribeck.identification.curve_fit.problem import FitProblem, joint_problem
from stribeck.identification.curve_fit.recursion import predict_in_turn
from stribeck.identification.curve_fit.validation import held_out, validate
from stribeck.identification.joint_fit import JointFit
from stribeck.identification.judgement.curve import ROUNDING
from stribeck.log.storage import allocate
from stribeck.methods.contract import SHARED, Fitted, FrictionTorque, Method
from stribeck.methods.curve_fit import couplings_left_out
from stribeck.methods.unseen import Unseen
from stribeck.preparation import PreparedLog, Progress
from stribeck.robot import Robot
from stribeck.robot.kinematics import joint_torque_of_wrench
from stribeck.samples import Samples
from stribeck.settings import Settings
from stribeck.typing import Array

DIFFERENT = 0.5
"""Share of its friction [1] by which a swinging joint may differ from what is predicted: half of it is no noise."""
SURE = 2.0
"""Standard errors [1] beyond which it is told."""
FEWEST_SWINGS = 3
"""Swings or seconds of them [1] that say next to nothing of standard errors."""


def find(
    prepared: Sequence[PreparedLog],
    robot: Robot,
    law: FrictionLaw,
    settings: Settings,
    friction_torque: FrictionTorque,
    progress: Progress,
) -> Fitted:
    """Fit the law to every joint that moves enough, standing legs' samples by the wrenches; see how it suits swings."""
    if robot.base == "fixed":
        raise SettingsError(
            "method 'ground-reaction' finds the friction of legs that stand, and [robot] base is 'fixed'; "
            "expected a floating base, or --method whole-log or curve-fit"
        )
    for part in prepared:
        require_wrenches(part.log, robot)
    logs, notes, unknown = zip(*(_zeroed(part, robot) for part in prepared), strict=True)
    samples = friction_torque(logs, robot, settings).samples
    progress("fitting", 0.0)
    fits = fit_law(samples, law, settings)
    swings = _predicted(fits, samples, robot, law, settings)
    return Fitted(
        fits=fits,
        validations=validate(fits, samples, law, settings),
        unseen=Unseen(fits=fits, usable=held_out(fits, samples, law, settings)),
        robot=robot,
        logs=logs,
        findings=[
            *([couplings_left_out(robot)] if robot.couplings else []),
            *_without_zero(dict.fromkeys(foot for of_log in unknown for foot in of_log), logs[0].log.position, robot),
            *_differing(swings),
        ],
        notes=[*(note for of_log in notes for note in of_log), *_said(swings)],
    )


class _Swing(NamedTuple):
    """A joint while its leg swings: its friction torque, of which `size` is the rms [N m], over the predicted one.

    It is that times `factor` [1], plus `shift` [N m], with these standard errors.
    """

    factor: float
    shift: float
    factor_error: float
    shift_error: float
    size: float

    @property
    def differs(self) -> bool:
        """Whether by more than `DIFFERENT`, for sure."""
        by = abs(self.factor - 1), abs(self.shift) / self.size
        errors = self.factor_error, self.shift_error / self.size
        return any(each - SURE * error > DIFFERENT for each, error in zip(by, errors, strict=True))


def _zeroed(part: PreparedLog, robot: Robot) -> tuple[PreparedLog, list[str], list[str]]:
    """Return a log without the zeros of its wrench sensors, a note on each, and feet that never show theirs.

    A foot that swings feels nothing of the ground: what its sensor reads is its zero, and the weight of what of the
    foot hangs below it.
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


def _predicted(
    fits: Mapping[str, JointFit], samples: Samples, robot: Robot, law: FrictionLaw, settings: Settings
) -> dict[str, _Swing]:
    """Return how the friction of swinging legs is predicted from the steps before, by joint."""
    feet = [tuple(name.split("+")) for name in samples.support_names]
    swings = np.array([swinging_joints(robot, each)[robot.torque_controlled] for each in feet])[samples.support]
    standing, swung = (replace(samples, usable=samples.usable & rows) for rows in (~swings, swings))
    interval, found = samples.period * samples.stride, {}
    for joint, fit in fits.items():
        asked, learnt = (joint_problem(part, joint, law, settings) for part in (swung, standing))
        if not all(len(part.velocity) and _rms(part.friction_torque) > ROUNDING for part in (asked, learnt)):
            continue
        predicted = predict_in_turn(fit, learnt, asked, interval)
        known = np.isfinite(predicted)
        if len(np.unique(asked.block[known])) > FEWEST_SWINGS:
            found[joint] = _compared(asked.take(known), predicted[known])
    return found


def _compared(swung: FitProblem, predicted: Array) -> _Swing:
    """Regress friction on what is predicted of it; standard errors are from how swings differ."""
    columns = np.column_stack([predicted, np.ones_like(predicted)])
    inverse = np.linalg.pinv(columns.T @ columns)
    found = inverse @ columns.T @ swung.friction_torque
    left = columns * (swung.friction_torque - columns @ found)[:, None]
    starts = np.flatnonzero(np.diff(swung.block, prepend=-1))
    errors = np.sqrt(np.sum((np.add.reduceat(left, starts) @ inverse) ** 2, axis=0))
    return _Swing(
        factor=float(found[0]),
        shift=float(found[1]),
        factor_error=float(errors[0]),
        shift_error=float(errors[1]),
        size=_rms(swung.friction_torque),
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _said(swings: Mapping[str, _Swing]) -> list[str]:
    """Return a note on how swinging legs were predicted."""
    if not swings:
        return []
    shown = ", ".join(f"{joint} {each.factor:.2f} times {each.shift:+.2g} N m" for joint, each in swings.items())
    return [f"friction of swinging legs against what the steps before, on the same leg, predict: {shown}"]


def _without_zero(feet: Collection[str], position: Array, robot: Robot) -> list[Finding]:
    """Return that sensors' zeros are not known, and what they do to friction where the robot stands in the mean."""
    if not feet:
        return []
    posture, levers = np.tile(position.mean(axis=0), (3, 1)), []
    for foot in feet:
        frame = robot.tree.model.getFrameId(robot.contacts[foot].frame)
        levers.append(np.linalg.norm(joint_torque_of_wrench(robot.tree, frame, posture, np.eye(3, 6)), axis=0).max())
    return [
        Finding(
            check="wrench-zero",
            text=f"{', '.join(feet)} never swing, so that the zeros of their wrench sensors are not known and go into "
            f"the offsets: of a joint above up to {max(levers):.2g} N m for 1 N, and 1 N m for 1 N m",
            cure="lift each foot for a second in the log, or zero the sensors in the air",
        )
    ]


def _differing(swings: Mapping[str, _Swing]) -> list[Finding]:
    """Return which joints have another friction where their leg swings."""
    joints = {joint: each for joint, each in swings.items() if each.differs}
    if not joints:
        return []
    shown = ", ".join(f"{joint} {each.factor:.2f} times {each.shift:+.2g} N m" for joint, each in joints.items())
    return [
        Finding(
            check="swing-differs",
            text=f"swinging legs have another friction than standing ones: {shown} of what the steps before predict",
            cure="check the wrench sensors' gains and frames and the legs' masses, or see by --law auto of the method "
            "whole-log whether friction depends on load",
            joints=tuple(joints),
        )
    ]


GROUND_REACTION = Method(
    name="ground-reaction",
    uses=(SHARED - {"double_support", "standing_legs"}) | {"loss", "averaged_law", "holdout"},
    laws=LAWS,
    defaults=lambda _: {"law": "stribeck", "standing_legs": "measured"},
    find=find,
)

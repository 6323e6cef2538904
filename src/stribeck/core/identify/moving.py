"""Selection of joints that move enough, and their top speeds, before the fit."""

import numpy as np
import scipy  # its ndimage is slow to import: loaded at its first use

from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.equations.friction_torque.preparation import Logs
from stribeck.core.equations.whole_log.mode_rows import rows_of_modes
from stribeck.core.equations.whole_log.segments import cut_segments
from stribeck.core.errors import NothingIdentifiedError
from stribeck.core.friction import FrictionLaw
from stribeck.core.judgement.excitation import excitation, why_none
from stribeck.core.judgement.reason import Reason
from stribeck.core.robot import Robot
from stribeck.core.settings import Settings


def joints_that_move(
    prepared: Logs, robot: Robot, law: FrictionLaw, settings: Settings
) -> tuple[IntArray, tuple[str, ...], Array]:
    """Find the columns of the torque-controlled joints that move enough, their couplings, and all top speeds.

    The top speeds [rad/s] are ordered by joints, then couplings. Only the samples count whose equations the settings
    allow.
    """
    velocity, block, used = _some_speeds(prepared, robot, settings)
    slow = scipy.ndimage.uniform_filter1d(velocity, 10, axis=0)  # over 0.1 s, for coarse encoders
    names = [robot.joint_names[column] for column in robot.torque_controlled]

    def reason(speed: Array, prismatic: bool, rows: BoolArray) -> Reason | None:
        return excitation(speed[rows], block[rows], len(law.parameters), prismatic).reason

    if not used.any():
        other = "set corrections = 'inertia', " if settings.corrections == "calibration" else ""
        why = f"unknown contact forces act on all joints; {other}lift one foot at a time, or hang or jack the robot up"
        if "wheel" in {contact.kind for contact in robot.contacts.values()}:
            why = (
                f"the wheels {', '.join(robot.contacts)} always roll on the ground, with unknown forces; log the "
                "positions of wheels on legs and set their radius in [contacts], or jack the robot up so that its "
                "wheels turn freely, and set [robot] base = 'fixed' without [contacts]"
            )
        raise NothingIdentifiedError(f"no joint can be identified from this log: {why}")
    slides = [robot.prismatic[column] for column in robot.torque_controlled]
    reasons = [reason(*motion) for motion in zip(velocity.T, slides, used.T, strict=True)]
    for factor in (1, 5):  # if no joint moves fast, slow ones are better than none
        if factor == 1 or all(reasons):
            others = [reason(*motion) for motion in zip(factor * slow.T, slides, used.T, strict=True)]
            reasons = [other and why for why, other in zip(reasons, others, strict=True)]
    moves = np.array([not reason for reason in reasons])
    tree, wheels = robot.tree, [contact.frame for contact in robot.contacts.values() if contact.axle]
    if wheels and moves.any():  # the legs' equations need those of the wheels, which may roll in one direction
        turned = [tree.column(tree.model.frames[tree.model.getFrameId(wheel)].parentJoint) for wheel in wheels]
        moves |= np.isin(robot.torque_controlled, turned)
    for coefficients in robot.couplings.values():
        parts = np.isin(names, [name for name in coefficients if name in robot.bare])
        moves |= parts & moves[parts].any()  # the motors of one joint also act on the others
    if not moves.any():
        raise NothingIdentifiedError(why_none(dict(zip(names, reasons, strict=True))))
    moving = {name for name, moved in zip(names, moves, strict=True) if moved}
    sums = {name: velocity @ robot.coefficients(names, [name])[:, 0] for name in robot.couplings}
    couplings = [
        name
        for name, coefficients in robot.couplings.items()
        if moving.issuperset(coefficients) and not reason(sums[name], False, np.ones(len(block), dtype=bool))
    ]
    speeds = np.column_stack([velocity[:, moves], *(sums[name] for name in couplings)])
    top_speeds = np.percentile(np.abs(speeds), 99.9, axis=0)  # excludes impacts
    return robot.torque_controlled[moves], tuple(couplings), top_speeds


def _some_speeds(prepared: Logs, robot: Robot, settings: Settings) -> tuple[Array, IntArray, BoolArray]:
    """Compute speeds of the torque-controlled joints, shape (N, n), their segments, (N,), and those used, (N, n)."""
    cut = []
    for part in prepared:
        period = part.sampling.period
        step = max(1, round(0.010 / period))  # speeds over 10 ms
        segments = cut_segments(part.support.phases, part.sampling.segments, period, 0, 5 * step)
        modes = rows_of_modes(robot, part.log, segments, robot.torque_controlled, settings)
        seen = {feet: mode.with_rows for feet, mode in modes.items()}
        cut += [(part, step, segment, seen.get(segment.feet, np.array(False))) for segment in segments]
    if not cut:
        raise NothingIdentifiedError(
            "no joint can be identified from this log: every support phase is shorter than the time excluded "
            "around contact changes"
        )
    many = sum((segment.last - segment.first) // step for _, step, segment, _ in cut)
    speeds: list[Array] = []
    blocks: list[IntArray] = []
    used: list[BoolArray] = []
    for part, step, segment, with_rows in cut[:: -(-many // 200_000)]:  # long logs: every k-th segment
        position = part.log.position[segment.first : segment.last : step, robot.torque_controlled]
        speeds.append(np.diff(position, axis=0) / (step * part.sampling.period))
        blocks.append(np.full(len(position) - 1, len(blocks)))
        used.append(np.broadcast_to(with_rows, speeds[-1].shape))
    return np.concatenate(speeds), np.concatenate(blocks), np.concatenate(used)

"""Which joints move enough for the whole log, and how fast, before anything is fitted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stribeck.equations.segments import cut_segments
from stribeck.errors import NothingIdentifiedError
from stribeck.friction import FrictionLaw
from stribeck.identification.curve_fit.problem import FitProblem
from stribeck.identification.judgement.excitation import excitation
from stribeck.preparation import PreparedLog
from stribeck.robot import Robot
from stribeck.typing import Array

TOP_SPEED = 99.9
"""Percentile of |v| [%] that the knots of the friction curves reach to; impacts are faster."""

SPEED_SPACING = 0.010
"""Over which speeds are looked at beforehand [s]."""

MOST_SPEEDS = 200_000
"""Speeds [1] that are looked at: of longer logs, one of some segments."""

FEWEST = 5
"""Speeds in a segment [1]; less is not worth the trouble."""


def joints_that_move(
    prepared: Sequence[PreparedLog], robot: Robot, law: FrictionLaw
) -> tuple[NDArray[np.int64], Array]:
    """Return the columns of the torque-controlled joints that move enough, and their top speeds [rad/s]."""
    velocity, block = _some_speeds(prepared, robot)
    reasons = []
    for k, column in enumerate(robot.torque_controlled):
        problem = FitProblem(
            law=law,
            parameters=law.parameters,
            velocity=velocity[:, k],
            friction_torque=np.zeros(len(velocity)),
            acceleration=None,
            block=block,
        )
        reasons.append(excitation(problem, robot.prismatic[column]).reason)
    moves = np.array([not reason for reason in reasons])
    if not moves.any():
        names = [robot.joint_names[column] for column in robot.torque_controlled[:3]]
        why = "; ".join(f"{name}: {reason}" for name, reason in zip(names, reasons, strict=False))
        raise NothingIdentifiedError(f"no joint can be identified from this log: {why}")
    return robot.torque_controlled[moves], np.percentile(np.abs(velocity[:, moves]), TOP_SPEED, axis=0)


def _some_speeds(prepared: Sequence[PreparedLog], robot: Robot) -> tuple[Array, NDArray[np.int64]]:
    """Return speeds of the torque-controlled joints, shape (N, n), and the segments that they are from, shape (N,)."""
    cut = []
    for part in prepared:
        period = part.sampling.period
        step = max(1, round(SPEED_SPACING / period))
        segments = cut_segments(part.support.phases, part.sampling.segments, period, 0, FEWEST * step)
        cut += [(part, step, segment) for segment in segments]
    if not cut:
        raise NothingIdentifiedError(
            "no joint can be identified from this log: no support phase is longer than what is left out around contact "
            "changes"
        )
    many = sum((segment.last - segment.first) // step for _, step, segment in cut)
    speeds: list[Array] = []
    blocks: list[NDArray[np.int64]] = []
    for part, step, segment in cut[:: -(-many // MOST_SPEEDS)]:
        position = part.log.position[segment.first : segment.last : step, robot.torque_controlled]
        speeds.append(np.diff(position, axis=0) / (step * part.sampling.period))
        blocks.append(np.full(len(position) - 1, len(blocks)))
    return np.concatenate(speeds), np.concatenate(blocks)

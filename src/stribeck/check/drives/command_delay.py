"""Time from the stamp of a command until it acts, found by simulating each joint from its command.

A delay of commands acts like viscous friction, kp times delay times velocity. In the equation of motion both are so
similar that the noise of the accelerations decides between them. A simulation needs no measured accelerations of the
joint. While a joint moves, its motion follows from

    (M(t) + A) a = clip(command(t - delay) - kp q - kd v) - c(t) - b v - F sign(v) - o

with the inertia M and the other torques c of inverse dynamics (gravity, coupling) along the measured motion. The delay,
A, b, F, o and the initial state of each piece minimize the distance to measured positions (output-error method: Ljung,
System Identification, 1999, section 7.2).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from stribeck.check.drives.joint_simulation import STEP, OutputErrors, Pieces
from stribeck.core.base.spans import runs_of
from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.dynamics.rooted import joint_inertia
from stribeck.core.equations.friction_torque.inverse_dynamics import torque_chunks
from stribeck.core.equations.friction_torque.preparation import Logs, PreparedLog
from stribeck.core.estimator.solver.gauss_newton import minimise
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.core.settings import FilterSettings, Settings

LONGEST, MOST, FEWEST = 1.0, 60, 6
"""Longest piece [s], largest number of pieces of a joint [1], and smallest number of samples in a piece [1]."""

EARLIEST, LATEST = -0.01, 0.2
"""Smallest and largest estimate [s]; inexact models make estimates negative, but no command acts before it is sent."""

SPREAD = 2e-4
"""Smallest standard deviation of delays from joint to joint, and of the errors that all joints share [s]."""

UNKNOWN = 30e-3
"""Standard error of a delay that no joint shows [s]."""


def command_delays(logs: Logs, robot: Robot, settings: Settings) -> tuple[Array, Array]:
    """Estimate the delay of each joint's commands in all logs and its standard error [s], shape (n,) each.

    A joint that does not move enough gets the common delay of the others.
    Without any motion the delay is zero, with the standard error of an unknown delay.
    """
    size = len(robot.joint_names)
    pieces = _pieces(logs, robot, settings)
    if pieces is None:
        return np.zeros(size), np.full(size, UNKNOWN)
    joints = np.unique(pieces.joint)
    (common, of_common), estimates = pooled(*_fit(pieces))
    delay, spread = np.full(size, common), np.full(size, of_common)
    delay[joints], spread[joints] = estimates
    # standard error of all delays per sampling period [1]: between samples of a log, commands are interpolated
    hold = 0.02
    of_log = np.array([(SPREAD, hold * part.sampling.period, 0.5 * part.sampling.jitter) for part in logs]).max(axis=0)
    return np.maximum(delay, 0.0), np.sqrt(spread**2 + of_log @ of_log)


def pooled(estimate: Array, error: Array) -> tuple[tuple[float, float], tuple[Array, Array]]:
    """Pool the estimates of k joints [s], shape (k,): their drives share one network unless the estimates differ.

    Wrong models make the estimates scatter beyond their errors, which are therefore increased by the ratio of both
    (Birge 1932). Delays differ between drives only if the scatter exceeds three standard errors. Then estimates
    approach the common delay by the ratio of their variance to the variance between joints. If a single estimate
    deviates by two to four standard errors, its standard error increasingly includes the deviation, because either its
    model is wrong or its delay differs. A negative estimate only shows a wrong model.

    Returns
    -------
    common, joints
        The common delay and the delays of the joints, each with standard errors.
    """
    wrong = estimate < -2 * error
    right = estimate[~wrong] if not wrong.all() else estimate
    variance, middle = 2 * error**2 + SPREAD**2, float(np.median(right))  # as estimates scatter in simulated logs
    usual, scatter = float(np.median(variance)), 1.48 * float(np.median(np.abs(right - middle)))
    different = 3.0  # scatter beyond which the drives differ [standard errors]
    differ = scatter > different * np.sqrt(usual)
    between = max(differ * (scatter**2 - usual), SPREAD**2)
    variance = variance * (1.0 if differ else max(scatter**2 / usual, 1.0))
    total = variance + between
    weights = 1 / (total + (estimate - middle) ** 2)  # outliers are joints with a wrong model
    common, of_common = float(np.average(estimate, weights=weights)), 1 / float(weights.sum())
    share = np.where(wrong, 0.0, between / total)
    rest = (1 - share) * (estimate - common)
    apart = np.where(wrong, 0.0, 0.5 * rest * np.clip(np.abs(estimate - common) / np.sqrt(total) / 2 - 1, 0.0, 1.0))
    spread = np.where(wrong, between, share * variance) + (1 - share) ** 2 * of_common + apart**2
    return (common, float(np.sqrt(of_common + between))), (estimate - rest + apart, np.sqrt(spread))


@dataclass(frozen=True)
class _Piece:
    """Part of a log in which a joint moves: its column, and samples of `Pieces`, one every `stride` rows."""

    log: RobotLog
    joint: int
    rows: IntArray
    stride: int
    period: float
    position: Array
    velocity: Array
    inertia: Array
    others: Array


def _pieces(logs: Logs, robot: Robot, settings: Settings) -> Pieces | None:
    """Cut pieces out of logs in which a joint of a swinging limb, or of an arm, moves in one direction."""
    pieces = [piece for part in logs for piece in _cut(part, robot, settings)]
    chosen = [
        group[place]
        for joint in robot.torque_controlled
        if (group := [piece for piece in pieces if piece.joint == joint])
        for place in np.unique(np.linspace(0, len(group) - 1, MOST).astype(int))
    ]
    if not chosen:
        return None
    assert robot.command_gains is not None
    joint = np.array([piece.joint for piece in chosen])
    kp, kd = robot.command_gains
    limits = np.max([part.log.effort_limits for part in logs], axis=0)
    longest = max(len(piece.rows) for piece in chosen)
    period = np.array([piece.period for piece in chosen])
    stride = np.array([piece.stride for piece in chosen])
    lead = int(np.ceil(LATEST / (period / stride).min())) + 1

    def command(piece: _Piece) -> Array:
        rows = piece.rows[0] + np.arange(-lead, stride.max() * longest + 1)
        assert piece.log.command is not None
        return np.asarray(piece.log.command[rows.clip(0, len(piece.log.time) - 1), piece.joint])

    def padded(name: str) -> Array:
        return np.stack([np.pad(getattr(p, name), (0, longest - len(p.rows)), mode="edge") for p in chosen], axis=1)

    return Pieces(
        joint=joint,
        known=np.arange(longest)[:, None] < [len(piece.rows) for piece in chosen],
        command=np.stack([command(piece) for piece in chosen], axis=1),
        lead=lead,
        stride=stride,
        period=period,
        kp=np.maximum(kp, 1e-9)[joint],
        kd=kd[joint],
        limit=limits[joint],
        **{name: padded(name) for name in ("position", "velocity", "inertia", "others")},
    )


def _cut(prepared: PreparedLog, robot: Robot, settings: Settings) -> Iterator[_Piece]:
    """Yield the pieces of a log, with the torques c and inertias M along the measured motion."""
    log, period, known = prepared.log, prepared.sampling.period, robot.torque_controlled
    window = 2 * max(3, round(0.05 / period)) + 1  # of 0.1 s
    plain = {"averaged_law": False, "filter_torque": False, "standing_legs": False, "observer_bandwidth": None}
    of_filter = {"filter": FilterSettings(kind="savitzky-golay", window=window)}
    stride = max(1, round(0.004 / period))
    for chunk in torque_chunks(prepared, robot, settings.model_copy(update=plain | of_filter), stride=stride):
        samples, position = chunk.samples, log.position[chunk.rows]
        inertia = np.einsum("tjj->tj", joint_inertia(robot.tree, position))[:, known]
        needed = log.applied_torque()[chunk.rows][:, known] - samples.friction_torque
        others = needed - inertia * samples.acceleration
        for k, joint in enumerate(known.tolist()):
            for run in _moving(samples.velocity[:, k], samples.usable[:, k], chunk.runs(), stride * period):
                along = (position[run, joint], samples.velocity[run, k], inertia[run, k], others[run, k])
                yield _Piece(log, joint, chunk.rows[run], stride, stride * period, *along)


def _moving(velocity: Array, usable: BoolArray, runs: Iterator[slice], period: float) -> Iterator[slice]:
    """Yield the samples of each piece in which a joint moves, in one run, at most `LONGEST` seconds each."""
    top = np.percentile(np.abs(velocity), 99) if len(velocity) else 0.0
    moving = 0.03  # share of the top speed above which a joint moves [1]; a joint that sticks does not show the delay
    length = max(FEWEST, round(LONGEST / period))
    for run in runs:
        moves = usable[run] & (np.abs(velocity[run]) > moving * top)
        for first, last in (runs_of(moves) + run.start).tolist():
            count = -(-(last - first) // length)
            for start, stop in pairwise(np.linspace(first, last, count + 1).astype(int).tolist()):
                if stop - start >= FEWEST:
                    yield slice(start, stop)


def _fit(pieces: Pieces) -> tuple[Array, Array]:
    """Fit the simulation of all joints twice; the second fit whitens residuals by their correlation in the first.

    Inexact models and friction laws leave slow residuals, which hide the delay; fast residuals follow the commands. The
    second fit has the same start, because the first, with longer steps, may end at a local minimum of the second.

    Returns
    -------
    delay, error
        Delays of the joints with pieces, and their standard errors [s], shape (b,) each.
    """
    joints, first = np.unique(pieces.joint, return_index=True)
    kp, torque = pieces.kp[first], np.full(len(joints), 1e-9)
    np.maximum.at(torque, np.searchsorted(joints, pieces.joint), np.abs(pieces.others).max(axis=0))
    start = np.stack([np.full(len(kp), 0.02), 1e-3 * kp, 0.02 * kp, 0.15 * torque, 0 * torque], axis=1)
    low = np.broadcast_to([EARLIEST, 0.0, 0.0, 0.0, -np.inf], start.shape)
    high = np.broadcast_to([LATEST, np.inf, np.inf, np.inf, np.inf], start.shape)
    enough, correlation = 0.2, np.zeros(len(kp))  # smallest increase of the log-likelihood per step [1]
    for step in (4 * STEP, STEP):
        fits = OutputErrors(pieces, joints, correlation, step)
        minimum = minimise(fits, start, low, high, enough)
        error, correlation = fits.uncertainty(minimum.x)
    return minimum.x[:, 0] - 0.5 * STEP, np.where(minimum.converged, error, UNKNOWN)

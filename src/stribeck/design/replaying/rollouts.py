"""Short simulations from measured states under the measured torque or the commands, and their velocity errors.

Joints whose friction torque is known in a contact mode are simulated; the root and all other joints move as measured:

    (M + dt D) a = tau - ID(q, v, 0 | a measured) - D v,    R(v) = D v
    v <- v + dt a,    q <- q + dt v

If tau follows from commands, the drives act on the simulated motion: tau + kp (q measured - q) + kd (v measured - v).
The friction acts on the velocity at the end of a step, so that it stops a joint but never reverses it.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.dynamics.contact import SupportPhase
from stribeck.core.dynamics.contact.mode import ContactMode, contact_modes
from stribeck.core.dynamics.rooted import MASSLESS, RootMotion, joint_inertia, rooted_inverse_dynamics
from stribeck.core.dynamics.state import State
from stribeck.core.equations.friction_torque.inverse_dynamics import differentiate, orientation_filter
from stribeck.core.equations.friction_torque.preparation import PreparedLog
from stribeck.core.filters import make_filter
from stribeck.core.robot import Robot
from stribeck.core.settings import Settings
from stribeck.design.replaying.other_model import ModelFriction

HORIZONS = (0.1, 0.4, 1.0)
"""Shares of the longest duration after which the velocities are compared [1]."""
STARTS = 100
"""Number of rollouts per log, spread evenly over the rows that can be simulated."""
STEP = 1e-3
"""Step of the simulation [s]."""
TRACE = 0.01
"""Interval of simulated positions that are kept [s]."""


@dataclass(frozen=True, kw_only=True)
class RolloutError:
    """Velocity error of a joint after a horizon.

    Attributes
    ----------
    relative
        Root mean square of the error divided by the root mean square of the measured velocity change [1].
    rms
        Root mean square of the error [rad/s], [m/s].
    rollouts
        Number of rollouts that are long enough.
    """

    relative: float
    rms: float
    rollouts: int


@dataclass(frozen=True, eq=False)
class Simulated:
    """Positions of S rollouts every `TRACE`, shape (S, K, n), NaN where not simulated, and start times [s], (S,)."""

    start: Array
    position: Array


@dataclass(frozen=True, eq=False)
class _Batch:
    """S rollouts of one contact mode: signals at T rows from the start, padded with the last row.

    The torque has shape (S, T, n). `start` is the time of the first row [s], `reach` the duration of each rollout [s],
    `steady` the duration of the support [s], `horizons` the durations that are compared [s].
    """

    mode: ContactMode
    states: list[State]
    torque: Array
    period: float
    start: Array
    reach: Array
    steady: Array
    horizons: tuple[float, ...]


def massless_joints(robot: Robot, position: Array) -> list[str]:
    """Find joints with negligible inertia at a position, which cannot be simulated, shape (n,)."""
    inertia = np.diag(joint_inertia(robot.tree, position[None])[0])
    return [robot.joint_names[k] for k in np.flatnonzero(inertia <= MASSLESS * inertia.max())]


def rollout_errors(
    prepared: PreparedLog,
    robot: Robot,
    frictions: Sequence[ModelFriction],
    massless: Collection[str],
    settings: Settings,
    horizons: tuple[float, ...],
) -> list[tuple[dict[str, list[RolloutError | None]], Simulated]]:
    """Compute velocity errors by joint after each of the horizons, and positions, for each friction of a model.

    Joints that are `massless` or position-controlled move as measured.
    """
    drives = np.zeros((2, len(robot.joint_names))) if robot.command_gains is None else robot.command_gains
    moving = [k for k in robot.torque_controlled if robot.joint_names[k] not in massless]
    batches = _batches(prepared, robot, moving, settings, horizons)
    if not batches:
        return [({}, Simulated(np.zeros(0), np.zeros((0, 0, 0))))] * len(frictions)
    rollouts = []
    for friction in frictions:
        parts = [_compared(robot, batch, friction, np.nan_to_num(drives), moving, settings) for batch in batches]
        error, change, counts, position = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        errors = {robot.joint_names[k]: _of_joint(error[..., k], change[..., k], counts[..., k]) for k in moving}
        rollouts.append((errors, Simulated(np.concatenate([batch.start for batch in batches]), position)))
    return rollouts


def _batches(
    prepared: PreparedLog, robot: Robot, moving: Sequence[int], settings: Settings, horizons: tuple[float, ...]
) -> list[_Batch]:
    """Collect the measured signals of rollouts, grouped by contact mode."""
    period, log, phases = prepared.sampling.period, prepared.log, prepared.support.phases
    motion_filter = make_filter(settings.filter, period)
    turn_filter = orientation_filter(robot, log, motion_filter, period, settings)
    margin = max(motion_filter.half_width, turn_filter.half_width)
    shortest, longest = int(np.ceil(horizons[0] / period)) + 1, int(np.ceil(horizons[-1] / period)) + 2
    candidates: list[tuple[int, int, SupportPhase, ContactMode]] = []
    for segment in prepared.sampling.segments:
        for phase, mode in zip(phases, contact_modes(robot, phases), strict=True):
            row, stop = max(phase.first, segment.start + margin), min(phase.last, segment.stop - margin)
            seen = bool(mode.feet) and mode.seen(settings)[moving].any()
            candidates += [(start, stop, phase, mode) for start in range(row, stop - shortest) if seen]
    by_mode: dict[ContactMode, list[tuple[int, int, SupportPhase]]] = {}
    for place in np.unique(np.linspace(0, len(candidates) - 1, min(STARTS, len(candidates))).astype(int)):
        start, stop, phase, mode = candidates[place]
        by_mode.setdefault(mode, []).append((start, stop, phase))
    batches = []
    for mode, starts in by_mode.items():
        used = [slice(row, min(stop, row + longest)) for row, stop, _ in starts]
        read = [differentiate(robot, log, window, motion_filter, turn_filter, settings) for window in used]
        kept = [np.minimum(np.arange(longest), len(torque) - 1) for _, torque in read]
        states = [state.take(samples) for (state, _), samples in zip(read, kept, strict=True)]
        torque = np.stack([torque[samples] for (_, torque), samples in zip(read, kept, strict=True)])
        reach = period * np.array([stop - 1 - row for row, stop, _ in starts])
        steady = period * np.array(
            [(phase.steady_last - 1 - row) * (row >= phase.steady_first) for row, _, phase in starts]
        )
        first = log.time[[row for row, _, _ in starts]]
        batches.append(_Batch(mode, states, torque, period, first, reach, steady, horizons))
    return batches


def _compared(
    robot: Robot, batch: _Batch, friction: ModelFriction, drives: Array, moving: Sequence[int], settings: Settings
) -> tuple[Array, Array, BoolArray, Array]:
    """Compute error and change of the velocity after each horizon, mark the valid ones, and compute positions.

    The first three have shape (S, H, n), the positions (S, K, n).
    """
    measured = np.stack([state.velocity for state in batch.states])
    simulated = np.isin(np.arange(len(robot.joint_names)), moving) & batch.mode.seen(settings)
    predicted, position = _simulate(batch, friction, drives, np.flatnonzero(simulated))
    truth = np.stack([_at(measured, horizon / batch.period) for horizon in batch.horizons], axis=1)
    swinging = batch.mode.swinging
    lasts = np.where(swinging, batch.reach[:, None, None], np.minimum(batch.steady, batch.reach)[:, None, None])
    lasts = np.where(simulated, lasts + STEP / 2, -1.0)  # equal within half a step
    counts = lasts >= np.array(batch.horizons)[None, :, None]
    position[lasts < TRACE * np.arange(position.shape[1])[None, :, None]] = np.nan
    return predicted - truth, truth - measured[:, :1], counts, position


def _simulate(batch: _Batch, friction: ModelFriction, drives: Array, free: IntArray) -> tuple[Array, Array]:
    """Simulate the velocity after each horizon, shape (S, H, n), and positions every `TRACE`, shape (S, K, n).

    Joints that are not `free` move as measured. `drives` has kp and kd of the drives, shape (2, n).
    """
    roots, rooted = [batch.mode.root(state) for state in batch.states], batch.mode.rooted
    names = [name for name in ("gravity", "velocity", "acceleration") if getattr(roots[0], name, None) is not None]
    root = {name: np.stack([getattr(motion, name) for motion in roots]) for name in names}
    motion = [np.stack([getattr(state, name) for state in batch.states]) for name in ("position", "velocity")]
    acceleration = np.stack([state.acceleration for state in batch.states])
    acceleration[:, :, free] = 0.0
    position, velocity = (signal[:, 0].copy() for signal in motion)
    velocities, positions = [], []
    steps = [round(horizon / STEP) for horizon in batch.horizons]
    for step in range(steps[-1]):
        if step % round(TRACE / STEP) == 0:
            positions.append(position.copy())
        at = (step + 0.5) * STEP / batch.period  # [rows]
        torque = _at(batch.torque, at)
        for simulated, measured, gain in zip((position, velocity), motion, drives, strict=True):
            now = _at(measured, at)
            torque += gain * (now - simulated)
            now[:, free] = simulated[:, free]
            simulated[:] = now
        moved = RootMotion(**{name: _at(signal, at) for name, signal in root.items()}) if root else None
        _, bias = rooted_inverse_dynamics(rooted, position, velocity, _at(acceleration, at), moved)
        force = (torque - bias)[:, free] + drives[1, free] * velocity[:, free]  # kd acts on the next velocity
        inertia = joint_inertia(rooted, position)[:, free[:, None], free]
        before = velocity.copy()
        for _ in range(5 if friction else 1):  # with one, the error on exact logs of an arm is four times as large
            damping = (friction.damping(velocity) + np.diag(drives[1]))[:, free]
            resisted = inertia + STEP * damping[:, :, free]
            change = np.linalg.solve(resisted, force[:, :, None] - damping @ before[:, :, None])[:, :, 0]
            velocity[:, free] = np.clip(before[:, free] + STEP * change, -1e3, 1e3)  # [rad/s], [m/s]
        position[:, free] += STEP * velocity[:, free]
        if step + 1 in steps:
            velocities.append(velocity.copy())
    return np.stack(velocities, axis=1), np.stack(positions, axis=1)


def _at(signal: Array, row: float) -> Array:
    """Interpolate a signal of shape (S, T, ...) between rows, shape (S, ...)."""
    before = min(int(row), signal.shape[1] - 2)
    share = row - before
    return np.asarray((1 - share) * signal[:, before] + share * signal[:, before + 1])


def _of_joint(error: Array, change: Array, counts: BoolArray) -> list[RolloutError | None]:
    """Summarize a joint's errors after each horizon over the rollouts, shape (S, H) each.

    The result is None for horizons with fewer than five rollouts or without a change of velocity.
    """
    errors: list[RolloutError | None] = []
    for k, counted in enumerate(counts.T):
        rollouts = int(np.count_nonzero(counted))
        moved = float(np.sqrt(np.mean(change[counted, k] ** 2))) if rollouts >= 5 else 0.0
        rms = float(np.sqrt(np.mean(error[counted, k] ** 2))) if moved > 0 else 0.0
        errors.append(RolloutError(relative=rms / moved, rms=rms, rollouts=rollouts) if moved > 0 else None)
    return errors

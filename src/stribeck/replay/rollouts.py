"""Short simulations from measured states under the measured torque: how far the velocities run away.

Joints whose friction torque is known in a contact mode are simulated; the root and all other joints move as measured:

    (M + dt D) a = tau - ID(q, v, 0 | a measured) - D v,    R(v) = D v
    v <- v + dt a,    q <- q + dt v

The friction acts on the velocity at the end of a step, so that it brings a joint to rest and never turns it round.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.contact import SupportPhase
from stribeck.differentiation import make_filter
from stribeck.dynamics.rooted import RootMotion, joint_inertia, rooted_inverse_dynamics
from stribeck.dynamics.state import State
from stribeck.friction_torque.auto_filter import MASSLESS
from stribeck.friction_torque.contact_modes import (
    StandingFeet,
    contact_modes,
    contact_root,
    seen_joints,
    swinging_joints,
)
from stribeck.friction_torque.inverse_dynamics import differentiate, orientation_filter
from stribeck.friction_torque.preparation import PreparedLog
from stribeck.replay.model_friction import ModelFriction
from stribeck.robot import Robot
from stribeck.settings import Settings

HORIZONS = (0.05, 0.2, 0.5)
"""Times after which the velocities are compared [s]."""
STARTS = 100
"""Rollouts in a log, evenly spread over the rows that can be simulated."""
STEP = 1e-3
"""Step of the simulation [s]."""


@dataclass(frozen=True, kw_only=True)
class RolloutError:
    """The velocity error of a joint after a time.

    Attributes
    ----------
    relative
        Root mean square of the error over that of the change of the measured velocity [1].
    rms
        Of the error [rad/s], [m/s].
    rollouts
        That reached this time.
    """

    relative: float
    rms: float
    rollouts: int


@dataclass(frozen=True, eq=False)
class _Batch:
    """S rollouts of one contact mode: signals at T rows from the start on, the last row repeated.

    The torque has shape (S, T, n); `reach` is the duration of each rollout [s], `steady` how long the feet rest [s].
    """

    mode: StandingFeet
    states: list[State]
    torque: Array
    period: float
    reach: Array
    steady: Array


def massless_joints(robot: Robot, position: Array) -> list[str]:
    """Return the joints that the model gives hardly any inertia at a position, shape (n,): none can be simulated."""
    inertia = np.diag(joint_inertia(robot.tree, position[None])[0])
    return [robot.joint_names[k] for k in np.flatnonzero(inertia <= MASSLESS * inertia.max())]


def rollout_errors(
    prepared: PreparedLog,
    robot: Robot,
    frictions: Sequence[ModelFriction],
    massless: Collection[str],
    settings: Settings,
) -> list[dict[str, list[RolloutError | None]]]:
    """Compute the velocity errors of a model with each of some frictions, by joint, after each of `HORIZONS`.

    Joints that are `massless`, and those that are position-controlled, move as measured.
    """
    moving = [k for k in robot.torque_controlled if robot.joint_names[k] not in massless]
    batches = _batches(prepared, robot, moving, settings)
    found = []
    for friction in frictions:
        parts = [_compared(robot, batch, friction, moving, settings) for batch in batches]
        together = [np.concatenate(each) for each in zip(*parts, strict=True)]
        found.append({robot.joint_names[k]: _of_joint(*(part[:, :, k] for part in together)) for k in moving if parts})
    return found


def _batches(prepared: PreparedLog, robot: Robot, moving: Sequence[int], settings: Settings) -> list[_Batch]:
    """Read the measured signals of rollouts, those of one contact mode together."""
    period, log, phases = prepared.sampling.period, prepared.log, prepared.support.phases
    motion_filter = make_filter(settings.filter, period)
    turn_filter = orientation_filter(robot, log, motion_filter, period, settings)
    margin = max(motion_filter.half_width, turn_filter.half_width)
    shortest, longest = int(np.ceil(HORIZONS[0] / period)) + 1, int(np.ceil(HORIZONS[-1] / period)) + 2
    rows = owners = np.zeros(0, dtype=int)
    spans: list[tuple[int, SupportPhase, StandingFeet]] = []
    for segment in prepared.sampling.segments:
        for phase, mode in zip(phases, contact_modes(phases), strict=True):
            row, stop = max(phase.first, segment.start + margin), min(phase.last, segment.stop - margin)
            seen = bool(mode.feet) and seen_joints(robot, mode.feet, settings)[moving].any()
            if stop - row > shortest and seen:
                rows = np.append(rows, np.arange(row, stop - shortest))
                owners = np.append(owners, np.full(stop - shortest - row, len(spans)))
                spans.append((stop, phase, mode))
    by_mode: dict[StandingFeet, list[tuple[int, int, SupportPhase]]] = {}
    for place in np.unique(np.linspace(0, len(rows) - 1, min(STARTS, len(rows))).astype(int)):
        stop, phase, mode = spans[owners[place]]
        by_mode.setdefault(mode, []).append((int(rows[place]), stop, phase))
    batches = []
    for mode, starts in by_mode.items():
        used = [slice(row, min(stop, row + longest)) for row, stop, _ in starts]
        read = [differentiate(robot, log, each, motion_filter, turn_filter, settings) for each in used]
        kept = [np.minimum(np.arange(longest), len(torque) - 1) for _, torque in read]
        states = [state.take(each) for (state, _), each in zip(read, kept, strict=True)]
        torque = np.stack([torque[each] for (_, torque), each in zip(read, kept, strict=True)])
        reach = [stop - 1 - row for row, stop, _ in starts]
        steady = [(phase.steady_last - 1 - row) * (row >= phase.steady_first) for row, _, phase in starts]
        batches.append(_Batch(mode, states, torque, period, *(np.array([reach, steady]) * period)))
    return batches


def _compared(
    robot: Robot, batch: _Batch, friction: ModelFriction, moving: Sequence[int], settings: Settings
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return error and change of the velocity after each horizon, and which of them count, shape (S, H, n) each."""
    measured = np.stack([state.velocity for state in batch.states])
    simulated = np.isin(np.arange(len(robot.joint_names)), moving) & seen_joints(robot, batch.mode.feet, settings)
    predicted = _simulate(robot, batch, friction, np.flatnonzero(simulated))
    truth = np.stack([_at(measured, horizon / batch.period) for horizon in HORIZONS], axis=1)
    swinging = swinging_joints(robot, batch.mode.feet)
    horizons = np.array(HORIZONS)[None, :, None] - STEP / 2  # half a step decides what is equal
    lasts = np.where(swinging, batch.reach[:, None, None], np.minimum(batch.steady, batch.reach)[:, None, None])
    counts = simulated & (lasts >= horizons)
    return predicted - truth, truth - measured[:, :1], counts


def _simulate(robot: Robot, batch: _Batch, friction: ModelFriction, free: NDArray[np.int64]) -> Array:
    """Return the velocity after each horizon, shape (S, H, n); of joints that are not `free` it is the measured one."""
    roots = [contact_root(robot, batch.mode, state) for state in batch.states]
    rooted, first = roots[0]
    names = [name for name in ("gravity", "velocity", "acceleration") if getattr(first, name, None) is not None]
    root = {name: np.stack([getattr(motion, name) for _, motion in roots]) for name in names}
    motion = [np.stack([getattr(state, name) for state in batch.states]) for name in ("position", "velocity")]
    acceleration = np.stack([state.acceleration for state in batch.states])
    acceleration[:, :, free] = 0.0
    position, velocity = (signal[:, 0].copy() for signal in motion)
    found = []
    steps = [round(horizon / STEP) for horizon in HORIZONS]
    for step in range(steps[-1]):
        at = (step + 0.5) * STEP / batch.period  # [rows]
        for simulated, measured in zip((position, velocity), motion, strict=True):
            now = _at(measured, at)
            now[:, free] = simulated[:, free]
            simulated[:] = now
        moved = RootMotion(**{name: _at(signal, at) for name, signal in root.items()}) if root else None
        _, bias = rooted_inverse_dynamics(rooted, position, velocity, _at(acceleration, at), moved)
        force = (_at(batch.torque, at) - bias)[:, free]
        inertia = joint_inertia(rooted, position)[:, free[:, None], free]
        before = velocity.copy()
        for _ in range(5 if friction else 1):  # with one, exact logs of an arm are left four times as fast
            damping = friction.damping(velocity)[:, free]
            resisted = inertia + STEP * damping[:, :, free]
            change = np.linalg.solve(resisted, force[:, :, None] - damping @ before[:, :, None])[:, :, 0]
            velocity[:, free] = np.clip(before[:, free] + STEP * change, -1e3, 1e3)  # [rad/s], [m/s]
        position[:, free] += STEP * velocity[:, free]
        if step + 1 in steps:
            found.append(velocity.copy())
    return np.stack(found, axis=1)


def _at(signal: Array, row: float) -> Array:
    """Return a signal of shape (S, T, ...) at a row between two, shape (S, ...)."""
    before = min(int(row), signal.shape[1] - 2)
    share = row - before
    return np.asarray((1 - share) * signal[:, before] + share * signal[:, before + 1])


def _of_joint(error: Array, change: Array, counts: NDArray[np.bool_]) -> list[RolloutError | None]:
    """Summarize a joint's errors after each horizon, from those of the rollouts, shape (S, H) each.

    A horizon that fewer than five rollouts reach, or without any change of the velocity, has None.
    """
    found: list[RolloutError | None] = []
    for k, counted in enumerate(counts.T):
        rollouts = int(np.count_nonzero(counted))
        moved = float(np.sqrt(np.mean(change[counted, k] ** 2))) if rollouts >= 5 else 0.0
        rms = float(np.sqrt(np.mean(error[counted, k] ** 2))) if moved > 0 else 0.0
        found.append(RolloutError(relative=rms / moved, rms=rms, rollouts=rollouts) if moved > 0 else None)
    return found

"""Simulation of single joints from their commands, along the measured motion of all others (`command_delay`)."""

from dataclasses import dataclass, fields, replace

import numpy as np

from stribeck.core.base.typing import Array, BoolArray, IntArray

STEP = 5e-4
"""Longest time step of the simulation [s]."""


@dataclass(frozen=True, eq=False)
class Pieces:
    """B pieces of a log in which a joint moves, with up to T samples each.

    Attributes
    ----------
    joint
        Column of the joint in the log, shape (B,).
    known
        Samples that belong to the piece, shape (T, B).
    command, lead, stride
        All commands in the log [N m], shape (any, B); the piece starts at row `lead` and has a sample every `stride`
        rows, shape (B,). A held command that is thinned would act earlier or later.
    position, velocity, inertia, others
        Measured position [rad], its derivative [rad/s], inertia M [kg m^2] and torques c [N m], shape (T, B).
    period
        Sampling period [s], shape (B,).
    kp, kd, limit
        Gains [N m/rad], [N m s/rad] and largest torque [N m] of the joint's drive, shape (B,).
    """

    joint: IntArray
    known: BoolArray
    command: Array
    lead: int
    stride: IntArray
    position: Array
    velocity: Array
    inertia: Array
    others: Array
    period: Array
    kp: Array
    kd: Array
    limit: Array

    def take(self, numbers: IntArray) -> "Pieces":
        """Select some pieces by their numbers."""
        arrays = {field.name: getattr(self, field.name) for field in fields(self)}
        return replace(self, **{name: array[..., numbers] for name, array in arrays.items() if np.ndim(array)})


def linearize(pieces: Pieces, values: Array, scale: Array, correlation: Array, step: float) -> tuple[Array, Array]:
    """Compute residuals [rad], shape (T, B), and slopes by each parameter over its scale, shape (5, T, B).

    Both are whitened, e(t) - rho e(t - 1), with the correlation rho of successive residuals of each joint [1], shape
    (n,). The initial state of each piece is fitted, too: residuals and slopes are orthogonal to its effect.
    """
    small = 1e-3
    changes = np.concatenate([np.zeros((1, 7)), small * np.eye(7)])  # of five parameters, position and velocity
    parameters = (values + changes[:, :5, None] * scale)[:, :, pieces.joint]
    fast = np.abs(pieces.velocity).max(axis=0)
    starts = np.stack([pieces.position[0] + 0 * fast, pieces.velocity[0]]) + changes[:, 5:, None] * np.stack(
        [0.03 * fast, fast]
    )
    motion = simulate(pieces, parameters, starts, step)
    both = np.concatenate([(pieces.position - motion[0])[None], (motion[1:] - motion[0]) / small])
    rho = correlation[pieces.joint]
    first = np.sqrt(1 - rho**2) * both[:, :1]
    both = pieces.known * np.concatenate([first, both[:, 1:] - rho * both[:, :-1]], axis=1)
    state, _ = np.linalg.qr(both[6:].transpose(2, 1, 0))  # (B, T, 2)
    both = both[:6].transpose(2, 1, 0)
    both = (both - state @ (state.transpose(0, 2, 1) @ both)).transpose(2, 1, 0)
    return both[0], both[1:]


def simulate(pieces: Pieces, parameters: Array, starts: Array, longest: float = STEP) -> Array:
    """Simulate all pieces with P sets of parameters, shape (P, 5, B), and initial states, shape (P, 2, B).

    The implicit Euler method, with steps of at most `longest` [s], is stable for any friction. The positions [rad] have
    shape (P, T, B); beyond a piece's samples they are its initial position.
    """
    order = np.argsort(-pieces.known.sum(axis=0), kind="stable")  # pieces that end are the last columns
    pieces, parameters, starts = pieces.take(order), parameters[:, :, order], starts[:, :, order]
    delay, rotor, viscous, coulomb, offset = parameters.transpose(1, 0, 2)
    parts = max(1, int(np.ceil(pieces.period.max() / longest)))
    step, share = pieces.period / parts, (np.arange(1, parts + 1) / parts)[:, None, None]
    delays, same = np.unique(delay, axis=0, return_inverse=True)
    since = share * pieces.stride + pieces.lead - delays * pieces.stride / pieces.period  # of commands, in rows
    rows, count = since.astype(np.int64), len(order)
    after, place = since - rows, rows * count + np.arange(count)
    commands = np.pad(pieces.command[:-1], ((0, int(rows.max())), (0, 0)), mode="edge").ravel()  # the last one is held
    slow, stiffness = (1e-3 * np.abs(pieces.velocity).max(axis=0)) ** 2, pieces.kp * step
    braked, rotor, masses = pieces.kd + stiffness, rotor / step, pieces.inertia / step
    drives = (np.broadcast_to(value, delay.shape) for value in (pieces.kd, pieces.limit, slow, stiffness, braked))
    state = np.stack([pieces.kp * starts[:, 0], starts[:, 1], viscous + braked, coulomb, *drives])
    positions = np.repeat(starts[:, :1], len(pieces.position), axis=1)
    for k, b in enumerate(pieces.known[1:].sum(axis=1).tolist()):
        now, weight = place[:, :, :b] + k * count * pieces.stride[:b], after[:, :, :b]
        command = (1 - weight) * commands.take(now) + weight * commands.take(now + count)
        others = (1 - share) * pieces.others[k, :b] + share * pieces.others[k + 1, :b] + offset[:, :b]
        inertia = (1 - share) * masses[k, :b] + share * masses[k + 1, :b] + rotor[:, :b]
        state = state[:, :, :b].copy() if b < state.shape[2] else state
        spring, velocity, resisting, coulomb, kd, limit, slow, stiffness, braked = state
        drag, push = np.empty((2, *velocity.shape))
        for force, against, mass in zip(command.take(same, axis=1), others, inertia, strict=True):
            force -= spring  # in place: a new array costs as much
            np.multiply(velocity, velocity, out=drag)
            drag += slow
            np.divide(coulomb, np.sqrt(drag, out=drag), out=drag)
            drag += resisting
            np.subtract(force, np.multiply(kd, velocity, out=push), out=push)
            free = np.abs(push, out=push) < limit
            if not free.all():  # a drive is at its limit
                drag -= ~free * braked
                np.copysign(limit, force, out=force, where=~free)
            velocity *= mass
            velocity += force
            velocity -= against
            drag += mass
            velocity /= drag
            spring += np.multiply(stiffness, velocity, out=push)
        positions[:, k + 1, :b] = spring / pieces.kp[:b]
    return positions[:, :, np.argsort(order)]

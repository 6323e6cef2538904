"""Simulation of single joints from their commands, along the measured motion of all others (`command_delay`)."""

from dataclasses import dataclass, field, fields, replace
from typing import NamedTuple

import numpy as np

from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.estimator.solver.positive_definite import inverse_of

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


class _Fit(NamedTuple):
    """Cost of one joint's N residuals e with slopes J, and correlation of successive residuals [1].

    Gradients J^T e of its pieces, shape (pieces, 5), and information J^T J, shape (5, 5), are divided by the residuals'
    variance.
    """

    cost: float
    gradients: Array
    information: Array
    correlation: float


@dataclass(frozen=True, eq=False)
class OutputErrors:
    """Fits of the simulation to measured positions, one descent per joint (`gauss_newton.Problem`).

    Coordinates are delay [s], A [kg m^2], b [N m s/rad], F and o [N m]. The cost N / 2 log(e^T e) is the negative
    log-likelihood of N residuals for noise of unknown variance.

    Attributes
    ----------
    pieces, joints
        Pieces of b joints, and the joints' columns in the log, ascending, shape (b,).
    correlation
        Correlation rho of successive residuals [1], shape (b,); residuals are whitened, e(t) - rho e(t - 1).
    step
        Longest time step of the simulation [s].
    fits
        Fits by joint and coordinates, because one simulation yields cost and derivatives.
    """

    pieces: Pieces
    joints: IntArray
    correlation: Array
    step: float
    fits: dict[tuple[int, bytes], _Fit] = field(default_factory=dict)

    def of(self, rows: IntArray) -> "OutputErrors":
        """Select some of the joints."""
        pieces = self.pieces.take(np.flatnonzero(np.isin(self.pieces.joint, self.joints[rows])))
        return replace(self, pieces=pieces, joints=self.joints[rows], correlation=self.correlation[rows])

    def costs(self, x: Array) -> Array:
        """Simulate the joints and compute the cost of each at its coordinates, shape (b, 5) -> (b,)."""
        place = np.searchsorted(self.joints, self.pieces.joint)
        residual, slopes = linearize(self.pieces, x[place].T, self.correlation[place], self.step)
        for k, (joint, point) in enumerate(zip(self.joints.tolist(), x, strict=True)):
            e, J, known = residual[:, place == k], slopes[:, :, place == k], self.pieces.known[:, place == k]
            square = max(float(np.sum(e**2)), 1e-30)
            weight = known.sum() / square
            gradients, information = np.einsum("atb,tb->ba", J, e), np.tensordot(J, J, ((1, 2), (1, 2)))
            cost, correlation = 0.5 * known.sum() * np.log(square), np.sum(e[1:] * e[:-1]) / square
            self.fits[joint, point.tobytes()] = _Fit(cost, weight * gradients, weight * information, correlation)
        return np.array([fit.cost for fit in self._at(x)])

    def derivatives(self, x: Array) -> tuple[Array, Array]:
        """Look up gradients, shape (b, 5), and Gauss-Newton's second derivatives, shape (b, 5, 5)."""
        fits = self._at(x)
        return -np.stack([fit.gradients.sum(axis=0) for fit in fits]), np.stack([fit.information for fit in fits])

    def uncertainty(self, x: Array) -> tuple[Array, Array]:
        """Compute standard errors of delays [s] and correlations of successive residuals [1], shape (b,) each.

        The errors allow for correlation within a piece.
        """
        fits = self._at(x)
        effects = [fit.gradients @ inverse_of(fit.information)[0] for fit in fits]
        errors = [np.linalg.norm(effect) * np.sqrt(len(effect) / max(len(effect) - 5, 0.5)) for effect in effects]
        return np.array(errors), np.array([fit.correlation for fit in fits])

    def _at(self, x: Array) -> list[_Fit]:
        return [self.fits[joint, point.tobytes()] for joint, point in zip(self.joints.tolist(), x, strict=True)]


def linearize(pieces: Pieces, values: Array, rho: Array, step: float) -> tuple[Array, Array]:
    """Compute residuals [rad], shape (T, B), and slopes by each parameter, shape (5, T, B), for values of shape (5, B).

    Both are whitened, e(t) - rho e(t - 1). The initial state of each piece is fitted, too: residuals and slopes are
    orthogonal to its effect.
    """
    fast, torque = np.abs(pieces.velocity).max(axis=0), np.abs(pieces.others).max(axis=0) + 1e-9
    scales = [0.01 + 0 * fast, 1e-3 * pieces.kp, 0.02 * pieces.kp, 0.3 * torque, 0.3 * torque, 0.03 * fast, fast]
    change = 1e-3 * np.stack(scales)  # of five parameters, position and velocity
    point = np.concatenate([values, pieces.position[:1], pieces.velocity[:1]])
    points = point + np.concatenate([np.zeros((1, 7)), np.eye(7)])[:, :, None] * change
    motion = simulate(pieces, points[:, :5], points[:, 5:], step)
    both = np.concatenate([(pieces.position - motion[0])[None], (motion[1:] - motion[0]) / change[:, None]])
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

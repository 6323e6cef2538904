"""Make a trot physically possible: on two point feet, ground reactions have no moment about the line between them.

The distance of the base from this line must satisfy the equation of an inverted pendulum, zero moment about the line.
Each swing is a boundary value problem, solved by collocation at Chebyshev points. The base returns smoothly while all
feet stand.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Chebyshev
from scipy.interpolate import BPoly

from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError
from stribeck.simulation.prescribed.gait import STAND_TIME, Swing
from stribeck.simulation.prescribed.ground import inverse_dynamics
from stribeck.simulation.prescribed.motion import Motion, sway_at
from stribeck.simulation.prescribed.trajectory import Sines

NODES = 48
"""Number of collocation points of each swing."""
STEP = 1e-4
"""Step of the difference quotients [m], [m/s], [m/s^2]; coarse, because the moment is smooth and Newton's method
tolerates errors."""


@dataclass(frozen=True, eq=False)
class Line:
    """A swing, and the line through the two standing feet: a point, its direction, and its horizontal normal."""

    swing: Swing
    point: Array
    direction: Array
    normal: Array


class Piece(NamedTuple):
    """A displacement along a horizontal normal between two times [s]: functions of time for it and two derivatives."""

    normal: Array
    start: float
    end: float
    curves: Sequence[Callable[[Array], Array]]


@dataclass(frozen=True, eq=False)
class Shift:
    """Displacement of the base from the line of each swing."""

    pieces: list[Piece]

    def at(self, time: Array) -> Array:
        """Compute the displacement in the world at these times [s], shape (3, T, 3)."""
        total = np.zeros((3, len(time), 3))
        for piece in self.pieces:
            rows = (time >= piece.start) & (time < piece.end)
            for signal, curve in zip(total, piece.curves, strict=True):
                signal[rows] += np.outer(curve(time[rows]), piece.normal)
        return total


def keep_from_tipping(motion: Motion, sway: Sines) -> Shift:
    """Compute the displacement of the base for zero moment about the line of a trot's standing feet.

    Raises
    ------
    SettingsError
        If no such displacement is near the motion.
    """
    lines = [_line(motion, swing) for swing in motion.swings]
    times, first, second = zip(*(_collocation(line.swing) for line in lines), strict=True)
    time, D, DD = np.array(times), np.array(first), np.array(second)
    phi = np.zeros_like(time)
    for _ in range(20):
        derivatives = np.array([phi, *(np.einsum("sij,sj->si", matrix, phi) for matrix in (D, DD))])
        moment = _moment(motion, sway, lines, time, derivatives)
        slopes = []
        for order in range(3):
            moved = derivatives.copy()
            moved[order] += STEP
            slopes.append((_moment(motion, sway, lines, time, moved) - moment)[:, :, None] / STEP)
        system = slopes[0] * np.eye(NODES) + slopes[1] * D + slopes[2] * DD
        for end in (0, -1):  # on the line when the swing starts and ends
            system[:, end] = np.eye(NODES)[end]
            moment[:, end] = 0.0
        change = -np.linalg.solve(system, moment[:, :, None])[:, :, 0]
        phi = phi + change
        if np.abs(change).max() < 1e-12:  # [m]
            return Shift([piece for row in zip(lines, time, phi, strict=True) for piece in _pieces(*row)])
    raise SettingsError(
        "gait: no balanced trot is near this posture; give a posture with the feet about under the hips"
    )


def _line(motion: Motion, swing: Swing) -> Line:
    standing = [leg.place for leg in motion.legs if leg.contact.name not in swing.feet]
    direction = (standing[1] - standing[0]) / np.linalg.norm(standing[1] - standing[0])
    return Line(swing, standing[0], direction, np.cross([0.0, 0.0, 1.0], direction))


def _collocation(swing: Swing) -> tuple[Array, Array, Array]:
    """Compute Chebyshev points of a swing [s], shape (N,), and the matrices of first and second derivative there."""
    nodes = 0.5 * (swing.start + swing.end) - 0.5 * (swing.end - swing.start) * np.cos(np.linspace(0, np.pi, NODES))
    basis = [Chebyshev.basis(k, domain=[swing.start, swing.end]) for k in range(NODES)]
    values, first, second = (np.column_stack([series.deriv(order)(nodes) for series in basis]) for order in range(3))
    inverse = np.linalg.inv(values)
    return nodes, first @ inverse, second @ inverse


def _moment(motion: Motion, sway: Sines, lines: list[Line], time: Array, derivatives: Array) -> Array:
    """Compute the motion's moment about the lines [N m], shape (S, N), for displacements (3, S, N)."""
    flat = time.ravel()
    normal, direction, point = (
        np.repeat([getattr(line, name) for line in lines], NODES, axis=0) for name in ("normal", "direction", "point")
    )
    base = sway_at(sway, flat, np.array([d.ravel()[:, None] * normal for d in derivatives]))
    wrench, _ = inverse_dynamics(motion.robot, motion.joints_at(flat, base), base)
    about = wrench[:, 3:] + np.cross(base.position - point, wrench[:, :3])
    return np.asarray(np.sum(about * direction, axis=1).reshape(time.shape))


def _pieces(line: Line, nodes: Array, phi: Array) -> list[Piece]:
    """Compute a displacement before, during and after a swing, continuous with two derivatives."""
    swing = line.swing
    during = Chebyshev.fit(nodes, phi, NODES - 1, domain=[swing.start, swing.end])
    start, end = ([0.0, during.deriv(1)(t), during.deriv(2)(t)] for t in (swing.start, swing.end))
    pieces = [Piece(line.normal, swing.start, swing.end, [during.deriv(order) for order in range(3)])]
    rest = [0.0, 0.0, 0.0]
    for first, last, ends in (
        (swing.start - STAND_TIME, swing.start, [rest, start]),
        (swing.end, swing.end + STAND_TIME, [end, rest]),
    ):
        curve = BPoly.from_derivatives([first, last], ends)
        pieces.append(Piece(line.normal, first, last, [curve.derivative(order) for order in range(3)]))
    return pieces

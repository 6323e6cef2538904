"""LuGre: bristles that bend before they slip."""

from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import numpy as np
import scipy  # its linalg is slow to import: loaded at its first use

from stribeck.core.base.typing import Array
from stribeck.core.friction.law import LawWithState, Motion, Parameter
from stribeck.core.friction.stribeck import Stribeck, bell, from_coefficients
from stribeck.paper.stribeck_exponent import StribeckExponent


class LuGre(LawWithState):
    """Bristles with a mean deflection z (Canudas de Wit, Olsson, Astrom, Lischinsky 1995), with sigma0 = Fc / d.

        dz/dt = v - sigma0 |v| z / g(v),    g(v) = Fc (1 + S exp(-(v / vs)^2))
        R = sigma0 z + sigma1 dz/dt + Fv v + offset

    Steady sliding has R = g(v) sgn(v) + Fv v + offset. With S = 0 and sigma1 = 0 it is Dahl's law (1968) with viscous
    friction. The fit uses d instead of sigma0: with u = z / d, friction is linear in Fv, Fc, sigma1 and the offset,

        du/dt = v / d - |v| u / (d l(v)),    l(v) = 1 + S exp(-(v / vs)^2),    R = Fc u + sigma1 d du/dt + Fv v + offset

    and u depends only on the path, except for l. Over a path of length x in one direction, with l at its mean velocity,
    u <- l sgn(v) + (u - l sgn(v)) exp(-x / (d l)). This is exact for a constant speed and stable for any step. The
    velocity is linear between two samples, and the path ends where it changes its sign.

    When to use it: for logs with slow reversals, to learn how friction builds up after them.
    """

    name: ClassVar[str] = "lugre"
    title: ClassVar[str] = "LuGre, with presliding"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        *Stribeck.parameters[:-1],
        Parameter(
            name="bristle_travel",
            symbol="d",
            unit="rad",
            lower=1e-6,
            upper=1.0,
            starts=(1e-3, 3e-3, 1e-2, 3e-2),
            start_speed_power=1,
            logarithmic=True,
        ),
        Parameter(name="bristle_damping", symbol="sigma1", unit="N m s/rad"),
    )
    free_coefficients: ClassVar[tuple[int, ...]] = (3,)
    jumps: ClassVar[bool] = True
    _steady: ClassVar[StribeckExponent] = StribeckExponent()  # with the exponent 2

    def torque(self, velocity: Array, values: Array) -> Array:
        """Compute R(v) of steady sliding [N m], shape (N,)."""
        return self._steady.torque(velocity, _select_steady(values))

    def jacobian(self, velocity: Array, values: Array) -> Array:
        """Compute dR/dp of steady sliding, shape (N, 7), in the order of `parameters`."""
        columns = np.zeros((len(velocity), 7), order="F")
        columns[:, :5] = self._steady.jacobian(velocity, _select_steady(values))[:, [0, 1, 2, 3, 5]]
        return columns

    def basis(self, velocity: Array, shape: Mapping[str, float]) -> Array:
        """Compute the columns v, sgn(v), sgn(v) exp(-(v / vs)^2), 1, 0, shape (N, 5)."""
        return np.column_stack([self._steady.basis(velocity, {**shape, "exponent": 2.0}), np.zeros_like(velocity)])

    def from_linear(self, coefficients: Array, shape: Mapping[str, float]) -> Array:
        """Compute the seven parameters from (Fv, Fc, Fc S, offset, sigma1) and the nonlinear parameters."""
        *linear, offset, damping = coefficients
        nonlinear = shape["stribeck_velocity"], offset, shape["bristle_travel"]
        return np.array([*from_coefficients(*linear), *nonlinear, max(damping, 0.0)])

    def torque_along(self, motion: Motion, values: Array) -> Array:
        """Compute R [N m] along a motion, shape (M,)."""
        Fv, Fc, S, vs, offset, d, damping = values
        u, v = _compute_deflection(_make_legs(motion, S, vs, d)), motion.velocity
        return np.asarray(Fv * v + Fc * u + damping * _compute_rate(v, u, S, vs) + offset)

    def jacobian_along(self, motion: Motion, values: Array) -> Array:
        """Compute dR/dp along a motion, shape (M, 7), in the order of `parameters`."""
        _, Fc, S, vs, _, d, damping = values
        legs, v = _make_legs(motion, S, vs, d), motion.velocity
        u, by_shape = _differentiate_deflection(legs, S, vs, d)
        weight = bell(v, vs)
        level = 1.0 + S * weight
        by_level = damping * np.abs(v) * u / level**2
        columns = np.empty((len(v), 7), order="F")
        columns[:, 0] = v
        columns[:, 1] = u
        columns[:, [5, 2, 3]] = (Fc - damping * np.abs(v) / level)[:, None] * by_shape
        columns[:, 2] += by_level * weight
        columns[:, 3] += by_level * S * weight * 2.0 * (v / vs) ** 2 / vs
        columns[:, 4] = 1.0
        columns[:, 6] = _compute_rate(v, u, S, vs)
        return columns

    def basis_along(self, motion: Motion, shape: Mapping[str, float]) -> Array:
        """Compute the columns v, u, u exp(-(v / vs)^2), 1, dz/dt, shape (M, 5), with u without a Stribeck effect."""
        v, vs = motion.velocity, shape["stribeck_velocity"]
        u = _compute_deflection(_make_legs(motion, 0.0, vs, shape["bristle_travel"]))
        return np.column_stack([v, u, u * bell(v, vs), np.ones_like(v), _compute_rate(v, u, 0.0, vs)])


def _select_steady(values: Array) -> Array:
    """Select the parameters of steady sliding: Fv, Fc, S, vs, the exponent 2 and the offset."""
    return np.array([*values[:4], 2.0, values[4]])


class _Legs(NamedTuple):
    """Two legs between each sample and the next, each in one direction; shape (2 M,).

    velocity, path
        Mean velocity [rad/s], and length [rad]; infinite at the start of a motion, which is steady.
    level, keep
        l at that velocity, and exp(-path / (d l)) [1].
    """

    velocity: Array
    path: Array
    level: Array
    keep: Array

    @property
    def aim(self) -> Array:
        """Deflection divided by d after a long leg [1]."""
        return np.sign(self.velocity) * self.level


def _make_legs(motion: Motion, gain: float, stribeck_velocity: float, travel: float) -> _Legs:
    velocity, path = motion.legs
    level = 1.0 + gain * bell(velocity, stribeck_velocity)
    return _Legs(velocity, path, level, np.exp(-path / (travel * level)))


def _solve_recursion(keep: Array, right: Array) -> Array:
    """Solve x[k] = keep[k] x[k - 1] + right[k] with x[-1] = 0; shape of `right`, (K, ...)."""
    bands = np.stack([np.ones_like(keep), -np.append(keep[1:], 0.0)])
    return np.asarray(scipy.linalg.solve_banded((1, 0), bands, right, check_finite=False))


def _compute_deflection(legs: _Legs) -> Array:
    """Compute u at each sample [1], shape (M,)."""
    return _solve_recursion(legs.keep, (1.0 - legs.keep) * legs.aim)[1::2]


def _differentiate_deflection(legs: _Legs, gain: float, stribeck_velocity: float, travel: float) -> tuple[Array, Array]:
    """Compute u at each sample, shape (M,), and its derivatives by d, S and vs, shape (M, 3)."""
    u = _solve_recursion(legs.keep, (1.0 - legs.keep) * legs.aim)
    before = np.append(0.0, u[:-1])
    path = np.where(np.isfinite(legs.path), legs.path, 0.0)  # `keep` is zero at a start
    fades = legs.keep * path / (travel * legs.level) * (before - legs.aim)
    weight = bell(legs.velocity, stribeck_velocity)
    by_level = fades / legs.level + (1.0 - legs.keep) * np.sign(legs.velocity)
    by_speed = gain * weight * 2.0 * (legs.velocity / stribeck_velocity) ** 2 / stribeck_velocity
    right = np.column_stack([fades / travel, by_level * weight, by_level * by_speed])
    return u[1::2], _solve_recursion(legs.keep, right)[1::2]


def _compute_rate(velocity: Array, deflection: Array, gain: float, stribeck_velocity: float) -> Array:
    """Compute dz/dt [rad/s], shape (M,)."""
    level = 1.0 + gain * bell(velocity, stribeck_velocity)
    return np.asarray(velocity - np.abs(velocity) * deflection / level)

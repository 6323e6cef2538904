"""Friction curves that covariates change: `--law auto`, each joint with terms of its own.

    R = Fv (v + alpha |v|) + Fc tanh(a v) (1 + S exp(-(v / vs)^2)) + offset
        + mu |load| tanh(a v) + slow (Fc' tanh(a v) + Fv' v)

with load the torque that the joint carries, and slow its temperature above the mean, or else the time, from -1/2 at the
beginning of a log to 1/2 at its end. Both are known beforehand, so that these curves too are sums of functions of
velocity, some of them times a covariate (docs/estimator.md, "Friction curves").
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stribeck.friction import Parameter
from stribeck.friction.assembled import JUMP, Assembled
from stribeck.friction.terms import LADDER, LOAD, SLOW
from stribeck.identification.whole_log.constants import VARYING_BASIS_TOLERANCE
from stribeck.identification.whole_log.model.basis import Basis, grid_of, spanning
from stribeck.identification.whole_log.model.friction_curves import Curves
from stribeck.typing import Array


@dataclass(frozen=True, eq=False)
class VaryingCurves(Curves):
    """Curves of the law `Assembled`, and of how covariates change them.

    Attributes
    ----------
    slow
        What friction changes slowly with: "temperature" or "drift".
    """

    slow: str

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The law's, then those of load and slow change."""
        return (*self.law.parameters, LOAD, *SLOW[self.slow])

    def coefficients(self, internal: Array) -> Array:
        """Return the coefficients of all joints' curves [N m], shape (n R,)."""
        blocks = []
        for v, p in zip(self.basis.velocity, self.external(internal), strict=True):
            (*law, load, coulomb, viscous), rise = p, np.tanh(p[5] * v)
            torque = self.law.torque(v, np.array(law))
            blocks.append(self.basis.coefficients(torque, load * rise, coulomb * rise + viscous * v))
        return np.concatenate(blocks)

    def jacobians(self, internal: Array) -> Array:
        """Return their derivatives by each joint's own internal coordinates, shape (n, R, p)."""
        found = []
        for v, p in zip(self.basis.velocity, self.external(internal), strict=True):
            (*law, load, coulomb, _), count = p, len(self.law.parameters)
            rise = np.tanh(p[5] * v)
            slope = v * (1 - rise**2)
            base, loaded, slow = np.zeros((3, len(v), count + 3))
            base[:, :count] = self.law.jacobian(v, np.array(law))
            loaded[:, 5], loaded[:, count] = load * slope, rise
            slow[:, 5], slow[:, count + 1], slow[:, count + 2] = coulomb * slope, rise, v
            found.append(self.basis.coefficients(base, loaded, slow) * np.where(self.logarithmic, p, 1.0))
        return np.stack(found)

    def inside(self, values: Array) -> Array:
        """Return internal coordinates, shape (n, p), from values of the law alone: nothing changes with a covariate."""
        beyond = np.zeros((len(values), len(self.parameters) - len(self.law.parameters)))
        return super().inside(np.hstack([values, beyond]))

    def with_terms(self, kept: frozenset[str]) -> NDArray[np.bool_]:
        """Return which parameters a joint with these terms has, shape (p,)."""
        without = {name for term in LADDER for name in term.parameters}
        without -= {name for term in LADDER if term.name in kept for name in term.parameters}
        return np.array([parameter.name not in without for parameter in self.parameters])


def varying_curves(plain: Curves, basis: Basis, slow: str) -> VaryingCurves:
    """Return the curves with all terms for joints whose scales are known."""
    free = np.hstack([plain.having, np.ones((len(plain.top_speed), 3), dtype=bool)])
    return VaryingCurves(plain.law, basis, plain.top_speed, plain.torque, plain.priors, slow, free=free)


def rising(basis: Basis) -> Basis:
    """Return the basis of curves that may also have v and tanh(a v) times each of two covariates."""
    velocity = basis.velocity[0] / basis.velocity[0].max()
    slopes = [JUMP, *grid_of(next(p for p in Assembled.parameters if p.name == "slope"))]
    curves = np.column_stack([velocity, *(np.tanh(slope * velocity) for slope in slopes)])
    return replace(basis, modulated=basis.functions.T @ spanning(curves, VARYING_BASIS_TOLERANCE), covariates=2)

"""Friction curves that covariates change: `--law auto`, each joint with terms of its own.

    R = Fv (v + alpha |v|) + Fc tanh(a v) (1 + S exp(-(v / vs)^2)) + offset
        + mu |load| tanh(a v) + slow (Fc' tanh(a v) + Fv' v) + (Fc_c cosine + Fc_s sine) tanh(a v)
        + tau_c cos(k q) + tau_s sin(k q) + Fc_z (z - s(v))

with load the torque that the joint carries, slow its temperature above the mean, or else the time, from -1/2 at the
beginning of a log to 1/2 at its end, cosine and sine of its position q less their means, k the periods of a torque
ripple a turn; z follows s, a smooth sign of the velocity, within a travel (`friction/presliding.py`). All are
known beforehand, so that these curves too are sums of functions of velocity, some of them times a covariate
(docs/estimator.md, "Friction curves").
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.friction import Parameter
from stribeck.friction.auto import JUMP, AutoLaw
from stribeck.friction.terms import LADDER, LOAD, POSITION, PRESLIDING, RIPPLE, SLOW
from stribeck.whole_log.constants import COARSE_BASIS_TOLERANCE, VARYING_BASIS_TOLERANCE
from stribeck.whole_log.model.basis import Basis, grid_of, spanning
from stribeck.whole_log.model.friction_curves import Curves

SLOPE = [parameter.name for parameter in AutoLaw.parameters].index("slope")
"""Place of the slope a among the law's parameters."""


@dataclass(frozen=True, eq=False)
class VaryingCurves(Curves):
    """Curves of the law `AutoLaw`, and of how covariates change them.

    Attributes
    ----------
    slow
        What friction changes slowly with: "temperature" or "drift".
    """

    slow: str

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The law's, then those of load, slow change, position, ripple and presliding."""
        return (*self.law.parameters, LOAD, *SLOW[self.slow], *POSITION, *RIPPLE, PRESLIDING)

    def coefficients(self, internal: Array) -> Array:
        """Return the coefficients of all joints' curves [N m], shape (n R,)."""
        values, v, count = self.external(internal), self.basis.velocity, len(self.law.parameters)
        torque = self.law.torque(v, values[:, :count].T[:, :, None])
        load, coulomb, viscous, cosine, sine, of_cosine, of_sine, lagging = values[:, count:].T[:, :, None]
        rise, same = np.tanh(values[:, [SLOPE]] * v), np.ones_like(v)
        changed = (
            load * rise,
            coulomb * rise + viscous * v,
            cosine * rise,
            sine * rise,
            of_cosine * same,
            of_sine * same,
            lagging * same,
        )
        return self.basis.fewer(self.basis.coefficients(torque.T, *(each.T for each in changed)).T).ravel()

    def jacobians(self, internal: Array) -> Array:
        """Return their derivatives by each joint's own internal coordinates, shape (n, R, p)."""
        values, v, count = self.external(internal), self.basis.velocity, len(self.law.parameters)
        base, *changed = np.zeros((8, v.shape[1], *values.shape))  # of each function, at each knot
        own = self.law.jacobian(v.ravel(), np.repeat(values[:, :count].T, v.shape[1], axis=1))  # all joints' at once
        base[:, :, :count] = own.reshape(*v.shape, count).transpose(1, 0, 2)
        rise = np.tanh(values[:, [SLOPE]] * v)
        slope = (v * (1 - rise**2)).T
        loaded, slow, of_cosine, of_sine, *steady = changed
        for function, place in ((loaded, 0), (slow, 1), (of_cosine, 3), (of_sine, 4)):
            function[:, :, SLOPE] = values[:, count + place] * slope
            function[:, :, count + place] = rise.T
        slow[:, :, count + 2] = v.T
        for place, function in enumerate(steady, count + 5):
            function[:, :, place] = 1.0
        flat = (each.reshape(v.shape[1], -1) for each in (base, *changed))
        found = self.basis.coefficients(*flat).reshape(-1, *values.shape).transpose(1, 0, 2)
        return self.basis.fewer(found * np.where(self.logarithmic, values, 1.0)[:, None])

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
    beyond = 1 + len(SLOW[slow]) + len(POSITION) + len(RIPPLE) + 1
    free = np.hstack([plain.having, np.ones((len(plain.top_speed), beyond), dtype=bool)])
    return VaryingCurves(plain.law, basis, plain.top_speed, plain.torque, plain.priors, slow, free=free)


def rising(
    basis: Basis, slow: bool = True, position: bool = True, ripple: bool = True, presliding: bool = True
) -> Basis:
    """Return the basis of curves that may also have v and tanh(a v) times load, slow change and position, and more.

    That are constants times ripple and presliding. All but load take no columns where no joint can have them.
    """
    velocity = basis.velocity[0] / basis.velocity[0].max()
    slopes = [JUMP, *grid_of(next(p for p in AutoLaw.parameters if p.name == "slope"))]
    curves = np.column_stack([velocity, *(np.tanh(slope * velocity) for slope in slopes)])
    fine = basis.functions.T @ spanning(curves, VARYING_BASIS_TOLERANCE)
    coarse = basis.functions.T @ spanning(curves[:, 1:], COARSE_BASIS_TOLERANCE)
    coarse = coarse[:, : position * coarse.shape[1]]
    steady = basis.functions.T @ np.full((len(velocity), 1), len(velocity) ** -0.5)
    of_ripple, lag = steady[:, : int(ripple)], steady[:, : int(presliding)]
    slow_part = fine[:, : slow * fine.shape[1]]
    return replace(basis, modulated=(fine, slow_part, coarse, coarse, of_ripple, of_ripple, lag))

"""The least squares problem of one joint: which samples, which parameters; built here, solved in `curve_fit`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from stribeck.friction import FrictionLaw, Parameter
from stribeck.identification.speed import top_speed
from stribeck.log import Array
from stribeck.samples import Samples
from stribeck.settings import Settings

ARMATURE = Parameter(name="armature", symbol="Ia", unit="kg m^2")
"""Rotor inertia that the model lacks: an extra torque, armature times acceleration."""


@dataclass(frozen=True, eq=False, kw_only=True)
class FitProblem:
    """N samples of one joint and the p parameters that shall explain them, (6.4).

    Attributes
    ----------
    law
        The friction law.
    parameters
        The law's, and the armature if it is fitted.
    velocity, friction_torque
        [rad/s] and [N m], shape (N,).
    acceleration
        [rad/s^2], shape (N,); None if no armature is fitted.
    block
        Step or second of each sample, shape (N,), ascending.
    """

    law: FrictionLaw
    parameters: tuple[Parameter, ...]
    velocity: Array
    friction_torque: Array
    acceleration: Array | None
    block: NDArray[np.int64]

    @property
    def logarithmic(self) -> NDArray[np.bool_]:
        """Which parameters are fitted by their logarithm, shape (p,)."""
        return np.array([parameter.logarithmic for parameter in self.parameters])

    @property
    def bounds(self) -> Array:
        """Lower and upper bound of each parameter, shape (p, 2)."""
        return np.array([(parameter.lower, parameter.upper) for parameter in self.parameters])

    def predict(self, values: Array) -> Array:
        """Return the torque [N m] of parameter values, shape (p,) -> (N,)."""
        if self.acceleration is None:
            return self.law.torque(self.velocity, values)
        return np.asarray(self.law.torque(self.velocity, values[:-1]) + values[-1] * self.acceleration)

    def jacobian(self, values: Array) -> Array:
        """Return the derivatives of `predict`, shape (N, p)."""
        if self.acceleration is None:
            return self.law.jacobian(self.velocity, values)
        return np.column_stack([self.law.jacobian(self.velocity, values[:-1]), self.acceleration])

    def take(self, rows: slice | NDArray[np.bool_] | NDArray[np.int64]) -> FitProblem:
        """Return the problem of these samples alone."""
        return replace(
            self,
            velocity=self.velocity[rows],
            friction_torque=self.friction_torque[rows],
            acceleration=None if self.acceleration is None else self.acceleration[rows],
            block=self.block[rows],
        )


def joint_problem(samples: Samples, joint: str, law: FrictionLaw, settings: Settings) -> FitProblem:
    """Return the problem of all usable, finite samples of a joint, ordered by block.

    A joint at rest holds any torque up to the Coulomb friction, and the sign of its velocity is noise: for laws that
    jump at standstill, samples slower than `settings.rest` times the top speed are left out.
    """
    column = samples.joint_names.index(joint)
    fits_armature = settings.fit_armature if isinstance(settings.fit_armature, bool) else joint in settings.fit_armature
    velocity, torque = samples.velocity[:, column], samples.friction_torque[:, column]
    keep = samples.usable[:, column] & np.isfinite(velocity) & np.isfinite(torque)
    if fits_armature:
        keep &= np.isfinite(samples.acceleration[:, column])
    if law.jumps and keep.any():
        keep &= np.abs(velocity) >= settings.rest * top_speed(velocity[keep])
    rows = np.flatnonzero(keep)
    rows = rows[np.argsort(samples.block[rows], kind="stable")]
    return FitProblem(
        law=law,
        parameters=(*law.parameters, ARMATURE) if fits_armature else law.parameters,
        velocity=np.ascontiguousarray(velocity[rows], dtype=np.float64),
        friction_torque=np.ascontiguousarray(torque[rows], dtype=np.float64),
        acceleration=np.ascontiguousarray(samples.acceleration[rows, column]) if fits_armature else None,
        block=samples.block[rows],
    )


def hold_out(problem: FitProblem, every: int) -> tuple[FitProblem, FitProblem]:
    """Return the training and the validation problem: every n-th of the joint's own blocks is kept from all fits."""
    _, number = np.unique(problem.block, return_inverse=True)
    validation = cast("NDArray[np.bool_]", number % every == every // 2)
    return problem.take(~validation), problem.take(validation)

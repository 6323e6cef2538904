"""Samples of one joint and the parameters of its law, for fits and verdicts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.friction import FrictionLaw, LawWithState, Parameter
from stribeck.core.judgement.curve_fit.along import Along, along, state_known
from stribeck.core.judgement.excitation import Excitation, excitation
from stribeck.core.judgement.speed import top_speed
from stribeck.core.result.samples import FrictionSamples
from stribeck.core.settings import Settings

ARMATURE = Parameter(name="armature", symbol="Ia", unit="kg m^2")
"""Rotor inertia missing in the model; its torque is armature times acceleration."""


@dataclass(frozen=True, eq=False, kw_only=True)
class FitProblem:
    """N samples of one joint and the p parameters to fit (Equation 6.4 of the term paper).

    Attributes
    ----------
    law
        The friction law.
    parameters
        Parameters of the law, and the armature if it is fitted.
    velocity, friction_torque
        Velocity [rad/s] and friction torque [N m], shape (N,).
    acceleration
        Acceleration [rad/s²], shape (N,); None if no armature is fitted.
    block
        Step or second of each sample, ascending, shape (N,).
    around, weights
        Velocity [rad/s] at the K instants over which the filter averages the torque, shape (N, K), and their weights,
        shape (K,); None without averaging.
    along
        Motion along which a law with state is evaluated; None for other laws.
    """

    law: FrictionLaw
    parameters: tuple[Parameter, ...]
    velocity: Array
    friction_torque: Array
    acceleration: Array | None
    block: IntArray
    around: Array | None = None
    weights: Array | None = None
    along: Along | None = None

    @cached_property
    def turning(self) -> IntArray:
        """Samples with a relevant change of velocity within the filter's window."""
        around = self.velocity[:, None] if self.around is None else self.around
        change = np.abs(around - self.velocity[:, None]).max(axis=1)
        return np.flatnonzero(change > 0.2 * np.abs(self.velocity))  # the law is nearly linear over smaller changes

    def excitation(self, prismatic: bool) -> Excitation:
        """Judge the motion of the joint."""
        return excitation(self.velocity, self.block, len(self.parameters), prismatic)


def to_internal(values: Array, logarithmic: BoolArray) -> Array:
    """Convert parameter values, shape (..., p), to internal coordinates, with logarithms of scales."""
    return np.where(logarithmic, np.log(np.where(logarithmic, values, 1.0)), values)


def to_external(internal: Array, logarithmic: BoolArray) -> Array:
    """Convert internal coordinates, shape (..., p), to parameter values."""
    return np.where(logarithmic, np.exp(np.where(logarithmic, internal, 0.0)), internal)


def joint_problem(samples: FrictionSamples, joint: str, law: FrictionLaw, settings: Settings) -> FitProblem:
    """Build the problem of all usable, finite samples of a joint, ordered by block.

    For laws that jump at standstill, samples slower than `settings.rest` times the top speed are excluded: a joint at
    rest balances any torque up to the Coulomb friction, and the sign of its velocity is noise. For laws with state, the
    start of each piece of motion is excluded, because the state is unknown.
    """
    column = samples.joint_names.index(joint)
    asked = settings.fit_armature
    fits_armature = joint in asked if isinstance(asked, list) else asked is True
    velocity, torque = samples.velocity[:, column], samples.friction_torque[:, column]
    keep = samples.usable[:, column] & np.isfinite(velocity) & np.isfinite(torque)
    if fits_armature:
        keep &= np.isfinite(samples.acceleration[:, column])
    if law.jumps and keep.any():
        keep &= np.abs(velocity) >= settings.rest * top_speed(velocity[keep])
    if isinstance(law, LawWithState):
        keep &= state_known(samples, column, settings.rest)
    rows = np.flatnonzero(keep)
    rows = rows[np.argsort(samples.block[rows], kind="stable")]
    return FitProblem(
        law=law,
        parameters=(*law.parameters, ARMATURE) if fits_armature else law.parameters,
        velocity=np.ascontiguousarray(velocity[rows], dtype=np.float64),
        friction_torque=np.ascontiguousarray(torque[rows], dtype=np.float64),
        acceleration=np.ascontiguousarray(samples.acceleration[rows, column]) if fits_armature else None,
        block=samples.block[rows],
        around=samples.velocity_around(column, rows),
        weights=None if samples.nodes is None else samples.nodes.weights,
        along=along(samples, column, rows) if isinstance(law, LawWithState) else None,
    )

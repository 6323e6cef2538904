"""Parts of a result other than joints: model corrections, validation logs, and evidence for the report."""

from base64 import b64decode, b64encode
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field

from stribeck.core.base.frozen import freeze_dicts
from stribeck.core.base.typing import Array, TorqueSource
from stribeck.core.result.samples import FrictionSamples
from stribeck.core.robot import Robot


def _ascending(ends: tuple[float, float]) -> tuple[float, float]:
    if ends[0] > ends[1]:
        raise ValueError(f"it ends at {ends[1]:g}, but starts at {ends[0]:g}")
    return ends


Count = Annotated[int, Field(ge=0, le=10**15)]
Size = Annotated[float, Field(ge=0)]
Interval = Annotated[tuple[float, float], AfterValidator(_ascending)]
Three = Annotated[tuple[float, ...], Field(min_length=3, max_length=3)]
Six = Annotated[tuple[float, ...], Field(min_length=6, max_length=6)]

BODY_COORDINATES = ("log_mass", "centre_x", "centre_y", "centre_z", *(f"shape_{k}" for k in range(1, 7)))
"""Coordinates of a body's errors; `stribeck.core.robot.inertial_parameters.shape_coordinates` defines the last six."""


@dataclass(frozen=True, kw_only=True)
class ErrorCorrelation:
    """Correlation of the errors of m coordinates, named "joint.parameter" and "body.coordinate" (`BODY_COORDINATES`).

    `lower` has the entries below the diagonal, row by row, as little-endian 32-bit floats in base64.
    """

    names: tuple[str, ...]
    lower: str

    def __post_init__(self) -> None:
        """Check that there is a finite number for each pair."""
        count = len(self.names) * (len(self.names) - 1) // 2
        try:
            numbers = np.frombuffer(b64decode(self.lower, validate=True), dtype="<f4")
        except ValueError as error:
            raise ValueError(f"lower: is not base64 of 32-bit floats ({error})") from error
        if len(numbers) != count or not np.all(np.abs(numbers) <= 1):
            raise ValueError(f"lower: expected {count} numbers from -1 to 1 for {len(self.names)} names")

    @classmethod
    def of(cls, names: Sequence[str], covariance: Array) -> "ErrorCorrelation":
        """Encode the correlation of a covariance, shape (m, m); coordinates without error are correlated with none."""
        errors = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        unit = np.divide(1.0, errors, out=np.zeros_like(errors), where=errors > 0)
        below = np.nan_to_num(covariance * np.outer(unit, unit))[np.tril_indices(len(names), -1)].clip(-1.0, 1.0)
        return cls(names=tuple(names), lower=b64encode(below.astype("<f4").tobytes()).decode())

    @property
    def matrix(self) -> Array:
        """Correlation, shape (m, m)."""
        matrix = np.eye(len(self.names))
        matrix[np.tril_indices(len(matrix), -1)] = np.frombuffer(b64decode(self.lower), dtype="<f4")
        return np.tril(matrix) + np.tril(matrix, -1).T


@dataclass(frozen=True, kw_only=True)
class BodyCorrection:
    """Inertia of a body before and after the correction, in the frame of the joint that carries the body.

    `inertia` is Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the center of mass [kg m²]. `known` is the share of the prior
    variance that the log removes, from 0 to 1. `shape_error` are standard errors of the last six of
    `BODY_COORDINATES`; empty in files of earlier versions.
    """

    mass: tuple[float, float]
    mass_error: Size
    centre_of_mass: tuple[Three, Three]
    centre_of_mass_error: Three
    inertia: tuple[Six, Six]
    known: Size
    shape_error: Six | None = None


@dataclass(frozen=True, kw_only=True)
class Corrections:
    """Estimates of the whole-log method other than friction.

    - `chi_square`: squared error divided by its expectation; near 1 if the noise model is right.
    - `disagreement`: heterogeneity over folds, the same ratio for differences between parts of the log; above 1, the
      prior gets more weight.
    - Gains [1], encoder zeros [rad] and delays [s] as (value, standard error), to be subtracted. Delays of the torques
      and of the base orientation are relative to the encoders.
    - `command_delay`: time from the stamp of a joint's command until it acts [s], as (value, standard error).
    - `log_offsets`: offset of a joint in each log minus its offset in all logs [N m], [N]; empty for a single log.
    - `log_friction`: friction of a joint in each log at half the top speed relative to its friction in all logs, minus
      one [1]; empty for a single log.
    - `held_out_change`: change of the held-out torque error by the corrections: mean logarithm of the ratio of RMS
      errors over joints and blocks of the log, and its standard error [1]; None if nothing was held out.
    - `correlation`: correlation of the errors of friction and bodies; None in files of earlier versions.
    """

    chi_square: float
    disagreement: float = 1.0
    bodies: dict[str, BodyCorrection] = field(default_factory=dict)
    torque_gain: dict[str, tuple[float, float]] = field(default_factory=dict)
    encoder_zero: dict[str, tuple[float, float]] = field(default_factory=dict)
    log_offsets: dict[str, tuple[float, ...]] = field(default_factory=dict)
    log_friction: dict[str, tuple[float, ...]] = field(default_factory=dict)
    torque_delay: tuple[float, float] | None = None
    command_delay: dict[str, tuple[float, float]] = field(default_factory=dict)
    base_delay: tuple[float, float] | None = None
    held_out_change: tuple[float, float] | None = None
    correlation: ErrorCorrelation | None = None

    def __post_init__(self) -> None:
        """Make dictionaries read-only."""
        freeze_dicts(self)


@dataclass(frozen=True, kw_only=True)
class HeldOutError:
    """Torque error e of a joint: torque minus inverse dynamics, rotor torque and friction.

    Attributes
    ----------
    rms, rms_zero_friction
        Root mean square of the error with and without friction [N m], [N].
    torque_r2
        1 - sum e^2 / sum (tau - mean tau)^2.
    samples
        Number of samples.
    """

    rms: Size
    rms_zero_friction: Size
    torque_r2: float
    samples: Count


@dataclass(frozen=True, kw_only=True)
class HeldOutLog:
    """Errors on a validation log, by joint, for joints with identified friction that move in the log."""

    path: str
    sha256: str
    duration: Size
    joints: dict[str, HeldOutError]

    def __post_init__(self) -> None:
        """Make dictionaries read-only."""
        freeze_dicts(self)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Evidence:
    """Samples and texts that the report shows; not part of result.json.

    Attributes
    ----------
    samples
        Samples of the friction torque, without the torque of a fitted rotor inertia.
    phases
        Contact modes: (start [s], end [s], name, whether it was used), in log order.
    close_up
        A few seconds of `samples` at the full rate.
    provenance
        Versions, settings and choices, as label and text.
    notes
        Sentences on how the log was prepared.
    prismatic
        Prismatic joints; their units are m, N and N s/m.
    correction
        Samples of free and swinging limbs before and after the correction of model and log.
    torque_source
        Source of the robot's torques, which determines the friction that is included; None if unknown.
    robot
        Robot of the logs; None for a result that was read from a file.
    """

    samples: FrictionSamples
    phases: list[tuple[float, float, str, bool]]
    close_up: FrictionSamples | None
    provenance: list[tuple[str, str]]
    notes: list[str] = field(default_factory=list)
    prismatic: frozenset[str] = frozenset()
    correction: tuple[FrictionSamples, FrictionSamples] | None = None
    torque_source: TorqueSource | None = "link_side_sensor"
    robot: Robot | None = None

    @cached_property
    def measured(self) -> dict[str, tuple[Array, Array]]:
        """Velocity and friction torque of evenly spaced usable samples, by joint, shape (N,) each."""
        samples = {}
        for k, name in enumerate(self.samples.joint_names):
            known = np.flatnonzero(self.samples.usable[:, k] & np.isfinite(self.samples.friction_torque[:, k]))
            rows = known[:: max(1, -(-len(known) // 5000))]  # more samples are not visible behind a curve
            samples[name] = (self.samples.velocity[rows, k], self.samples.friction_torque[rows, k])
        return samples

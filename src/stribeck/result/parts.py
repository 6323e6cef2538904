"""What a result holds beside its joints: corrections of the model, held-out logs, and what the report draws."""

from dataclasses import dataclass, field
from typing import Annotated

from pydantic import Field

from stribeck.base.typing import TorqueSource
from stribeck.friction_torque.samples import FrictionSamples

Three = Annotated[tuple[float, ...], Field(min_length=3, max_length=3)]
Six = Annotated[tuple[float, ...], Field(min_length=6, max_length=6)]

BODY_COORDINATES = ("log_mass", "centre_x", "centre_y", "centre_z", *(f"shape_{k}" for k in range(1, 7)))
"""Of a body's errors: `stribeck.robot.inertial_parameters.shape_coordinates` has the last six."""


@dataclass(frozen=True, kw_only=True)
class BodyCorrection:
    """What the log says about a body's inertia; before and after, in the frame of the joint that carries the body.

    `inertia` is Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the centre of mass [kg m^2]. `known` is the share of the prior
    variance of the body that the log removes, from 0 to 1. `shape_error` are standard errors of the last six of
    `BODY_COORDINATES`; files of earlier versions have none.
    """

    mass: tuple[float, float]
    mass_error: float
    centre_of_mass: tuple[Three, Three]
    centre_of_mass_error: Three
    inertia: tuple[Six, Six]
    known: float
    shape_error: Six | None = None


@dataclass(frozen=True, kw_only=True)
class Corrections:
    """What a whole log says beside friction.

    `chi_square` is the squared error over what it was taken to be; near 1 if all is well. `disagreement` is the
    heterogeneity over folds, the same for differences between parts of the log about the model; above 1 the prior is
    given more weight. Gains [1], zeros [rad] and delays [s] are (value, standard error), to be taken off; delays are
    against the encoders, of all torques and of the base orientation. `log_offsets` is by how much the offset of a joint
    is larger in each log than in all, in their order [N m], [N]; empty for a single log. `correlations` are of two
    errors each, of friction as "joint.parameter" and of bodies as "body.coordinate" (`BODY_COORDINATES`); those among
    the parameters of one joint are in `JointResult`, and small ones are left out.
    """

    chi_square: float
    disagreement: float = 1.0
    bodies: dict[str, BodyCorrection] = field(default_factory=dict)
    torque_gain: dict[str, tuple[float, float]] = field(default_factory=dict)
    encoder_zero: dict[str, tuple[float, float]] = field(default_factory=dict)
    log_offsets: dict[str, tuple[float, ...]] = field(default_factory=dict)
    torque_delay: tuple[float, float] | None = None
    base_delay: tuple[float, float] | None = None
    correlations: list[tuple[str, str, float]] = field(default_factory=list)


@dataclass(frozen=True, kw_only=True)
class HeldOutError:
    """The torque error of a joint: torque less inverse dynamics, rotor and friction, as they were found.

    Attributes
    ----------
    rms, rms_zero_friction
        Of it, and of the same without friction [N m], [N].
    torque_r2
        1 - sum e^2 / sum (tau - mean tau)^2.
    samples
        That they are over.
    """

    rms: float
    rms_zero_friction: float
    torque_r2: float
    samples: int


@dataclass(frozen=True, kw_only=True)
class HeldOutLog:
    """A log that no fit has seen; its errors by joint, those whose friction was found and that move in it."""

    path: str
    sha256: str
    duration: float
    joints: dict[str, HeldOutError]


@dataclass(frozen=True, eq=False, kw_only=True)
class Evidence:
    """What the report draws beside the numbers; not part of result.json.

    Attributes
    ----------
    samples
        The friction torque samples that were kept; the torque of a fitted rotor inertia is taken out of them.
    phases
        Contact modes over time: (start [s], end [s], name, whether it was used), in log order.
    close_up
        A few seconds at the full rate, treated like `samples`.
    provenance
        Versions, settings and choices, as label and text.
    notes
        How the log was prepared, a sentence each.
    prismatic
        Joints that slide: their units are m, N and N s/m.
    correction
        Samples of free and swinging limbs by model and log as they were given, and as they were corrected.
    torque_source
        Where the robot's torques come from, which decides what the friction is of.
    """

    samples: FrictionSamples
    phases: list[tuple[float, float, str, bool]]
    close_up: FrictionSamples | None
    provenance: list[tuple[str, str]]
    notes: list[str] = field(default_factory=list)
    prismatic: frozenset[str] = frozenset()
    correction: tuple[FrictionSamples, FrictionSamples] | None = None
    torque_source: TorqueSource = "link_side_sensor"

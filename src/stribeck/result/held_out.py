"""How well the friction that was found explains logs that no fit has seen."""

from dataclasses import dataclass


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

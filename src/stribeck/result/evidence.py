"""What the report draws beside the numbers."""

from dataclasses import dataclass, field

from stribeck.samples import Samples
from stribeck.typing import TorqueSource


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

    samples: Samples
    phases: list[tuple[float, float, str, bool]]
    close_up: Samples | None
    provenance: list[tuple[str, str]]
    notes: list[str] = field(default_factory=list)
    prismatic: frozenset[str] = frozenset()
    correction: tuple[Samples, Samples] | None = None
    torque_source: TorqueSource = "link_side_sensor"

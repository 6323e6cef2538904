"""Current friction of a joint of a robot in service."""

from dataclasses import dataclass


@dataclass(frozen=True)
class FrictionState:
    """Current friction of a joint.

    R(v) = scale (R_0(v) - offset_0) + offset_0 + offset + viscous v, with the identified law R_0.

    Attributes
    ----------
    scale, offset, viscous
        Correction of the identified friction [1], [N m], [N m s/rad]; 1, 0, 0 at the start.
    friction, baseline
        Friction at middle speed now, and as identified [N m], [N].
    motion
        Duration of the motion that was observed [s].
    interval_95, interval_next_log
        Interval of `friction`, and interval in which the friction of another log is expected.
    alarm
        Whether an alarm is raised for this joint.
    """

    scale: float
    offset: float
    viscous: float
    friction: float
    baseline: float
    motion: float
    interval_95: tuple[float, float]
    interval_next_log: tuple[float, float]
    alarm: bool

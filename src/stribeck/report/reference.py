"""Friction that is known from elsewhere, drawn and printed beside what was found."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from stribeck.base.typing import Array


@dataclass(frozen=True, eq=False, kw_only=True)
class Reference:
    """Known friction: the truth of a simulation, or what a test bench measured.

    Attributes
    ----------
    name
        What it is called, in the legend and, abbreviated to its last word, in front of its numbers.
    curves
        By joint: velocity [rad/s] and friction torque there [N m], each of shape (K,).
    parameters
        By joint and parameter, where it is of the law that was fitted.
    """

    name: str
    curves: Mapping[str, tuple[Array, Array]] = field(default_factory=dict)
    parameters: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    @property
    def word(self) -> str:
        """The last word of its name."""
        return self.name.split()[-1]


NO_REFERENCE = Reference(name="none")

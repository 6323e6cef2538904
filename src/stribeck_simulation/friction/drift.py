"""Friction parameters that change while the joints warm up."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stribeck.errors import SettingsError
from stribeck.typing import Array


@dataclass(frozen=True)
class Drift:
    """Parameters that go from cold to warm like a body that is heated evenly: 1 + (ratio - 1) (1 - exp(-t / T)).

    Viscous friction of a gear falls to about a half between 30 and 80 deg C, Coulomb friction changes little
    (Bittencourt and Gunnarsson 2012, "Static friction in a robot joint", J. Dyn. Sys., Meas., Control 134(5)).

    Attributes
    ----------
    ratios
        Warm over cold, by parameter; the others stay.
    time_constant
        T [s].
    """

    ratios: Mapping[str, float]
    time_constant: float

    def require(self, names: Sequence[str], law: str) -> None:
        """Refuse ratios of parameters that the law does not have, and ratios and times that are not positive.

        Raises
        ------
        SettingsError
            Naming the first of them.
        """
        for name, ratio in self.ratios.items():
            if name not in names:
                raise SettingsError(f"drift: law '{law}' has no parameter '{name}'; it has {', '.join(names)}")
            if not 0 < ratio < np.inf:
                raise SettingsError(f"drift: ratio of {name} is {ratio}; expected a positive number")
        if not 0 < self.time_constant < np.inf:
            raise SettingsError(f"drift: time_constant is {self.time_constant}; expected a positive number of seconds")

    def factors(self, names: Sequence[str], time: float) -> Array:
        """Return what each parameter is multiplied by at a time [s], shape (p,)."""
        warm = 1.0 - np.exp(-time / self.time_constant)
        return np.array([1.0 + (self.ratios.get(name, 1.0) - 1.0) * warm for name in names])

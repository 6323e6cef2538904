"""Errors that no sensor makes: of the model, and of the root that is taken to stand still.

Around contact changes feet rock, slip and strike, and both errors are larger. How much, the log itself says: such
windows count as little as they should, rather than being left out by a guess.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from stribeck.typing import Array
from stribeck.weak_equations import WeakEquations

FIRST_MODEL, FIRST_LINEAR, FIRST_ANGULAR = 0.02, 0.01, 0.01
"""Levels before the pilot fit [N m], [m/s^2], [rad/s^2]: of a good model and a hard floor."""

FIRST_WRENCH = np.repeat([2.0, 0.5], 3)
"""The same of what wrench sensors and the model make of one another [N], [N m]."""

SINCE = (0.06, 0.12, 0.24)
"""Ends of the first bins, by the time since a contact change [s]."""

UNTIL = 0.06
"""Length of the last bin, by the time until a contact change [s]."""

BINS = len(SINCE) + 2
AWAY = len(SINCE)
"""Index of the bin that is far from any contact change."""


@dataclass(frozen=True, eq=False)
class VarianceComponents:
    """Standard deviations, each error correlated over a window's length.

    Attributes
    ----------
    model
        Of each joint's inverse dynamics while its limb swings and while it stands [N m], shape (2, n).
    root
        Of the root's linear [m/s^2] and angular acceleration [rad/s^2], shape (6,); (0,) for a fixed base.
    contact_scale
        How much larger the model's and the root's errors are around contact changes, shape (2, BINS); one when calm.
    rest, stiction
        Speed [rad/s] below which a joint is at rest, and the torque [N m] that then holds it, which a law that jumps at
        standstill says nothing about, shape (n,) each; zeros for other laws.
    wrench
        Of the wrench on a standing foot, by its sensor or by the model [N], [N m], shape (6,); (0,) without sensors.
    encoder_scale
        How many times larger the errors of each joint's acceleration are than its encoder's noise makes them [1],
        shape (encoders,); at least one. Clocks jitter, and links vibrate.
    """

    model: Array
    root: Array
    contact_scale: Array
    rest: Array
    stiction: Array
    encoder_scale: Array
    wrench: Array = field(default_factory=lambda: np.zeros(0))

    def encoder_errors(self, equations: WeakEquations) -> Array:
        """Return what errors of the accelerations do to the equations, of unit overlap, shape (K, m, encoders)."""
        return equations.encoder_response * (equations.encoder_noise * self.encoder_scale)

    def response(self, equations: WeakEquations) -> Array:
        """Return what errors of unit level do to the equations, shape (K, m, n + root + wrench)."""
        sensed = len(equations.wrench_noise) > 0
        wrench = float(sensed) * np.eye(equations.residual.shape[1], len(self.wrench))
        wrenches = np.broadcast_to(wrench, (len(equations.residual), *wrench.shape))
        return np.concatenate([equations.weights, equations.root_response, wrenches], axis=2)

    @property
    def away_from_contacts(self) -> Array:
        """Levels far from contact changes: swinging and standing joints', root's, wrench's, (2 n + root + wrench,)."""
        return np.concatenate([self.model.ravel(), self.root, self.wrench])

    @property
    def root_turns(self) -> Array:
        """Of the root's angular acceleration [rad/s^2], shape (3,); (0,) for a fixed base."""
        return self.root[3:]

    @property
    def kinds(self) -> NDArray[np.int64]:
        """Row of `contact_scale` of each level, shape (2 n + root + wrench,)."""
        return np.repeat([0, 1], [self.model.size, len(self.root) + len(self.wrench)])

    def which(self, equations: WeakEquations) -> NDArray[np.int64]:
        """Return which of the levels `response` has, shape (n + root + wrench,)."""
        joints = np.arange(len(equations.standing)) + len(equations.standing) * equations.standing
        return np.concatenate([joints, self.model.size + np.arange(len(self.root) + len(self.wrench))])

    def at(self, equations: WeakEquations) -> Array:
        """Return the levels in each window, in the order of `response`, shape (K, n + root + wrench)."""
        which = self.which(equations)
        components = np.asarray(
            self.away_from_contacts[which] * self.contact_scale[self.kinds[which]][:, bin_of(equations)].T
        )
        if self.rest.any():
            joints = len(self.rest)
            components[:, :joints] = np.hypot(components[:, :joints], self.stiction * resting(equations, self.rest))
        return components


def first_components(
    equations: WeakEquations, rest: Array, stiction: Array, sensed: bool = False
) -> VarianceComponents:
    """Return the levels to begin with; `rest` and `stiction` are kept as they are; wrenches are `sensed` or not."""
    joints, root = equations.velocity.shape[1], equations.root_response.shape[2]
    both = np.repeat([FIRST_LINEAR, FIRST_ANGULAR], 3)[:root]
    encoder_scale = np.ones(len(equations.encoder_noise))
    model, wrench = np.full((2, joints), FIRST_MODEL), FIRST_WRENCH if sensed else FIRST_WRENCH[:0]
    return VarianceComponents(model, both, np.ones((2, BINS)), rest, stiction, encoder_scale, wrench)


def bin_of(equations: WeakEquations) -> NDArray[np.int64]:
    """Return which bin each window is in, shape (K,)."""
    early = np.searchsorted(SINCE, equations.since, side="right")
    return np.where((early == AWAY) & (equations.until < UNTIL), BINS - 1, early)


def resting(equations: WeakEquations, rest: Array) -> Array:
    """Return the share of each window in which a joint is slower than `rest` [rad/s], shape (K, n)."""
    return equations.windows((np.abs(equations.velocity) < rest).astype(float))

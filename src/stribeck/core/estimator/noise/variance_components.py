"""Variance components: errors other than sensor noise (docs/estimator.md, second line of equation 6).

The model has errors, and the root, which is assumed to be at rest, has accelerations. Around contact changes, feet
rock, slip and strike: both errors are larger there by the contact variance scale, which is estimated as well.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.core.equations.constants import CONTACT_BINS
from stribeck.core.equations.weak_equations import WeakEquations

BINS, AWAY = len(CONTACT_BINS) + 2, len(CONTACT_BINS)
"""Number of bins, and index of the bin far from contact changes."""


@dataclass(frozen=True, eq=False)
class ErrorSource:
    """One source of errors: the response to a standard deviation of each of e errors, and their autocorrelation.

    Shapes are (K, m, e) and (lags + 1,) by windows. By groups of windows they are (B, b, e) and (2, b, b): between
    windows of one group, and between windows of a group and the previous one.
    """

    response: Array
    correlation: Array


@dataclass(frozen=True, eq=False)
class VarianceComponents:
    """Standard deviations of errors whose autocorrelation is equation (8).

    Attributes
    ----------
    model
        Errors of each joint's inverse dynamics while its limb swings and while it stands [N m], shape (2, n).
    root
        Errors of the root's linear [m/s^2] and angular acceleration [rad/s^2], shape (6,); (0,) for a fixed base.
    contact_scale
        Ratio of standard deviations around contact changes to elsewhere, for the model and for the root [1], shape (2,
        BINS).
    rest, stiction
        Speed [rad/s] below which a joint is at rest, and the torque [N m] that may then hold it, shape (n,) each; zeros
        for laws that do not jump at standstill.
    reversal
        Error of friction where the filter of velocities hides whether a joint sticks or reverses [N m], shape (n,).
    wrench
        Errors of the wrench on a standing foot from its sensor or the model [N], [N m], shape (6,); (0,) without
        sensors.
    encoder_scale
        Encoder-noise scale: errors of each joint's acceleration relative to the effect of its encoder's noise [1],
        shape (encoders,); at least one, because clocks jitter and links vibrate.
    """

    model: Array
    root: Array
    contact_scale: Array
    rest: Array
    stiction: Array
    reversal: Array
    encoder_scale: Array
    wrench: Array = field(default_factory=lambda: np.zeros(0))

    def response(self, equations: WeakEquations) -> Array:
        """Compute the response of the equations to a unit of each component, shape (K, m, n + root + wrench)."""
        sensed = len(equations.wrench_noise) > 0
        wrench = float(sensed) * np.eye(equations.residual.shape[1], len(self.wrench))
        wrenches = np.broadcast_to(wrench, (len(equations.residual), *wrench.shape))
        return np.concatenate([equations.weights, equations.root_response, wrenches], axis=2)

    @property
    def away_from_contacts(self) -> Array:
        """Components away from contact changes: swinging and standing joints, root, wrench, (2 n + root + wrench,)."""
        return np.concatenate([self.model.ravel(), self.root, self.wrench])

    @property
    def kinds(self) -> NDArray[np.int64]:
        """Row of `contact_scale` of each component, shape (2 n + root + wrench,)."""
        return np.repeat([0, 1], [self.model.size, len(self.root) + len(self.wrench)])

    def which(self, equations: WeakEquations) -> NDArray[np.int64]:
        """Find the indices of the components in `response`, shape (n + root + wrench,)."""
        joints = np.arange(len(equations.standing)) + len(equations.standing) * equations.standing
        return np.concatenate([joints, self.model.size + np.arange(len(self.root) + len(self.wrench))])

    def at(self, equations: WeakEquations) -> Array:
        """Compute the components in each window, in the order of `response`, shape (K, n + root + wrench)."""
        which = self.which(equations)
        components = np.asarray(
            self.away_from_contacts[which] * self.contact_scale[self.kinds[which]][:, bin_of(equations)].T
        )
        if self.rest.any():
            joints = len(self.rest)
            at_rest, near_rest = equations.resting(self.rest)
            held = np.hypot(self.stiction * at_rest, self.reversal * near_rest)
            components[:, :joints] = np.hypot(components[:, :joints], held)
        return components

    def marginal(self, equations: WeakEquations, windows: int = 1) -> Array:
        """Compute the marginal variance of the mean error of consecutive windows, shape (K - windows + 1, m).

        Noise of the sensors cancels in means as far as its correlation allows; other errors are taken as equal in them.
        """
        distance = np.arange(len(equations.torque_overlap))
        shares = np.where(distance, 2.0, 1.0) * np.maximum(windows - distance, 0) / windows**2
        encoder, torque, other = ((source.response**2).sum(axis=2) for source in self.sources(equations))
        encoder *= equations.acceleration_overlap @ shares
        torque *= equations.torque_overlap @ shares
        return means(encoder + torque + other, windows)

    def sources(self, equations: WeakEquations) -> list[ErrorSource]:
        """Collect the errors of encoders, of torque sensors, and of model, root and wrenches, by windows."""
        encoder = equations.encoder_response * (equations.encoder_noise * self.encoder_scale)
        return [
            ErrorSource(encoder, equations.acceleration_overlap),
            ErrorSource(equations.sensors, equations.torque_overlap),
            ErrorSource(self.response(equations) * self.at(equations)[:, None], equations.model_overlap),
        ]

    def by_groups(self, equations: WeakEquations) -> list[ErrorSource]:
        """Collect the errors, and large ones of windows that are set aside, by groups of windows."""
        windows, rows = equations.residual.shape
        lags, sources = equations.lags, self.sources(equations)
        if equations.set_aside is not None:
            large = 1e3 * np.sqrt(self.marginal(equations).max())
            sources.append(ErrorSource(large * equations.set_aside[:, None, None] * np.eye(rows), np.eye(lags + 1)[0]))
        grouped = []
        for source in sources:
            groups = np.zeros((-(-windows // lags), lags * rows, source.response.shape[2]))
            groups.reshape(-1, groups.shape[2])[: windows * rows] = source.response.reshape(windows * rows, -1)
            grouped.append(ErrorSource(groups, _between_groups(source.correlation[: lags + 1], rows)))
        return grouped


def _between_groups(correlation: Array, rows: int) -> Array:
    """Arrange correlations at lags 0 to `lags` between windows of groups, shape (2, b, b); zero at larger lags."""
    lags = len(correlation) - 1
    window = np.arange(lags)
    apart = np.abs(window[:, None] - window + np.array([0, lags])[:, None, None])
    blocks = np.append(correlation, np.zeros(lags))[apart]
    return np.repeat(np.repeat(blocks, rows, axis=1), rows, axis=2)


def means(values: Array, windows: int) -> Array:
    """Compute the means of consecutive windows, from shape (K, ...) to shape (K - windows + 1, ...)."""
    count = max(len(values) - windows + 1, 0)
    return np.asarray(sum(values[k : k + count] for k in range(windows)) / windows)


def first_components(
    equations: WeakEquations, rest: Array, stiction: Array, sensed: bool = False
) -> VarianceComponents:
    """Reset the components to their values before the pilot; `rest` and `stiction` stay; wrenches are `sensed` or not.

    The values fit a good model, 0.02 N m, on a hard floor, 0.01 m/s^2 and rad/s^2; wrenches 2 N and 0.5 N m.
    """
    joints, root = equations.velocity.shape[1], equations.root_response.shape[2]
    return VarianceComponents(
        model=np.full((2, joints), 0.02),
        root=np.full(root, 0.01),
        contact_scale=np.ones((2, BINS)),
        rest=rest,
        stiction=stiction,
        reversal=np.zeros(joints),
        encoder_scale=np.ones(len(equations.encoder_noise)),
        wrench=np.repeat([2.0, 0.5], 3)[: 6 * sensed],
    )


def bin_of(equations: WeakEquations) -> NDArray[np.int64]:
    """Find the bin of each window, shape (K,)."""
    early = np.searchsorted(CONTACT_BINS, equations.since, side="right")
    return np.where((early == AWAY) & (equations.until < CONTACT_BINS[0]), BINS - 1, early)

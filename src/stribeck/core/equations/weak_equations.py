"""The weak form of the equation of motion over a segment of a log (docs/estimator.md, equations 3, 6 and 8)."""

from dataclasses import dataclass, field

import numpy as np

from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.equations.constants import COSINES
from stribeck.core.friction.presliding import SMOOTH_SIGN, lag_behind


@dataclass(frozen=True, eq=False, kw_only=True)
class WeakEquations:
    """K windows of one segment in one contact mode, with m equations each for the friction of n joints.

    With the smooth window w around sample t_k, r = tau - inverse dynamics, and the contact projection P_k,

        P_k^T W_k[r] = P_k^T W_k[R(v)] + (regressors times corrections of the model) + error

    Both sides pass the same window, so that smoothing causes no bias. The error's covariance between windows k and
    l = k + j is

        rho_a(j) G_k diag(encoder_noise^2) G_l^T + rho_t(j) P_k^T diag(torque_noise^2) P_l
            + beta(j) (B_k diag(root^2) B_l^T + P_k^T diag(model^2) P_l)

    The standard deviations of the last two terms, accelerations of the root (assumed to be at rest) and errors of the
    model, are unknown, as well as the encoder-noise scale of the first term.

    A coupling B^T v of joints counts as one more joint, after the others, without a torque sensor: its friction acts on
    them through P_k^T B.

    Attributes
    ----------
    time
        Time of the windows' centers [s], shape (K,).
    since, until
        Time since the last and until the next change of contacts [s], shape (K,); infinite without a change.
    gait
        Number of the gait phase, which steps on the same feet in the same log share; -1 without steps.
    residual
        Left side of the equations [N m], shape (K, m).
    velocity
        Velocities at the full rate [rad/s], shape (T, n).
    before
        Velocities of the preceding rows at the full rate [rad/s], shape (any, n); None if unknown.
    taps, step
        Weights of the window, shape (L,), and rows from one window to the next: window k weighs rows
        `k step ... k step + L - 1` of `velocity`.
    projection
        P_k^T, shape (K, m, n); None if every joint has a separate equation without other forces.
    standing
        Mask of joints between the base and a standing foot, shape (n,).
    encoder_response
        G_k: response of the left side to an error of a joint's acceleration [kg m^2], shape (K, m, encoders).
    root_response
        B_k: response of the left side to an acceleration of the root [kg], [kg m], shape (K, m, 6); (K, m, 0) for a
        fixed base.
    encoder_noise, torque_noise
        Standard deviations of encoders [rad], shape (encoders,), and of torque sensors [N m], shape (n,).
    acceleration_overlap, torque_overlap
        rho_a [s^-4] and rho_t [1] per unit of sensor variance, from lag 0 to the last lag with a correlation.
    regressors
        Derivative of the left side's inverse dynamics by the model's corrections, shape (K, m, c); None if none.
    torque
        Measured torque, windowed [N m], shape (K, n).
    elapsed
        Time since the start of the log [s], shape (K,).
    temperature
        Temperature of the joints [deg C], shape (K, n); None if not logged.
    position
        Positions of the joints at the full rate [rad], shape (T, n); NaN for prismatic joints and couplings.
    position_noise
        Standard deviations of the noise of `position` [rad], shape (n,); zero for couplings, None if unknown.
    couplings
        B, shape (n - c, c): coefficients of the joints in the last c columns, the couplings; None without couplings.
    wrench_noise
        Standard deviations of a standing foot's wrench [N], [N m], shape (6,), whose equations come first and contain
        no friction; (0,) without these equations.
    set_aside
        Mask of windows with outliers, which are not used, shape (K,); None without outliers.
    blur
        Rows of `velocity` on either side of a reversal over which the filter of velocities hides it [1].
    shares_of_rest
        Results of `resting` by speed.
    """

    time: Array
    since: Array
    until: Array
    gait: int
    residual: Array
    velocity: Array
    taps: Array
    step: int
    projection: Array | None
    standing: BoolArray
    encoder_response: Array
    root_response: Array
    encoder_noise: Array
    torque_noise: Array
    acceleration_overlap: Array
    torque_overlap: Array
    regressors: Array | None
    torque: Array
    elapsed: Array
    position: Array
    temperature: Array | None = None
    position_noise: Array | None = None
    couplings: Array | None = None
    wrench_noise: Array = field(default_factory=lambda: np.zeros(0))
    set_aside: BoolArray | None = None
    before: Array | None = None
    blur: int = 0
    shares_of_rest: dict[bytes, tuple[Array, Array]] = field(default_factory=dict)

    @property
    def used(self) -> BoolArray:
        """Mask of used windows, shape (K,)."""
        return np.ones(len(self.time), dtype=bool) if self.set_aside is None else ~self.set_aside

    @property
    def period(self) -> float:
        """Sampling period of the rows [s]; 0 for a single window."""
        return float(self.time[1] - self.time[0]) / self.step if len(self.time) > 1 else 0.0

    @property
    def joints(self) -> int:
        """Number of joints without couplings."""
        return self.velocity.shape[1] if self.couplings is None else len(self.couplings)

    @property
    def lags(self) -> int:
        """Largest distance of windows with correlated errors [1], at most the number of windows."""
        return min(len(self.torque_overlap) - 1, len(self.time))

    @property
    def model_overlap(self) -> Array:
        """Correlation of the model's errors from lag 0 to the last lag with a correlation [1], equation (8)."""
        return autocorrelation(len(self.torque_overlap) - 1)

    @property
    def weights(self) -> Array:
        """P_k^T, or the identity, shape (K, m, n)."""
        if self.projection is not None:
            return self.projection
        return np.broadcast_to(np.eye(self.joints), (len(self.residual), self.joints, self.joints))

    def windows(self, signal: Array) -> Array:
        """Compute the windows of a signal at the full rate, shape (T, n) -> (K, n)."""
        return through_windows(signal, self.taps, self.step)[: len(self.time)]

    def presliding(self, top_speed: Array, travels: Array) -> Array:
        """Compute windowed z - s of presliding, shape (c, K, n), for c travels [rad], shape (c, n)."""
        velocity = self.velocity if self.before is None else np.concatenate([self.before, self.velocity])
        lagging = lag_behind(velocity, self.period, SMOOTH_SIGN * top_speed, travels)[:, -len(self.velocity) :]
        return np.stack([self.windows(lag) for lag in lagging])

    def resting(self, rest: Array) -> tuple[Array, Array]:
        """Compute the shares of each window in which joints are at rest and near rest [1], shape (K, n) each.

        A joint is at rest in rows slower than `rest` [rad/s], shape (n,), and near rest within `blur` rows of its rest
        or reversal. All variance components need both, so that they are kept.
        """
        from scipy.ndimage import maximum_filter1d, minimum_filter1d

        key = rest.tobytes()
        if key not in self.shares_of_rest:
            reach = 2 * self.blur + 1
            least, most = minimum_filter1d(self.velocity, reach, axis=0), maximum_filter1d(self.velocity, reach, axis=0)
            at, near = np.abs(self.velocity) < rest, (least < rest) & (most > -rest)
            self.shares_of_rest[key] = self.windows(at.astype(float)), self.windows(near.astype(float))
        return self.shares_of_rest[key]

    @property
    def sensors(self) -> Array:
        """Response of the left side to the noise of torque sensors and of a wrench sensor, shape (K, m, n or n + 6)."""
        torque = self.weights * self.torque_noise
        wrench = np.eye(self.residual.shape[1], len(self.wrench_noise)) * self.wrench_noise
        return np.concatenate([torque, np.broadcast_to(wrench, (len(torque), *wrench.shape))], axis=2)

    def gait_phase_effects(self) -> Array:
        """Compute the derivatives by the cosines of the gait phase, shape (K m, COSINES (n + turns)), equation (28).

        Feet rock in the same way after every lift-off, and an inertia that is wrong is wrong in every step. Such errors
        do not average out over steps; treated as noise, they would make intervals too narrow. Therefore every joint may
        have a smooth torque in each gait phase, some cosines over its progress. The fit omits them; its covariance
        includes their effect.

        The effects are n joint torques and, for a free root, three angular accelerations. Their unit is noise with the
        autocorrelation (8). Such noise, the same in every phase of a length T, is a sum of cosines with variances 2
        reach / T (half as much for the constant), where the reach is the integral of the autocorrelation.
        """
        whole = np.isfinite(self.since + self.until)
        length = np.where(whole, self.since + self.until, 1.0)
        progress = np.where(whole, self.since / length, 0.5)  # a phase that is cut off counts as its middle
        reach = (self.time[1] - self.time[0]) * (2 * self.model_overlap.sum() - 1)
        waves = np.cos(np.pi * progress[:, None] * np.arange(COSINES))[:, None, :, None]
        noise = waves * np.sqrt(np.r_[1, np.full(COSINES - 1, 2)] * reach / length[:, None])[:, None, :, None]
        torques, turns = waves * self.weights[:, :, None], noise * self.root_response[:, :, None, 3:]
        return np.concatenate([torques, turns], axis=3).reshape(self.residual.size, -1)


def through_windows(signal: Array, taps: Array, step: int) -> Array:
    """Compute the windows of a signal, one every `step` rows, shape (T, n) -> (K, n); T is at least one window."""
    return np.asarray(np.lib.stride_tricks.sliding_window_view(signal, len(taps), axis=0)[::step] @ taps)


def autocorrelation(lags: int) -> Array:
    """Compute the correlation of the model's errors at lags 0 to `lags` [1], (1 - j / (lags + 1))^2: equation (8).

    It is strictly convex, so that its spectrum is positive at every frequency (Polya 1949). The spectrum of a triangle
    (a running mean) has zeros, and a fit would trust these frequencies more than any other.
    """
    return np.asarray((1 - np.arange(lags + 1) / (lags + 1)) ** 2)

"""What was found of one joint: parameters with their intervals and verdicts, and the friction that they say."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from stribeck.base.typing import Array
from stribeck.errors import NothingIdentifiedError
from stribeck.friction import FrictionLaw, LawWithState, get_law
from stribeck.friction.auto import beyond_velocity
from stribeck.friction.law import Motion
from stribeck.friction.presliding import SMOOTH_SIGN, lag_behind

Verdict = Literal["identified", "weak", "no friction", "not excited"]


def verdict_place(verdict: str) -> str:
    """Name the command that explains a verdict."""
    return f"stribeck explain {verdict.replace(' ', '-')}"


TermDecision = Literal["kept", "refused", "open"]

STEP = 1e-4
"""Of differences, relative to a parameter [1]; what they differentiate is nearly linear."""


@dataclass(frozen=True, kw_only=True)
class ParameterEstimate:
    """A fitted parameter: value, standard error, 95 % interval, unit and verdict.

    `variance_shares` says what the squared standard error is made of, by name, adding up to one, if the method knows.
    """

    value: float
    standard_error: float
    interval_95: tuple[float, float]
    unit: str
    verdict: Verdict
    variance_shares: dict[str, float] | None = None


@dataclass(frozen=True, kw_only=True)
class CurvePoint:
    """Torque that resists motion at one speed [rad/s], [m/s], mean of both directions, without the offset [N m], [N].

    With its standard error, its 95 % interval, which ends at zero, and its unit.
    """

    velocity: float
    value: float
    standard_error: float
    interval_95: tuple[float, float]
    unit: str

    @property
    def half_width(self) -> float:
        """Of the interval, where no zero cuts it off."""
        return self.interval_95[1] - self.value


@dataclass(frozen=True, kw_only=True)
class Validation:
    """Root mean square of the friction torque not explained, on blocks that no fit saw [N m]."""

    rms: float
    rms_zero_friction: float
    rms_coulomb_only: float


@dataclass(frozen=True, kw_only=True)
class TorqueR2:
    """Share of the variance of a joint's held-out torque that its model explains with the friction found [1].

    Of the model and log as they were given, `nominal`, and with the corrections found, `corrected`; None if there are
    none. 1 - sum e^2 / sum (tau - mean tau)^2, with e = tau - inverse dynamics - R(v), at the bandwidth of the filter,
    over samples of free and swinging limbs in parts of the logs that the fit has not seen.
    """

    nominal: float
    corrected: float | None = None

    @property
    def best(self) -> float:
        """Of the model that the friction belongs to."""
        return self.nominal if self.corrected is None else self.corrected


@dataclass(frozen=True, kw_only=True)
class TermVerdict:
    """Whether a joint's friction has a term, and why.

    A term is open if the log shows something that the term explains, but not what it is. `gain` is by how much the term
    lowers chi^2 where it was not fitted, `gain_error` the standard error of that; None where nothing could be tried.
    """

    verdict: TermDecision
    reason: str
    gain: float | None = None
    gain_error: float | None = None

    @property
    def kept(self) -> bool:
        """Whether the joint has it."""
        return self.verdict == "kept"


@dataclass(frozen=True, kw_only=True)
class JointResult:
    """What the log says about one joint; `parameters` is empty when it did not move enough.

    `curve` is its friction as a whole, at slow, middle and top speed; the verdict is the curve's. A joint without
    detectable friction has no parameters but those of other torques, an offset or a rotor inertia.
    Of the law "auto", `terms` says which of them the joint has, `mean_load` is the torque that it carries [N m], of
    which `load_deviation` is the standard deviation, and
    `mean_direction` are the means of cosine and sine of its position; None of a prismatic joint. `ripple_per_turn` is
    how many periods a turn its torque ripple has; None without any. `presliding_travel` is the travel after a reversal
    within which the parameter `presliding` builds up [rad], [m]; None without any.
    `mean_temperature` is that of the joint in the log [deg C], at which its friction holds; None if it was not logged.
    `position_range` are its lowest and highest position in the log [rad], [m].
    `correlation` is that of the parameters' errors, in their order, shape (p, p); None where nothing was fitted.
    `torque_r2` is how much of its torque is explained, None where nothing was held out.
    `law` is the name of the law that was fitted; the `Result` that holds the joint gives it.
    """

    parameters: dict[str, ParameterEstimate]
    verdict: Verdict
    reason: str
    samples: int
    velocity_range: tuple[float, float]
    reversals: int
    residual_rms: float | None = None
    validation: Validation | None = None
    positive_power_fraction: float | None = None
    terms: dict[str, TermVerdict] | None = None
    mean_load: float | None = None
    load_deviation: float | None = None
    mean_direction: Annotated[tuple[float, ...], Field(min_length=2, max_length=2)] | None = None
    ripple_per_turn: float | None = None
    mean_temperature: float | None = None
    presliding_travel: float | None = None
    curve: tuple[CurvePoint, ...] = ()
    position_range: tuple[float, float] | None = None
    correlation: tuple[tuple[float, ...], ...] | None = None
    torque_r2: TorqueR2 | None = None
    law: str = field(default="", repr=False, compare=False)

    def friction(
        self,
        velocity: ArrayLike,
        load: ArrayLike | None = None,
        temperature: ArrayLike = 0.0,
        position: ArrayLike | None = None,
        period: float | None = None,
    ) -> Array:
        """Return the friction torque of the law that was found [N m], of a prismatic joint [N].

        Of a joint whose friction drifts, it is that of the middle of the log; of one with presliding or bristles, that
        of steady motion, unless a period is given.

        Parameters
        ----------
        velocity
            [rad/s] or [m/s], of any shape.
        load
            Torque that the joint carries without friction [N m], of a shape that broadcasts with the velocity's; the
            mean one of the log if None. It changes nothing unless friction was found to grow with it (law "auto").
        temperature
            Above the joint's mean temperature in the log [K], likewise.
        position
            Of the joint [rad], likewise; if None, friction is the mean over the log's positions, without ripple. Where
            the log has not been, friction over position is that of the nearest position where it has.
        period
            From one velocity to the next [s], of a motion in the order of time along the first axis: friction then
            builds up after reversals, if the joint has presliding or bristles. At the beginning of the motion it has
            built up.

        Returns
        -------
        friction
            Shape of `velocity`; positive for positive velocity, offset included.

        Raises
        ------
        NothingIdentifiedError
            If the joint did not move enough.
        SettingsError
            If its law is not known here (see `register_law`).

        Examples
        --------
        >>> result.joints["elbow"].friction([-1.0, 0.0, 1.0]).round(2)
        array([-1.9, -0.4,  1.1])
        """
        speeds = np.asarray(velocity, dtype=np.float64)
        found = {name: parameter.value for name, parameter in self.parameters.items()}
        if self.verdict == "no friction":
            return np.full(speeds.shape, found.get("offset", 0.0))
        law = get_law(self.law)
        values = law_values(law, found)
        if values is None:
            raise NothingIdentifiedError(f"no friction was found of this joint: {self.reason}")
        carried = (self.mean_load or 0.0) if load is None else load
        if period is not None and isinstance(law, LawWithState):
            own = _along(law, speeds.reshape(len(speeds), -1), values, period).reshape(speeds.shape)
        else:
            own = law.torque(speeds.ravel(), values).reshape(speeds.shape)
        turned: tuple[ArrayLike, ArrayLike] = (0.0, 0.0)
        if position is not None and self.mean_direction:
            reached = np.clip(position, *self.position_range) if self.position_range else position
            turned = np.cos(reached) - self.mean_direction[0], np.sin(reached) - self.mean_direction[1]
        angle = None
        if position is not None and self.ripple_per_turn is not None:
            angle = self.ripple_per_turn * np.asarray(position)
        if period is not None and self.presliding_travel is not None and self.curve:
            flat, top = speeds.reshape(len(speeds), -1), self.curve[-1].velocity
            travels = np.full((1, flat.shape[1]), self.presliding_travel)
            lag = lag_behind(flat, period, SMOOTH_SIGN * top, travels)[0]
            own = own + found.get("presliding", 0.0) * lag.reshape(speeds.shape)
        return np.asarray(own + beyond_velocity(found, speeds, carried, temperature, *turned, angle))

    def band(self, velocity: Array, *, offset: bool = True) -> tuple[Array, Array | None] | None:
        """Compute the friction torque of the fitted law at the mean load, and its 95 % band.

        The band is by the delta method, `var R = J C J^T` with the covariance C of the parameters.

        Parameters
        ----------
        velocity
            [rad/s] or [m/s], shape (N,).
        offset
            Whether the offset is part of the torque.

        Returns
        -------
        friction, band
            [N m] or [N], shape (N,) and (2, N), the lower and the upper end; the band is None where no correlation is
            known. None where no law was fitted.
        """
        law, load = get_law(self.law), self.mean_load or 0.0
        found = {name: parameter.value for name, parameter in self.parameters.items()}
        values = law_values(law, found, load)
        if values is None:
            return None
        kept = np.array([offset or parameter.name != "offset" for parameter in law.parameters])
        torque = law.torque(velocity, values * kept)
        correlation = self.correlation_matrix()
        if correlation is None:
            return torque, None
        errors = np.array([parameter.standard_error for parameter in self.parameters.values()])
        J = (law.jacobian(velocity, values * kept) * kept) @ law_slopes(law, found, load) * errors
        variance = np.einsum("ni,ij,nj->n", J, correlation, J)
        half = self._errors_95(law) * np.sqrt(np.maximum(variance, 0.0))
        return torque, np.stack([torque - half, torque + half])

    def correlation_matrix(self) -> Array | None:
        """Return the correlation of the p parameters, shape (p, p); None if unknown or of another shape."""
        count, rows = len(self.parameters), self.correlation or ()
        return np.array(rows) if [len(row) for row in rows] == [count] * count else None

    def _errors_95(self, law: FrictionLaw) -> float:
        """Return the number of standard errors in half of a 95 % interval: larger, the fewer blocks the fit saw.

        The median over the parameters is used, since bounds cut off some ends.
        """
        logarithmic = {parameter.name for parameter in law.parameters if parameter.logarithmic}
        ratios = [
            max(found.interval_95[1] - found.value, found.value - found.interval_95[0]) / found.standard_error
            for name, found in self.parameters.items()
            if name not in logarithmic and found.standard_error > 0
        ]
        return float(np.median(ratios)) if ratios else 0.0


@dataclass(frozen=True, kw_only=True)
class CouplingResult(JointResult):
    """What the log says about friction R that acts on a sum of joint speeds.

    `joints` has the coefficients: with v_c = sum_j b_j v_j, it acts on joint j as b_j R(v_c).
    """

    joints: dict[str, float]


def velocity_grid(low: float, high: float, points: int = 31) -> Array:
    """Return velocities between two, dense around zero, where a friction law turns: about 3 `points` of them."""
    reach = max(abs(low), abs(high), 1e-300)  # smaller numbers have no thousandth
    near = np.geomspace(1e-3 * reach, 0.15 * reach, points // 2)
    grid = np.concatenate([np.linspace(low, high, 2 * points), -near, near, [0.0]])
    return np.unique(grid[(grid >= low) & (grid <= high)])


def _along(law: LawWithState, velocity: Array, values: Array, period: float) -> Array:
    """Return the friction torque along motions [N m], shape (T, n), that begin steadily."""
    begins = np.arange(len(velocity)) == 0
    motions = (Motion(velocity=own, period=period, begins=begins) for own in velocity.T)
    return np.column_stack([law.torque_along(motion, values) for motion in motions])


def law_values(law: FrictionLaw, found: Mapping[str, float], load: float = 0.0) -> Array | None:
    """Return the values of a law under a load [N m], in its order, shape (p,); None where some are missing."""
    if not found or any(p.neutral is None and p.name not in found for p in law.parameters):
        return None
    loaded = at_load(found, load) if load and "load" in found else found
    return np.array([loaded.get(p.name, p.neutral) for p in law.parameters], dtype=float)


def law_slopes(law: FrictionLaw, found: Mapping[str, float], load: float = 0.0) -> Array:
    """Return the derivatives of a law's values under a load [N m] by the k parameters found, shape (p, k)."""
    columns = []
    for name, value in found.items():
        step = STEP * max(abs(value), STEP)
        ends = [law_values(law, {**found, name: value + sign * step}, load) for sign in (1, -1)]
        columns.append((np.array(ends[0]) - np.array(ends[1])) / (2 * step))
    return np.column_stack(columns)


def at_load(values: Mapping[str, float], load: float) -> dict[str, float]:
    """Return parameters whose curve is that of a joint that carries a load [N m]: Coulomb friction is larger.

    The Stribeck effect, Fc S, is what it was, so that the gain S is smaller.
    """
    coulomb = values["coulomb"] + values.get("load", 0.0) * load
    changed = {**values, "coulomb": coulomb}
    if coulomb > 0 and "stribeck_gain" in values:
        changed["stribeck_gain"] = values["stribeck_gain"] * values["coulomb"] / coulomb
    return changed

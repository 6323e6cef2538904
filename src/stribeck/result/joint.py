"""Result of one joint: parameters with intervals and verdicts, friction curve, and friction torque."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from stribeck.base.frozen import freeze_dicts
from stribeck.base.text_table import TextTable, number, span
from stribeck.base.typing import Array
from stribeck.errors import NothingIdentifiedError, require_extra
from stribeck.friction import FrictionLaw, LawWithState, get_law
from stribeck.friction.auto import JUMP
from stribeck.friction.law import Motion
from stribeck.friction.terms.motion import beyond_velocity, drift, signals
from stribeck.result.parts import Count, Interval, Size

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Verdict = Literal["identified", "weak", "no friction", "not excited"]


def verdict_place(verdict: str) -> str:
    """Name the command that explains a verdict."""
    return f"stribeck explain {verdict.replace(' ', '-')}"


TermDecision = Literal["kept", "refused", "open"]


@dataclass(frozen=True, kw_only=True)
class ParameterEstimate:
    """A fitted parameter: value, standard error, 95 % interval, unit and verdict.

    `variance_shares` are the contributions to the squared standard error by name, with sum one; None if unknown.
    """

    value: float
    standard_error: Size
    interval_95: Interval
    unit: str
    verdict: Verdict
    variance_shares: dict[str, float] | None = None

    @property
    def half_width(self) -> float:
        """Half of the 95 % interval, measured on the side that is not clipped."""
        return max(self.interval_95[1] - self.value, self.value - self.interval_95[0])


@dataclass(frozen=True, kw_only=True)
class CurvePoint:
    """Torque that resists motion [N m], [N] at one speed [rad/s], [m/s]: mean of both directions, without the offset.

    Includes standard error, 95 % interval (clipped at zero) and unit. `interval_95` is about the friction in this log,
    `interval_next_log` about another log of the same robot, because temperature, load and wear change friction; None in
    files of earlier versions.
    """

    velocity: Size
    value: float
    standard_error: Size
    interval_95: Interval
    unit: str
    interval_next_log: Interval | None = None

    @property
    def half_width(self) -> float:
        """Half of the 95 % interval, measured upwards, where it is not clipped."""
        return self.interval_95[1] - self.value

    @property
    def between_logs(self) -> float:
        """Standard deviation of friction from log to log relative to the value [1]; zero if unknown."""
        if self.interval_next_log is None or self.value <= 0:
            return 0.0
        other, own = self.interval_next_log[1] - self.value, self.half_width
        return min(math.sqrt(max((other - own) * (other + own), 0.0)) / (1.96 * self.value), 1e3)


@dataclass(frozen=True, kw_only=True)
class Validation:
    """Root mean square of the unexplained friction torque on held-out blocks [N m]."""

    rms: Size
    rms_zero_friction: Size
    rms_coulomb_only: Size

    @property
    def unexplained(self) -> float:
        """Residual relative to the residual without friction [1]."""
        return self.rms / max(self.rms_zero_friction, 1e-300)


@dataclass(frozen=True, kw_only=True)
class TorqueR2:
    """Share of the variance of a joint's held-out torque that model and friction explain [1].

    `nominal` uses model and log as given; `corrected` includes the estimated corrections, None without any.
    1 - sum e^2 / sum (tau - mean tau)^2, with e = tau - inverse dynamics - R(v), at the bandwidth of the filter,
    over held-out samples of free and swinging limbs.
    """

    nominal: float
    corrected: float | None = None

    @property
    def best(self) -> float:
        """R² of the model for which the friction was estimated."""
        return self.nominal if self.corrected is None else self.corrected


@dataclass(frozen=True, kw_only=True)
class TermVerdict:
    """Decision on one term of a joint's friction, with its reason.

    A term is open if the log contains an effect that the term explains, but other terms explain it, too. `gain` is the
    reduction of χ² on held-out data and `gain_error` its standard error; None where the term could not be tried.
    """

    verdict: TermDecision
    reason: str
    gain: float | None = None
    gain_error: float | None = None

    def __post_init__(self) -> None:
        """Check that a gain has its error."""
        if (self.gain is None) != (self.gain_error is None):
            raise ValueError("a gain needs a gain_error, and the other way round")

    @property
    def kept(self) -> bool:
        """Whether the joint's friction includes the term."""
        return self.verdict == "kept"


@dataclass(frozen=True, kw_only=True, repr=False)
class JointResult:
    """Identification result of one joint. `parameters` is empty if the joint moved too little.

    - `verdict` refers to `curve`, the friction at slow, middle and top speed. For "no friction", the parameters are at
      most an offset and a rotor inertia.
    - `main_reason`, `remedy`: main clause of the reason, and what to do if the reason says so; None if unknown.
    - `terms` (law "auto"): decision on each term of the law.
    - `mean_load`, `load_deviation` (law "auto"): mean and standard deviation of the joint's load [N m].
    - `mean_direction` (law "auto"): means of cosine and sine of the position; None for a prismatic joint.
    - `ripple_per_turn`: periods per turn of the torque ripple; None without ripple.
    - `presliding_travel`: travel after a reversal within which `presliding` builds up [rad], [m]; None without it.
    - `mean_temperature`: mean temperature of the joint in the log [°C], for which the friction holds; None if unknown.
    - `position_range`: lowest and highest position in the log [rad], [m].
    - `correlation`: correlation of the parameters' errors, in their order, shape (p, p); None if nothing was fitted.
    - `torque_r2`: explained share of the held-out torque; None if nothing was held out.
    - `torque_unit`: unit of torques if torque constant or kp is unknown: "A", "rad" or "m"; None for N m and N.
    - `law`: name of the fitted law, set by the `Result` that contains the joint.
    - `measured`: velocity and friction torque of samples for plots, shape (N,) each; None after `read_result`.
    """

    parameters: dict[str, ParameterEstimate]
    verdict: Verdict
    reason: str
    samples: Count
    velocity_range: Interval
    reversals: Count
    main_reason: str | None = None
    remedy: str | None = None
    residual_rms: Size | None = None
    validation: Validation | None = None
    positive_power_fraction: Size | None = None
    terms: dict[str, TermVerdict] | None = None
    mean_load: float | None = None
    load_deviation: float | None = None
    mean_direction: Annotated[tuple[float, ...], Field(min_length=2, max_length=2)] | None = None
    ripple_per_turn: float | None = None
    mean_temperature: float | None = None
    presliding_travel: float | None = None
    curve: tuple[CurvePoint, ...] = ()
    position_range: Interval | None = None
    correlation: tuple[tuple[float, ...], ...] | None = None
    torque_r2: TorqueR2 | None = None
    torque_unit: str | None = None
    law: str = field(default="", repr=False, compare=False)
    measured: ClassVar[tuple[Array, Array] | None] = None

    def __post_init__(self) -> None:
        """Make dictionaries read-only."""
        freeze_dicts(self)

    @property
    def values(self) -> dict[str, float]:
        """Values of the parameters by name."""
        return {name: parameter.value for name, parameter in self.parameters.items()}

    @property
    def slides(self) -> bool:
        """Whether the units of the result are those of a prismatic joint."""
        units = {*(point.unit for point in self.curve), *(own.unit for own in self.parameters.values())}
        return any(unit in ("N", "m") or unit.endswith("s/m") for unit in units)

    def units(self, prismatic: bool | None = None) -> tuple[str, str]:
        """Return the units of velocity and torque; `prismatic` is by default as in `slides`."""
        slides = self.slides if prismatic is None else prismatic
        return "m/s" if slides else "rad/s", self.torque_unit or ("N" if slides else "N m")

    @property
    def unit_note(self) -> str:
        """Note on the unit of a joint without a known torque constant or kp, and the missing factor; "" for others."""
        factor = "torque constant and gear ratio" if self.torque_unit == "A" else "kp"
        return f"friction in {self.torque_unit}, multiply by {factor} for N m" if self.torque_unit else ""

    def friction(
        self,
        velocity: ArrayLike,
        load: ArrayLike | None = None,
        temperature: ArrayLike = 0.0,
        position: ArrayLike | None = None,
        period: float | None = None,
        *,
        offset: bool = False,
    ) -> Array:
        """Compute the friction torque of the fitted law [N m], [N].

        Friction that drifts is evaluated at the middle of the log. Presliding and bristles are evaluated for steady
        motion, unless a period is given.

        Parameters
        ----------
        velocity
            Joint velocity [rad/s] or [m/s], any shape.
        load
            Torque that the joint carries without friction [N m]; broadcasts with `velocity`. The mean of the log if
            None. Used only if the fitted friction depends on load (law "auto").
        temperature
            Temperature minus the joint's mean temperature in the log [K]; broadcasts with `velocity`.
        position
            Joint position [rad]; broadcasts with `velocity`. Positions are clipped to the range of the log. If None,
            friction is the mean over the log's positions, without ripple.
        period
            Sampling period [s] if `velocity` is a motion along the first axis. Presliding and bristles then build up
            after reversals; the motion starts with friction fully built up.
        offset
            Whether to add the torque offset, as in measured torques.

        Returns
        -------
        friction
            Friction torque with the shape of `velocity`, positive for positive velocity.

        Raises
        ------
        NothingIdentifiedError
            If the joint did not move enough.
        SettingsError
            If the law is not registered (see `register_law`).

        Examples
        --------
        >>> result.joints["elbow"].friction([-1.0, 0.0, 1.0]).round(2)
        array([-1.5,  0. ,  1.5])
        """
        speeds = np.asarray(velocity, dtype=np.float64)
        found = self.values
        if "offset" in found and not offset:
            found["offset"] = 0.0
        if self.verdict == "no friction":
            return np.full(speeds.shape, found.get("offset", 0.0))
        law = get_law(self.law)
        values = law_values(law, found)
        if values is None and "offset" in found:  # friction below the resolution of the log
            return np.full(speeds.shape, found["offset"])
        if values is None:
            raise NothingIdentifiedError(f"no friction was found of this joint: {self.reason}")
        if period is not None and isinstance(law, LawWithState):
            own = _along(law, speeds.reshape(len(speeds), -1), values, period).reshape(speeds.shape)
        else:
            own = law.torque(speeds.ravel(), values).reshape(speeds.shape)
        motion = signals(
            speeds,
            found.get("slope", JUMP),
            np.nan if position is None else position,
            self.position_range or (-np.inf, np.inf),
            self.mean_direction or (np.nan, np.nan),
            period,
            self.curve[-1].velocity if self.curve else np.nan,
            load=(self.mean_load or 0.0) if load is None else np.asarray(load),
            temperature=np.asarray(temperature),
        )
        return np.asarray(own + beyond_velocity(found, {**vars(self), **motion}))

    def between_logs(self, parameter: str) -> float:
        """Compute the standard deviation of a parameter from log to log relative to its value [1].

        All friction of a joint varies by one factor, as its curve does; offset, scales and rotor inertia do not.
        """
        varies = parameter != "offset" and self.parameters[parameter].unit.startswith("N")
        return varies * max((point.between_logs for point in self.curve), default=0.0)

    def __repr__(self) -> str:
        values = ", ".join(f"{name} {own.value:.4g} ± {own.half_width:.2g}" for name, own in self.parameters.items())
        return f"{type(self).__name__}({self.verdict}{'; ' * bool(values)}{values})"

    def _repr_html_(self) -> str:
        """Format the parameters as an HTML table for notebooks."""
        rows = [
            [name, number(own.value), number(own.standard_error), span(own.interval_95), own.unit, own.verdict]
            for name, own in self.parameters.items()
        ]
        numbers = ("value", "standard error", "95 % interval")
        title = f"{self.verdict}: {self.reason}"
        return TextTable(title=title, left=["parameter"], right=numbers, last=["unit", "verdict"], rows=rows).html()

    def plot(self, ax: Axes | None = None, *, offset: bool = False) -> Axes:
        """Draw friction torque versus velocity: the fitted curve, its 95 % band and the samples.

        Parameters
        ----------
        ax
            Matplotlib axes to draw on; new ones if None.
        offset
            Whether to include the torque offset.

        Examples
        --------
        >>> axes = result.joints["elbow"].plot()
        >>> axes.get_xlabel(), axes.get_ylabel()
        ('velocity [rad/s]', 'friction torque [N m]')
        """
        require_extra("plot", "matplotlib")
        from matplotlib import pyplot

        from stribeck.result.plot import draw_friction

        ax = ax or pyplot.subplots()[1]
        draw_friction(ax, self, offset=offset)
        return ax

    def band(self, velocity: Array, *, offset: bool = False) -> tuple[Array, Array | None] | None:
        """Compute the friction torque of the fitted law at the mean load, and its 95 % band.

        The band uses the delta method, `var R = J C J^T`, with the covariance C of the parameters. It contains a drift
        from the start of the log to its end.

        Parameters
        ----------
        velocity
            Joint velocity [rad/s] or [m/s], shape (N,).
        offset
            Whether to include the offset.

        Returns
        -------
        friction, band
            Torque, shape (N,), and lower and upper end of the band, shape (2, N) [N m] or [N]. The band is None if the
            correlation is unknown. None if no law was fitted.
        """
        law, load, found = get_law(self.law), self.mean_load or 0.0, self.values
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
        half = np.hypot(self._errors_95(law) * np.sqrt(np.maximum(variance, 0.0)), drift(found, velocity))
        return torque, np.stack([torque - half, torque + half])

    def correlation_matrix(self) -> Array | None:
        """Convert the correlation of the p parameters to an array, shape (p, p); None if unknown or malformed."""
        count, rows = len(self.parameters), self.correlation or ()
        return np.array(rows) if [len(row) for row in rows] == [count] * count else None

    def _errors_95(self, law: FrictionLaw) -> float:
        """Compute the number of standard errors in half of a 95 % interval, which depends on the number of blocks.

        It is the median over the parameters, because bounds clip some intervals.
        """
        logarithmic = {parameter.name for parameter in law.parameters if parameter.logarithmic}
        ratios = [
            found.half_width / found.standard_error
            for name, found in self.parameters.items()
            if name not in logarithmic and found.standard_error > 0
        ]
        return float(np.median(ratios)) if ratios else 0.0


@dataclass(frozen=True, kw_only=True, repr=False)
class CouplingResult(JointResult):
    """Identification result of friction R that acts on a sum of joint speeds.

    `joints` contains the coefficients b_j. With v_c = sum_j b_j v_j, the friction acts on joint j as b_j R(v_c).
    """

    joints: dict[str, float]


def _along(law: LawWithState, velocity: Array, values: Array, period: float) -> Array:
    """Compute the friction torque along motions that start with steady friction [N m], shape (T, n)."""
    begins = np.arange(len(velocity)) == 0
    motions = (Motion(velocity=own, period=period, begins=begins) for own in velocity.T)
    return np.column_stack([law.torque_along(motion, values) for motion in motions])


def law_values(law: FrictionLaw, found: Mapping[str, float], load: float = 0.0) -> Array | None:
    """Collect the parameter values of a law under a load [N m], in its order, shape (p,); None if any are missing."""
    if not found or any(p.neutral is None and p.name not in found for p in law.parameters):
        return None
    loaded = at_load(found, load) if load and "load" in found else found
    return np.array([loaded.get(p.name, p.neutral) for p in law.parameters], dtype=float)


def law_slopes(law: FrictionLaw, found: Mapping[str, float], load: float = 0.0) -> Array:
    """Compute the derivatives of a law's values under a load [N m] with respect to the k parameters, shape (p, k)."""
    columns = []
    for name, value in found.items():
        step = 1e-4 * max(abs(value), 1e-4)  # the values are nearly linear in the parameters
        ends = [law_values(law, {**found, name: value + sign * step}, load) for sign in (1, -1)]
        columns.append((np.array(ends[0]) - np.array(ends[1])) / (2 * step))
    return np.column_stack(columns)


def at_load(values: Mapping[str, float], load: float) -> dict[str, float]:
    """Compute the parameters of a joint that carries a load [N m], with larger Coulomb friction Fc.

    The Stribeck effect Fc S is constant, so the gain S decreases.
    """
    coulomb = values["coulomb"] + values.get("load", 0.0) * load
    changed = {**values, "coulomb": coulomb}
    if coulomb > 0 and "stribeck_gain" in values:
        changed["stribeck_gain"] = values["stribeck_gain"] * values["coulomb"] / coulomb
    return changed

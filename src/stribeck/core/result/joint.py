"""Result of one joint: parameters with intervals and verdicts, friction curve, and friction torque."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self, overload

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from stribeck.core.base.frozen import freeze_dicts
from stribeck.core.base.parts import SERVICES
from stribeck.core.base.text_table import TextTable, number, span
from stribeck.core.base.typing import Array
from stribeck.core.errors import NothingIdentifiedError
from stribeck.core.friction import FrictionLaw, LawWithState, get_law
from stribeck.core.friction.auto import JUMP
from stribeck.core.friction.terms.motion import beyond_velocity, drift, signals
from stribeck.core.result.estimates import CurvePoint, ParameterEstimate, TermVerdict, TorqueR2, Validation, Verdict
from stribeck.core.result.law_values import along_motion, law_slopes, law_values
from stribeck.core.result.parts import Count, Interval, Size

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, kw_only=True, repr=False)
class JointResult:
    """Identification result of one joint. `parameters` is empty if the joint moved too little.

    - `verdict` refers to `curve`, the friction at slow, middle and top speed. For "no friction", the parameters are at
      most an offset and a rotor inertia.
    - `main_reason`, `remedy`: main clause of the reason, and its remedy; None if unknown.
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

    def with_values(self, values: Mapping[str, float]) -> Self:
        """Replace values of parameters."""
        parameters = {name: replace(p, value=values.get(name, p.value)) for name, p in self.parameters.items()}
        return replace(self, parameters=parameters)

    @property
    def friction_r2(self) -> float | None:
        """Share of the friction torque's mean square that the law explains on held-out data [1]; None without friction.

        Limited to a law that is 1000 times worse than zero friction.
        """
        validation = self.validation if self.curve and self.verdict != "no friction" else None
        return None if validation is None else 1 - min(validation.unexplained, 1e3) ** 2

    @property
    def slides(self) -> bool:
        """Whether the units of the result are those of a prismatic joint."""
        units = {*(point.unit for point in self.curve), *(parameter.unit for parameter in self.parameters.values())}
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

    @overload
    def friction(self, velocity: float, *args: Any, **others: Any) -> float: ...

    @overload
    def friction(self, velocity: ArrayLike, *args: Any, **others: Any) -> Array: ...

    def friction(
        self,
        velocity: ArrayLike,
        load: ArrayLike | None = None,
        temperature: ArrayLike = 0.0,
        position: ArrayLike | None = None,
        period: float | None = None,
        *,
        offset: bool = False,
    ) -> Array | float:
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
            Friction torque with the shape of `velocity`, a number for a number; positive for positive velocity.

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
        >>> round(result.joints["elbow"].friction(1.0), 2)
        1.5
        """
        speeds = np.asarray(velocity, dtype=np.float64)
        parameters, nothing = self.values, self.verdict == "no friction"
        if nothing or "offset" in parameters:
            parameters["offset"] = parameters.get("offset", 0.0) * offset
        values = None if nothing else law_values(get_law(self.law), parameters)
        if values is None and "offset" not in parameters:
            raise NothingIdentifiedError(f"no friction was found of this joint: {self.reason}")
        if values is None:  # friction below the resolution of the log
            return _plain(np.full(speeds.shape, parameters["offset"]))
        law = get_law(self.law)
        if period is not None and isinstance(law, LawWithState):
            torque = along_motion(law, speeds.reshape(len(speeds), -1), values, period).reshape(speeds.shape)
        else:
            torque = law.torque(speeds.ravel(), values).reshape(speeds.shape)
        motion = signals(
            speeds,
            parameters.get("slope", JUMP),
            np.nan if position is None else position,
            self.position_range or (-np.inf, np.inf),
            self.mean_direction or (np.nan, np.nan),
            period,
            self.curve[-1].velocity if self.curve else np.nan,
            load=(self.mean_load or 0.0) if load is None else np.asarray(load),
            temperature=np.asarray(temperature),
        )
        return _plain(np.asarray(torque + beyond_velocity(parameters, {**vars(self), **motion})))

    def between_logs(self, parameter: str) -> float:
        """Compute the standard deviation of a parameter from log to log relative to its value [1].

        All friction of a joint varies by one factor, as its curve does; offset, scales and rotor inertia do not.
        """
        varies = parameter != "offset" and self.parameters[parameter].unit.startswith("N")
        return varies * max((point.between_logs for point in self.curve), default=0.0)

    def __repr__(self) -> str:
        values = ", ".join(f"{name} {p.value:.4g} ± {p.half_width:.2g}" for name, p in self.parameters.items())
        return f"{type(self).__name__}({self.verdict}{'; ' * bool(values)}{values})"

    def _repr_html_(self) -> str:
        """Format the parameters as an HTML table for notebooks."""
        rows = [
            [name, number(p.value), number(p.standard_error), span(p.interval_95), p.unit, p.verdict]
            for name, p in self.parameters.items()
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
        axes: Axes = SERVICES["plot_joint"](self, ax, offset)
        return axes

    def band(self, velocity: Array, *, offset: bool = False) -> tuple[Array, Array | None] | None:
        """Compute the friction torque of the fitted law at the mean load, and its 95 % band.

        The band uses the delta method, `var R = J C J^T`, with the covariance C of the parameters. It contains a drift
        from the start of the log to its end, and the intervals of `curve`.

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
        law, load, parameters = get_law(self.law), self.mean_load or 0.0, self.values
        values = law_values(law, parameters, load)
        if values is None:
            return None
        kept = np.array([offset or parameter.name != "offset" for parameter in law.parameters])
        torque = law.torque(velocity, values * kept)
        correlation = self.correlation_matrix()
        if correlation is None:
            return torque, None
        slopes = law_slopes(law, parameters, load) * [p.standard_error for p in self.parameters.values()]

        def half_width(speeds: Array) -> Array:
            J = (law.jacobian(speeds, values * kept) * kept) @ slopes
            variance = self._errors_95(law) ** 2 * np.einsum("ni,ij,nj->n", J, correlation, J)
            return np.asarray(np.hypot(np.sqrt(np.maximum(variance, 0.0)), drift(parameters, speeds)))

        half = half_width(velocity)
        if self.curve:
            speeds, ends = np.array([(point.velocity, point.interval_95[1] - point.value) for point in self.curve]).T
            wider = np.maximum(ends**2 - half_width(speeds) ** 2, 0.0)
            half = np.sqrt(half**2 + np.interp(np.abs(velocity), speeds, wider))
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
            parameter.half_width / parameter.standard_error
            for name, parameter in self.parameters.items()
            if name not in logarithmic and parameter.standard_error > 0
        ]
        return float(np.median(ratios)) if ratios else 0.0


def _plain(values: Array) -> Array | float:
    """Convert an array without dimensions to a number."""
    return values if values.ndim else float(values)


@dataclass(frozen=True, kw_only=True, repr=False)
class CouplingResult(JointResult):
    """Identification result of friction R that acts on a sum of joint speeds.

    `joints` contains the coefficients b_j. With v_c = sum_j b_j v_j, the friction acts on joint j as b_j R(v_c).
    """

    joints: dict[str, float]

"""What was found: the content of result.json."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NotRequired

import numpy as np
from numpy.typing import ArrayLike
from pydantic import TypeAdapter, ValidationError
from pydantic_core import from_json
from typing_extensions import TypedDict

from stribeck.errors import NothingIdentifiedError, SettingsError
from stribeck.friction import FrictionLaw, get_law
from stribeck.friction.assembled import beyond_velocity
from stribeck.result.tables import html_table, parameter_rows, verdict_counts
from stribeck.samples import Samples
from stribeck.settings import describe
from stribeck.typing import Array

if TYPE_CHECKING:
    import pandas

SCHEMA = 1
Verdict = Literal["identified", "weak", "not excited"]
TermDecision = Literal["kept", "refused", "open"]


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
class Validation:
    """Root mean square of the friction torque not explained, on blocks that no fit saw [N m]."""

    rms: float
    rms_zero_friction: float
    rms_coulomb_only: float


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

    Of the law "auto", `terms` says which of them the joint has, and `mean_load` is the torque that it carries [N m].
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
    law: str = field(default="", repr=False, compare=False)

    def friction(self, velocity: ArrayLike, load: ArrayLike | None = None, temperature: ArrayLike = 0.0) -> Array:
        """Return the friction torque of the law that was found [N m], of a prismatic joint [N].

        Of a joint whose friction drifts, it is that of the middle of the log.

        Parameters
        ----------
        velocity
            [rad/s] or [m/s], of any shape.
        load
            Torque that the joint carries without friction [N m], of a shape that broadcasts with the velocity's; the
            mean one of the log if None. It changes nothing unless friction was found to grow with it (law "auto").
        temperature
            Above the joint's mean temperature in the log [K], likewise.

        Returns
        -------
        friction
            Shape of `velocity`; positive for positive velocity, offset included.

        Raises
        ------
        NothingIdentifiedError
            If the joint has no numbers.
        SettingsError
            If its law is not known here (see `register_law`).

        Examples
        --------
        >>> result.joints["elbow"].friction([-1.0, 0.0, 1.0]).round(2)
        array([-1.9, -0.4,  1.1])
        """
        law, speeds = get_law(self.law), np.asarray(velocity, dtype=np.float64)
        found = {name: parameter.value for name, parameter in self.parameters.items()}
        values = law_values(law, found)
        if values is None:
            raise NothingIdentifiedError(f"no friction was found of this joint: {self.reason}")
        carried = (self.mean_load or 0.0) if load is None else load
        own = law.torque(speeds.ravel(), values).reshape(speeds.shape)
        return np.asarray(own + beyond_velocity(found, speeds, carried, temperature))


def law_values(law: FrictionLaw, found: Mapping[str, float], load: float = 0.0) -> Array | None:
    """Return the values of a law under a load [N m], in its order, shape (p,); None where some are missing."""
    if not found or any(p.neutral is None and p.name not in found for p in law.parameters):
        return None
    loaded = at_load(found, load) if load and "load" in found else found
    return np.array([loaded.get(p.name, p.neutral) for p in law.parameters], dtype=float)


def at_load(values: Mapping[str, float], load: float) -> dict[str, float]:
    """Return parameters whose curve is that of a joint that carries a load [N m]: Coulomb friction is larger.

    The Stribeck effect, Fc S, is what it was, so that the gain S is smaller.
    """
    coulomb = values["coulomb"] + values.get("load", 0.0) * load
    changed = {**values, "coulomb": coulomb}
    if coulomb > 0 and "stribeck_gain" in values:
        changed["stribeck_gain"] = values["stribeck_gain"] * values["coulomb"] / coulomb
    return changed


@dataclass(frozen=True, kw_only=True)
class BodyCorrection:
    """What the log says about a body's inertia; before and after, in the frame of the joint that carries the body.

    `inertia` is Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the centre of mass [kg m^2]. `known` is the share of the prior
    variance of the body that the log removes, from 0 to 1.
    """

    mass: tuple[float, float]
    mass_error: float
    centre_of_mass: tuple[tuple[float, ...], tuple[float, ...]]
    centre_of_mass_error: tuple[float, ...]
    inertia: tuple[tuple[float, ...], tuple[float, ...]]
    known: float


@dataclass(frozen=True, kw_only=True)
class Corrections:
    """What a whole log says beside friction.

    `chi_square` is the squared error over what it was taken to be; near 1 if all is well. `disagreement` is the
    heterogeneity over folds, the same for differences between parts of the log about the model; above 1 the prior is
    given more weight. Gains [1] and zeros [rad] are (value, standard error), to be taken off.
    """

    chi_square: float
    disagreement: float = 1.0
    bodies: dict[str, BodyCorrection] = field(default_factory=dict)
    torque_gain: dict[str, tuple[float, float]] = field(default_factory=dict)
    encoder_zero: dict[str, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class LogSummary:
    """Which log, and how much of it was used; for several logs `path` and `sha256` are lists."""

    path: str | list[str]
    sha256: str | list[str]
    duration: float
    rate: float
    samples_used: int


@dataclass(frozen=True, eq=False, kw_only=True)
class Evidence:
    """What the report draws beside the numbers; not part of result.json.

    Attributes
    ----------
    samples
        The friction torque samples that were kept; the torque of a fitted rotor inertia is taken out of them.
    covariance
        Per joint, of the fitted parameters in the order of `JointResult.parameters`.
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
    """

    samples: Samples
    covariance: dict[str, Array]
    phases: list[tuple[float, float, str, bool]]
    close_up: Samples | None
    provenance: list[tuple[str, str]]
    notes: list[str] = field(default_factory=list)
    prismatic: frozenset[str] = frozenset()
    correction: tuple[Samples, Samples] | None = None


@dataclass(frozen=True, kw_only=True)
class Result:
    """The whole finding; `result.json` is this without `evidence`.

    Examples
    --------
    >>> result
    Result('arm', law stribeck, method curve-fit, 3 joints: 3 identified)
    >>> found = result.joints["elbow"].parameters["coulomb"]
    >>> round(found.value, 2), found.unit, found.verdict
    (1.2, 'N m', 'identified')
    """

    robot: str
    log: LogSummary
    law: str
    method: str
    joints: dict[str, JointResult]
    warnings: list[str]
    stribeck: str
    corrections: Corrections | None = None
    schema: int = SCHEMA
    evidence: Evidence | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Tell every joint the law, so that it can say its friction."""
        joints = {name: replace(joint, law=self.law) for name, joint in self.joints.items()}
        object.__setattr__(self, "joints", joints)

    def __repr__(self) -> str:
        return f"Result({self.robot!r}, law {self.law}, method {self.method}, {verdict_counts(self)})"

    def _repr_html_(self) -> str:
        """Return a table of the joints, for notebooks."""
        return html_table(self)

    def to_dataframe(self) -> pandas.DataFrame:
        """Return a pandas table with a row for each parameter of each joint, and one for a joint without any.

        Columns: joint, parameter, value, standard_error, low and high (the ends of the 95 % interval), unit, verdict,
        joint_verdict, reason. A joint without numbers has None or NaN from `parameter` to `verdict`.

        Raises
        ------
        SettingsError
            If pandas is not installed.

        Examples
        --------
        >>> table = result.to_dataframe()
        >>> table[table.joint == "elbow"].parameter.to_list()
        ['viscous', 'coulomb', 'stribeck_gain', 'stribeck_velocity', 'offset', 'slope']
        """
        try:
            import pandas
        except ImportError as error:
            raise SettingsError("to_dataframe: pandas is not installed; expected it: pip install pandas") from error
        return pandas.DataFrame(parameter_rows(self))

    def to_json(self) -> str:
        """Return the text of result.json."""
        document = {
            "schema": self.schema,
            "stribeck": self.stribeck,
            "robot": self.robot,
            "log": asdict(self.log),
            "law": self.law,
            "method": self.method,
            "joints": {name: _joint_to_plain(joint) for name, joint in self.joints.items()},
            **({"corrections": asdict(self.corrections)} if self.corrections else {}),
            "warnings": self.warnings,
        }
        return json.dumps(document, indent=2, allow_nan=False) + "\n"


def read_result(path: str | Path) -> Result:
    """Read a result.json.

    Raises
    ------
    SettingsError
        If the file is not a result of a schema that this version reads.

    Examples
    --------
    >>> read_result("out/result.json") == result
    True
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
        document = from_json(text)
    except OSError as error:
        raise SettingsError(f"{path}: cannot be read ({error.strerror}); expected a result.json") from error
    except ValueError as error:
        raise SettingsError(f"{path}: is not JSON ({error}); expected a result.json") from error
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        found = document.get("schema") if isinstance(document, dict) else type(document).__name__
        raise SettingsError(f"{path}: key 'schema' is {found!r:.80}; this version reads schema {SCHEMA}")
    try:
        return Result(**TypeAdapter(_Document).validate_json(text, strict=True))
    except ValidationError as error:
        raise SettingsError(f"{path}: {describe(error)}; expected a result.json") from error


class _Document(TypedDict):
    """What result.json holds."""

    schema: int
    stribeck: str
    robot: str
    log: LogSummary
    law: str
    method: str
    joints: dict[str, JointResult]
    corrections: NotRequired[Corrections]
    warnings: list[str]


def _joint_to_plain(joint: JointResult) -> dict[str, Any]:
    """Return a joint as plain data; what only some laws or methods have is left out of others."""
    plain = asdict(joint)
    del plain["law"]  # the result's
    for parameter in plain["parameters"].values():
        if parameter["variance_shares"] is None:
            del parameter["variance_shares"]
    return {key: value for key, value in plain.items() if value is not None or key not in ("terms", "mean_load")}

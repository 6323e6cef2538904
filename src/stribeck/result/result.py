"""What was found: the content of result.json."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NotRequired

from pydantic import TypeAdapter, ValidationError
from pydantic_core import from_json
from typing_extensions import TypedDict

from stribeck.base.files import read_text
from stribeck.base.finding import Finding
from stribeck.errors import SettingsError
from stribeck.result.joint import CouplingResult, JointResult
from stribeck.result.parts import Corrections, Evidence, HeldOutLog
from stribeck.result.tables import html_table, parameter_rows, verdict_counts
from stribeck.settings import describe

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

SCHEMA = 1


@dataclass(frozen=True, kw_only=True)
class LogSummary:
    """Which log, and how much of it was used; for several logs `path` and `sha256` are lists.

    `samples` is how many there are on the even clock, without those that gaps and missing values cost; 0 if not known.
    """

    path: str | list[str]
    sha256: str | list[str]
    duration: float
    rate: float
    samples_used: int
    samples: int = 0

    @property
    def usage(self) -> str:
        """How many samples a fit may use, of how many, in words."""
        if not self.samples:
            return f"{self.samples_used:,} samples used"
        share = 100 * self.samples_used / self.samples
        return f"{self.samples_used:,} of {self.samples:,} samples used ({share:.0f} %)"


@dataclass(frozen=True, kw_only=True)
class Result:
    """The whole result; `result.json` is this without `evidence`.

    `findings` say in parts what `warnings` say in one line each: joints, evidence and cure.

    Examples
    --------
    >>> result
    Result('arm', law auto, method whole-log, 3 joints: 3 identified)
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
    couplings: dict[str, CouplingResult] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    corrections: Corrections | None = None
    held_out: list[HeldOutLog] = field(default_factory=list)
    schema: int = SCHEMA
    evidence: Evidence | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Tell every joint the law, so that it can say its friction."""
        for of in ("joints", "couplings"):
            found = {name: replace(joint, law=self.law) for name, joint in getattr(self, of).items()}
            object.__setattr__(self, of, found)

    @property
    def all_friction(self) -> dict[str, JointResult]:
        """Joints, and couplings behind them."""
        return {**self.joints, **self.couplings}

    @property
    def warning_lines(self) -> list[str]:
        """The warnings, those of findings with the place where their check is explained."""
        explained = {str(finding): finding.line for finding in self.findings}
        return [explained.get(warning, warning) for warning in self.warnings]

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
        columns = ("joint", "parameter", "value", "standard_error", "low", "high", "unit", "verdict")
        return pandas.DataFrame(parameter_rows(self), columns=[*columns, "joint_verdict", "reason"])

    def plot(self) -> Figure:
        """Draw the friction curve of every joint with its 95 % band, and return the Matplotlib figure.

        Examples
        --------
        >>> result.plot().savefig("friction.png")
        """
        from stribeck.result.plot import friction_figure

        return friction_figure(self.all_friction)

    def to_json(self) -> str:
        """Return the text of result.json."""
        plain = asdict(replace(self, evidence=None))
        for kind in ("joints", "couplings"):
            plain[kind] = {name: _joint_to_plain(joint) for name, joint in plain[kind].items()}
        optional = ("couplings", "corrections", "held_out", "findings")
        document = {key: plain[key] for key in _Document.__annotations__ if plain[key] or key not in optional}
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
    text = read_text(Path(path), "a result.json", SettingsError)
    try:
        document = from_json(text)
        json.dumps(document, allow_nan=False)  # or it is no JSON: what is not finite, or becomes infinite
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
    couplings: NotRequired[dict[str, CouplingResult]]
    corrections: NotRequired[Corrections]
    held_out: NotRequired[list[HeldOutLog]]
    warnings: list[str]
    findings: NotRequired[list[Finding]]


def _joint_to_plain(plain: dict[str, Any]) -> dict[str, Any]:
    """Remove the law, which is the result's, and what only some laws or methods have from a joint without it."""
    always = ("residual_rms", "validation", "positive_power_fraction")
    for parameter in plain["parameters"].values():
        if parameter["variance_shares"] is None:
            del parameter["variance_shares"]
    return {key: value for key, value in plain.items() if key != "law" and (value is not None or key in always)}

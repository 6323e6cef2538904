"""Result of an identification: the content of result.json."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NotRequired

from pydantic import Field, TypeAdapter, ValidationError
from pydantic_core import from_json
from typing_extensions import TypedDict

from stribeck.core.base.checked_table import describe
from stribeck.core.base.files import read_text
from stribeck.core.base.finding import Finding
from stribeck.core.base.frame import data_frame
from stribeck.core.base.frozen import freeze_dicts
from stribeck.core.base.outputs import whole_or_not_at_all
from stribeck.core.base.parts import SERVICES
from stribeck.core.base.text_table import aligned
from stribeck.core.errors import SettingsError, UnknownJointError, did_you_mean, listed
from stribeck.core.result.joint import CouplingResult, JointResult
from stribeck.core.result.parts import Corrections, Count, Evidence, HeldOutLog, Size
from stribeck.core.result.tables import (
    joint_rows,
    logs_text,
    parameter_rows,
    result_table,
    summary_rows,
    verdict_counts,
)

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

    from stribeck.core.base.typing import Array
    from stribeck.core.log import LogLike
    from stribeck.core.result.posterior import Posterior
    from stribeck.core.robot import Robot

SCHEMA = 1
LARGEST = 1e300
"""Largest number of a result.json, so that sums are finite."""


@dataclass(frozen=True, kw_only=True)
class LogSummary:
    """Log of a result and its used part; for several logs, `path` and `sha256` are lists.

    `samples` is the number after resampling, without gaps and missing values; 0 if unknown.
    """

    path: str | list[str]
    sha256: str | list[str]
    duration: Size
    rate: Annotated[float, Field(ge=1e-6, le=1e9)]
    samples_used: Count
    samples: Count = 0

    def __post_init__(self) -> None:
        """Check that each log has one hash."""
        if len(self.paths) != len([self.sha256] if isinstance(self.sha256, str) else self.sha256):
            raise ValueError("path and sha256 name different numbers of logs")

    @property
    def paths(self) -> list[str]:
        """Paths of the logs."""
        return [self.path] if isinstance(self.path, str) else self.path

    @property
    def usage(self) -> str:
        """Phrase on the number of samples whose friction torque is known; methods can use more of the log."""
        if not self.samples:
            return f"friction torque known in {self.samples_used:,} samples"
        share = 100 * self.samples_used / self.samples
        return f"friction torque known in {self.samples_used:,} of {self.samples:,} samples ({share:.0f} %)"


@dataclass(frozen=True, kw_only=True)
class FileStamp:
    """Full path of a file, and its hash."""

    path: str
    sha256: str


@dataclass(frozen=True, kw_only=True)
class Result(Mapping[str, JointResult]):
    """Result of an identification; `result.json` contains all but `evidence`.

    A mapping from the names of joints and couplings to their results. `findings` are structured (check, joints, text,
    remedy). `robot_file` is None for a robot without a file. `path` is the result.json that the result was read from.

    Examples
    --------
    >>> result
    Result('arm', law auto, method whole-log, 3 joints: 3 identified)
    >>> found = result["elbow"].parameters["coulomb"]
    >>> round(found.value, 2), found.unit, found.verdict
    (1.2, 'N m', 'identified')
    >>> list(result)
    ['shoulder', 'elbow', 'slide']
    """

    robot: str
    log: LogSummary
    law: str
    method: str
    joints: dict[str, JointResult]
    stribeck: str
    couplings: dict[str, CouplingResult] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    corrections: Corrections | None = None
    held_out: list[HeldOutLog] = field(default_factory=list)
    robot_file: FileStamp | None = None
    schema: int = SCHEMA
    evidence: Evidence | None = field(default=None, repr=False, compare=False)
    path: str = field(default="", repr=False, compare=False)

    def __post_init__(self) -> None:
        """Give every joint its law and measured samples; make dictionaries read-only."""
        measured = self.evidence.measured if self.evidence else {}
        for of in ("joints", "couplings"):
            joints = {name: replace(joint, law=self.law) for name, joint in getattr(self, of).items()}
            object.__setattr__(self, of, joints)
            for name in joints.keys() & measured:
                object.__setattr__(joints[name], "measured", measured[name])
        freeze_dicts(self)

    def __getitem__(self, name: str) -> JointResult:
        """Return the result of a joint or coupling; raises UnknownJointError."""
        if name not in self.all_friction:
            where, names = self.path or self.robot, list(self)
            has = f"it has {listed(names, 40)}{did_you_mean(str(name), names)}"
            raise UnknownJointError(f"{where}: the result has no joint '{name}'; {has}")
        return self.all_friction[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.all_friction)

    def __len__(self) -> int:
        return len(self.all_friction)

    @property
    def all_friction(self) -> dict[str, JointResult]:
        """Joints, followed by couplings."""
        return {**self.joints, **self.couplings}

    @cached_property
    def posterior(self) -> Posterior:
        """Joint distribution of the parameters of all joints and bodies.

        Examples
        --------
        >>> place = result.posterior.names.index("elbow.coulomb")
        >>> bool(result.posterior.mean[place] == result.joints["elbow"].values["coulomb"])
        True
        """
        from stribeck.core.result.posterior import posterior_of

        return posterior_of(self.all_friction, self.corrections)

    @property
    def covariance(self) -> pandas.DataFrame:
        """Covariance of all parameters of joints and bodies, with their names as rows and columns.

        Raises
        ------
        SettingsError
            If pandas is not installed; `posterior` has the same numbers as an array.

        Examples
        --------
        >>> coulomb, viscous = "elbow.coulomb", "elbow.viscous"
        >>> bool(result.covariance.loc[coulomb, viscous] < 0)
        True
        """
        return data_frame("covariance", self.posterior.covariance, self.posterior.names, self.posterior.names)

    def find_robot(self, robot: Robot | str | Path | None = None) -> Robot:
        """Return a robot, read from its file if a path is given; None stands for the robot file of the identification.

        That file is looked for at its path, and next to the result.json.

        Raises
        ------
        SettingsError
            If the robot file is unknown, does not exist, or has changed since.
        RobotFileError
            If the robot file cannot be used.
        """
        found: Robot = SERVICES["find_robot"](self, robot)
        return found

    def predict(self, log: LogLike, robot: Robot | str | Path | None = None, *, offset: bool = False) -> Array:
        """Compute the friction torque along the motion of a log, with its loads, positions and temperatures.

        Parameters
        ----------
        log
            Log, its path, or a frame.
        robot
            Robot, or the path of its robot file; by default that of the identification (see `find_robot`).
        offset
            Whether to add the torque offsets, as in measured torques.

        Returns
        -------
        friction
            Friction torque [N m], [N] at each sample of the log and of each joint of `joints`, shape (m, k). NaN at the
            ends, in gaps, on standing legs, and for joints without friction.

        Raises
        ------
        RobotFileError, LogError, SettingsError
            As for `identify`.

        Examples
        --------
        >>> result.predict(log).shape == log.torque.shape
        True
        """
        friction: Array = SERVICES["friction_of_log"](self, log, robot)[0]
        return friction - [(not offset) * joint.values.get("offset", 0.0) for joint in self.joints.values()]

    def score(self, log: LogLike, robot: Robot | str | Path | None = None) -> float:
        """Compute the mean of `scores` over the joints: 1 is perfect; 0 is as good as a constant friction torque.

        Examples
        --------
        >>> result.score("log.npz") > 0.95
        True
        """
        scores = self.scores(log, robot).values()
        return sum(scores) / len(scores) if scores else float("nan")

    def scores(self, log: LogLike, robot: Robot | str | Path | None = None) -> dict[str, float]:
        """Compute R² of the measured friction torque of a log by joint: 1 - sum (R - predicted)² / sum (R - mean R)².

        R is the torque minus that of the model's motion and of fitted rotors. Only samples of moving joints of swinging
        limbs count, and no joints without friction. The arguments are those of `predict`.

        Examples
        --------
        >>> list(result.scores(log))
        ['shoulder', 'elbow', 'slide']
        """
        scores: dict[str, float] = SERVICES["friction_of_log"](self, log, robot)[1]
        return scores

    @property
    def warnings(self) -> list[str]:
        """Findings as one line each."""
        return [str(finding) for finding in self.findings]

    def __repr__(self) -> str:
        return f"Result({self.robot!r}, law {self.law}, method {self.method}, {verdict_counts(self.joints)})"

    def _repr_html_(self) -> str:
        """Format the joints as an HTML table for notebooks."""
        title = f"{self.robot}: law {self.law}, method {self.method}, {verdict_counts(self.joints)}"
        return result_table(title, self.all_friction).html()

    def to_dataframe(self, rows: Literal["parameters", "joints"] = "parameters") -> pandas.DataFrame:
        """Convert to a pandas table.

        Parameters
        ----------
        rows
            "parameters" for one row per parameter, and one per joint without parameters: joint, parameter, value,
            standard_error, low and high (the ends of the 95 % interval), unit, verdict, joint_verdict. Joints without
            parameters have None or NaN from `parameter` to `verdict`. "joints" for one row per joint: joint,
            verdict, reason, next_step, r2 of the torque and friction_r2 (held out), and friction, low, high, unit,
            low_next_log, high_next_log (the interval for another log of the robot) and velocity at middle speed.

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
        if rows == "joints":
            return data_frame("to_dataframe", joint_rows(self.all_friction))
        columns = ("joint", "parameter", "value", "standard_error", "low", "high", "unit", "verdict", "joint_verdict")
        return data_frame("to_dataframe", parameter_rows(self.all_friction), columns)

    def plot(self, *, offset: bool = False) -> Figure:
        """Draw the friction curve of every joint with its 95 % band, and return the Matplotlib figure.

        `offset` includes the torque offsets.

        Examples
        --------
        >>> result.plot().savefig("friction.png")
        """
        figure: Figure = SERVICES["plot_joints"](self.all_friction, offset)
        return figure

    def summary(self) -> str:
        """Format one line per joint: friction at middle speed, Coulomb and viscous friction, verdict and next step."""
        between = logs_text(self.corrections, self.log.paths)
        return "\n".join([repr(self), *aligned(summary_rows(self.all_friction)), *([between] if between else [])])

    def save(self, path: str | Path) -> None:
        """Write result.json, completely or not at all; an existing file is replaced."""
        with whole_or_not_at_all(path) as temporary:
            temporary.write_text(self.to_json(), encoding="utf-8")

    def to_json(self) -> str:
        """Format the content of result.json."""
        plain = asdict(replace(self, evidence=None)) | {"warnings": self.warnings}
        for kind in ("joints", "couplings"):
            plain[kind] = {name: _joint_to_plain(joint) for name, joint in plain[kind].items()}
        optional = ("couplings", "corrections", "held_out", "findings", "robot_file")
        document = {key: plain[key] for key in _Document.__annotations__ if plain[key] or key not in optional}
        return json.dumps(document, indent=2, allow_nan=False) + "\n"


def read_result(path: str | Path) -> Result:
    """Read a result.json, or the one in an output folder of `stribeck identify`.

    Raises
    ------
    SettingsError
        If the file is not a result, or its schema is not supported.

    Examples
    --------
    >>> read_result("out") == result
    True
    """
    path = Path(path, "result.json") if Path(path).is_dir() else Path(path)
    text = read_text(path, "a result.json", SettingsError)
    try:
        document = from_json(text)
        json.dumps(document, allow_nan=False)  # JSON has no infinity or NaN
    except ValueError as error:
        raise SettingsError(f"{path}: is not JSON ({error}); expected a result.json") from error
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        schema = document.get("schema") if isinstance(document, dict) else type(document).__name__
        raise SettingsError(f"{path}: key 'schema' is {schema!r:.80}; this version reads schema {SCHEMA}")
    if (largest := _largest(document)) > LARGEST:
        raise SettingsError(f"{path}: contains the number {largest:.3g}; expected numbers up to {LARGEST:g}")
    try:
        corrections = document.get("corrections")
        if isinstance(corrections, dict) and corrections.pop("correlations", ...) is not ...:  # of earlier versions
            text = json.dumps(document)
        content: dict[str, Any] = {**TypeAdapter(_Document).validate_json(text, strict=True)}
        del content["warnings"]  # the findings as text
        return Result(**content, path=str(path))
    except ValidationError as error:
        raise SettingsError(f"{path}: {describe(error)}; expected a result.json") from error


def _largest(plain: Any) -> float:
    """Find the largest absolute value in plain data, at any depth; 0 without numbers."""
    if isinstance(plain, dict | list):
        return max(map(_largest, plain.values() if isinstance(plain, dict) else plain), default=0.0)
    return float(min(abs(plain), 10**308)) if isinstance(plain, int | float) else 0.0


class _Document(TypedDict):
    """Content of result.json."""

    schema: int
    stribeck: str
    robot: str
    robot_file: NotRequired[FileStamp]
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
    """Remove the law, which the result states, and empty fields of certain laws and methods."""
    always = ("residual_rms", "validation", "positive_power_fraction")
    for parameter in plain["parameters"].values():
        if parameter["variance_shares"] is None:
            del parameter["variance_shares"]
    return {key: value for key, value in plain.items() if key != "law" and (value is not None or key in always)}

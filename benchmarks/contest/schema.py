"""Files of the benchmark: input and answer of a contestant, and the hidden ground truth.

    cases/<robot>/<condition>/   case.json, robot.toml, the model, the logs, and predict.npz of real robots
    truth/<robot>/<condition>/   truth.json, and torque.npz of real robots
    SHA256SUMS                   checksums of all files for `sha256sum --check`

Logs are NumPy arrays (npz) with the names, units and orders of docs/logs.md.
"""

import hashlib
from pathlib import Path
from typing import Annotated, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from stribeck.core.base.checked_table import describe
from stribeck.core.base.files import read_text
from stribeck.core.base.outputs import whole_or_not_at_all
from stribeck.core.errors import SettingsError

CASE, TRUTH, ANSWER = "case.json", "truth.json", "answer.json"
PREDICT, TORQUE = "predict.npz", "torque.npz"
SUMS = "SHA256SUMS"
PARAMETERS = ("coulomb", "viscous", "offset")

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Need = Literal["contact flags", "foot wrenches", "IMU", "fixed base", "velocities", "accelerations"]


class Table(BaseModel):
    """Base class of the files' tables, which rejects unknown keys and wrong types."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Asked(Table):
    """Query for one joint: velocities of its friction curve [rad/s], and its load [N m]."""

    velocity: list[Finite]
    load: NonNegative


class Case(Table):
    """Input of a contestant in addition to the logs, the robot file and the model.

    `band` is the frequency up to which predicted torques are compared [Hz], `predict` the file of the motion whose
    torques are to be predicted. Both are None if the friction is known.
    """

    benchmark: Literal[1] = 1
    robot: str
    condition: str
    base: Literal["floating", "fixed"]
    seconds: Positive
    rate: Positive
    logs: list[str]
    joints: dict[str, Asked]
    predict: str | None = None
    band: Positive | None = None


class KnownFriction(Table):
    """True friction of one joint: parameters [N m], [N m s/rad], and R(v) without offset at the queried velocities."""

    coulomb: Positive
    viscous: Positive
    offset: Finite
    curve: list[Finite]


class Truth(Table):
    """Ground truth of a case; `joints` is empty if held-out torques replace the truth."""

    benchmark: Literal[1] = 1
    says: str
    joints: dict[str, KnownFriction] = {}


class Estimate(Table):
    """Estimated number; `good` is false if the method itself marks the number as unreliable."""

    value: Finite
    standard_error: NonNegative | None = None
    interval_95: tuple[Finite, Finite] | None = None
    good: bool = True


class JointAnswer(Table):
    """Answer for one joint; missing numbers count as blank, not as zero.

    `curve` is R(v) without offset [N m] at the queried velocities. If it is missing, Coulomb and viscous friction
    determine the curve.
    """

    coulomb: Estimate | None = None
    viscous: Estimate | None = None
    offset: Estimate | None = None
    curve: list[Finite] | None = None


class Answer(Table):
    """Answer of a contestant; `blank` is the reason for a missing answer or for missing joints."""

    benchmark: Literal[1] = 1
    method: str
    version: str
    needs: list[Need] = []
    joints: dict[str, JointAnswer] = {}
    blank: str | None = None


Content = TypeVar("Content", bound=Table)


def read(kind: type[Content], path: Path) -> Content:
    """Read a file of the benchmark.

    Raises
    ------
    SettingsError
        If the file is missing or invalid; the message names the place and valid values.
    """
    try:
        return kind.model_validate_json(read_text(path, f"{path.name} of the benchmark", SettingsError))
    except ValidationError as error:
        raise SettingsError(f"{path}: {describe(error, kind)}") from error


def write(content: Table, path: Path) -> None:
    """Write a file of the benchmark, completely or not at all."""
    with whole_or_not_at_all(path) as temporary:
        temporary.write_text(content.model_dump_json(indent=1, exclude_none=True) + "\n", encoding="utf-8")


def folders_of(folder: Path, robot: str, condition: str) -> tuple[Path, Path]:
    """Create the folders of a case and of its ground truth."""
    cases, truth = (folder / part / robot / condition for part in ("cases", "truth"))
    for each in (cases, truth):
        each.mkdir(parents=True, exist_ok=True)
    return cases, truth


def check_answer(answer: Answer, case: Case, path: Path) -> None:
    """Check that an answer contains only queried joints and curves of the right length.

    Raises
    ------
    SettingsError
        If it contains others.
    """
    for joint, found in answer.joints.items():
        if joint not in case.joints:
            raise SettingsError(f"{path}: joint '{joint}' was not asked for; expected {', '.join(case.joints)}")
        points = len(case.joints[joint].velocity)
        if found.curve is not None and len(found.curve) != points:
            raise SettingsError(
                f"{path}: the curve of joint '{joint}' has {len(found.curve)} values; expected {points}, one a velocity"
            )


def checksums(folder: Path) -> str:
    """Compute the lines of SHA256SUMS for all files of a benchmark."""
    files = sorted(path for part in ("cases", "truth") for path in (folder / part).rglob("*") if path.is_file())
    return "".join(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.relative_to(folder)}\n" for path in files)


def cases_of(folder: Path) -> list[str]:
    """List the cases of a benchmark as `robot/condition`.

    Raises
    ------
    SettingsError
        If the folder contains no cases.
    """
    found = [str(path.parent.relative_to(folder / "cases")) for path in sorted((folder / "cases").glob(f"*/*/{CASE}"))]
    if not found:
        raise SettingsError(f"{folder}: has no cases; make them with `python -m benchmarks.contest make {folder}`")
    return found

"""The files of the benchmark: what a contestant is given, what it answers, and the truth that it does not see.

    cases/<robot>/<condition>/   case.json, robot.toml, the model, the logs, and predict.npz of real robots
    truth/<robot>/<condition>/   truth.json, and torque.npz of real robots
    SHA256SUMS                   of all of them, as `sha256sum --check` reads it

Logs are NumPy arrays (npz) in the names, units and orders of docs/logs.md.
"""

import hashlib
from pathlib import Path
from typing import Annotated, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from stribeck.base.files import read_text
from stribeck.base.outputs import whole_or_not_at_all
from stribeck.errors import SettingsError
from stribeck.settings import describe

CASE, TRUTH, ANSWER = "case.json", "truth.json", "answer.json"
PREDICT, TORQUE = "predict.npz", "torque.npz"
SUMS = "SHA256SUMS"
PARAMETERS = ("coulomb", "viscous", "offset")

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Need = Literal["contact flags", "foot wrenches", "IMU", "fixed base", "velocities", "accelerations"]


class Table(BaseModel):
    """Unknown keys and wrong types are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Asked(Table):
    """A joint whose friction is asked for: at these velocities [rad/s], under this load [N m]."""

    velocity: list[Finite]
    load: NonNegative


class Case(Table):
    """What a contestant is told beside the logs, the robot file and the model.

    `band` is the frequency up to which predicted torques are compared [Hz], `predict` the log whose torques are to be
    predicted; both are None where the friction itself is known.
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
    """The friction of one joint: parameters [N m], [N m s/rad], and R(v) without the offset at the velocities asked."""

    coulomb: Positive
    viscous: Positive
    offset: Finite
    curve: list[Finite]


class Truth(Table):
    """What is known of a case; `joints` is empty where the torque that was held out takes the place of the truth."""

    benchmark: Literal[1] = 1
    says: str
    joints: dict[str, KnownFriction] = {}


class Estimate(Table):
    """A number that was found; `good` unless the method itself says that it is not to be relied on."""

    value: Finite
    standard_error: NonNegative | None = None
    interval_95: tuple[Finite, Finite] | None = None
    good: bool = True


class JointAnswer(Table):
    """What was found of one joint; whatever is left out is a blank, never a zero.

    `curve` is R(v) without the offset [N m] at the velocities asked; without it, Coulomb and viscous friction say it.
    """

    coulomb: Estimate | None = None
    viscous: Estimate | None = None
    offset: Estimate | None = None
    curve: list[Finite] | None = None


class Answer(Table):
    """What a contestant writes; `blank` is why there is nothing, or why some joints are missing."""

    benchmark: Literal[1] = 1
    method: str
    version: str
    needs: list[Need] = []
    joints: dict[str, JointAnswer] = {}
    blank: str | None = None


Content = TypeVar("Content", bound=Table)


def read(kind: type[Content], path: Path) -> Content:
    """Return the content of a file of the benchmark.

    Raises
    ------
    SettingsError
        If it is missing or not what it should be; the sentence says where and what would be valid.
    """
    try:
        return kind.model_validate_json(read_text(path, f"{path.name} of the benchmark", SettingsError))
    except ValidationError as error:
        raise SettingsError(f"{path}: {describe(error, kind)}") from error


def write(content: Table, path: Path) -> None:
    """Write a file of the benchmark, whole or not at all."""
    with whole_or_not_at_all(path) as temporary:
        temporary.write_text(content.model_dump_json(indent=1, exclude_none=True) + "\n", encoding="utf-8")


def check_answer(answer: Answer, case: Case, path: Path) -> None:
    """Refuse an answer to what was not asked.

    Raises
    ------
    SettingsError
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
    """Return the lines of SHA256SUMS for all files of a benchmark."""
    files = sorted(path for part in ("cases", "truth") for path in (folder / part).rglob("*") if path.is_file())
    return "".join(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.relative_to(folder)}\n" for path in files)


def cases_of(folder: Path) -> list[str]:
    """Return the cases of a benchmark, as `robot/condition`.

    Raises
    ------
    SettingsError
        If there is none.
    """
    found = [str(path.parent.relative_to(folder / "cases")) for path in sorted((folder / "cases").glob(f"*/*/{CASE}"))]
    if not found:
        raise SettingsError(f"{folder}: has no cases; make them with `python -m benchmarks.contest make {folder}`")
    return found

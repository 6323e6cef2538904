"""Scenario files: robot, motion, friction and sensors of a simulation."""

from fnmatch import fnmatch
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, ValidationError, model_validator

from stribeck.core.base.checked_table import Finite, Positive, Table, describe, rule
from stribeck.core.base.files import read_text
from stribeck.core.base.toml import parse_toml
from stribeck.core.errors import SettingsError
from stribeck.simulation.prescribed.gait import Gait
from stribeck.simulation.robots.sole import Sole
from stribeck.simulation.walking.footsteps import Push, Steps

Named = dict[str, Finite]
LONGEST = 1000.0
"""Longest simulation [s]; its log fits into memory."""


class DriftTable(Table):
    """`[friction.drift]`: parameters that change while the joints warm up."""

    ratios: dict[str, Positive]  # warm over cold, by parameter
    time_constant: Positive  # [s]


class FrictionTable(Table):
    """`[friction]`: friction between torque sensor and link by joint-name pattern; later patterns have priority."""

    law: str = "stribeck"
    common: Named = {}  # parameters of every joint that a pattern names
    joints: dict[str, Named] = {}  # pattern -> parameters of the law
    drift: DriftTable | None = None
    lugre: dict[str, Named] = {}  # pattern -> parameters
    backlash: dict[str, Named] = {}  # pattern -> parameters
    load: dict[str, Named] = {}  # pattern -> parameters


class Scenario(Table):
    """Content of a scenario file."""

    robot: str = "toro"  # packaged: "toro", "biped", "quadruped", "arm"; else the path of a robot file
    simulator: Literal["mujoco", "constrained", "constrained-paper", "exact"] = "mujoco"
    sensors: Literal["ideal", "calibrated", "realistic", "harsh"] = "ideal"
    state: Literal["estimated", "true"] = "estimated"  # input of the controller (mujoco)
    seed: int = Field(default=0, ge=0)
    model_error: Annotated[float, Field(ge=0, lt=1)] = 0.0  # relative error of the controller's masses (mujoco)
    physics_step: Annotated[float, Field(ge=1e-5, le=1e-3)] = 0.00025  # [s] (mujoco); at most one period of the log
    posture: Named = {}  # joint -> position [rad]
    walk: list[Steps] = []
    push: list[Push] = []
    soles: dict[str, Sole] = {}
    gait: Gait = "walk"  # (exact)
    duration: Annotated[float, Field(gt=0, le=LONGEST)] = 20.0  # [s] (exact)
    rate: Annotated[float, Field(ge=20, le=10_000)] = 1000.0  # [Hz] (exact)
    friction: FrictionTable = FrictionTable()

    @model_validator(mode="after")
    def _ends(self) -> Self:
        """Reject a walk that is longer than the longest simulation."""
        walked = sum(steps.stand + steps.count * (steps.single_support + steps.double_support) for steps in self.walk)
        if walked > LONGEST:
            raise rule(f"[[walk]] takes {walked:.4g} s, expected {LONGEST:g} s at most")
        return self


def read_scenario(path: Path) -> Scenario:
    """Read and validate a scenario file (TOML).

    Raises
    ------
    SettingsError
        If the file is missing, is not TOML, or has a wrong key or value.
    """
    text = read_text(path, "a scenario (TOML)", SettingsError)
    try:
        return Scenario.model_validate(parse_toml(text))
    except ValidationError as error:
        raise SettingsError(f"{path}: {describe(error, Scenario)}") from error
    except ValueError as error:
        raise SettingsError(f"{path}: is not TOML: {error}") from error


def by_joint(patterns: dict[str, Named], common: Named, joints: tuple[str, ...], where: str) -> dict[str, Named]:
    """Compute the parameters of each joint that a pattern names.

    Raises
    ------
    SettingsError
        If a pattern names no joint.
    """
    parameters: dict[str, Named] = {}
    for pattern, values in patterns.items():
        named = [joint for joint in joints if fnmatch(joint, pattern)]
        if not named:
            raise SettingsError(f"{where} '{pattern}' names no joint; the robot has {', '.join(joints)}")
        for joint in named:
            parameters[joint] = {**common, **parameters.get(joint, {}), **values}
    return parameters

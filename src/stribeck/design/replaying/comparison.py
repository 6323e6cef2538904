"""Result of a replay: errors of each model, and measured, predicted and simulated motion."""

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import median

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.judgement.torque_error import TorqueError
from stribeck.design.replaying.rollouts import RolloutError


@dataclass(frozen=True, kw_only=True)
class Replayed:
    """Errors of one model on a log.

    Attributes
    ----------
    model
        Path of the model file.
    friction
        Whether the joint friction stated in the file is included.
    torque
        Torque error by joint, for joints whose friction torque is known.
    rollouts
        Velocity errors by joint, after each of the horizons; None where too few rollouts are that long.
    predicted
        Predicted torque by joint at the times of `LoggedMotion` [N m], [N], shape (T,); NaN where unknown, and
        at rest.
    positions
        Start times and positions of the rollouts by joint [rad], [m], shape (S,) and (S, K).
    """

    model: str
    friction: bool
    torque: dict[str, TorqueError]
    rollouts: dict[str, list[RolloutError | None]]
    predicted: dict[str, Array] = field(default_factory=dict, repr=False, compare=False)
    positions: dict[str, tuple[Array, Array]] = field(default_factory=dict, repr=False, compare=False)

    @property
    def name(self) -> str:
        """Name of the file, with "friction" if included."""
        return Path(self.model).name + ", friction" * self.friction

    def median_r2(self) -> float | None:
        """Compute the median R² of the torque over the joints."""
        return _median(error.r2 for error in self.torque.values())

    def median_relative(self, horizon: int) -> float | None:
        """Compute the median relative velocity error over the joints after a horizon."""
        return _median(errors[horizon].relative for errors in self.rollouts.values() if errors[horizon])  # type: ignore[union-attr]


@dataclass(frozen=True, kw_only=True)
class CommandedMotion:
    """Position errors of simulations under the commands of logs, all joints together.

    Attributes
    ----------
    as_given, other
        Root mean square error of the robot's own model and the other one, each with its friction [rad], [m].
    logs, seconds
        Number of logs, and duration of each simulation [s].
    spread
        Smallest and largest difference between logs with the same commands [rad], [m]; None without such logs.
    free
        Whether nothing measured enters after the start; otherwise the base moves as measured, in short simulations.
    """

    as_given: float
    other: float
    logs: int
    seconds: float
    spread: tuple[float, float] | None = None
    free: bool = True

    def __str__(self) -> str:
        """State both errors."""
        errors = f"positions {1e3 * self.as_given:.2g} → {1e3 * self.other:.2g} mrad"
        about = "free simulation" if self.free else f"up to {self.seconds:g} s with the base as measured"
        about += " under the commands of " + ("the log" if self.logs == 1 else f"{self.logs} logs")
        if self.spread:
            low, high = self.spread
            about += f"; logs of the same motion differ by {1e3 * low:.2g} to {1e3 * high:.2g}"
        return f"{errors} ({about})"


@dataclass(frozen=True, kw_only=True, eq=False)
class LoggedMotion:
    """Measured torque and position by joint, shape (T,) each, with their times [s], and the prismatic joints."""

    torque_time: Array
    torque: dict[str, Array]
    position_time: Array
    position: dict[str, Array]
    prismatic: frozenset[str] = frozenset()


def _median(values: Iterable[float]) -> float | None:
    numbers = list(values)
    return median(numbers) if numbers else None


@dataclass(frozen=True, kw_only=True)
class Replay:
    """Result of `stribeck replay`.

    Attributes
    ----------
    robot, log, stribeck
        Name of the robot, path of the log, and version of stribeck.
    filter
        Filter of motion and torque, the same for all models.
    horizons
        Times after which the velocities of the rollouts are compared [s].
    models
        Errors of the robot's own model without and with friction, then of the other model.
    notes
        Sentences on adaptations and omissions.
    motion
        Measured torque and position.
    commanded
        Position errors under the commands of the log; None for logs of measured torques and robots that are not fixed.
    """

    robot: str
    log: str
    filter: str
    horizons: tuple[float, ...]
    models: list[Replayed]
    notes: list[str]
    stribeck: str
    motion: LoggedMotion | None = field(default=None, repr=False, compare=False)
    commanded: CommandedMotion | None = None

    def headline(self) -> str:
        """Summarize the errors of both models, each with its friction, in a sentence."""
        original = [model for model in self.models if model.model == self.models[0].model][-1]
        rms = [[error.rms for error in model.torque.values()] for model in (original, self.models[-1])]
        before, after = (f"{np.sqrt(np.mean(np.square(errors))):.2g}" if errors else "–" for errors in rms)
        return f"{self.commanded}; " * bool(self.commanded) + f"torque error {before} → {after} N m"

    @property
    def joints(self) -> list[str]:
        """Joints with any error."""
        first = self.models[0]
        return list(dict.fromkeys([*first.torque, *(name for name, errors in first.rollouts.items() if any(errors))]))

    def to_json(self) -> str:
        """Format as JSON, without measured and simulated motion."""
        motions = ("motion", "predicted", "positions")
        plain = asdict(self, dict_factory=lambda fields: {key: value for key, value in fields if key not in motions})
        return json.dumps(plain, indent=2, allow_nan=False) + "\n"

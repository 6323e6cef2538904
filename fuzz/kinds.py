"""All kinds of input, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fuzz import model_file, result_file, robot_file, scenario_file, set_option

Make = Callable[[np.random.Generator, Path, Path], list[str]]


@dataclass(frozen=True)
class Kind:
    """How an input is made, and how many of them there are beside those of other kinds."""

    make: Make
    share: float


KINDS = {
    "robot-file": Kind(robot_file.make, 1.0),
    "model-file": Kind(model_file.make, 1.5),
    "set-option": Kind(set_option.make, 0.7),
    "result-file": Kind(result_file.make, 1.0),
    "scenario-file": Kind(scenario_file.make, 0.3),
}

"""All kinds of input, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fuzz import robot_file

Make = Callable[[np.random.Generator, Path, Path], list[str]]


@dataclass(frozen=True)
class Kind:
    """How an input is made, and how many of them there are beside those of other kinds."""

    make: Make
    share: float


KINDS = {
    "robot-file": Kind(robot_file.make, 1.0),
}

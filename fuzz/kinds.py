"""All kinds of input, by name."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from fuzz import extreme, log_file, model_file, result_file, robot_file, runs, scenario_file, set_option

Make = Callable[[np.random.Generator, Path, Path], list[str]]
Differs = Callable[[list[str], Path, Path], bool]


@dataclass(frozen=True)
class Kind:
    """How an input is made, and how many of them there are beside those of other kinds.

    `differs` says, of an input that was accepted, its command, its folder and that of the seeds, whether it was taken
    for something else than it was made from; that breaks nothing where `unseen` says that no format could tell.
    """

    make: Make
    share: float
    differs: Differs | None = None
    unseen: bool = False


KINDS = {
    "robot-file": Kind(robot_file.make, 1.0),
    "model-file": Kind(model_file.make, 1.5),
    "replayed-model": Kind(model_file.make_other, 0.3),
    "set-option": Kind(set_option.make, 0.7),
    "result-file": Kind(result_file.make, 1.0),
    "scenario-file": Kind(scenario_file.make, 0.3),
    **{
        f"log-{name}": Kind(
            partial(log_file.make_damaged, name),
            0.3,
            partial(log_file.differs, name),
            unseen=name not in log_file.CHECKED,
        )
        for name in log_file.FORMATS
    },
    "log-strange": Kind(log_file.make_strange, 1.0),
    "run-extreme": Kind(extreme.make, 0.1, extreme.inconsistent),
    "run-stopped": Kind(runs.make_stopped, 0.05, runs.torn),
    "runs-at-once": Kind(runs.make_two, 0.05, runs.torn),
}

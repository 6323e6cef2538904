"""Files of simulated logs, which need no settings, and of their ground truth."""

import json
from dataclasses import fields
from pathlib import Path

import numpy as np

from stribeck.core.base.outputs import whole_or_not_at_all
from stribeck.core.log import RobotLog
from stribeck.io import write_log
from stribeck.simulation.prescribed.exact import Truth


def truth_file(log: Path) -> Path:
    """Return the path of the ground truth of a simulated log."""
    return log.with_name(f"{log.stem}.truth.npz")


def write_simulated(log: RobotLog, truth: Truth, path: Path) -> Path:
    """Write a log to `path` and its ground truth to a file next to it, both or neither; return the latter's path.

    The truth's arrays have the names of `Truth`; `parameters` is JSON text, by joint and name.
    """
    sidecar = truth_file(path)
    arrays = {
        field.name: value for field in fields(truth) if isinstance(value := getattr(truth, field.name), np.ndarray)
    }
    with whole_or_not_at_all(sidecar) as temporary:
        with temporary.open("wb") as file:
            np.savez(
                file,
                allow_pickle=False,
                time=log.time,
                joint_names=np.array(log.joint_names),
                parameters=np.array(json.dumps(truth.parameters)),
                **arrays,
            )
        write_log(log, path)
    return sidecar


def read_truth(log: Path) -> Truth:
    """Read the ground truth that `write_simulated` wrote for a log."""
    with np.load(truth_file(log), allow_pickle=False) as file:
        arrays = {field.name: file[field.name] for field in fields(Truth) if field.name in file.files}
        return Truth(**arrays | {"parameters": json.loads(str(file["parameters"]))})

"""Writes simulated logs as files that `stribeck.read_log` reads without any setting, and their truth beside them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from stribeck.log import RobotLog
from stribeck.result import whole_or_not_at_all


def write_npz(log: RobotLog, path: Path) -> None:
    """Write a log as NumPy arrays under the contract's names, whole or not at all."""
    names = {"joint_names": np.array(log.joint_names)}
    if log.foot_names:
        names["foot_names"] = np.array(log.foot_names)
    with whole_or_not_at_all(path) as temporary, temporary.open("wb") as file:
        np.savez(file, allow_pickle=False, **names, **log.channels())


def write_truth(law: str, parameters: Mapping[str, Mapping[str, float]], path: Path) -> None:
    """Write the friction parameters that a log was made with, as JSON: the law, then joints, then parameters."""
    text = json.dumps({"law": law, "joints": {joint: dict(values) for joint, values in parameters.items()}}, indent=2)
    with whole_or_not_at_all(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")

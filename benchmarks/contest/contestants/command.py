"""Files and torques that the contestants without stribeck share; it needs only NumPy."""

import json
import sys
import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np


def read_case(folder: Path) -> tuple[dict[str, Any], dict[str, Any], list[Any]]:
    """Read the task, the robot file and the logs of a case."""
    case = json.loads((folder / "case.json").read_text(encoding="utf-8"))
    robot_file = tomllib.loads((folder / "robot.toml").read_text(encoding="utf-8"))
    return case, robot_file, [np.load(folder / log) for log in case["logs"]]


def names_of(log: Mapping[str, Any]) -> list[str]:
    """List the joints of a log."""
    return [str(name) for name in log["joint_names"]]


def with_rotors(robot: Mapping[str, Any]) -> bool:
    """Whether torques are measured in front of the rotors."""
    return bool(robot.get("torque_source", "link_side_sensor") != "link_side_sensor")


def torque_of(log: Mapping[str, Any], robot: Mapping[str, Any], joints: Sequence[str]) -> Any:
    """Return the logged torques, or compute them from the commands as if drives acted at once [N m], shape (T, n)."""
    if "torque" in log:
        return log["torque"]
    kp, kd = (np.array([robot[gain][joint] for joint in joints]) for gain in ("kp", "kd"))
    return kp * (log["desired_position"] - log["position"]) - kd * log["velocity"]


def main(answer: Callable[[Path, Path], dict[str, Any]]) -> None:
    """Answer the case in the first argument's folder, and write the answer to the second argument's folder."""
    folder, out = Path(sys.argv[1]), Path(sys.argv[2])
    (out / "answer.json").write_text(json.dumps(answer(folder, out)), encoding="utf-8")

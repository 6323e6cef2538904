"""Identified parameters of the leg joints of a simulated walk, and the paper's tables."""

import tomllib
from pathlib import Path

import numpy as np

from stribeck import Settings, identify
from stribeck.core.base.typing import Array
from stribeck.core.judgement.speed import top_speed
from stribeck.core.log import RobotLog
from stribeck.core.result import JointResult
from stribeck.simulation.run import Simulated
from studies.paper.study import Numbers

PAPER = Path(__file__).with_name("tables.toml")
PARAMETERS = ("viscous", "coulomb", "stribeck_gain", "stribeck_velocity", "offset", "slope")
"""Parameters of the law, in the order of the paper."""
JOINTS = tuple(
    f"{side}_{joint}"
    for side in ("right", "left")
    for joint in ("hip_roll", "hip_pitch", "hip_yaw", "knee", "ankle_roll", "ankle_pitch")
)


def read_paper() -> dict[str, dict[str, Numbers]]:
    """Read the paper's tables: walk -> joint -> "found" and "error" [%] of the six parameters."""
    return tomllib.loads(PAPER.read_text(encoding="utf-8"))


def identified(walk: Simulated, settings: Settings, log: RobotLog | None = None) -> dict[str, Numbers]:
    """Identify each leg joint's friction from a walk, or from another log of the same walk.

    The row of a joint contains verdict, reason, top speed [rad/s], and per parameter, in the order of the paper: value,
    half width of the 95 % interval, error [%], whether the interval covers the true value, and whether the parameter is
    weak. Missing numbers are NaN.
    """
    result = identify(log or walk.log, walk.robot, settings, law="stribeck", method="curve-fit")
    assert result.evidence is not None
    samples = result.evidence.samples
    found: dict[str, Numbers] = {}
    for joint in JOINTS:
        column = samples.joint_names.index(joint)
        speed = top_speed(samples.velocity[samples.usable[:, column], column])
        each = result.joints[joint]
        numbers = np.array([_numbers(each, name, walk.truth.parameters[joint][name]) for name in PARAMETERS]).T
        keys = ("value", "half_width", "error", "held", "weak")
        found[joint] = {
            "verdict": each.verdict,
            "reason": each.reason,
            "top_speed": speed,
            **dict(zip(keys, numbers, strict=True)),
        }
    return found


def _numbers(joint: JointResult, name: str, truth: float) -> tuple[float, ...]:
    if name not in joint.parameters:
        return (np.nan,) * 5
    parameter = joint.parameters[name]
    low, high = parameter.interval_95
    error = 100 * (parameter.value / truth - 1)
    return parameter.value, (high - low) / 2, error, float(low <= truth <= high), float(parameter.verdict == "weak")


def mean_and_worst(rows: dict[str, Numbers]) -> dict[str, Array]:
    """Compute the mean and the largest absolute error of each parameter over the joints [%]."""
    sizes = np.abs(np.array([row["error"] for row in rows.values()]))
    return {"mean": np.nanmean(sizes, axis=0), "worst": np.nanmax(sizes, axis=0)}

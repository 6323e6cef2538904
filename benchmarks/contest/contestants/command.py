"""Torques for logs with position commands instead of torques."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np


def torque_of(log: Mapping[str, Any], robot: Mapping[str, Any], joints: Sequence[str]) -> Any:
    """Return the logged torques, or compute them from the commands as if drives acted at once [N m], shape (T, n)."""
    if "torque" in log:
        return log["torque"]
    kp, kd = (np.array([robot[gain][joint] for joint in joints]) for gain in ("kp", "kd"))
    return kp * (log["desired_position"] - log["position"]) - kd * log["velocity"]

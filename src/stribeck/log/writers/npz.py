"""NumPy archives: arrays named as the channels of RobotLog."""

from pathlib import Path

import numpy as np

from stribeck.log.robot_log import RobotLog


def write_npz(log: RobotLog, path: Path) -> list[str]:
    """Write every channel; there is none without a place."""
    names = {"joint_names": np.array(log.joint_names), "torque_source": np.array(log.torque_source)}
    if log.foot_names:
        names["foot_names"] = np.array(log.foot_names)
    with path.open("wb") as file:
        np.savez(file, allow_pickle=False, **names, **log.channels())
    return []

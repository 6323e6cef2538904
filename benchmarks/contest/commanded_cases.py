"""Cases with position commands instead of torques."""

from pathlib import Path
from typing import Any

import numpy as np
from tests.commanded import ARM, QUADRUPED, arm_drives, arm_log, clamped_log, leg_drives, write_robot

from benchmarks.contest.cases import COMMANDED_SECONDS, LATENCIES
from benchmarks.contest.schema import CASE, TRUTH, Asked, Case, KnownFriction, Truth, folders_of, write

POINTS = 61
"""Number of velocities of a curve, over the middle 98 % of the joint's velocities."""


def publish_commanded(name: str, folder: Path, seed: int) -> None:
    """Write the cases of a robot, one per latency, and their ground truth."""
    for number, (label, latency) in enumerate(LATENCIES.items(), seed):
        case_folder, truth_folder = folders_of(folder, name, label)
        if name == "hobby-arm":
            model, drives = ARM, arm_drives(number, latency)
            log: dict[str, Any] = dict(arm_log(drives, number, COMMANDED_SECONDS))
        else:
            model, drives = QUADRUPED, leg_drives(number, latency)
            log = dict(clamped_log(drives, number, COMMANDED_SECONDS))
        np.savez(case_folder / "log.npz", joint_names=np.array(list(drives)), **log)
        write_robot(case_folder, model, drives)
        asked, known = {}, {}
        loads = np.mean(np.abs(log["desired_position"] - log["position"]), axis=0)
        for (joint, drive), v, load in zip(drives.items(), log["velocity"].T, loads, strict=True):
            low, high = np.percentile(v, [1, 99]).tolist()
            velocity = np.linspace(low, high, POINTS)
            curve = drive.coulomb * np.sign(velocity) + drive.viscous * velocity
            asked[joint] = Asked(velocity=velocity.tolist(), load=float(drive.kp * load))
            known[joint] = KnownFriction(coulomb=drive.coulomb, viscous=drive.viscous, offset=0.0, curve=curve.tolist())
        case = Case(
            robot=name,
            condition=label,
            base="fixed",
            seconds=COMMANDED_SECONDS,
            rate=float(round(1 / np.median(np.diff(log["time"])))),
            logs=["log.npz"],
            joints=asked,
        )
        write(case, case_folder / CASE)
        write(Truth(says=f"position commands that act {1e3 * latency:g} ms late", joints=known), truth_folder / TRUTH)

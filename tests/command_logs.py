"""Logs of position commands in folders, as users have them; each function returns the ground truth."""

import numpy as np
from tests.commanded import ARM, LEGS, QUADRUPED, arm_drives, arm_log, clamped_log, leg_drives, write_robot
from tests.log.readers.test_lerobot import dataset
from tests.trotting import trot

GAINS = ("kp", "kd")


def write_case(folder, model, drives, log, keys=GAINS):
    """Write model, robot file and `log.npz` into a folder."""
    write_robot(folder, model, drives, keys)
    np.savez(folder / "log.npz", joint_names=np.array(list(drives)), **log)
    return drives


def hobby_arm(folder, seed=1, latency=0.012, seconds=40.0, velocity=True, keys=GAINS, drives=None, **rates):
    """Write a log of the hobby arm, at 50 Hz unless `policy` or `rate` [Hz] is given."""
    drives = drives or arm_drives(seed, latency)
    log = arm_log(drives, seed, seconds, **rates)
    if not velocity:
        del log["velocity"]
    return write_case(folder, ARM, drives, log, keys)


def lerobot_arm(folder, seed=3, latency=0.02, seconds=40.0, version="v3.0", keys=("kp",)):
    """Write the hobby arm's commands and positions as a dataset, `dataset`, of 30 Hz in degrees, in two episodes."""
    drives, rate = arm_drives(seed, latency), 30.0
    log = arm_log(drives, seed, seconds, policy=rate)
    half, samples, names = len(log["time"]) // 2, len(log["time"]), [f"{joint}.pos" for joint in drives]
    dataset(
        folder,
        version,
        fps=rate,
        episodes=(slice(0, half), slice(half, samples)),
        observation__state=(np.rad2deg(log["position"]), names),
        action=(np.rad2deg(log["desired_position"]), names),
    )
    write_robot(folder, ARM, drives, keys)
    with (folder / "robot.toml").open("a") as file:
        file.write('\n[log.position]\nunit = "deg"\n\n[log.desired_position]\nname = "action"\nunit = "deg"\n')
    return drives


def clamped_quadruped(folder, seed=17, latency=0.006, seconds=15.0, keys=GAINS, **rates):
    """Write a log of the clamped quadruped, at 200 Hz unless `rate` [Hz] is given."""
    drives = leg_drives(seed, latency)
    log = clamped_log(drives, seed, seconds, **rates)
    return write_case(folder, QUADRUPED, drives, log, keys)


def trotting_quadruped(folder, keys=GAINS, flags=True, **settings):
    """Write a log of the trotting quadruped at 500 Hz, with raw contact flags or without `flags`."""
    log, drives = trot(**settings)
    if not flags:
        del log["foot_names"], log["contact"]
    write_case(folder, QUADRUPED, drives, log, keys)
    path = folder / "robot.toml"
    feet = "".join(f'{foot} = {{ frame = "{foot}", kind = "point" }}\n' for foot in LEGS)
    path.write_text(path.read_text().replace('base = "fixed"\n', "") + f"\n[contacts]\n{feet}")
    return drives

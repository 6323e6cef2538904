"""The demonstration: the packaged biped steps from foot to foot with known friction, and its log is written."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

from stribeck.friction import FrictionLaw, Stribeck
from stribeck.robot import Robot
from stribeck.simulation.biped import LEG, MODELS
from stribeck.simulation.exact import exact_log
from stribeck.simulation.files import write_npz, write_truth
from stribeck.simulation.pictures import walk_picture
from stribeck.simulation.sensors import with_noise
from stribeck.simulation.sole import Sole
from stribeck.walk import WalkPicture

DURATION = 40.0
"""[s]"""
ENCODER_NOISE = 1e-5
"""[rad]"""
TORQUE_NOISE = 0.1
"""[N m]"""
POSTURE = {"hip_pitch": -0.3, "knee": 0.6, "ankle_pitch": -0.3}
"""Of each leg [rad]."""
LEVELS = {
    "hip_roll": 1.0,
    "hip_pitch": 0.75,
    "hip_yaw": 0.75,
    "knee": 1.0,
    "ankle_pitch": 0.2,
    "ankle_roll": 0.1,
    "shoulder_pitch": 0.6,
    "shoulder_roll": 0.5,
    "shoulder_yaw": 0.4,
    "elbow": 0.3,
}
"""Coulomb torque and offset [N m]; those of the legs are of Table 6.2 of Egle 2021."""
WAIST_LEVEL = 0.9
"""[N m]"""


@dataclass(frozen=True)
class Demo:
    """The files of a demonstration, its true friction law and parameters by joint and name, and what it looks like."""

    robot_file: Path
    log: Path
    law: FrictionLaw
    parameters: dict[str, dict[str, float]]
    walk: WalkPicture


def demo_posture() -> dict[str, float]:
    """Return a posture of the packaged biped with bent knees and level feet."""
    return {f"{side}_{joint}": value for side in ("left", "right") for joint, value in POSTURE.items()}


def demo_soles() -> dict[str, Sole]:
    """Return the soles of the packaged biped: its feet are boxes about the contacts."""
    length, width = LEG[-1].size[:2]
    return {f"{side}_foot": Sole((0.0, 0.0, 0.0), length / 2, width / 2) for side in ("left", "right")}


def demo_parameters() -> dict[str, dict[str, float]]:
    """Return the friction parameters of the demonstration: Fv, S, vs and a as in Table 6.2, Fc and offset by joint."""
    levels = {f"{side}_{joint}": level for side in ("left", "right") for joint, level in LEVELS.items()}
    levels["waist"] = WAIST_LEVEL
    return {
        joint: {
            "viscous": 0.2,
            "coulomb": level,
            "stribeck_gain": 0.2,
            "stribeck_velocity": 0.2,
            "offset": level,
            "slope": 40.0,
        }
        for joint, level in levels.items()
    }


def make_demo(folder: Path, *, duration: float = DURATION, seed: int = 0) -> Demo:
    """Write robot file, model, log and truth of the demonstration into an existing folder.

    Parameters
    ----------
    folder
        Where to; gets `robot.toml`, `biped.urdf`, `log.npz` and `truth.json`.
    duration
        Of the log [s].
    seed
        Of motion and noise.
    """
    for name in ("robot.toml", "biped.urdf"):
        shutil.copyfile(MODELS / name, folder / name)
    robot = Robot.from_file(folder / "robot.toml")
    law, parameters = Stribeck(), demo_parameters()
    exact, truth = exact_log(robot, law, parameters, duration=duration, seed=seed, posture=demo_posture())
    log = with_noise(exact, position=ENCODER_NOISE, torque=TORQUE_NOISE, seed=seed)
    write_npz(log, folder / "log.npz")
    write_truth(law.name, parameters, folder / "truth.json")
    assert truth.base_position is not None  # the biped's base floats
    walk = walk_picture(robot, exact, truth.base_position, demo_soles(), rendered=True)
    return Demo(folder / "robot.toml", folder / "log.npz", law, parameters, walk)

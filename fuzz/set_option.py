"""Settings after `--set`: keys and values."""

import json
from pathlib import Path

import numpy as np

from fuzz.damage import NUMBERS, VALUES, WORDS, nested, pick
from stribeck.settings import Settings, flat

KEYS = list(flat(Settings()))
CHOICES = (
    *("true", "savitzky-golay", "butterworth", "log", "kinematics", "forces", "imu"),
    *("flat", "fit", "soft_l1", "cauchy", "none", "inertia", "calibration", "coulomb-viscous", "stribeck"),
    *("curve-fit", '["elbow"]', "[1.0, 2.0, 1.0]"),
)
"""What one setting or another may be."""


def make(generator: np.random.Generator, folder: Path, seeds: Path) -> list[str]:
    """Return a command line with one to three settings; nothing is written but what it names."""
    (folder / "robot.toml").write_text((seeds / "robot.toml").read_text(encoding="utf-8"), encoding="utf-8")
    (folder / "arm.urdf").write_text((seeds / "arm.urdf").read_text(encoding="utf-8"), encoding="utf-8")
    words = ["inspect", str(seeds / "log.npz"), "-r", "robot.toml"]
    if generator.random() < 0.05:  # these take longer
        words = ["identify", str(seeds / "log.npz"), "-r", "robot.toml", "-o", "out", "--method", "curve-fit"]
    for _ in range(pick(generator, (1, 1, 1, 2, 3))):
        words += ["--set", _assignment(generator)]
    return words


def _assignment(generator: np.random.Generator) -> str:
    key = pick(generator, KEYS) if generator.random() < 0.9 else pick(generator, WORDS)
    if generator.random() < 0.1:
        key += f".{pick(generator, ('x', 'kind', '', '.'))}" * int(10 ** generator.uniform(0, 3))
    match int(generator.integers(6)):
        case 3:
            value = str(int(10 ** generator.uniform(0, 4)))
        case 4:
            value = pick(generator, CHOICES)
        case 0:
            value = pick(generator, NUMBERS)
        case 1:
            value = pick(generator, WORDS)
        case 2:
            value = json.dumps(pick(generator, VALUES))
        case _:
            value = (
                nested(generator, "[", "1", "]") if generator.random() < 0.2 else str(10 ** generator.uniform(-3, 9))
            )
    return f"{key}={value}".replace("\0", "").encode(errors="replace").decode()[:100_000]

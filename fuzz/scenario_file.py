"""Scenarios of simulations: their words, keys and the types of their values."""

import tomllib
from pathlib import Path

import numpy as np

from fuzz.damage import bytes_damaged, pick, text_damaged, value_damaged
from fuzz.robot_file import as_toml

EXACT = """robot = "arm"
simulator = "exact"
sensors = "realistic"
seed = 1
duration = 0.3

[friction]
law = "stribeck"

[friction.joints."*"]
viscous = 0.2
coulomb = 0.5
stribeck_gain = 0.2
stribeck_velocity = 0.2
offset = 0.2
slope = 40.0

[posture]
elbow = 0.3
"""
WALK = """robot = "biped"
simulator = "constrained"

[[walk]]
count = 0
stand = 0.1
forward = 0.1

[friction.joints."*_knee"]
viscous = 0.2
coulomb = 1.0
stribeck_gain = 0.2
stribeck_velocity = 0.2
"""


def make(generator: np.random.Generator, folder: Path, seeds: Path) -> list[str]:
    """Write a scenario that is damaged somewhere."""
    del seeds
    text = EXACT if generator.random() < 0.8 else WALK
    match int(generator.integers(6)):
        case 0:
            content = bytes_damaged(generator, text.encode())
        case 1 | 2:
            content = text_damaged(generator, text).encode(errors="surrogatepass")
        case _:
            document = tomllib.loads(text)
            for _ in range(int(generator.integers(1, 4))):
                document = value_damaged(generator, document)
            content = as_toml(document).encode(errors="surrogatepass")
    (folder / "scenario.toml").write_bytes(content)
    return ["simulate", "scenario.toml", "-o", pick(generator, ("out.npz", "out.npz", "out.npz", "out", "out.csv"))]

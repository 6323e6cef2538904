"""Robots that can walk, and how they stand and rub."""

from pathlib import Path

from tests.models import EXAMPLES, POSTURES, SIDES, STRIBECK
from tests.models import MODELS as EXAMPLE_MODELS

from stribeck.core.friction import Stribeck
from stribeck.core.robot import Robot
from stribeck.simulation.friction import FrictionTruth, LawFriction
from stribeck.simulation.robots import MODELS
from stribeck.simulation.robots.sole import Sole

LEG_JOINTS = ("leg_", "hip", "knee", "ankle")
SOLES: dict[str, dict[str, Sole]] = {"talos": {side: Sole(half_length=0.1, half_width=0.06) for side in SIDES}}
"""Of feet that are meshes in the model."""
BENT = {
    f"{side}_{joint}": value
    for side in SIDES
    for joint, value in (("hip_pitch", -0.3), ("knee", 0.6), ("ankle_pitch", -0.3))
}
POSTURE = {"toro": BENT, **POSTURES}


def walker(name: str, folder: Path) -> Robot:
    """Return a robot that was read from a robot file."""
    if name == "toro":
        return Robot.from_file(MODELS / "toro.toml")
    model, _, contacts = EXAMPLE_MODELS[name]
    lines = ["[robot]", f"model = '{EXAMPLES / model}'", f"name = '{name}'"]
    for contact, table in contacts.items():
        lines += [f"[contacts.{contact}]", f"frame = '{table['frame']}'", f"kind = '{table['kind']}'"]
    path = folder / "robot.toml"
    path.write_text("\n".join(lines), encoding="utf-8")
    return Robot.from_file(path)


def leg_friction(robot: Robot, coulomb: float, offset: float = 0.3) -> FrictionTruth:
    """Return friction and an offset [N m] in all leg joints, in the tree's order."""
    names = [str(name) for name in list(robot.tree.model.names)[2:]]
    values = {**STRIBECK, "coulomb": coulomb, "offset": offset}
    legs = {name: values for name in names if any(part in name for part in LEG_JOINTS)}
    return FrictionTruth(len(names), [LawFriction(names, Stribeck(), legs)])

"""Walks with friction that no law of velocity describes, and the same walk with friction that one does."""

from collections.abc import Mapping

from stribeck_simulation.run import Simulated
from stribeck_simulation.scenario import DriftTable, FrictionTable, Scenario, read_scenario
from studies.accuracy_cases import COMMON
from studies.kept_walks import ROOT, kept_walk

LEGS = read_scenario(ROOT / "examples" / "scenarios" / "straight-and-sideways.toml")
"""40 steps with the friction of Table 6.2 of the paper in all leg joints."""

INSIDE = "inside the family"
STIFFNESS = 300.0
"""Of bristles [N m/rad]: friction of 0.75 N m comes within some 3 mrad, which is a sixth of a degree."""


SHARE = {"load_share": 0.03, "load_slope": 40.0}
"""Of the torque that a gear loses: 2 to 10 % is usual."""


def _bristles(values: Mapping[str, float]) -> dict[str, float]:
    sliding = {name: value for name, value in COMMON.items() if name != "slope"}
    return {**sliding, **values, "bristle_stiffness": STIFFNESS, "bristle_damping": 2.0}


def _with(**changes: object) -> FrictionTable:
    return LEGS.friction.model_copy(update=changes)


CASES: dict[str, FrictionTable] = {
    INSIDE: LEGS.friction,
    "LuGre": FrictionTable(lugre={joint: _bristles(values) for joint, values in LEGS.friction.joints.items()}),
    "backlash": _with(backlash={"*_ankle_pitch": {"play": 0.005, "stiffness": 2e4, "damping": 2.0}}),
    "load": _with(load=dict.fromkeys(LEGS.friction.joints, SHARE)),
    "drift": _with(drift=DriftTable(ratios={"viscous": 0.5, "coulomb": 0.8}, time_constant=20.0)),
}


def walk(name: str) -> Simulated:
    """Return the walk of a case as sensors without errors see it."""
    return kept_walk(f"beyond-{name.replace(' ', '-')}", scenario(name))


def scenario(name: str) -> Scenario:
    """Return the scenario of a case."""
    return LEGS.model_copy(update={"friction": CASES[name]})

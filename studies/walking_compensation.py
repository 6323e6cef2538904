"""Measure friction compensation of walking humanoids, with friction identified from their own noisy walks.

    python -m studies.walking_compensation --save studies/walking_compensation.json

Each robot walks six steps on its estimated state, with friction in all leg joints as in `studies.walking`. The friction
is identified from this walk's log with default settings, exported as a C header, compiled, and compensated in the loop
at 500 Hz at the planned velocities. The study then increases friction, and compares walks without compensation, with
the friction identified at this level, and with the true friction. If the robot falls without compensation, friction is
identified from a walk that is compensated by the friction identified at the previous level.
"""

from collections.abc import Callable
from functools import cache
from itertools import product

import numpy as np

from stribeck import Robot, identify
from stribeck.base.typing import Array
from stribeck.errors import StribeckError
from stribeck.result import Result
from stribeck_simulation.sensors.profiles import get_profile
from stribeck_simulation.walking.footsteps import Steps
from stribeck_simulation.walking.plan import BOTH
from stribeck_simulation.walking.simulate import Conditions, Walk, simulate_walk
from studies.command import Row, command
from studies.compensation import SETTINGS, compiled, with_truth
from studies.markdown import markdown_table
from studies.walking import how_it_went, leg_friction, truth_of
from studies.walking_cases import WALKERS, robot_of

STEPS = {
    "TORO-like": Steps(count=6, forward=0.2),
    "TALOS": Steps(count=6, forward=0.3),
    "G1": Steps(count=6, forward=0.2, width=0.16),
}
"""Steps with bent knees: at 0.3 m, the rear knee of the TORO-like robot snaps through, and friction brakes it."""
FACTORS = (1.0, 2.0, 4.0, 8.0, 16.0)
"""Friction levels relative to `WALKERS` [1]."""
KINDS = ("none", "identified", "true")
MEASURES = {"error": "DCM [mm]", "com": "centre of mass [mm]", "foot": "swing foot [mm]"}
PERIOD = 2e-3
"""Period of the controller [s]."""
WALKING_SETTINGS = SETTINGS | {"near": 2.0}
"""Compensation settings that use the desired velocity at nearly all speeds, chosen on sideways walks."""


def walked(name: str, factor: float, result: Result | None) -> Walk | None:
    """Simulate a walk, with the friction of a result compensated; None if the robot fell."""
    robot = robot_of(name)
    conditions = Conditions(
        friction=leg_friction(robot, truth_of(name, robot, factor)),
        profile=get_profile("realistic"),
        soles=WALKERS[name].soles,
        compensation=None if result is None else in_the_tree(result, robot),
    )
    try:
        return simulate_walk(robot, [STEPS[name]], WALKERS[name].posture, conditions)
    except StribeckError:
        return None


def in_the_tree(result: Result, robot: Robot) -> Callable[[Array, Array], Array]:
    """Wrap the compiled compensation, which takes measured and desired velocities, for the tree's order."""
    own, columns = compiled(result, robot, period=PERIOD, settings=WALKING_SETTINGS), robot.tree.columns

    def compensate(measured: Array, desired: Array) -> Array:
        velocities = np.empty((2, len(columns)))
        velocities[:, columns] = measured, desired
        return own(*velocities)[columns]

    return compensate


@cache
def identified(name: str, factor: float) -> tuple[Walk | None, Result]:
    """Simulate a walk at a friction level, and identify its friction; the walk is None if the robot fell."""
    bare = walked(name, factor, None)
    before = FACTORS[FACTORS.index(factor) - 1]
    shown = bare or walked(name, factor, identified(name, before)[1])
    return bare, identify(shown.log, robot_of(name)) if shown else identified(name, before)[1]


def run(robot: str, friction: float) -> Row:
    """Measure the walks at a friction level with each kind of compensation; None for a fall."""
    machine, (bare, result) = robot_of(robot), identified(robot, friction)
    true = with_truth(result, truth_of(robot, machine, friction))
    walks = {"none": bare, "identified": walked(robot, friction, result), "true": walked(robot, friction, true)}
    return {kind: None if walk is None else _measured(robot, machine, walk) for kind, walk in walks.items()}


def _measured(name: str, robot: Robot, walk: Walk) -> dict[str, float]:
    """Measure the largest error of the DCM, and root mean squares of centre of mass and swing foot [mm]."""
    course = how_it_went(name, robot, walk)
    assert walk.swing_error is not None
    foot = np.linalg.norm(walk.swing_error[walk.plan.swing != BOTH], axis=1)
    rms = 1e3 * float(np.sqrt(np.mean(foot**2)))
    return {"error": round(course.error, 1), "com": round(course.com, 1), "foot": round(rms, 2)}


def gain(row: Row, measure: str) -> float:
    """Compute the gain of the identified compensation relative to the gain of the true one [1]."""
    none, own, true = (row[kind][measure] for kind in KINDS)
    return float((none - own) / (none - true))


def tables(rows: list[Row]) -> list[str]:
    """Format the table: each measure without, with identified, and with true compensation."""
    cells = []
    for row in rows:
        shown = (" / ".join(_shown(row[kind], measure) for kind in KINDS) for measure in MEASURES)
        cells.append((row["robot"], f"{row['friction']:g}", *shown))
    return [markdown_table(("robot", "friction", *MEASURES.values()), cells, 5)]


def _shown(own: dict[str, float] | None, measure: str) -> str:
    if own is None:
        return "falls"
    return f"{own[measure]:.0f}" if own[measure] >= 100 else f"{own[measure]:.3g}"


if __name__ == "__main__":
    keys = [{"robot": robot, "friction": factor} for robot, factor in product(STEPS, FACTORS)]
    command(__doc__, keys, run, tables)

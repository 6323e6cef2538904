"""The walks that the studies share: each simulated once, and kept under build/ until its scenario or the code changes.

They are the scenarios of examples/scenarios, and what the paper does with them.
"""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.metadata import version
from pathlib import Path

import stribeck
from stribeck import Robot, read_log
from stribeck.simulation.files import read_truth, write_simulated
from stribeck.simulation.run import Simulated, run_scenario
from stribeck.simulation.scenario import Scenario, read_scenario
from stribeck.simulation.toro import ROBOT_FILE
from studies.paper.study import ROOT

FOLDER = ROOT / "build" / "walks"
SOURCES = ("simulation", "friction", "robot.py", "rooting.py")
"""Parts of the package that a simulated log depends on."""
QUICK_STEPS = 2
"""Of each kind, in the quick variant of a walk."""
QUICK_STAND = 0.1
"""How long the robot stands before each kind of steps, and after them, in the quick variant [s]."""


def _scenario(name: str, **changes: object) -> Scenario:
    """Return an example's scenario, some of its keys changed."""
    found = read_scenario(ROOT / "examples" / "scenarios" / f"{name}.toml")
    return found.model_copy(update=changes)


def _scenarios() -> dict[str, Scenario]:
    knee, straight = _scenario("right-knee"), _scenario("straight")
    return {
        "right-knee-ideal": knee,  # Fig. 6.1 to 6.3
        "right-knee-literal": _scenario("right-knee", simulator="constrained-paper"),  # by the paper's forward Euler
        "right-knee-contact": _scenario("right-knee-contact"),  # Fig. 6.4, 6.5a, 7.2
        "legs-contact": _scenario("right-knee-contact", friction=straight.friction),  # Fig. 6.5b, 7.1, 7.3 to 7.6
        "straight": straight,  # Table 6.1
        "straight-and-sideways": _scenario("straight-and-sideways"),  # Table 6.2
        "harsh": _scenario("straight", sensors="harsh", seed=1),  # Fig. 7.1, 7.3, 7.7, 7.8
    }


SCENARIOS = _scenarios()
"""By name."""


def get_walk(name: str, quick: bool = False) -> Simulated:
    """Return a walk by name, simulated if it is not at hand; a quick one has only a few steps."""
    scenario = SCENARIOS[name]
    if quick:
        change = {"count": QUICK_STEPS, "stand": QUICK_STAND}
        short = [steps.model_copy(update=change) for steps in scenario.walk]
        scenario = scenario.model_copy(update={"walk": short})
    label = f"{name}-quick" if quick else name
    path = FOLDER / f"{label}.{_digest(scenario)}.npz"
    if not path.exists():
        found = run_scenario(scenario)
        FOLDER.mkdir(parents=True, exist_ok=True)
        for outdated in FOLDER.glob(f"{label}.*.npz"):
            outdated.unlink()
        write_simulated(found.log, found.truth, path)
    robot = Robot.from_file(ROBOT_FILE)
    return Simulated(robot, read_log(path, robot), read_truth(path))


def _digest(scenario: Scenario) -> str:
    """Return a short hash of all that a simulated log follows from."""
    text = "\n".join([scenario.model_dump_json(), version("mujoco"), version("pin"), _source_digest()])
    return hashlib.sha256(text.encode()).hexdigest()[:12]


@cache
def _source_digest() -> str:
    package = Path(stribeck.__file__).parent
    places = [package / source for source in SOURCES]
    files = [file for place in places for file in ([place] if place.is_file() else sorted(place.rglob("*")))]
    digest = hashlib.sha256()
    for file in files:
        if file.suffix in (".py", ".xml", ".toml"):
            digest.update(file.read_bytes())
    return digest.hexdigest()

"""Walks that the studies of the paper share: the scenarios of examples/scenarios, and the paper's variants."""

from dataclasses import replace

from stribeck.simulation.run import Simulated
from stribeck.simulation.scenario import Scenario, read_scenario
from stribeck.simulation.sensors.measure import measure, sensors_for
from stribeck.simulation.sensors.profiles import SensorProfile, get_profile
from studies.kept_walks import kept_walk
from studies.paper.study import ROOT

QUICK_STEPS = 2
"""Number of steps of each kind in the quick variant of a walk."""
QUICK_STAND = 0.1
"""Duration of standing before and after each kind of steps in the quick variant [s]."""
QUICK_PHYSICS = 0.0005
"""Step of the contact simulator in the quick variant [s], twice the default."""


def _scenario(name: str, **changes: object) -> Scenario:
    """Read an example's scenario, and change some of its keys."""
    found = read_scenario(ROOT / "examples" / "scenarios" / f"{name}.toml")
    return found.model_copy(update=changes)


def _scenarios() -> dict[str, Scenario]:
    knee, straight = _scenario("right-knee"), _scenario("straight")
    return {
        "right-knee-ideal": knee,  # Fig. 6.1 to 6.3
        "right-knee-literal": _scenario("right-knee", simulator="constrained-paper"),  # by the paper's forward Euler
        "right-knee-contact": _scenario("right-knee-contact"),  # Fig. 6.4, 6.5a
        "legs-contact": _scenario("right-knee-contact", friction=straight.friction),  # Fig. 7.1, 7.3 to 7.6
        "straight": straight,  # Table 6.1
        "straight-and-sideways": _scenario("straight-and-sideways"),  # Table 6.2
        "harsh": _scenario("straight", sensors="harsh", seed=1),  # Fig. 7.1, 7.3, 7.7, 7.8
    }


SCENARIOS = _scenarios()
"""Scenarios of the walks, by name."""


def get_walk(name: str, quick: bool = False) -> Simulated:
    """Load or simulate a walk by name; a quick walk has only a few steps."""
    scenario = SCENARIOS[name]
    if quick:
        change = {"count": QUICK_STEPS, "stand": QUICK_STAND}
        short = [steps.model_copy(update=change) for steps in scenario.walk]
        scenario = scenario.model_copy(update={"walk": short, "physics_step": QUICK_PHYSICS})
    return kept_walk(f"{name}-quick" if quick else name, scenario)


def sensed(walk: Simulated, profile: SensorProfile, seed: int = 1) -> Simulated:
    """Measure the exact log of a walk with sensors of a profile."""
    return replace(walk, log=measure(walk.log, sensors_for(walk.log, profile, seed)))


def legs_by_sensors(quick: bool) -> dict[str, Simulated]:
    """Load walks with friction in all leg joints, by their sensors."""
    exact = get_walk("legs-contact", quick)
    return {"exact": exact, "realistic": sensed(exact, get_profile("realistic")), "harsh": get_walk("harsh", quick)}

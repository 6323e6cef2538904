"""How near the friction observer comes to the truth, beside the other methods: an arm, and a humanoid that walks.

    python -m studies.observer --save studies/observer.json

The arm is that of `studies.compensation` with its noisy log, the humanoid the walk of `stribeck demo`. The law is known
to be (3.5). Printed are, over the joints that have a fit, median and largest error of Coulomb and viscous friction.
"""

import argparse
import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import TypedDict

from stribeck import Robot, RobotLog, Settings, identify
from stribeck.outputs import whole_or_not_at_all
from stribeck_simulation.demo import SCENARIO
from stribeck_simulation.scenario import read_scenario
from studies.compensation import arm, noisy_log, truth_of
from studies.kept_walks import kept_walk

LAW = "stribeck"
METHODS: dict[str, dict[str, object]] = {
    "curve-fit": {"method": "curve-fit"},
    "observer": {"method": "observer"},
    "observer, 10 Hz": {"method": "observer", "observer_bandwidth": 10.0},
    "observer, 100 Hz": {"method": "observer", "observer_bandwidth": 100.0},
    "whole-log": {"method": "whole-log"},
}
HEAD = """\
| log | method | joints | Coulomb %, median / largest | viscous % |
|---|---|---:|---:|---:|"""


class Errors(TypedDict):
    """Of one log by one method: joints that have a fit; errors [%], median and largest."""

    log: str
    method: str
    joints: int
    coulomb: tuple[float, float]
    viscous: tuple[float, float]


def cases() -> Iterator[tuple[str, Robot, RobotLog, Mapping[str, Mapping[str, float]]]]:
    """Yield name, robot, log and true parameters by joint."""
    robot = arm()
    yield "arm", robot, noisy_log(robot), truth_of(robot)
    walk = kept_walk("demo", read_scenario(SCENARIO), SCENARIO.parent)
    yield "TORO-like", walk.robot, walk.log, walk.truth.parameters


def errors(name: str, robot: Robot, log: RobotLog, truth: Mapping[str, Mapping[str, float]], method: str) -> Errors:
    """Return how far a method's numbers are off."""
    settings = Settings.model_validate({"law": LAW, **METHODS[method]})
    # positions alone say how the joints move, as in most logs
    found = identify(replace(log, velocity=None, acceleration=None), robot, settings).joints
    fitted = [joint for joint in truth if found[joint].parameters]

    def off(parameter: str) -> tuple[float, float]:
        values = [(found[joint].parameters[parameter].value, truth[joint][parameter]) for joint in fitted]
        shares = [100 * abs(value - true) / true for value, true in values]
        return float(f"{median(shares):.2g}"), float(f"{max(shares):.2g}")

    return Errors(log=name, method=method, joints=len(fitted), coulomb=off("coulomb"), viscous=off("viscous"))


def table(found: list[Errors]) -> str:
    """Return the table of the docs."""
    lines = [
        f"| {each['log']} | {each['method']} | {each['joints']} | {each['coulomb'][0]:g} / {each['coulomb'][1]:g} | "
        f"{each['viscous'][0]:g} / {each['viscous'][1]:g} |"
        for each in found
    ]
    return "\n".join([HEAD, *lines])


def main() -> None:
    """Print the table, and save it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--save", type=Path, metavar="FILE", help="save the figures as JSON")
    options = parser.parse_args()
    found = [errors(*case, method) for case in cases() for method in METHODS]
    print(table(found))
    if options.save:
        with whole_or_not_at_all(options.save) as temporary:
            temporary.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

"""How accurate friction is from a walk on real contacts with exact sensors: what the method itself leaves.

    python studies/contact_accuracy.py --save studies/contact_accuracy.json

The robot of examples/scenarios/straight-and-sideways.toml takes 40 steps in the contact simulator, and the main job is
run on its log as a user would: filter and support phases are found by themselves, all six parameters of the law are
free. Nothing is noisy, so what is left is the feet that rock, the filter, and what the walk does not excite. A second
walk has friction in arms and waist too, which the walk moves along with the legs or not at all: the verdict has to say
which.
"""

import argparse
import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from stribeck import identify
from stribeck.result import JointResult
from stribeck_simulation.run import run_scenario
from stribeck_simulation.scenario import FrictionTable, Scenario, read_scenario

SCENARIO = Path(__file__).parents[1] / "examples" / "scenarios" / "straight-and-sideways.toml"
UPPER_BODY = {
    "waist": {"coulomb": 0.9, "offset": 0.9},
    "*_shoulder_?": {"coulomb": 0.5, "offset": 0.5},
    "*_elbow": {"coulomb": 0.3, "offset": 0.3},
    "*_wrist_?": {"coulomb": 0.1, "offset": 0.1},
}
"""By pattern of joint names [N m]; the other parameters are those that the scenario's joints share."""
CASES = ("the legs", "all joints")


@dataclass(frozen=True)
class Row:
    """What was found of one joint: its verdict, and how far its numbers are from the truth if it has any.

    The error of `coulomb` is relative [1], those of `viscous` [N m s/rad] and `offset` [N m] are not.
    """

    verdict: str
    coulomb: float | None = None
    viscous: float | None = None
    offset: float | None = None


def with_upper_body(scenario: Scenario) -> Scenario:
    """Return the scenario with friction in arms and waist, too."""
    joints = scenario.friction.joints | UPPER_BODY
    return scenario.model_copy(update={"friction": FrictionTable(common=scenario.friction.common, joints=joints)})


def leg_joints(joints: Iterable[str]) -> list[str]:
    """Return those of the joints that are in the legs."""
    return [joint for joint in joints if any(part in joint for part in ("hip", "knee", "ankle"))]


def accuracy(scenario: Scenario) -> dict[str, Row]:
    """Return what is found of every joint that has friction in a scenario."""
    found = run_scenario(scenario)
    joints = identify(found.log, found.robot, method="curve-fit").joints
    return {joint: _row(joints[joint], truth) for joint, truth in found.truth.parameters.items()}


def _row(joint: JointResult, truth: dict[str, float]) -> Row:
    if not joint.parameters:
        return Row(joint.verdict)
    wrong = {name: joint.parameters[name].value - truth[name] for name in ("coulomb", "viscous", "offset")}
    return Row(
        joint.verdict,
        coulomb=round(wrong["coulomb"] / truth["coulomb"], 6),
        viscous=round(wrong["viscous"], 6),
        offset=round(wrong["offset"], 6),
    )


def summary(rows: Mapping[str, Row]) -> tuple[str, str, str, str]:
    """Return the legs' errors: of Coulomb friction mean and worst, of viscous friction and offset the worst."""
    joints = leg_joints(rows)
    errors = np.array([(rows[j].coulomb, rows[j].viscous, rows[j].offset) for j in joints], dtype=np.float64)
    coulomb, viscous, offset = np.abs(errors).T
    return (
        f"{100 * coulomb.mean():.2f} %",
        f"{100 * coulomb.max():.2f} %",
        f"{viscous.max():.4f} N m s/rad",
        f"{offset.max():.4f} N m",
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--save", type=Path, help="write the rows as JSON")
    arguments = parser.parse_args()
    scenario = read_scenario(SCENARIO)
    document = {}
    for case, each in zip(CASES, (scenario, with_upper_body(scenario)), strict=True):
        rows = accuracy(each)
        document[case] = {joint: asdict(row) for joint, row in rows.items()}
        print(f"friction in {case}")
        for joint, row in rows.items():
            print(f"  {joint:18}{_in_words(row)}")
        mean, worst, viscous, offset = summary(rows)
        print(f"  legs: Coulomb {mean} mean, {worst} worst; viscous {viscous}, offset {offset} at worst", flush=True)
    if arguments.save:
        arguments.save.write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")


def _in_words(row: Row) -> str:
    if row.coulomb is None:
        return row.verdict
    return (
        f"{row.verdict:12}Coulomb {100 * row.coulomb:+.3f} %, viscous {row.viscous:+.5f} N m s/rad, "
        f"offset {row.offset:+.5f} N m"
    )


if __name__ == "__main__":
    main()

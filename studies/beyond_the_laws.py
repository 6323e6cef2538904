"""What the user is told when friction is of no law that was fitted.

    python -m studies.beyond_the_laws --save studies/beyond_the_laws.json

A humanoid like TORO walks 40 steps, straight and sideways, with friction inside the family of the smooth Stribeck law,
and with friction outside of it: bristles (LuGre), play in the ankles, Coulomb friction that grows with load, and
friction that falls while the joints warm up. Encoder noise is 2e-5 rad, torque noise 0.1 N m. Then both methods fit the
Stribeck law.

Of the leg joints, what is told: the verdicts; the validation, whose noise alone is what it shows inside the family;
chi^2; and of how many joints a warning says what kind of friction they have. And what is not told: how much of the
friction torque that acted the law misses, root mean square over the walk, relative to that torque without its mean.
"""

import argparse
import json
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import TypedDict

import numpy as np

from stribeck import Settings, identify
from stribeck.finding import FRICTION
from stribeck.friction import get_law
from stribeck.identification.whole_log.tests_of_fit.findings import SENTENCES
from stribeck.outputs import whole_or_not_at_all
from stribeck.result import JointResult, Result
from stribeck_simulation.run import Simulated
from studies.accuracy_cases import CASES as NOISE
from studies.accuracy_cases import measured
from studies.beyond_cases import CASES, INSIDE, walk

LAW = "stribeck"
METHODS = {"curve-fit": Settings(law=LAW, method="curve-fit"), "whole-log": Settings(law=LAW, corrections="inertia")}
SEEDS = 2


class Told(TypedDict):
    """What a result says of the leg joints, and how far it is from the truth."""

    case: str
    method: str
    seed: int
    verdicts: dict[str, int]
    validation: float  # root mean square, mean over the joints [N m]
    chi_square: float | None
    kinds: dict[str, int]  # joints that a warning names, by what it says of them
    warnings: list[str]
    missed: float  # [1], mean over the joints


def tell(case: str, method: str, seed: int, simulated: Simulated) -> Told:
    """Return what a method says of a walk as noisy sensors see it."""
    log = measured(simulated.log, NOISE["A"], seed, 0)
    result = identify(log, simulated.robot, METHODS[method])
    legs = {joint: result.joints[joint] for joint in simulated.truth.parameters}
    rms = [joint.validation.rms for joint in legs.values() if joint.validation]
    return Told(
        case=case,
        method=method,
        seed=seed,
        verdicts=dict(Counter(joint.verdict for joint in legs.values())),
        validation=round(float(np.mean(rms)), 5),
        chi_square=round(result.corrections.chi_square, 3) if result.corrections else None,
        kinds=kinds_told(result, legs),
        warnings=result.warnings,
        missed=round(missed(simulated, legs), 4),
    )


def kinds_told(result: Result, joints: Iterable[str]) -> dict[str, int]:
    """Return how many of some joints a warning says something of, by what it says."""
    told = {finding.check.removeprefix(FRICTION): finding.joints for finding in result.findings}
    return {kind: len(set(told[kind]) & set(joints)) for kind in SENTENCES if kind in told}


def missed(simulated: Simulated, found: dict[str, JointResult]) -> float:
    """Return how much of the friction torque that acted the law misses, mean over the joints [1]."""
    log, law, shares = simulated.log, get_law(LAW), []
    velocity = np.gradient(log.position, log.time, axis=0)
    for name, joint in found.items():
        if not joint.parameters:
            continue
        column = log.joint_names.index(name)
        acted = simulated.truth.friction_torque[:, column]
        values = np.array([joint.parameters[parameter.name].value for parameter in law.parameters])
        left = acted - law.torque(velocity[:, column], values)
        shares.append(np.sqrt(np.mean(left**2)) / np.std(acted))
    return float(np.mean(shares))


def table(found: list[Told]) -> list[str]:
    """Return the rows of the table in docs/whole-log.md: means over the seeds."""
    together: dict[tuple[str, str], list[Told]] = {}
    for one in found:
        together.setdefault((one["case"], one["method"]), []).append(one)
    return [_row(*label, runs, together[INSIDE, label[1]]) for label, runs in together.items()]


def _row(case: str, method: str, runs: list[Told], inside: list[Told]) -> str:
    joints = sum(runs[0]["verdicts"].values())
    identified = _mean([one["verdicts"].get("identified", 0) for one in runs])
    rms, noise = (_mean([one["validation"] for one in several]) for several in (runs, inside))
    chi = [one["chi_square"] for one in runs if one["chi_square"] is not None]
    told = [
        f"{kind} {_mean([one['kinds'].get(kind, 0) for one in runs]):.0f}"
        for kind in SENTENCES
        if any(kind in one["kinds"] for one in runs)
    ]
    return (
        f"| {case} | {method} | {100 * _mean([one['missed'] for one in runs]):.0f} % | {identified:.0f} of {joints} "
        f"| {rms:.3f} | {rms / noise:.2f} | {f'{_mean(chi):.2f}' if chi else '–'} | {', '.join(told) or '–'} |"
    )


def _mean(values: Iterable[float]) -> float:
    return float(np.mean(list(values)))


HEAD = (
    "| friction | method | missed | identified | validation [N m] | over noise | chi^2 | joints flagged |\n"
    "|---|---|---:|---:|---:|---:|---:|---|"
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--save", type=Path, help="write what was told as JSON")
    arguments = parser.parse_args()
    found = []
    for case in CASES:
        simulated = walk(case)
        for method in METHODS:
            for seed in range(arguments.seeds):
                found.append(tell(case, method, seed, simulated))
                print(f"{case}, {method}, seed {seed}:", *found[-1]["warnings"], sep="\n  ", flush=True)
    print(HEAD, *table(found), sep="\n")
    if arguments.save:
        with whole_or_not_at_all(arguments.save) as temporary:
            temporary.write_text(json.dumps({"told": found}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

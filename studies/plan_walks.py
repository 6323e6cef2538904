"""Whether a walk that lasts longer, or is twice as fast, reaches the intervals that its plan promises.

    python -m studies.plan_walks --save studies/plan_walks.json

A robot walks 30 s at half of its pace, with noise of 2e-5 rad and so much in its torques that many joints are weak. The
plan says what the same walk would bring if it lasted longer, and what at twice the pace in the same time. Both walks
are made, exactly and with noise of their own, and identified. All that estimator and plan know is a wrong model, as in
`studies.accuracy`. The law is that of Coulomb and viscous friction.

Of each joint with friction, half of the 95 % interval of the friction curve that is obtained over the one that was
promised, at the same three speeds.
"""

import argparse
import json
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from stribeck import Robot, identify, plan
from stribeck.friction import get_law
from stribeck.log import RobotLog
from stribeck.planning.joint import PlannedJoint, Reach
from stribeck.result import JointResult
from stribeck.typing import Array
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.run import POSTURES
from studies.accuracy_cases import wrong_model
from studies.plan import ENCODER, MODELS, friction_of, rounded

LAW = "coulomb-viscous"
ROBOTS = {"TORO-like": ("toro.toml", "toro", 6.0), "quadruped": ("quadruped.toml", "quadruped", 3.0)}
"""Robot file, posture, and noise of the torques [N m]."""
RATE, SECONDS, TIMES, PACE = 500.0, 30.0, 4, 0.5
"""[Hz], length of the present walk [s], how many times as long the longer one is, pace of both [1]."""
FASTER = "the present motion twice as fast"
HEAD = (
    "| robot | joints | weak before | walk | curve: median, slow | middle | top | worst | within 30 % |\n"
    "|---|---:|---:|---|---:|---:|---:|---:|---:|"
)
"""Of the table."""


def walk(name: str, seconds: float, pace: float, path: int, noise: int) -> tuple[Robot, RobotLog]:
    """Return a robot, and the log of one of its walks, with noise drawn from a seed."""
    file, posture, std = ROBOTS[name]
    robot = Robot.from_file(MODELS / file)
    friction = friction_of(robot, LAW, 0)
    log, _ = exact_log(
        robot, get_law(LAW), friction, duration=seconds, rate=RATE, seed=path, posture=POSTURES[posture], pace=pace
    )
    generator = np.random.default_rng(noise)
    return robot, replace(
        log,
        velocity=None,
        acceleration=None,
        foot_wrench=None,
        position=log.position + ENCODER * generator.standard_normal(log.position.shape),
        torque=log.torque + std * generator.standard_normal(log.position.shape),
    )


def run(name: str, seed: int) -> dict[str, Any]:
    """Return what was obtained over what was promised, joint by joint."""
    robot, log = walk(name, SECONDS, PACE, seed, 10 * seed)
    known = wrong_model(robot, 0)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        found = identify(log, known, law=LAW, table=place / "friction_torque.parquet")
        (place / "result.json").write_text(found.to_json())
        names = [joint for joint, own in found.joints.items() if own.curve and own.verdict != "no friction"]
        planned = plan(place / "result.json", known, joints=names)
    longer = identify(walk(name, TIMES * SECONDS, PACE, seed, 10 * seed + 1)[1], known, law=LAW)
    faster = identify(walk(name, SECONDS, 2 * PACE, seed, 10 * seed + 2)[1], known, law=LAW)
    joints = {}
    for joint in names:
        now = found.joints[joint]
        share = PlannedJoint(
            column=0,
            found=now,
            guessed=False,
            prismatic=False,
            priors=known.settings.priors,
            rest=known.settings.rest,
            reach=Reach(low=0.0, high=0.0, speed=0.0),
        ).shrinking_share
        half = np.array([point.half_width for point in now.curve]) * np.sqrt(share / TIMES + 1 - share)
        promised = next(each for each in planned.joints[joint].candidates if each.motion == FASTER).curve
        joints[joint] = {
            "before": now.verdict,
            "longer": ratios(longer.joints[joint], [point.velocity for point in now.curve], half),
            "faster": ratios(
                faster.joints[joint],
                [point.velocity for point in promised],
                np.array([point.half_width for point in promised]),
            ),
        }
    return {"robot": name, "seed": seed, "joints": joints}


def ratios(joint: JointResult, speeds: Sequence[float], promised: Array) -> list[float]:
    """Return half of the 95 % interval of Coulomb + viscous speed, at three speeds, over the promised ones."""
    assert joint.correlation is not None
    names = list(joint.parameters)
    own = [names.index(name) for name in ("coulomb", "viscous")]
    errors = np.array([joint.parameters[names[k]].standard_error for k in own])
    covariance = np.array(joint.correlation)[np.ix_(own, own)] * np.outer(errors, errors)
    slopes = np.column_stack([np.ones(len(speeds)), speeds])
    quantile = np.mean([point.half_width / point.standard_error for point in joint.curve])
    half = quantile * np.sqrt(np.einsum("sp,pq,sq->s", slopes, covariance, slopes))
    return [rounded(value) for value in half / promised]


def rows(found: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the lines of the table."""
    lines = []
    for name in dict.fromkeys(each["robot"] for each in found):
        joints = [joint for each in found if each["robot"] == name for joint in each["joints"].values()]
        weak = sum(joint["before"] != "identified" for joint in joints)
        for key, label in (("longer", f"{TIMES} times as long"), ("faster", "twice as fast")):
            values = np.array([joint[key] for joint in joints])
            worst = values.flat[np.argmax(np.abs(np.log(values)))]
            near = np.mean((values >= 1 / 1.3) & (values <= 1.3))
            median = " | ".join(f"{value:.2f}" for value in np.median(values, axis=0))
            lines.append(f"| {name} | {len(joints)} | {weak} | {label} | {median} | {worst:.2f} | {near:.0%} |")
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", nargs="+", default=list(ROBOTS), choices=ROBOTS, help="only these")
    parser.add_argument("--seeds", type=int, default=3, help="walks and noise drawn so often")
    parser.add_argument("--save", type=Path, help="JSON that is written")
    arguments = parser.parse_args()
    found = [run(name, seed) for name in arguments.robots for seed in range(arguments.seeds)]
    if arguments.save:
        lines = ",\n".join(json.dumps(each) for each in found)
        arguments.save.write_text(f'{{"walks": [\n{lines}\n]}}\n', encoding="utf-8")
    print(HEAD, *rows(found), sep="\n")


if __name__ == "__main__":
    main()

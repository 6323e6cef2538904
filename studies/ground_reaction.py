"""What measured foot wrenches are worth: friction from ground reactions beside the curve fit and the whole log.

    python -m studies.ground_reaction --save studies/ground_reaction.json

The TORO-like humanoid of the accuracy study walks straight on, to the left and to the right, 138 s in all, in MuJoCo;
its feet's wrenches are logged. White noise is added, and in the last case the wrench sensors have zeros of 10 N and
1 N m and gains off by 3 %, standard deviations. All six parameters of the law are free. "Standing alone" fits it to the
samples of standing legs and no others, as one must whose swinging legs have no torque of their own.

Errors are those of the 12 leg joints: of Coulomb friction, relative, mean and worst; of viscous friction and offset the
mean. Beside them how much of a sensor's zero goes into an offset where it is not taken off: by the posture that the
robot has in the mean.
"""

import argparse
import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypedDict

import numpy as np

from stribeck import Robot, Settings, identify
from stribeck.friction_torque.stream import swinging_joints
from stribeck.identification.curve_fit.fit import fit_law
from stribeck.log import RobotLog
from stribeck.methods import METHODS, Fitted
from stribeck.methods.ground_reaction import GROUND_REACTION
from stribeck.robot.kinematics import joint_torque_of_wrench
from stribeck_simulation.run import Simulated
from stribeck_simulation.sensors.measure import with_noise
from studies.accuracy_cases import LAW, LEVELS, exact_walks

ROBOT = "TORO-like"
STANDING = "standing alone"


@dataclass(frozen=True)
class Case:
    """Standard deviations of white noise [rad], [N m], [N], [N m]; of zeros [N], [N m], and of gains [1]."""

    encoder: float = 0.0
    torque: float = 0.0
    force: float = 0.0
    moment: float = 0.0
    zeros: tuple[float, float] = (0.0, 0.0)
    gain: float = 0.0


CASES = {
    "clean": Case(),
    "A": Case(2e-5, 0.1, 1.0, 0.1),
    "B": Case(1e-4, 0.3, 3.0, 0.3),
    "A, wrench sensors wrong": Case(2e-5, 0.1, 1.0, 0.1, (10.0, 1.0), 0.03),
}


class Row(TypedDict):
    """A method on a case: joints that got numbers, and their errors [1], [1], [N m s/rad], [N m]."""

    case: str
    method: str
    joints: int
    coulomb: float
    coulomb_worst: float
    viscous: float
    offset: float


def standing_alone(prepared, robot, law, settings, friction_torque, progress):  # type: ignore[no-untyped-def] # noqa: ARG001
    """Fit the law to samples of standing legs; what is shown is all samples."""
    samples = friction_torque(prepared, robot, settings).samples
    feet = [name.split("+") for name in samples.support_names]
    swings = np.array([swinging_joints(robot, tuple(each))[robot.torque_controlled] for each in feet])
    fits = fit_law(replace(samples, usable=samples.usable & ~swings[samples.support]), law, settings)
    return Fitted(fits=fits, validations=dict.fromkeys(fits), robot=robot, logs=prepared)


def measured(log: RobotLog, case: Case, number: int) -> RobotLog:
    """Return a walk as the sensors of a case see it; the feet's errors are the same in all walks."""
    assert log.foot_wrench is not None
    if case == Case():
        return log
    noise, constant = np.random.default_rng([number, 1]), np.random.default_rng(0)
    feet = log.foot_wrench.shape[1]
    zeros = np.repeat(case.zeros, 3) * constant.standard_normal((feet, 6))
    gains = 1 + case.gain * constant.standard_normal((feet, 1))
    sizes = np.repeat([case.force, case.moment], 3)
    wrench = gains * log.foot_wrench + zeros + sizes * noise.standard_normal(log.foot_wrench.shape)
    return replace(with_noise(log, position=case.encoder, torque=case.torque, seed=number), foot_wrench=wrench)


def run(walks: list[Simulated], case: str, method: str) -> Row:
    """Return the errors of a method on a case."""
    logs = [measured(walk.log, CASES[case], number) for number, walk in enumerate(walks)]
    result = identify(logs, walks[0].robot, Settings(law=LAW, method=method))
    truth = walks[0].truth.parameters
    found = {joint: result.joints[joint].parameters for joint in truth if result.joints[joint].parameters}
    errors = np.array(
        [
            [one[name].value - truth[joint][name] for name in ("coulomb", "viscous", "offset")]
            for joint, one in found.items()
        ]
    )
    relative = np.abs(errors[:, 0]) / [truth[joint]["coulomb"] for joint in found]
    return Row(
        case=case,
        method=method,
        joints=len(found),
        coulomb=_rounded(relative.mean()),
        coulomb_worst=_rounded(relative.max()),
        viscous=_rounded(np.abs(errors[:, 1]).mean()),
        offset=_rounded(np.abs(errors[:, 2]).mean()),
    )


def levers(robot: Robot, log: RobotLog) -> dict[str, float]:
    """Return the torque of a joint for a newton of a sensor's zero in the worst direction [N m], left foot and leg."""
    posture = np.tile(log.position.mean(axis=0), (3, 1))
    (foot,) = (name for name in robot.contacts if "left" in name)
    frame = robot.tree.model.getFrameId(robot.contacts[foot].frame)
    found = np.linalg.norm(joint_torque_of_wrench(robot.tree, frame, posture, np.eye(3, 6)), axis=0)
    return {kind: _rounded(found[robot.joint_names.index(f"left_{kind.replace(' ', '_')}")]) for kind in LEVELS}


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")


HEAD = """\
| case | method | joints | Coulomb %, mean / worst | viscous | offset |
|---|---|---:|---:|---:|---:|"""


def table(rows: list[Row]) -> str:
    """Return the table of docs/ground-reaction.md."""
    lines = [
        f"| {row['case']} | {row['method']} | {row['joints']} | {100 * row['coulomb']:.2f} / "
        f"{100 * row['coulomb_worst']:.1f} | {row['viscous']:.3f} | {row['offset']:.4f} |"
        for row in rows
    ]
    return "\n".join([HEAD, *lines])


def lever_table(found: dict[str, float]) -> str:
    """Return the table of what a newton becomes."""
    shown = " | ".join(f"{value:.2f}" for value in found.values())
    return f"| {' | '.join(found)} |\n|{'---:|' * len(found)}\n| {shown} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--save", type=Path, help="JSON that is written")
    arguments = parser.parse_args()
    METHODS[STANDING] = replace(GROUND_REACTION, name=STANDING, find=standing_alone)
    walks = exact_walks(ROBOT)
    rows = []
    for case in CASES:
        for method in ("curve-fit", "ground-reaction", STANDING, "whole-log"):
            rows.append(run(walks, case, method))
            print(table(rows[-1:]).splitlines()[-1], flush=True)
    found = levers(walks[0].robot, walks[0].log)
    print(HEAD, lever_table(found), sep="\n")
    if arguments.save:
        arguments.save.write_text(json.dumps({"rows": rows, "levers": found}, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

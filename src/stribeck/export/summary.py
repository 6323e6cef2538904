"""The lines that an export prints, and writes at the head of its file."""

from collections.abc import Mapping
from pathlib import Path

from stribeck.export.joints import JointTerms
from stribeck.export.ranges import JointRanges
from stribeck.export.target import Target
from stribeck.result import Result
from stribeck.robot import Robot


def summary(
    result: Result, robot: Robot, target: Target, joints: Mapping[str, JointTerms | JointRanges], impossible: list[str]
) -> list[str]:
    """Return the lines.

    Parameters
    ----------
    result, robot
        What was found, of which robot.
    target
        What is written.
    joints
        What it says of each joint.
    impossible
        Joints whose body was found to be impossible.
    """
    paths = result.log.path if isinstance(result.log.path, list) else [result.log.path]
    logs = ", ".join(Path(path).name for path in paths if path) or "a log"
    model = Path(robot.model_path).name
    lines = [
        f"Written by stribeck from {model} and what was found in {logs} (method {result.method}, law {result.law})."
    ]
    corrections = result.corrections
    if corrections and corrections.bodies and target.models:
        lines.append(f"Inertias are changed of what these joints carry: {', '.join(corrections.bodies)}.")
    elif corrections and corrections.bodies:
        lines.append(f"Corrected inertias have no place here: {', '.join(corrections.bodies)}.")
    if impossible:
        lines.append(
            f"No body has the inertia found for these, so they have the nearest possible: {', '.join(impossible)}."
        )
    lines += [f"Joint {name}: {terms}." for name, terms in joints.items()]
    warm = {name: result.joints[name].mean_temperature for name in joints}
    if known := [f"{name} {mean:.3g}" for name, mean in warm.items() if mean is not None]:
        lines.append(f"It holds at the mean temperatures of the log [deg C]: {', '.join(known)}.")
    kept = [name for name in result.joints if name not in joints]
    if kept and target.models:
        lines.append(f"Not identified, so that these joints keep what the model said: {', '.join(kept)}.")
    elif kept:
        lines.append(f"Not identified, or not asked for: {', '.join(kept)}.")
    if result.couplings:
        lines.append(f"The friction of couplings has no place here: {', '.join(result.couplings)}.")
    if corrections and (corrections.torque_gain or corrections.encoder_zero):
        lines.append(
            "Gains of torque sensors and zeros of encoders were found too; they are the sensors', not the model's."
        )
    return lines

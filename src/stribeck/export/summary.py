"""What the head of an exported model says: where it comes from, what was changed, what it has no place for."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from stribeck.export.joints import JointTerms, Quantity
from stribeck.result import Result


def summary(result: Result, model: str, joints: Mapping[str, JointTerms], mended: list[str]) -> list[str]:
    """Return the lines.

    Parameters
    ----------
    result
        What was found.
    model
        Name of the robot's model file.
    joints
        What is stated of each joint.
    mended
        Joints whose body was found to be impossible.
    """
    paths = result.log.path if isinstance(result.log.path, list) else [result.log.path]
    logs = ", ".join(Path(path).name for path in paths if path) or "a log"
    lines = [
        f"Written by stribeck from {model} and what was found in {logs} (method {result.method}, law {result.law})."
    ]
    corrections = result.corrections
    if corrections and corrections.bodies:
        lines.append(f"Inertias are changed of what these joints carry: {', '.join(corrections.bodies)}.")
    if mended:
        lines.append(
            f"No body has the inertia found for these, so they have the nearest possible: {', '.join(mended)}."
        )
    for name, terms in joints.items():
        lost = f"; no place here for {_listed(terms.left_out)}" if terms.left_out else ""
        lines.append(f"Joint {name}: {_listed(terms.stated)}{lost}.")
    kept = [name for name in result.joints if name not in joints]
    if kept:
        lines.append(f"Not identified, so that these joints keep what the model said: {', '.join(kept)}.")
    if corrections and (corrections.torque_gain or corrections.encoder_zero):
        lines.append(
            "Gains of torque sensors and zeros of encoders were found too; they are the sensors', not the model's."
        )
    return lines


def _listed(quantities: Mapping[str, Quantity]) -> str:
    return ", ".join(f"{name} {value:.4g}" + f" {unit}" * (unit != "1") for name, (value, unit) in quantities.items())

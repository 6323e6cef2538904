"""What a result says of each joint, in a model format's own words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from stribeck.result import JointResult, Result, at_load

SOURCES = {
    "coulomb": ("coulomb", "coulomb_positive", "coulomb_negative"),
    "viscous": ("viscous", "viscous_positive", "viscous_negative"),
    "armature": ("armature",),
}
"""Parameters of laws behind each term that models know; of the two directions they get the mean."""

NO_FRICTION = {
    "N m": {"coulomb": "N m", "viscous": "N m s/rad"},
    "N": {"coulomb": "N", "viscous": "N s/m"},
}
"""Unit of a joint's friction -> units of its terms, of a joint that has none."""

Quantity = tuple[float, str]
"""Value and unit."""


@dataclass(frozen=True, kw_only=True)
class JointTerms:
    """What is stated of a joint, by the format's attribute, the parameters that it has no place for, and a note."""

    stated: dict[str, Quantity] = field(default_factory=dict)
    left_out: dict[str, Quantity] = field(default_factory=dict)
    note: str = ""


def joint_terms(result: Result, words: Mapping[str, str]) -> dict[str, JointTerms]:
    """Return the terms of the joints that the log identified.

    Friction is stated as a whole if it is identified, or Coulomb or viscous friction is, of any direction: the two make
    up for each other's errors. Where none was detectable it is zero. A rotor inertia stands by itself.

    Parameters
    ----------
    result
        What was found.
    words
        Term of `SOURCES` -> the format's attribute, of the terms that it has a place for.
    """
    terms = {name: _terms(joint, words) for name, joint in result.joints.items()}
    return {name: found for name, found in terms.items() if found.stated}


def _terms(joint: JointResult, words: Mapping[str, str]) -> JointTerms:
    there, loaded = joint.parameters, {}
    if "load" in there:  # formats know no load: what resists at the mean one
        loaded = at_load({name: found.value for name, found in there.items()}, joint.mean_load or 0.0)
    names = {term: [name for name in sources if name in there] for term, sources in SOURCES.items()}
    identified = {term for term, own in names.items() if any(there[name].verdict == "identified" for name in own)}
    if joint.verdict == "identified" or identified & {"coulomb", "viscous"}:
        identified |= {"coulomb", "viscous"}
    stated: dict[str, Quantity] = {}
    if joint.verdict == "no friction" and joint.curve:
        units = NO_FRICTION[joint.curve[0].unit]
        stated = {words[term]: (0.0, unit) for term, unit in units.items() if term in words}
    for term in words:
        if term in identified and names[term]:
            values = [loaded.get(name, there[name].value) for name in names[term]]
            stated[words[term]] = sum(values) / len(values), there[names[term][0]].unit
    bound = joint.reason if joint.verdict == "no friction" else ""
    left_out = {name: (found.value, found.unit) for name, found in there.items() if name not in words}
    return JointTerms(stated=stated, left_out=left_out, note=bound)


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
        note = f" ({terms.note})" if terms.note else ""
        lines.append(f"Joint {name}: {_listed(terms.stated)}{note}{lost}.")
    kept = [name for name in result.joints if name not in joints]
    if kept:
        lines.append(f"Not identified, so that these joints keep what the model said: {', '.join(kept)}.")
    if result.couplings:
        lines.append(f"The friction of couplings has no place here: {', '.join(result.couplings)}.")
    if corrections and (corrections.torque_gain or corrections.encoder_zero):
        lines.append(
            "Gains of torque sensors and zeros of encoders were found too; they are the sensors', not the model's."
        )
    return lines


def _listed(quantities: Mapping[str, Quantity]) -> str:
    return ", ".join(f"{name} {value:.4g}" + f" {unit}" * (unit != "1") for name, (value, unit) in quantities.items())

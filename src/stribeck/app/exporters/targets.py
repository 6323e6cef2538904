"""Targets of `stribeck export --to`, listed in targets.toml, and the summary at the head of their files."""

from __future__ import annotations

import tomllib
from collections import ChainMap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pinocchio as pin

from stribeck.app.exporters.forms import Form
from stribeck.app.exporters.joints import WrittenJoint
from stribeck.app.exporters.posterior import JointRanges
from stribeck.core.base.parts import Parts
from stribeck.core.result import Result
from stribeck.core.robot import Robot


@dataclass(frozen=True, eq=False, kw_only=True)
class Request:
    """The content of an export.

    Attributes
    ----------
    result, robot
        The result of an identification, and its robot.
    joints
        Terms that the target states, by joint.
    form
        Name of the friction model.
    links
        New inertias by link; empty unless the target writes the robot's model.
    lines
        Head of the file: quantities stated, approximated and left out.
    folder
        Folder of the file, for relative paths of meshes.
    """

    result: Result
    robot: Robot
    joints: Mapping[str, WrittenJoint]
    form: str
    links: Mapping[str, pin.Inertia]
    lines: list[str]
    folder: Path

    def numbers(self, joint: str) -> dict[str, float]:
        """Collect the values that the target states for a joint; empty for other joints."""
        return self.joints[joint].numbers if joint in self.joints else {}


@dataclass(frozen=True, eq=False, kw_only=True)
class Target:
    """A target of `stribeck export --to`.

    To add one: add its table to targets.toml, its row to the table in docs/export.md, and its template, named after
    target and suffix, e.g. templates/usd.py.j2. A target that writes a robot's model has a function in `MODELS` of
    model_files.py instead of a template.

    Attributes
    ----------
    forms
        Friction models by name; the first is the default. None stores all steady friction.
    suffix
        File suffix.
    models
        Kinds of robot models that the target writes with their inertias; empty for other kinds of files.
    any_unit
        Whether the file states each joint's unit, so that friction in A, or in rad of a command, can be stored.
    ranges
        Template of a file of ranges of the form "plain"; empty if the target does not support ranges.
    text
        Function that formats the file, for targets of other packages.
    """

    forms: Mapping[str, Form | None]
    suffix: str
    models: Sequence[str] = ()
    any_unit: bool = False
    ranges: str = ""
    text: Callable[[Request], str] | None = None


_OWN = {
    name: Target(**table | {"forms": {form: Form(words) if words else None for form, words in table["forms"].items()}})
    for name, table in tomllib.loads(Path(__file__).with_name("targets.toml").read_text("utf-8")).items()
}
TARGETS = ChainMap[str, Target](_OWN, Parts[Target]("stribeck.targets"))
"""Targets by their name after `--to`."""


Stated = Mapping[str, WrittenJoint | JointRanges]
"""Terms or ranges that a target states, by joint."""


def summary(
    result: Result, robot: Robot, target: Target, joints: Stated, impossible: list[str], inertia: bool, reason: str
) -> list[str]:
    """Summarize an export in lines for the console and the head of the file.

    Parameters
    ----------
    result, robot
        The result of an identification, and its robot.
    target
        The target of the export.
    joints
        Terms or ranges that the target states, by joint.
    impossible
        Joints whose estimated body is physically impossible.
    inertia, reason
        Whether a robot model gets the estimated inertias, and a clause on their effect.
    """
    logs = ", ".join(Path(path).name for path in result.log.paths if path) or "a log"
    corrections = result.corrections
    bodies = ", ".join(corrections.bodies) if corrections else ""
    temperatures = {name: result[name].mean_temperature for name in joints}
    warm = ", ".join(f"{name} {mean:.3g}" for name, mean in temperatures.items() if mean is not None)
    scaled = {name: joint for name, joint in result.joints.items() if joint.torque_unit and name not in joints}
    kept = ", ".join(name for name in result.joints if name not in joints and name not in scaled)
    slow = ", ".join(name for name, terms in joints.items() if isinstance(terms, WrittenJoint) and terms.beyond)
    couplings = [name for name in result.couplings if name not in joints]
    changed, unchanged = "Cannot store corrected inertias", "Not identified or not requested"
    if target.models:
        changed = "Wrote the estimated" if inertia else "Kept the model's"
        changed = f"{changed} inertias of the links driven by"
        bodies = bodies and f"{bodies} ({reason}{'; `--inertia write` writes them' * (not inertia)})"
        unchanged = "Not identified; the model's friction is kept for"
    nearest = "Physically impossible estimate; the nearest valid inertia was written for the links driven by"
    sentences = {
        "Offsets are zero, because commands have no sensor; all other values are the most probable ones then.": inertia
        and robot.torque_source == "command",
        f"{changed}: {bodies}.": bodies,
        f"{nearest}: {', '.join(impossible)}.": impossible,
        **{f"Joint {name}: {terms}.": True for name, terms in joints.items()},
        **{f"Left out joint {name}: {joint.unit_note}.": True for name, joint in scaled.items()},
        f"Extrapolated beyond the log's speeds, with the other joints: {slow}.": slow,
        f"Valid at the mean joint temperatures of the log [°C]: {warm}.": warm,
        f"{unchanged}: {kept}.": kept,
        f"Cannot store the friction of couplings: {', '.join(couplings)}.": couplings,
        "Not part of a model: the estimated gains of torque sensors and zeros of encoders.": corrections
        and (corrections.torque_gain or corrections.encoder_zero),
    }
    model = Path(robot.model_path).name or robot.name
    first = f"Written by stribeck from {model} and the result of {logs} (method {result.method}, law {result.law})."
    return [first, *(sentence for sentence, holds in sentences.items() if holds)]

"""Draft of a robot file: tables, comments and questions, and entries that the model determines."""

import re
import textwrap
import tomllib
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.items import Table

from stribeck.check.init.model import ModelFacts
from stribeck.check.init.names import QUESTIONS, match, words
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot, robot_fields
from stribeck.core.robot.robot_file import validated
from stribeck.io import Recording, read_recording


@dataclass
class Draft:
    """Draft of a robot file.

    Attributes
    ----------
    facts
        Joints and feet of the model.
    output
        Path of the robot file.
    document
        Tables of the robot file.
    notes
        Comments by dotted key.
    questions
        Questions that neither model nor log answer, one sentence each.
    warnings
        Problems of model and log that do not prevent their use, one sentence each.
    imus
        Topics of IMUs, if frames do not tell which one is on the base.
    """

    facts: ModelFacts
    output: Path
    document: dict[str, Any]
    notes: dict[str, list[str]] = field(default_factory=dict)
    questions: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    imus: list[str] = field(default_factory=list)
    _read: tuple[dict[str, Any], RobotLog] | None = None

    def table(self, place: str) -> dict[str, Any]:
        """Return a table by its dotted key; create it if necessary."""
        table = self.document
        for part in place.split("."):
            table = table.setdefault(part, {})
        return table

    def set(self, place: str, key: str, value: object, why: str) -> None:
        """Set a key of a table, with a comment that gives the reason."""
        self.table(place)[key] = value
        self.note(f"{place}.{key}", why)

    def guess(self, place: str, key: str, value: object, question: str) -> None:
        """Set a key of a table to a guess, with a question that gives its evidence."""
        self.table(place)[key] = value
        self.ask(f"{place}.{key}", question)

    def note(self, key: str, text: str) -> None:
        """Add a comment above a key, or below the header of a table."""
        self.notes.setdefault(key, []).append(text)

    def ask(self, key: str, text: str) -> None:
        """Add a question as a comment."""
        self.questions.append(text)
        self.note(key, f"TODO: {text}")

    def warn(self, key: str, text: str) -> None:
        """Add a warning as a comment."""
        self.warnings.append(text)
        self.note(key, f"Warning: {text}")

    @property
    def text(self) -> str:
        """Text of the robot file."""
        file = tomlkit.document()
        heading = ['Written by `stribeck init`. The page "Robot file" of the documentation explains every key.']
        if self.questions:
            heading.append(f"Questions that model and log leave open are marked TODO ({len(self.questions)} of them).")
        for line in heading:
            file.add(tomlkit.comment(line))
        for name, table in self.document.items():
            if table or name in self.notes:
                file.add(tomlkit.nl())
                file.add(name, _build_table(table, name, self.notes))
        return tomlkit.dumps(file)

    def robot(self) -> Robot:
        """Build the robot that the file describes."""
        return Robot(**robot_fields(validated(tomllib.loads(self.text), self.output), self.output))

    def read(self, source: Recording) -> RobotLog:
        """Read the opened log as the file describes it, only once while that stays the same."""
        if self._read is None or self._read[0] != self.document:
            self._read = deepcopy(self.document), read_recording(source, self.robot())
        return self._read[1]


def _build_table(values: Mapping[str, Any], place: str, notes: Mapping[str, list[str]]) -> Table:
    """Build a table of a robot file, plain keys before tables, with its comments."""
    # Largest length of a comment, and of a list on one line, in characters [1].
    width = 108
    table = tomlkit.table()

    def comment(key: str) -> None:
        for text in notes.get(key, []):
            for line in textwrap.wrap(text, width, break_long_words=False, break_on_hyphens=False):
                table.add(tomlkit.comment(line))

    comment(place)
    for key, value in sorted(values.items(), key=lambda item: isinstance(item[1], dict)):
        inside = f"{place}.{key}"
        if isinstance(value, dict):
            table.add(key, _build_table(value, inside, notes))
            continue
        comment(inside)
        item = tomlkit.item(value)
        if isinstance(value, list):
            item.multiline(len(str(value)) > width)
        table.add(key, item)
    return table


def ask_for_torque_source(draft: Draft) -> None:
    """Write the default torque source, and ask for the right one; rotors, which others contain, are fitted as well."""
    draft.guess("robot", "torque_source", "link_side_sensor", QUESTIONS["torque_source"])
    why = "as long as the torque source is a guess; torques before the gear contain the rotors."
    draft.set("identify", "fit_armature", True, why)


def ask_for_ankles(draft: Draft) -> None:
    """Propose couplings for ankles like those of G1, H1-2 and Digit, which two parallel motors move."""
    rolls = {joint: re.sub("pitch", "roll", joint, flags=re.IGNORECASE) for joint in draft.facts.joints}
    both = [pair for pair in rolls.items() if pair[1] in rolls.keys() - {pair[0]}]
    if ankles := [pair for pair in both if {"ankle", "toe"} & set(words(pair[0]))]:
        every = ", ".join(map(" and ".join, ankles))
        draft.ask("robot", QUESTIONS["ankles"].format(*ankles[0], every=every))


def write_contacts(draft: Draft, labels: Sequence[str]) -> None:
    """Write the feet, with the log's names if available."""
    facts = draft.facts
    if draft.document["robot"]["base"] == "fixed":
        return
    names = {foot: label for label, foot in match(labels, [foot.name for foot in facts.feet]).items()}
    if topics := {label: foot for foot, label in names.items() if label.startswith("/")}:
        draft.table("log")["foot_names"] = topics
    contacts: dict[str, dict[str, str | float]] = {}
    for foot in facts.feet:
        name = foot.name if foot.name in topics.values() else names.get(foot.name, foot.name)
        contacts[name] = {"frame": foot.frame, "kind": foot.kind}
        if foot.radius:
            contacts[name]["radius"] = foot.radius
            draft.note(f"contacts.{name}", "this contact rolls; the radius [m] is from the model's collision shape.")
        elif foot.kind == "wheel" and len(facts.wheels) == len(facts.feet):
            draft.note(f"contacts.{name}", "this wheel rolls; it and others share the load, so it is not identified.")
        elif foot.kind == "wheel":
            draft.ask(f"contacts.{name}", QUESTIONS["radius"])
        if foot.name in facts.tilted:
            draft.ask(f"contacts.{name}", "does the z axis of this frame point up when the sole lies flat?")
    draft.document["contacts"] = contacts
    unknown = [label for label in labels if label not in names.values()]
    if unknown and len(names) < len(facts.feet):
        draft.ask("robot.base", f"which contacts are the log's {', '.join(unknown)}? Name them in [log.foot_names].")
    if not contacts:
        draft.ask("robot.base", "which frames of the model are feet? Add [contacts.<foot>] frame and kind.")

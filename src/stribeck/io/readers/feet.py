"""Columns of a log for each foot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from stribeck.core.errors import LogError, listed
from stribeck.core.log.channels import FOOT_CHANNELS, WRENCH, widened
from stribeck.core.settings import LogTable
from stribeck.io.readers.recording import Recording

if TYPE_CHECKING:
    from stribeck.core.robot import Robot


def foot_columns(
    labels: dict[str, tuple[str, ...]], source: Recording, table: LogTable, robot: Robot | None, notes: list[str]
) -> tuple[tuple[str, ...], dict[str, list[int]]]:
    """Find the feet that all foot channels of the log cover, and their columns."""
    places: dict[str, dict[str, int]] = {}
    for name in FOOT_CHANNELS:
        if name in labels:
            renamed = [_rename_foot(label, table, tuple(robot.contacts) if robot else ()) for label in labels[name]]
            places[name] = places_of(renamed, name, source.path)
    if not places:
        return (), {}
    offers = {
        name: {foot.rsplit(".", 1)[0] if name == "foot_wrench" else foot: None for foot in feet}
        for name, feet in places.items()
    }
    known = tuple(robot.contacts) if robot else tuple(dict.fromkeys(foot for feet in offers.values() for foot in feet))
    strangers = [foot for foot in dict.fromkeys(f for feet in offers.values() for f in feet) if foot not in known]
    if strangers and robot:
        notes.append(f"Feet {listed(strangers)} of the log are not contacts of the robot and are ignored.")
    offers = {name: feet for name, feet in offers.items() if any(foot in feet for foot in known)}
    feet = tuple(foot for foot in known if offers and all(foot in feet for feet in offers.values()))
    if not feet:
        return (), {}
    columns: dict[str, list[int]] = {}
    for name in offers:
        wanted = widened(feet, len(WRENCH) if name == "foot_wrench" else 1)
        if absent := [label for label in wanted if label not in places[name]]:
            raise LogError(
                f"{source.path}: '{name}' has no column for {listed(absent)}; expected six columns per foot, or "
                "'foot_force' if only the vertical force is measured"
            )
        columns[name] = [places[name][label] for label in wanted]
    return feet, columns


def _rename_foot(label: str, table: LogTable, contacts: Sequence[str]) -> str:
    """Translate the log's name of a foot, or of a wrench column `<foot>.<axis>`, to the contact's name.

    A topic without a setting belongs to the contact whose name it contains, the longest if there are several.
    """
    foot, dot, axis = label.rpartition(".")
    if axis not in WRENCH:
        foot, dot, axis = label, "", ""
    name = table.foot_names.get(foot, foot)
    if name.startswith("/"):
        name = max((contact for contact in contacts if contact in name), key=len, default=name)
    return f"{name}{dot}{axis}"


def places_of(names: Sequence[str], channel: str, path: str) -> dict[str, int]:
    """Map names to their columns; refuse duplicate names."""
    places = {name: place for place, name in enumerate(names)}
    if len(places) < len(names):
        twice = sorted({name for name in names if list(names).count(name) > 1})
        raise LogError(
            f"{path}: '{channel}' has more than one column for {listed(twice)}; expected one per name; "
            f"choose it by [log.{channel}] name"
        )
    return places

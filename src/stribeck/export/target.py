"""The contract of an export's target: a simulator's or a controller's own form of a robot's friction."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from stribeck.export.forms import Form
from stribeck.export.joints import JointTerms
from stribeck.export.links import LinkInertia
from stribeck.export.ranges import JointRanges
from stribeck.result import Result
from stribeck.robot import Robot


@dataclass(frozen=True, eq=False, kw_only=True)
class Request:
    """What is to be written.

    Attributes
    ----------
    result, robot
        What was found, of which robot.
    joints
        What the target says of each joint.
    form
        Name of the form of their friction.
    links
        New inertias by link; none unless the target writes the robot's model.
    lines
        The file's head: what was found, projected and lost.
    folder
        That the file will lie in, as paths of meshes are relative.
    """

    result: Result
    robot: Robot
    joints: Mapping[str, JointTerms]
    form: str
    links: Mapping[str, LinkInertia]
    lines: list[str]
    folder: Path

    @property
    def model(self) -> Path:
        """The robot's model file."""
        return Path(self.robot.model_path)


@dataclass(frozen=True, eq=False, kw_only=True)
class Target:
    """A target of `stribeck export --to`.

    To add one: write `export/<name>.py` with a `TARGET`, add it to `TARGETS` in `export/write.py` and to `FORMATS` in
    `cli/app.py`, and its row to the table in docs/export.md.

    Attributes
    ----------
    title
        What it is for, a few words.
    forms
        Of its friction, by name; the first is taken where others lose as much. None says all of it.
    suffix
        Of its files.
    text
        Return the file's text.
    models
        Kinds of robot models that it writes again, with their inertias; none if it writes another kind of file.
    ranges
        Return the text of a file of ranges, from the lines of its head and the ranges of the first form; None if
        nobody draws robots there.
    """

    title: str
    forms: Mapping[str, Form | None]
    suffix: str
    text: Callable[[Request], str]
    models: tuple[str, ...] = ()
    ranges: Callable[[list[str], Mapping[str, JointRanges]], str] | None = None

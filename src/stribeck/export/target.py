"""The contract of an export's target: a simulator's or a controller's own form of a robot's friction."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import pinocchio as pin

from stribeck.export.forms import Form
from stribeck.export.joints import JointTerms
from stribeck.export.ranges import JointRanges
from stribeck.result import Result
from stribeck.robot import Robot


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
        Name of the form of their friction.
    links
        New inertias by link; none unless the target writes the robot's model.
    lines
        The file's head: quantities found, projected and lost.
    folder
        Folder of the file, as paths of meshes are relative.
    """

    result: Result
    robot: Robot
    joints: Mapping[str, JointTerms]
    form: str
    links: Mapping[str, pin.Inertia]
    lines: list[str]
    folder: Path

    @property
    def model(self) -> Path:
        """The robot's model file."""
        return Path(self.robot.model_path)


@dataclass(frozen=True, eq=False, kw_only=True)
class Target:
    """A target of `stribeck export --to`.

    To add one: write a function that returns the file's text, add its `Target` to `TARGETS` in `export/targets.py`
    and its name to `FORMATS` in `cli/app.py`, and its row to the table in docs/export.md.

    Attributes
    ----------
    forms
        Forms of its friction by name; the first is taken where others lose as much. None has all steady friction.
    suffix
        Suffix of its files.
    text
        Returns the file's text.
    models
        Kinds of robot models that it writes again, with their inertias; none if it writes another kind of file.
    ranges
        Returns the text of a file of ranges, from the lines of its head and the ranges of the form "plain"; None if
        the target has no use for ranges.
    """

    forms: Mapping[str, Form | None]
    suffix: str
    text: Callable[[Request], str]
    models: tuple[str, ...] = ()
    ranges: Callable[[list[str], Mapping[str, JointRanges]], str] | None = None

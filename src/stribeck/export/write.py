"""Writes the robot's own model file again, with what was found in its logs."""

from __future__ import annotations

from pathlib import Path

from stribeck.errors import NothingIdentifiedError, SettingsError
from stribeck.export import mjcf, urdf
from stribeck.export.document import document_text
from stribeck.export.joints import joint_terms, summary
from stribeck.export.links import corrected_links
from stribeck.outputs import whole_or_not_at_all
from stribeck.result import Corrections, Result, read_result
from stribeck.robot import Robot
from stribeck.robot.model_file import kind_of, load_model

TARGETS = {"mjcf": (mjcf.changed_mjcf, mjcf.TERMS), "urdf": (urdf.changed_urdf, urdf.TERMS)}
"""Format -> how a model file of it is changed, and its words for what it has a place for.

To add a format: write `export/<format>.py` with a function that takes the robot's model file, the new inertias by link,
the new terms by joint, and the folder that the file will lie in, and returns an XML document; then add it here.
"""


def export(result: Result | str | Path, robot: Robot | str | Path, path: str | Path, target: str) -> list[str]:
    """Write the robot's model with the inertias and the friction that its logs have shown.

    Inertias are those of the method `whole-log`. Joints whose friction was not identified keep what the model says of
    them, and so does everything else. The file's head says what was changed.

    Parameters
    ----------
    result
        What was found, or the path of its result.json.
    robot
        The robot as it was identified, or the path of its robot file.
    path
        The file to write, whole or not at all.
    target
        "urdf" or "mjcf", which is also the format of the robot's model.

    Returns
    -------
    summary
        What was changed and what the format has no place for, a line each.

    Raises
    ------
    SettingsError
        If the format is another one, the result is of another robot or model, or the file would be the model itself.
    NothingIdentifiedError
        If the result holds nothing that the format has a place for.
    RobotFileError
        If a robot file is given and cannot be used.

    Examples
    --------
    >>> for line in export("out/result.json", "robot.toml", "found.urdf", "urdf"):
    ...     print(line.partition(":")[0])
    Written by stribeck from arm.urdf and what was found in log.npz (method whole-log, law auto).
    Inertias are changed of what these joints carry
    Joint shoulder
    Joint elbow
    Joint slide
    """
    result = result if isinstance(result, Result) else read_result(result)
    robot = robot if isinstance(robot, Robot) else Robot.from_file(robot)
    if target not in TARGETS:
        raise SettingsError(f"export: the format is '{target}'; expected {' or '.join(TARGETS)}")
    change, words = TARGETS[target]
    model = Path(robot.model_path)
    _check(result, robot, model, Path(path), target)
    corrections = result.corrections or Corrections(chi_square=0.0)
    file, _ = load_model(model, robot.base)
    links, mended = corrected_links(file, robot.tree.model, corrections, str(model))
    joints = joint_terms(result, words)
    if not links and not joints:
        raise NothingIdentifiedError(
            f"export: the result has neither corrected inertias nor an identified friction that {target.upper()} has a "
            "place for"
        )
    lines = summary(result, model.name, joints, mended)
    text = document_text(change(model, links, joints, Path(path).parent), lines)
    with whole_or_not_at_all(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return lines


def _check(result: Result, robot: Robot, model: Path, path: Path, target: str) -> None:
    """Refuse a target of another format, a result of another robot, and writing over the model."""
    kind = kind_of(model)
    if kind not in TARGETS:
        raise SettingsError(
            f"{model}: is {kind.upper()}, which is not written; expected a robot whose model is URDF or MJCF"
        )
    if kind != target:
        raise SettingsError(
            f"{model}: is {kind.upper()}, and models are not converted; export to {kind}, or name a robot file whose "
            f"model is {target.upper()}"
        )
    unknown = [joint for joint in result.joints if joint not in robot.joint_names]
    if unknown:
        raise SettingsError(
            f"{robot.path}: the result has joint '{unknown[0]}', which this robot has not; it has "
            f"{', '.join(robot.joint_names)}"
        )
    if path.exists() and path.samefile(model):
        raise SettingsError(f"{path}: is the robot's own model; expected another file to write to")

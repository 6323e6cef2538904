"""Writes the friction that was found for a simulator or a controller: a robot's model again, or another file."""

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

from stribeck.base.outputs import staged_folder, whole_or_not_at_all
from stribeck.errors import NothingIdentifiedError, SettingsError, did_you_mean
from stribeck.exporters.joints import joint_terms
from stribeck.exporters.links import corrected_links
from stribeck.exporters.ranges import joint_ranges
from stribeck.exporters.samples import drawn
from stribeck.exporters.target import Request, summary
from stribeck.exporters.targets import TARGETS
from stribeck.result import Result, read_result
from stribeck.robot import Robot
from stribeck.robot.model_file import kind_of

MOST_SAMPLES = 100_000
"""Files that `export_samples` writes to one folder."""


def export(
    result: Result | str | Path,
    robot: Robot | str | Path,
    path: str | Path,
    target: str,
    *,
    joints: Collection[str] | None = None,
    include_weak: bool = False,
    strict: bool = False,
    friction: str | None = None,
) -> list[str]:
    """Write what was found of a robot as a simulator or a controller reads it.

    Friction that a target cannot say is replaced by the nearest that it can, and what that loses is told. Inertias are
    those of the method `whole-log`, for targets that are models. Joints whose friction was not identified keep what the
    model says of them, and so does everything else. The file's head says what was changed.

    Parameters
    ----------
    result
        What was found, or the path of its result.json.
    robot
        The robot as it was identified, or the path of its robot file.
    path
        The file to write, whole or not at all.
    target
        One of `TARGETS`; "urdf", "drake" and "mjcf" write the robot's model again, which must be a URDF, or an MJCF
        for "mjcf".
    joints
        Those whose friction is written; all if None.
    include_weak
        Whether weak friction is written too.
    strict
        Whether to refuse a target that cannot say all of the friction.
    friction
        Form of the friction, for targets with several ("plain" or "lugre" of MJCF, "all" or "plain" of YAML); the one
        that loses least if None.

    Returns
    -------
    summary
        What was changed, what is only nearly said, and what the target has no place for, a line each.

    Raises
    ------
    SettingsError
        If the target is another one, the result is of another robot or model, the file would be the model itself, a
        joint or a form is asked for that there is not, or, if `strict`, something would be lost.
    NothingIdentifiedError
        If the result holds nothing that the target has a place for.
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
    request = _request(*_read(result, robot), Path(path), target, joints, include_weak, friction)
    for name, own in request.joints.items():
        if strict and (lost := [*own.projected, *own.left_out]):
            raise SettingsError(
                f"export: joint '{name}' has {', '.join(lost)}, which {target} cannot say; export without --strict, "
                "or to a target that can"
            )
    with whole_or_not_at_all(path) as temporary:
        temporary.write_text(TARGETS[target].text(request), encoding="utf-8")
    return request.lines


def export_samples(
    result: Result | str | Path,
    robot: Robot | str | Path,
    folder: str | Path,
    target: str,
    count: int,
    *,
    joints: Collection[str] | None = None,
    include_weak: bool = False,
    friction: str | None = None,
    seed: int = 0,
) -> list[Path]:
    """Write so many files as `export` does, each of a robot that the log cannot tell from the one that was found.

    Parameters and inertias are drawn as by `stribeck.exporters.samples.drawn`: what a simulation that randomises its
    robots otherwise guesses.

    Parameters
    ----------
    folder
        That gets the files, all or none: 000 and so on with the target's suffix.
    count, seed
        How many, and the seed of the draws.
    result, robot, target, joints, include_weak, friction
        As of `export`.

    Returns
    -------
    paths
        Of the files.

    Raises
    ------
    SettingsError, NothingIdentifiedError, RobotFileError
        As `export` does.

    Examples
    --------
    >>> [path.name for path in export_samples("out/result.json", "robot.toml", "draws", "urdf", 2)]
    ['000.urdf', '001.urdf']
    """
    result, robot = _read(result, robot)
    if not 1 <= count <= MOST_SAMPLES:
        raise SettingsError(f"export: {count} samples are asked for; expected 1 to {MOST_SAMPLES:,}")
    form = _request(result, robot, Path(folder), target, joints, include_weak, friction).form  # the same in all
    own = TARGETS[target]
    paths = [Path(folder) / f"{k:03d}{own.suffix}" for k in range(count)]
    with staged_folder(folder) as staging:
        for path, each in zip(paths, drawn(result, count, seed), strict=True):
            text = own.text(_request(each, robot, path, target, joints, include_weak, form))
            (staging / path.name).write_text(text, encoding="utf-8")
    return paths


def export_ranges(
    result: Result | str | Path,
    robot: Robot | str | Path,
    path: str | Path,
    target: str,
    *,
    joints: Collection[str] | None = None,
    include_weak: bool = False,
) -> list[str]:
    """Write the ranges that a simulation draws friction and rotor inertias from, in a target's own form.

    Each holds 95 % of the robots that the log cannot tell apart from the one that was found
    (`stribeck.exporters.samples.drawn`).

    Parameters
    ----------
    path
        The file to write, whole or not at all: a Python module for "mjcf" and "isaaclab", or YAML.
    result, robot, target, joints, include_weak
        As of `export`; targets are those that have `ranges`.

    Returns
    -------
    summary
        The ranges of each joint, and what there are none of, a line each.

    Raises
    ------
    SettingsError, NothingIdentifiedError, RobotFileError
        As `export` does.

    Examples
    --------
    >>> for line in export_ranges("out/result.json", "robot.toml", "ranges.py", "mjcf")[2:]:
    ...     print(line.partition(":")[0])
    Joint shoulder
    Joint elbow
    Joint slide
    """
    result, robot = _read(result, robot)
    own = TARGETS.get(target)
    if own is None or own.ranges is None:
        ranged = [name for name, each in TARGETS.items() if each.ranges]
        raise SettingsError(f"export: ranges are asked for of target '{target}'; expected {_either(ranged)}")
    _check(result, robot, Path(path))
    form = own.forms["plain"]
    assert form is not None
    found = joint_ranges(result, form, joints, include_weak)
    if not found:
        raise NothingIdentifiedError(f"export: the result has no friction that {target.upper()} has a place for")
    first, *rest = summary(result, robot, replace(own, models=()), found, [])
    lines = [first, "Ranges hold 95 % of the robots that the log cannot tell apart, each number by itself.", *rest]
    with whole_or_not_at_all(path) as temporary:
        temporary.write_text(own.ranges(lines, found), encoding="utf-8")
    return lines


def _read(result: Result | str | Path, robot: Robot | str | Path) -> tuple[Result, Robot]:
    result = result if isinstance(result, Result) else read_result(result)
    return result, robot if isinstance(robot, Robot) else Robot.from_file(robot)


def _request(
    result: Result,
    robot: Robot,
    path: Path,
    target: str,
    joints: Collection[str] | None,
    include_weak: bool,
    friction: str | None,
) -> Request:
    """Collect the content of a file, with the form of friction that is asked for, or loses least."""
    if target not in TARGETS:
        raise SettingsError(
            f"export: the target is '{target}'; expected {_either(TARGETS)}{did_you_mean(target, TARGETS)}"
        )
    own = TARGETS[target]
    _check(result, robot, path, own.models, target)
    if friction is not None and friction not in own.forms:
        raise SettingsError(f"export: the form of friction is '{friction}'; expected {_either(own.forms)}")
    forms = own.forms if friction is None else {friction: own.forms[friction]}
    terms = {name: joint_terms(result, form, joints, include_weak) for name, form in forms.items()}
    form = min(terms, key=lambda name: round(sum(each.share for each in terms[name].values()), 6))
    found, corrections = terms[form], result.corrections
    links, impossible = corrected_links(robot, corrections) if own.models and corrections else ({}, [])
    if not links and not found:
        raise NothingIdentifiedError(
            f"export: the result has neither corrected inertias nor an identified friction that {target.upper()} has a "
            "place for"
        )
    lines = summary(result, robot, own, found, impossible)
    return Request(result=result, robot=robot, joints=found, form=form, links=links, lines=lines, folder=path.parent)


def _check(result: Result, robot: Robot, path: Path, models: Collection[str] = (), target: str = "") -> None:
    """Refuse a model that the target does not write again, a result of another robot, and writing over the model."""
    kind = kind_of(Path(robot.model_path))
    if models and kind not in models:
        others = [name for name, own in TARGETS.items() if not own.models or kind in own.models]
        raise SettingsError(
            f"{robot.model_path}: is {kind.upper()}, which '{target}' does not write again; expected a robot whose "
            f"model is {_either([own.upper() for own in models])}, or export to {_either(others)}"
        )
    if unknown := [joint for joint in result.joints if joint not in robot.joint_names]:
        raise SettingsError(
            f"{robot.path}: the result has joint '{unknown[0]}', which this robot has not; it has "
            f"{', '.join(robot.joint_names)}"
        )
    if path.exists() and path.samefile(robot.model_path):
        raise SettingsError(f"{path}: is the robot's own model; expected another file to write to")


def _either(names: Collection[str]) -> str:
    return " or ".join(", ".join(names).rsplit(", ", 1))

"""Writes the friction that was found for a simulator or a controller: a robot's model again, or another file."""

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

import pinocchio as pin

from stribeck.errors import NothingIdentifiedError, SettingsError, did_you_mean
from stribeck.export.joints import JointTerms, joint_terms
from stribeck.export.links import corrected_links
from stribeck.export.ranges import joint_ranges
from stribeck.export.samples import drawn
from stribeck.export.summary import summary
from stribeck.export.target import Request, Target
from stribeck.export.targets import TARGETS
from stribeck.outputs import staged_folder, whole_or_not_at_all
from stribeck.result import Corrections, Result, read_result
from stribeck.robot import Robot
from stribeck.robot.model_file import kind_of, load_model

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
    result, robot = _read(result, robot)
    text, lines = _text(result, robot, Path(path), target, joints, include_weak, strict, friction)
    with whole_or_not_at_all(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return lines


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

    Parameters and inertias are drawn as by `stribeck.export.samples.drawn`: what a simulation that randomises its
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
    _text(result, robot, Path(folder), target, joints, include_weak, False, friction)  # which refuses what is wrong
    if friction is None:  # the same in all
        friction, _ = _least_lost(result, TARGETS[target], None, joints, include_weak)
    paths = [Path(folder) / f"{k:03d}{TARGETS[target].suffix}" for k in range(count)]
    with staged_folder(folder) as staging:
        for path, each in zip(paths, drawn(result, count, seed), strict=True):
            text, _ = _text(each, robot, path, target, joints, include_weak, False, friction)
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
    (`stribeck.export.samples.drawn`).

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


def _text(
    result: Result,
    robot: Robot,
    path: Path,
    target: str,
    joints: Collection[str] | None,
    include_weak: bool,
    strict: bool,
    friction: str | None,
) -> tuple[str, list[str]]:
    """Return a file's text, and the lines of its head."""
    if target not in TARGETS:
        raise SettingsError(
            f"export: the target is '{target}'; expected {_either(TARGETS)}{did_you_mean(target, TARGETS)}"
        )
    own = TARGETS[target]
    _refuse_other_models(robot, target)
    _check(result, robot, path)
    form, terms = _least_lost(result, own, friction, joints, include_weak)
    links: dict[str, pin.Inertia] = {}
    impossible: list[str] = []
    if own.models:
        file, _ = load_model(Path(robot.model_path), robot.base)
        corrections = result.corrections or Corrections(chi_square=0.0)
        links, impossible = corrected_links(file, robot.tree.model, corrections, robot.model_path)
    if not links and not terms:
        raise NothingIdentifiedError(
            f"export: the result has neither corrected inertias nor an identified friction that {target.upper()} has a "
            "place for"
        )
    if strict:
        _refuse_losses(terms, target)
    lines = summary(result, robot, own, terms, impossible)
    request = Request(result=result, robot=robot, joints=terms, form=form, links=links, lines=lines, folder=path.parent)
    return own.text(request), lines


def _least_lost(
    result: Result, target: Target, friction: str | None, joints: Collection[str] | None, include_weak: bool
) -> tuple[str, dict[str, JointTerms]]:
    """Return the form of friction that is asked for, or loses least, and what it says of each joint."""
    if friction is not None and friction not in target.forms:
        raise SettingsError(f"export: the form of friction is '{friction}'; expected {_either(target.forms)}")
    forms = target.forms if friction is None else {friction: target.forms[friction]}
    terms = {name: joint_terms(result, form, joints, include_weak) for name, form in forms.items()}
    best = min(terms, key=lambda name: round(sum(own.share for own in terms[name].values()), 6))
    return best, terms[best]


def _refuse_other_models(robot: Robot, target: str) -> None:
    """Refuse a model of another format than those that a target writes again."""
    model, models = Path(robot.model_path), TARGETS[target].models
    kind = kind_of(model)
    if models and kind not in models:
        others = [name for name, own in TARGETS.items() if not own.models or kind in own.models]
        raise SettingsError(
            f"{model}: is {kind.upper()}, which '{target}' does not write again; expected a robot whose model is "
            f"{_either([own.upper() for own in models])}" + f", or export to {_either(others)}" * bool(others)
        )


def _check(result: Result, robot: Robot, path: Path) -> None:
    """Refuse a result of another robot, and writing over the model."""
    unknown = [joint for joint in result.joints if joint not in robot.joint_names]
    if unknown:
        raise SettingsError(
            f"{robot.path}: the result has joint '{unknown[0]}', which this robot has not; it has "
            f"{', '.join(robot.joint_names)}"
        )
    if path.exists() and path.samefile(robot.model_path):
        raise SettingsError(f"{path}: is the robot's own model; expected another file to write to")


def _refuse_losses(terms: dict[str, JointTerms], target: str) -> None:
    for name, own in terms.items():
        if lost := [*own.projected, *own.left_out]:
            raise SettingsError(
                f"export: joint '{name}' has {', '.join(lost)}, which {target} cannot say; export without --strict, "
                "or to a target that can"
            )


def _either(names: Collection[str]) -> str:
    *first, last = names or [""]
    return f"{', '.join(first)} or {last}" if first else last

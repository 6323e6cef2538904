"""Export of a result to a simulator or a controller: a robot model or another file."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

from stribeck.app.exporters.joints import Names, coupling_terms, joint_terms, table_of_joints
from stribeck.app.exporters.links import corrected_links
from stribeck.app.exporters.model_files import MODELS
from stribeck.app.exporters.posterior import drawn, inertias_pay, joint_ranges, projected
from stribeck.app.exporters.targets import TARGETS, Request, summary
from stribeck.app.exporters.text_files import file_text, rendered
from stribeck.core.base.outputs import staged_folder, whole_or_not_at_all
from stribeck.core.errors import NothingIdentifiedError, SettingsError, did_you_mean
from stribeck.core.result import Result, read_result
from stribeck.core.robot import Robot
from stribeck.core.robot.xml_file import read_xml


def export(
    result: Result | str | Path,
    robot: Robot | str | Path | None,
    path: str | Path,
    target: str,
    *,
    joints: Collection[str] | None = None,
    include_weak: bool = False,
    strict: bool = False,
    friction: str | None = None,
    inertia: bool | None = None,
) -> list[str]:
    """Write the identified friction in the format of a simulator or a controller.

    Friction that the target cannot represent is approximated, and the error is reported. A robot model also gets the
    estimated inertias where they lower the torque error of held-out parts of the logs; everything else is unchanged,
    including the friction of joints that were not identified. The head of the file lists the changes.

    Parameters
    ----------
    result
        The result, or the path of its result.json.
    robot
        The robot of the identification, or the path of its robot file; None for the file that the result states.
    path
        File to write; it is written completely or not at all.
    target
        One of `TARGETS`. "urdf", "drake" and "mjcf" write the robot's model, which must be a URDF, or also an MJCF for
        "mjcf".
    joints
        Joints to export; all if None.
    include_weak
        Whether to export weak friction, too.
    strict
        Whether to fail if the target cannot represent all of the friction.
    friction
        Friction model, for targets with several: "plain" or "lugre" for MJCF, "all" or "plain" for YAML; the first of
        them if None.
    inertia
        Whether robot models also get the estimated inertias; if None, `projection.inertias_pay` decides.

    Returns
    -------
    summary
        Lines on changes, with a table of the friction in the model, identified and written, or a line per joint.

    Raises
    ------
    SettingsError
        If target, joint or friction model are unknown, the result belongs to another robot or model, `path` is the
        model itself, or, if `strict`, the target cannot represent all of the friction.
    NothingIdentifiedError
        If the result contains nothing for the target to store.
    RobotFileError
        If the robot file cannot be used.

    Examples
    --------
    >>> lines = export("out/result.json", "robot.toml", "found.urdf", "urdf")
    >>> for line in lines[6:]:
    ...     print(line.partition(":")[0])
    Kept the model's inertias of the links driven by
    The head of found.urdf states what is approximated or cannot be stored of each joint.
    """
    result, robot = _read(result, robot)
    request = _request(result, robot, Path(path), target, (joints, include_weak), friction, inertia)
    for name, terms in request.joints.items():
        if strict and (lost := [*terms.projected, *terms.left_out]):
            raise SettingsError(
                f"export: {target} cannot store {', '.join(lost)} of joint '{name}'; allow the loss (no `strict`), or "
                "choose another target"
            )
    with whole_or_not_at_all(path) as temporary:
        temporary.write_text(_text(target, request), encoding="utf-8")
    first, *others = request.lines
    table = table_of_joints(result, robot, request.joints)
    if table:  # it has the numbers of the joints
        repeated = {f"Joint {name}: {terms}." for name, terms in request.joints.items()}
        others = [line for line in others if line not in repeated]
        others.append(f"The head of {path} states what is approximated or cannot be stored of each joint.")
    return [first, *table, *others]


def export_samples(
    result: Result | str | Path,
    robot: Robot | str | Path | None,
    folder: str | Path,
    target: str,
    count: int,
    *,
    joints: Collection[str] | None = None,
    include_weak: bool = False,
    friction: str | None = None,
    inertia: bool | None = None,
    seed: int = 0,
) -> list[Path]:
    """Write several files as `export` does, with parameters drawn from the uncertainty of the result.

    Use them for domain randomization: the draws of `samples.drawn` are all consistent with the log.

    Parameters
    ----------
    folder
        Output folder for files 000, 001, ... with the target's suffix; all are written, or none.
    count, seed
        Number of files, and seed of the draws.
    result, robot, target, joints, include_weak, friction, inertia
        See `export`.

    Returns
    -------
    paths
        Paths of the files.

    Raises
    ------
    SettingsError, NothingIdentifiedError, RobotFileError
        See `export`.

    Examples
    --------
    >>> [path.name for path in export_samples("out/result.json", "robot.toml", "draws", "urdf", 2)]
    ['000.urdf', '001.urdf']
    """
    result, robot = _read(result, robot)
    if not 1 <= count <= 100_000:  # in one folder
        raise SettingsError(f"export: {count} samples were requested; expected 1 to 100,000")
    content = target, (joints, include_weak), friction, inertia
    _request(result, robot, Path(folder), *content)  # refuses before anything is drawn
    paths = [Path(folder) / f"{k:03d}{TARGETS[target].suffix}" for k in range(count)]
    with staged_folder(folder) as staging:
        for path, draw in zip(paths, drawn(result, count, seed), strict=True):
            text = _text(target, _request(draw, robot, path, *content))
            (staging / path.name).write_text(text, encoding="utf-8")
    return paths


def export_ranges(
    result: Result | str | Path,
    robot: Robot | str | Path | None,
    path: str | Path,
    target: str,
    *,
    joints: Collection[str] | None = None,
    include_weak: bool = False,
) -> list[str]:
    """Write ranges of friction and rotor inertias for domain randomization, in a target's format.

    Each range contains 95 % of the draws of `stribeck.app.exporters.posterior.drawn`.

    Parameters
    ----------
    path
        File to write, completely or not at all: a Python module for "mjcf" and "isaaclab", or YAML.
    result, robot, target, joints, include_weak
        See `export`; the target must support ranges.

    Returns
    -------
    summary
        Lines with the ranges of each joint and the omissions.

    Raises
    ------
    SettingsError, NothingIdentifiedError, RobotFileError
        See `export`.

    Examples
    --------
    >>> for line in export_ranges("out/result.json", "robot.toml", "ranges.py", "mjcf")[2:]:
    ...     print(line.partition(":")[0])
    Joint shoulder
    Joint elbow
    Joint slide
    """
    result, robot = _read(result, robot)
    entry = TARGETS.get(target)
    if entry is None or not entry.ranges:
        ranged = [name for name, other in TARGETS.items() if other.ranges]
        raise SettingsError(f"export: target '{target}' has no ranges; expected {_either(ranged)}")
    _check(result, robot, Path(path))
    form = entry.forms["plain"]
    assert form is not None
    ranges = joint_ranges(result, form, joints, include_weak)
    if not ranges:
        raise NothingIdentifiedError(f"export: the result has no friction that {target.upper()} can store")
    first, *rest = summary(result, robot, replace(entry, models=()), ranges, [], inertia=False, reason="")
    lines = [first, "Each range contains 95 % of the models that are consistent with the log.", *rest]
    with whole_or_not_at_all(path) as temporary:
        temporary.write_text(rendered(entry.ranges, lines=lines, joints=ranges), encoding="utf-8")
    return lines


def _read(result: Result | str | Path, robot: Robot | str | Path | None) -> tuple[Result, Robot]:
    result = result if isinstance(result, Result) else read_result(result)
    return result, result.find_robot(robot)


Chosen = tuple[Names, bool]
"""Joints to export, all if None, and whether their weak friction is exported."""


def _request(
    result: Result, robot: Robot, path: Path, target: str, chosen: Chosen, friction: str | None, inertia: bool | None
) -> Request:
    """Collect the content of a file."""
    if target not in TARGETS:
        near = did_you_mean(target, TARGETS)
        raise SettingsError(f"export: the target is '{target}'; expected {_either(TARGETS)}{near}")
    entry = TARGETS[target]
    pays, reason = inertias_pay(result)
    inertia = bool(entry.models) and (pays if inertia is None else inertia)
    result = projected(result, robot) if inertia else result
    _check(result, robot, path, entry.models, target)
    form = next(iter(entry.forms)) if friction is None else friction
    if form not in entry.forms:
        raise SettingsError(f"export: the friction model is '{form}'; expected {_either(entry.forms)}")
    terms = joint_terms(result, entry.forms[form], *chosen, any_unit=entry.any_unit)
    if target == "mjcf":
        plain = entry.forms["plain"]
        assert plain is not None
        terms |= coupling_terms(result, robot, plain, *chosen)
    corrections = result.corrections
    links, impossible = corrected_links(robot, corrections) if entry.models and corrections else ({}, [])
    if not inertia:  # read to check that the model is the one of the result
        links, impossible = {}, []
    if not links and not terms:
        raise NothingIdentifiedError(
            f"export: the result has no identified friction that {target.upper()} can store"
            + " and no corrected inertias" * inertia
        )
    lines = summary(result, robot, entry, terms, impossible, inertia=inertia, reason=reason)
    return Request(result=result, robot=robot, joints=terms, form=form, links=links, lines=lines, folder=path.parent)


def _text(target: str, request: Request) -> str:
    """Format the file of a target: a robot's model, or a template."""
    text = TARGETS[target].text or MODELS.get(target)
    return text(request) if text else file_text(f"{target}{TARGETS[target].suffix}", request)


def _check(result: Result, robot: Robot, path: Path, models: Collection[str] = (), target: str = "") -> None:
    """Check that the target can write the model, the result belongs to the robot, and the model is not overwritten."""
    kind = read_xml(robot.model_file).kind if models else ""
    if models and kind not in models:
        others = [name for name, entry in TARGETS.items() if not entry.models or kind in entry.models]
        raise SettingsError(
            f"{robot.model_path}: is {kind.upper()}, which '{target}' cannot write; use a robot whose model is "
            f"{_either([name.upper() for name in models])}, or export to {_either(others)}"
        )
    if unknown := [joint for joint in result.joints if joint not in robot.joint_names]:
        raise SettingsError(
            f"{robot.path}: the robot has no joint '{unknown[0]}' of the result; it has {', '.join(robot.joint_names)}"
        )
    if robot.model_path and path.exists() and path.samefile(robot.model_path):
        raise SettingsError(f"{path}: is the robot's own model; choose another output")


def _either(names: Collection[str]) -> str:
    return " or ".join(", ".join(names).rsplit(", ", 1))

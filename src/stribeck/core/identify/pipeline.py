"""The spine: from logs to a result, one line per stage."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import cast

from stribeck.core.base.finding import Finding
from stribeck.core.base.outputs import check_outputs, whole_or_not_at_all
from stribeck.core.base.parts import SERVICES
from stribeck.core.base.threads import one_blas_thread
from stribeck.core.dynamics.contact.rolling import with_rolling_feet
from stribeck.core.equations.friction_torque.preparation import Logs, PreparedLog, Progress, log_path, prepare, quiet
from stribeck.core.equations.friction_torque.stage import FrictionTorqueStage
from stribeck.core.errors import LogError, findings_kept
from stribeck.core.identify.audited import reconciled, without_dead_joints
from stribeck.core.identify.compose import compose
from stribeck.core.identify.held_out import held_out_log
from stribeck.core.identify.methods import get_method
from stribeck.core.log import LogLike
from stribeck.core.log.overlap import refuse_overlap
from stribeck.core.result import Result
from stribeck.core.robot import Robot
from stribeck.core.settings import Settings


def identify(
    logs: LogLike | Sequence[LogLike],
    robot: Robot | str | Path,
    settings: Settings | None = None,
    *,
    law: str | None = None,
    method: str | None = None,
    table: str | Path | None = None,
    validate: LogLike | Sequence[LogLike] = (),
    force: bool = False,
    progress: Progress = quiet,
) -> Result:
    """Identify the friction of every joint of a robot from one or more logs.

    Parameters
    ----------
    logs
        Logs, their paths, or frames (see `RobotLog.from_frame`). Large logs are kept on disk.
    robot
        Robot, or the path of its robot file.
    settings
        Settings of the method; default: the robot file's `[identify]`.
    law, method
        Override `settings.law` and `settings.method`.
    table
        Path to write the friction torque of every sample to (friction_torque.parquet).
    validate
        Logs for validation only. `Result.held_out` reports how well the result predicts their torques.
    force
        Continue even if the audit finds an error that invalidates all results.
    progress
        Callback `progress(message, fraction)` with fraction in [0, 1].

    Returns
    -------
    result
        Result, including the samples that `write_report` draws.

    Raises
    ------
    RobotFileError, LogError, SettingsError
        If the input or the settings are wrong, two logs share samples, or the audit finds an error that invalidates all
        results and `force` is not set.
    NothingIdentifiedError
        If no joint moves enough. The notes of an error are the findings from before it.

    Examples
    --------
    >>> identify("log.npz", "robot.toml", method="curve-fit")
    Result('arm', law stribeck, method curve-fit, 3 joints: 3 identified)
    """
    robot = robot if isinstance(robot, Robot) else Robot.from_file(robot)
    asked = {key: value for key, value in (("law", law), ("method", method)) if value is not None}
    settings = (settings or robot.settings).model_copy(update=asked)
    chosen, friction_law, settings = get_method(settings, robot)
    sources, unseen_sources = _listed(logs), _listed(validate)
    if not sources:
        raise LogError("identify: the list of logs is empty; expected at least one log")
    where = _place_of(table, [*sources, *unseen_sources], robot) if table else nullcontext(None)
    with one_blas_thread(), findings_kept(robot.warnings) as findings, where as place:
        every = _prepared([*sources, *unseen_sources], robot, settings, findings, progress)
        # the fit depends on the order of logs: sort them, so that results do not
        prepared = sorted(every[: len(sources)], key=lambda part: (part.log.path, part.log.time[0]))
        unseen = every[len(sources) :]
        standing = [(part.log, part.support.phases, part.sampling.period) for part in prepared]
        robot, rolling = with_rolling_feet(robot, standing)
        findings += rolling
        progress("auditing", 0.0)
        every, of_torques, gain_errors, robot = find_torques(prepared, robot, settings, unseen)
        prepared, unseen = every[: len(sources)], every[len(sources) :]
        audited = [*of_torques, *SERVICES["audit"]([*prepared, *unseen], robot, settings, force)]
        findings += [str(finding) for finding in audited]
        robot = without_dead_joints(robot, audited)
        friction_torque = FrictionTorqueStage(place, progress, prepared[0], robot, settings)
        fitted = chosen.find(prepared, robot, friction_law, settings, friction_torque, progress)
        samples = friction_torque(fitted.logs, fitted.robot, fitted.settings or settings)
        del friction_torque  # and the corrected logs: composing the result corrects the held-out parts once more
        fitted = replace(fitted, logs=())
        result = compose(fitted, samples, prepared, robot, friction_law, settings, chosen, gain_errors)
        held_out = [held_out_log(log, fitted, result, robot, samples.settings) for log in unseen]
        known = reconciled(audited, result, len(prepared))
        return replace(result, joints=SERVICES["doubted"](result.joints, known), held_out=held_out, findings=known)


def find_torques(
    prepared: Logs, robot: Robot, settings: Settings, unseen: Logs
) -> tuple[list[PreparedLog], list[Finding], dict[str, float], Robot]:
    """Compute torques from currents and commands, by the service of that name."""
    conversion: tuple[list[PreparedLog], list[Finding], dict[str, float], Robot]
    conversion = SERVICES["find_torques"](prepared, robot, settings, unseen)
    return conversion


def _place_of(table: str | Path, sources: Sequence[LogLike], robot: Robot) -> AbstractContextManager[Path]:
    """Open the place of a table that replaces neither a log nor the robot."""
    files = [*map(log_path, sources), robot.path, robot.model_path]
    check_outputs([Path(table)], [Path(file) for file in files if file], overwrite=True)  # a log in memory has none
    return whole_or_not_at_all(table)


def _prepared(
    sources: Sequence[LogLike], robot: Robot, settings: Settings, findings: list[str], progress: Progress
) -> list[PreparedLog]:
    """Prepare logs, refuse logs that share samples, and add notes to the findings."""
    every: list[PreparedLog] = []
    for k, log in enumerate(sources):
        progress(f"reading log {k + 1} of {len(sources)}", k / len(sources))
        every.append(prepare(log, robot, settings))
        findings += every[-1].notes
        *before, last = ((part.prints, part.log.path) for part in every)
        refuse_overlap(*last, before)
    return every


def _listed(logs: LogLike | Sequence[LogLike]) -> list[LogLike]:
    """Make a list of one log or of several; `prepare` refuses what is not a log."""
    return list(logs) if isinstance(logs, list | tuple | Iterator) else [cast(LogLike, logs)]

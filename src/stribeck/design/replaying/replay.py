"""Comparison of a log with the robot's own model and another model, without and with friction."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from importlib.util import find_spec
from itertools import compress
from pathlib import Path

import numpy as np

from stribeck.check import audit_or_stop, find_torques
from stribeck.core.base.threads import one_blas_thread
from stribeck.core.base.typing import Array
from stribeck.core.base.version import __version__
from stribeck.core.equations.friction_torque.preparation import PreparedLog, Progress, as_read, prepare, quiet
from stribeck.core.equations.friction_torque.stage import thinned_samples, with_filter
from stribeck.core.errors import RobotFileError, SettingsError, errors_about, findings_kept
from stribeck.core.filters import make_filter
from stribeck.core.judgement.speed import top_speed
from stribeck.core.judgement.torque_error import COMMON, TorqueError, torque_errors
from stribeck.core.log import LogLike, RobotLog
from stribeck.core.result.samples import FrictionSamples
from stribeck.core.robot import Robot
from stribeck.core.robot.xml_file import read_xml
from stribeck.core.settings import Settings
from stribeck.design.replaying.comparison import CommandedMotion, LoggedMotion, Replay, Replayed
from stribeck.design.replaying.other_model import JointFriction, ModelFriction, StatedFriction, other_model, with_joints
from stribeck.design.replaying.rollouts import HORIZONS, TRACE, RolloutError, massless_joints, rollout_errors


def replay(
    log: LogLike,
    robot: Robot | str | Path,
    model: str | Path,
    settings: Settings | None = None,
    *,
    more: Sequence[LogLike] = (),
    horizon: float = 0.5,
    force: bool = False,
    progress: Progress = quiet,
) -> Replay:
    """Compare a log with another model of the robot and with the robot's own, each without and with friction.

    Parameters
    ----------
    log
        The log, its path, or a frame.
    robot
        The robot, or the path of its robot file.
    model
        URDF or MJCF with the robot's joints.
    settings
        Settings; by default from the robot file. Motion and torque pass the same filter, and standing legs move as
        measured.
    more
        More logs, which are only simulated under their commands.
    horizon
        Duration of the short simulations [s], 0.05 to 10.
    force
        Whether to continue although the audit found a fatal error.
    progress
        Callback `progress(stage, fraction)`.

    Raises
    ------
    RobotFileError, LogError, SettingsError
        If robot, model, log or horizon cannot be used, no joint's friction torque is known, or, unless forced, the
        audit finds a fatal error.

    Examples
    --------
    >>> replay("log.npz", "robot.toml", "arm.urdf").headline()
    'torque error 1.5 → 1.5 N m'
    """
    if not 0.05 <= horizon <= 10:
        raise SettingsError(f"replay: the horizon is {horizon:g} s; expected 0.05 to 10 s")
    robot = robot if isinstance(robot, Robot) else Robot.from_file(robot)
    if robot.loops:
        raise RobotFileError(f"{robot.path}: replay does not support [[robot.loops]]; leave them out")
    asked = settings or robot.settings
    settings = asked.model_copy(update=COMMON)
    horizons = tuple(round(share * horizon, 6) for share in HORIZONS)
    other, notes = other_model(robot, Path(model))
    frictions = [_friction(twin, notes) for twin in (robot, other)]
    with one_blas_thread(), findings_kept(notes):
        progress("reading the log", 0.0)
        logs = [as_read(source, robot) for source in (log, *more)]
        prepared, robot, findings = _prepared(logs[0], robot, asked, settings, force)
        notes += findings
        other = replace(other, position_controlled=(*other.position_controlled, *prepared.log.unscaled))
        if robot.command_gains is not None:
            columns = [robot.joint_names.index(name) for name in other.joint_names]
            kp, kd = robot.command_gains
            other = replace(other, command_gains=(kp[columns], kd[columns]))
        settings, _ = with_filter(prepared, robot, settings)
        cases = [(twin, with_joints(prepared, twin.joint_names)) for twin in (robot, other)]
        massless = [
            (twin.model_path, name) for twin, part in cases for name in massless_joints(twin, part.log.position[0])
        ]
        measured = "moves no mass, so rollouts take it as measured"
        notes += [f"{Path(file).name}: joint '{name}' {measured}" for file, name in massless]
        replays: list[Replayed] = []
        with errors_about(prepared.log.path), np.errstate(all="ignore"):  # implausible values are refused below
            for (twin, part), friction in zip(cases, frictions, strict=True):
                progress(f"replaying {Path(twin.model_path).name}", 0.1 if twin is robot else 0.55)
                models, samples = _replayed(part, twin, friction, [name for _, name in massless], settings, horizons)
                replays += models
        commanded = _commanded(logs, prepared, robot, other) or _commanded_spans(replays, robot, prepared.log, horizon)
    return Replay(
        robot=robot.name,
        log=prepared.log.path,
        filter=make_filter(settings.filter, prepared.sampling.period).name,
        horizons=horizons,
        models=replays,
        notes=list(dict.fromkeys([*prepared.notes, *notes])),
        stribeck=__version__,
        motion=_motion(prepared, robot, samples),
        commanded=commanded,
    )


def _prepared(
    log: LogLike, robot: Robot, asked: Settings, settings: Settings, force: bool
) -> tuple[PreparedLog, Robot, list[str]]:
    """Prepare a log, without flight phases, and audit it for `asked`; joints without torques move as measured."""
    (prepared,), of_torques, _, robot = find_torques([prepare(log, robot, settings)], robot, settings)
    robot = replace(robot, position_controlled=(*robot.position_controlled, *prepared.log.unscaled))
    findings = [*map(str, [*of_torques, *audit_or_stop([prepared], robot, asked, force)])]
    flight = sum(phase.last - phase.first for phase in prepared.support.phases if phase.kind == "flight")
    if flight:  # the joints move the base, too
        findings.append(f"{100 * flight / len(prepared.log.time):.2g} % of the log is flight, which is left out")
    grounded = tuple(phase for phase in prepared.support.phases if phase.kind != "flight")
    return replace(prepared, support=replace(prepared.support, phases=grounded)), robot, findings


def _commanded(logs: Sequence[RobotLog], prepared: PreparedLog, robot: Robot, other: Robot) -> CommandedMotion | None:
    """Simulate both models under the commands of the logs, if the base is fixed, with the delays that were found."""
    known = robot.command_gains is not None and all(log.desired_position is not None for log in logs)
    if not known or robot.base != "fixed" or robot.passive or not find_spec("mujoco"):
        return None
    from stribeck.design.replaying.commanded import commanded_motion  # MuJoCo is slow to import

    delays = np.array([delay for delay, _ in prepared.log.command_delays])
    return commanded_motion(logs, robot, (robot.model_file, other.model_file), delays)


def _commanded_spans(models: Sequence[Replayed], robot: Robot, log: RobotLog, seconds: float) -> CommandedMotion | None:
    """Compute the position errors of the short simulations of both models, if they follow commands."""
    if robot.command_gains is None:
        return None
    errors = []
    for model in ([model for model in models if model.model == models[0].model][-1], models[-1]):
        off = [
            position - np.interp(start[:, None] + TRACE * np.arange(position.shape[1]), log.time, measured)
            for name, measured in zip(log.joint_names, log.position.T, strict=True)
            if name in model.positions
            for start, position in [model.positions[name]]
        ]
        squares = np.concatenate([error[np.isfinite(error)] ** 2 for error in off] or [np.zeros(0)])
        errors.append(float(np.sqrt(np.mean(squares))) if len(squares) else 0.0)
    if not all(errors):
        return None
    return CommandedMotion(as_given=errors[0], other=errors[1], logs=1, seconds=seconds, free=False)


def _motion(prepared: PreparedLog, robot: Robot, samples: FrictionSamples) -> LoggedMotion:
    """Collect the measured motion and torque."""
    return LoggedMotion(
        torque_time=samples.time,
        torque=_by_joint(samples, samples.torque),
        position_time=prepared.log.time,
        position=dict(zip(prepared.log.joint_names, prepared.log.position.T, strict=True)),
        prismatic=frozenset(compress(robot.joint_names, robot.prismatic)),
    )


def _replayed(
    prepared: PreparedLog,
    robot: Robot,
    friction: ModelFriction,
    massless: Collection[str],
    settings: Settings,
    horizons: tuple[float, ...],
) -> tuple[list[Replayed], FrictionSamples]:
    """Compute torques, their errors and rollouts of a model without and with friction, and the samples."""
    none = ModelFriction([JointFriction()] * len(robot.joint_names))
    variants = [none, friction] if friction else [none]
    samples = thinned_samples(prepared, 1, robot, settings)
    assert samples.torque is not None  # the friction torque uses it
    errors = _torque_errors(samples, robot, variants)
    torque = torque_errors(samples.joint_names, samples.velocity, samples.torque, errors, settings.rest)
    try:
        rollouts = rollout_errors(prepared, robot, variants, massless, settings, horizons)
    except np.linalg.LinAlgError as error:
        raise _impossible(robot, f"its joint-space inertia matrix cannot be inverted ({error})") from error
    _require_finite(robot, torque, [rollout for rollout, _ in rollouts])
    rest = settings.rest * np.array([top_speed(velocity) for velocity in samples.velocity.T])
    moves = np.where(np.abs(samples.velocity) < rest, np.nan, 0.0)  # at rest, friction balances any torque
    models = [
        Replayed(
            model=robot.model_path,
            friction=n > 0,
            torque=torque[n],
            rollouts=rollout,
            predicted=_by_joint(samples, samples.torque - errors[n] + moves),
            positions={name: (moved.start, moved.position[..., robot.joint_names.index(name)]) for name in rollout},
        )
        for n, (rollout, moved) in enumerate(rollouts)
    ]
    return models, samples


def _by_joint(samples: FrictionSamples, values: Array | None) -> dict[str, Array]:
    assert values is not None
    return dict(zip(samples.joint_names, values.T, strict=False))


def _torque_errors(samples: FrictionSamples, robot: Robot, frictions: list[ModelFriction]) -> list[Array]:
    """Compute the torque errors for each friction of a model [N m], [N], shape (T, n); NaN where unknown."""
    columns = [robot.joint_names.index(name) for name in samples.joint_names]
    velocity = np.zeros((len(samples.time), len(robot.joint_names)))
    velocity[:, columns] = samples.velocity
    unusable = np.where(samples.usable, 0.0, np.nan)
    return [unusable + samples.friction_torque - friction.torque(velocity)[:, columns] for friction in frictions]


def _require_finite(
    robot: Robot, torque: list[dict[str, TorqueError]], rollouts: list[dict[str, list[RolloutError | None]]]
) -> None:
    checks = [("torque", name, error.rms, error.r2) for joints in torque for name, error in joints.items()]
    of_rollouts = [
        (name, error) for rollout in rollouts for name, errors in rollout.items() for error in errors if error
    ]
    checks += [("simulated velocity", name, error.rms, error.relative) for name, error in of_rollouts]
    for what, name, *values in checks:
        if not np.isfinite(values).all():
            raise _impossible(robot, f"its {what} of joint '{name}' is not finite")


def _impossible(robot: Robot, what: str) -> RobotFileError:
    return RobotFileError(f"{robot.model_path}: {what}; expected masses, lengths and friction that a robot can have")


def _friction(robot: Robot, notes: list[str]) -> ModelFriction:
    """Collect the friction that a robot's model states, with a note on missing friction."""
    path = robot.model_file
    joints, stated, about = read_friction(path)
    names, couplings = robot.joint_names, []
    unmeasured = [name for k, name in enumerate(names) if k not in robot.torque_controlled]
    for coupling, (coefficients, friction) in stated.items():
        if missing := [name for name in coefficients if name in unmeasured]:
            about.append(f"tendon '{coupling}' is left out, as the torque of '{missing[0]}' is not measured")
        else:
            couplings.append((np.array([coefficients.get(name, 0.0) for name in names]), friction))
    model_friction = ModelFriction([joints.get(name, JointFriction()) for name in names], couplings)
    notes += [f"{path.name}: {note}" for note in about]
    if not model_friction:
        notes.append(f"{path.name}: states no joint friction")
    return model_friction


def read_friction(path: Path) -> StatedFriction:
    """Read the friction of a model file.

    Raises
    ------
    RobotFileError
        If the file cannot be read, or a value is not a number or negative.
    """
    if read_xml(path).kind == "mjcf":
        from stribeck.design.replaying.mjcf_friction import read_mjcf_friction  # MuJoCo is slow to import

        return read_mjcf_friction(path)
    xml, joints = read_xml(path), {}
    for joint in xml.root.iter("joint"):
        numbers, name = {"friction": 0.0, "damping": 0.0}, joint.get("name", "")
        for dynamics in joint.iter("dynamics"):
            for word in numbers.keys() & dynamics.keys():
                of = f"{word} of joint '{name}'"
                (numbers[word],) = xml.numbers(dynamics, dynamics.get(word), 1, of)
                if numbers[word] < 0:
                    xml.refuse(dynamics, f"{of} is {dynamics.get(word)}; expected zero or more")
        if joint.get("type"):  # no transmission's
            joints[name] = JointFriction(coulomb=numbers["friction"], viscous=numbers["damping"])
    return joints, {}, []

"""Friction torque of every joint at every usable sample of a log, chunk by chunk."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from stribeck.core.base.parts import SERVICES
from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.dynamics.contact import SupportPhase
from stribeck.core.dynamics.contact.mode import ContactMode, contact_modes, takes_wrenches
from stribeck.core.dynamics.state import State, apparent_gravity, orientation_from_derivatives, root_quaternions
from stribeck.core.equations.friction_torque.explained import by_inverse_dynamics
from stribeck.core.equations.friction_torque.foot_wrenches import require_wrenches
from stribeck.core.equations.friction_torque.preparation import PreparedLog
from stribeck.core.errors import LogError
from stribeck.core.filters import Filter, make_filter
from stribeck.core.filters.averaging import average_nodes
from stribeck.core.filters.filters import sharper_filter
from stribeck.core.log import RobotLog
from stribeck.core.result.samples import FrictionSamples
from stribeck.core.robot import Robot
from stribeck.core.settings import FilterSettings, Settings

CHUNK = 16_384
"""Number of samples processed at a time: some tens of megabytes for a humanoid."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Chunk:
    """Friction torque of a part of a log.

    Attributes
    ----------
    rows
        Rows of the log, shape (N,), in order.
    samples
        N samples of the torque-controlled joints.
    wrench
        Predicted ground reaction on the only standing foot, in its frame, shape (N, 6); NaN otherwise.
    """

    rows: IntArray
    samples: FrictionSamples
    wrench: Array

    def runs(self) -> Iterator[slice]:
        """Yield consecutive samples without a break in one contact mode."""
        breaks = np.flatnonzero((np.diff(self.rows) > self.samples.stride) | (np.diff(self.samples.support) != 0)) + 1
        for start, stop in pairwise([0, *breaks.tolist(), len(self.rows)]):
            yield slice(start, stop)


def support_name(phase: SupportPhase) -> str:
    """Return the name of a phase's contact mode, e.g. "left_foot+right_foot"."""
    return "+".join(phase.feet) if phase.feet else phase.kind


def torque_chunks(
    prepared: PreparedLog,
    robot: Robot,
    settings: Settings,
    phases: tuple[SupportPhase, ...] | None = None,
    stride: int = 1,
    motion_filter: Filter | None = None,
) -> Iterator[Chunk]:
    """Yield the friction torque of a log, chunk by chunk.

    Parameters
    ----------
    prepared
        Prepared log.
    robot
        Robot.
    settings
        Uses `tilt`, `standing_legs`, `filter`, `filter_torque`, `averaged_law`, `block` and `observer_bandwidth`. The
        filter is not "auto". If `observer_bandwidth` is a number, the observer computes the friction torque.
    phases
        Support phases, whose trimmed rows are used; None for the phases of the log.
    stride
        Step between computed rows, counted in rows of the log; an observer computes all rows.
    motion_filter
        Filter that replaces the filter of the settings.

    Raises
    ------
    LogError
        If the log lacks a channel that the settings or the contacts require.
    SettingsError
        If the law is to be averaged with a filter that has no finite window.
    """
    log, period, bandwidth = prepared.log, prepared.sampling.period, settings.observer_bandwidth
    assert bandwidth != "auto"
    observer = SERVICES["log_observer"](period, bandwidth) if bandwidth else None
    require_channels(robot, log, settings)
    phases = prepared.support.phases if phases is None else phases
    flies = observer is None and uses_orientation(robot, log, settings)
    used = tuple(phase for phase in phases if phase.kind != "flight" or (flies and phase.plausible(period)))
    labels = _label_rows(robot, used, len(log.time), max(1, round(settings.block / period)))
    modes, mode_of_row, block_of_row, steady = labels
    labels_of_modes = ["+".join(mode.feet) or "flight" for mode in modes]
    names = tuple(dict.fromkeys(labels_of_modes))
    name_of = np.array([names.index(name) for name in labels_of_modes], dtype=np.int64)
    motion_filter = motion_filter or make_filter(settings.filter, period)
    turn_filter = orientation_filter(robot, log, motion_filter, period, settings)
    known = robot.torque_controlled
    swinging = np.array([mode.swinging[known] for mode in modes])
    nodes = average_nodes(motion_filter.window_weights(), period) if settings.averaged_law else None
    reach = nodes.reach if nodes else 0
    sharper = sharper_filter(settings.filter, period) if nodes else None
    stride = 1 if observer else stride
    for span in spans(prepared.sampling.segments, max(motion_filter.half_width, turn_filter.half_width) + reach):
        kept = np.flatnonzero((mode_of_row[span] >= 0) & (np.arange(span.start, span.stop) % stride == 0))
        if len(kept) == 0:
            continue
        span, kept = slice(span.start + kept[0], span.start + kept[-1] + 1), kept - kept[0]
        wide = slice(span.start - reach, span.stop + reach)
        state, torque = differentiate(robot, log, wide, motion_filter, turn_filter, settings)
        jerk, snap = _compute_jerk_and_snap(state, kept + reach, reach, period, known)
        if len(kept) < len(torque):
            state, torque = state.take(kept + reach), torque[kept + reach]
        rows = kept + span.start
        mode = mode_of_row[rows]
        if observer:
            estimate = observer(modes, mode, log.time[rows], state, torque, settings)
        else:
            wrenches = _select_wrenches(robot, log, wide, motion_filter, settings)
            measured = {foot: wrench[kept + reach] for foot, wrench in wrenches.items()}
            estimate = by_inverse_dynamics(modes, mode, state, torque, measured, settings)
        yield Chunk(
            rows=rows,
            wrench=estimate.wrench,
            samples=FrictionSamples(
                joint_names=tuple(robot.joint_names[c] for c in known),
                period=period,
                time=log.time[rows],
                velocity=estimate.velocity[:, known],
                acceleration=estimate.acceleration[:, known],
                friction_torque=estimate.friction[:, known],
                usable=estimate.usable[:, known] & (steady[rows, None] | swinging[mode]),
                block=block_of_row[rows],
                support=name_of[mode],
                support_names=names,
                stride=stride,
                prismatic=tuple(robot.prismatic[c] for c in known),
                nodes=estimate.nodes or nodes,
                jerk=jerk if estimate.jerk is None else estimate.jerk[:, known],
                snap=snap if estimate.snap is None else estimate.snap[:, known],
                sharp_velocity=_compute_velocity(log, span, sharper)[np.ix_(kept, known)] if sharper else None,
                torque=estimate.torque[:, known],
            ),
        )


def _label_rows(
    robot: Robot, phases: tuple[SupportPhase, ...], rows: int, longest: int
) -> tuple[tuple[ContactMode, ...], IntArray, IntArray, BoolArray]:
    """Label rows: contact modes, and each row's mode (-1 if not used), block, and whether it is steady.

    A block is a phase, or an equal part of a phase longer than `longest` rows.
    """
    used = [
        (phase, mode)
        for phase, mode in zip(phases, contact_modes(robot, phases), strict=True)
        if phase.last > phase.first
    ]
    modes = tuple(dict.fromkeys(mode for _, mode in used))
    mode, block, steady = np.full(rows, -1), np.zeros(rows, dtype=np.int64), np.zeros(rows, dtype=bool)
    begun = 0
    for phase, stands in used:
        length = phase.last - phase.first
        parts = max(1, round(length / longest))
        mode[phase.first : phase.last] = modes.index(stands)
        block[phase.first : phase.last] = begun + np.arange(length) * parts // length
        steady[phase.steady_first : phase.steady_last] = True
        begun += parts
    return modes, mode, block, steady


def spans(segments: tuple[slice, ...], margin: int) -> Iterator[slice]:
    """Yield ranges of rows with a filter's margin on both sides, at most `CHUNK` rows each."""
    for segment in segments:
        for start in range(segment.start + margin, segment.stop - margin, CHUNK):
            yield slice(start, min(start + CHUNK, segment.stop - margin))


def require_channels(robot: Robot, log: RobotLog, settings: Settings) -> None:
    """Refuse a log that lacks a channel required by the settings or the contacts.

    Raises
    ------
    LogError
        If a channel is missing.
    """
    if takes_wrenches(robot, settings):
        require_wrenches(log, robot)
    if settings.tilt == "imu" and log.base_orientation is None:
        raise LogError(
            f"{log.path or 'log'}: tilt is 'imu', but the channel base_orientation is missing; use 'flat' or 'auto'"
        )
    needed = ("velocity",) if settings.observer_bandwidth else ("velocity", "acceleration")
    missing = next((name for name in needed if getattr(log, name) is None), None)
    if settings.filter.kind == "log" and missing:
        raise LogError(
            f"{log.path or 'log'}: filter kind is 'log', but the channel {missing} is missing; choose another filter"
        )


def orientation_filter(robot: Robot, log: RobotLog, motion_filter: Filter, period: float, settings: Settings) -> Filter:
    """Make the filter of the base orientation: the joints' filter, unless joint velocities come from the log."""
    own_motion = settings.filter.kind == "log" and uses_orientation(robot, log, settings)
    return make_filter(FilterSettings(kind="savitzky-golay", window=11), period) if own_motion else motion_filter


def differentiate(
    robot: Robot, log: RobotLog, rows: slice, motion_filter: Filter, turn_filter: Filter, settings: Settings
) -> tuple[State, Array]:
    """Compute motion and torque at rows that have the filters' margins on both sides."""
    orientation = None
    if log.base_orientation is not None and uses_orientation(robot, log, settings):
        wide = _widen(rows, turn_filter)
        quaternions = root_quaternions(robot, log.position[wide], log.base_orientation[wide])
        orientation = orientation_from_derivatives(*turn_filter.apply(quaternions))
        if log.linear_acceleration is not None:
            wide = _widen(rows, motion_filter)
            apparent = apparent_gravity(robot, log.position[wide], log.linear_acceleration[wide])
            orientation = replace(orientation, apparent_gravity=motion_filter.smooth(apparent))
    acceleration = log.acceleration
    if acceleration is None and log.velocity is not None and settings.observer_bandwidth:
        acceleration = np.broadcast_to(np.nan, log.velocity.shape)  # an observer does not use it
    if log.velocity is not None and acceleration is not None and settings.filter.kind == "log":
        state = State(log.position[rows], log.velocity[rows], acceleration[rows], orientation)
    else:
        state = State(*motion_filter.apply(log.position[_widen(rows, motion_filter)]), orientation)
    return state, _filter_signal(log.applied_torque, rows, motion_filter, settings)


def _filter_signal(signal: Callable[[slice], Array], rows: slice, motion_filter: Filter, settings: Settings) -> Array:
    """Filter a torque or force as the settings require: averaged, smoothed, or unchanged."""
    if settings.averaged_law:
        return motion_filter.average(signal(_widen(rows, motion_filter)))
    return motion_filter.smooth(signal(_widen(rows, motion_filter))) if settings.filter_torque else signal(rows)


def _select_wrenches(
    robot: Robot, log: RobotLog, rows: slice, motion_filter: Filter, settings: Settings
) -> dict[str, Array]:
    """Select the filtered wrench on each foot at these rows, shape (N, 6); empty if the settings use no wrenches."""
    if log.foot_wrench is None or not takes_wrenches(robot, settings):
        return {}
    wrench = _filter_signal(log.foot_wrench.reshape(len(log.time), -1).__getitem__, rows, motion_filter, settings)
    return dict(zip(log.foot_names, np.split(wrench, len(log.foot_names), axis=1), strict=True))


def _compute_velocity(log: RobotLog, rows: slice, motion_filter: Filter) -> Array:
    """Compute the velocity of all joints at these rows from filtered positions, or take it from the log."""
    if motion_filter.half_width == 0 and log.velocity is not None:
        return log.velocity[rows]
    return motion_filter.run(log.position[_widen(rows, motion_filter)], (1,))[0]


def _compute_jerk_and_snap(
    state: State, rows: IntArray, reach: int, period: float, columns: IntArray
) -> tuple[Array | None, Array | None]:
    """Compute jerk and snap of the velocity such that it is exact `reach` rows before and after, shape (N, n)."""
    if not reach:
        return None, None
    time = reach * period
    before, now, after = (state.velocity[rows + shift][:, columns] for shift in (-reach, 0, reach))
    jerk = (before - 2 * now + after) / time**2
    snap = 6 * ((after - before) / (2 * time) - state.acceleration[rows][:, columns]) / time**2
    return jerk, snap


def uses_orientation(robot: Robot, log: RobotLog, settings: Settings) -> bool:
    """Return whether the orientation of the base is measured and used."""
    return robot.base == "floating" and settings.tilt != "flat" and log.base_orientation is not None


def _widen(rows: slice, motion_filter: Filter) -> slice:
    return slice(rows.start - motion_filter.half_width, rows.stop + motion_filter.half_width)

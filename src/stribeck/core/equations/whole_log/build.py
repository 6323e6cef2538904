"""The weak form of a log, computed segment by segment when it is requested (docs/estimator.md, equations 2 and 3).

Modulating functions: Shinbrot 1957; weak form: Messenger and Bortz 2021.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.dynamics.root_motion import gravity_in_root_link
from stribeck.core.dynamics.state import State, orientation_from_derivatives, root_quaternions
from stribeck.core.equations.friction_torque.inverse_dynamics import uses_orientation
from stribeck.core.equations.friction_torque.preparation import PreparedLog
from stribeck.core.equations.weak_equations import WeakEquations
from stribeck.core.equations.whole_log.corrections import CORRECTIONS, find_corrections, inertial_parameters_of
from stribeck.core.equations.whole_log.corrections.correction import Layout, Signals
from stribeck.core.equations.whole_log.filters import (
    Filters,
    derivatives,
    find_filters,
    shortest,
    smooth_window,
    turn_filter,
)
from stribeck.core.equations.whole_log.mode_rows import (
    ModeRows,
    null_projection,
    rows_of_modes,
    unknown_acceleration,
    without_forces,
)
from stribeck.core.equations.whole_log.noise import NoiseLevels, leading_rows, measure_noise, white_noise
from stribeck.core.equations.whole_log.segments import Segment, cut_segments
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.core.settings import Settings


@dataclass(frozen=True, eq=False, kw_only=True)
class WeakForm:
    """Everything that the weak form of a log is made from; `equations` makes the weak form of one segment.

    Attributes
    ----------
    joints
        Columns of the joints whose friction is identified, shape (n,).
    names
        Names of these joints, then of the couplings.
    contact_modes
        Contact mode for each set of feet that stand.
    filters
        Filters of the log.
    corrections
        Corrections of the model and of the calibration in addition to the friction.
    couplings
        Coefficients of the joints in each coupling, shape (n, c).
    period
        Sampling period [s].
    delay
        Assumed delay of the torques [s]; corrections start from it.
    corrected
        Robot with estimated inertias, at which the equations are linearized instead of the model.
    """

    robot: Robot
    log: RobotLog
    joints: IntArray
    names: tuple[str, ...]
    segments: tuple[Segment, ...]
    contact_modes: dict[tuple[str, ...], ModeRows]
    filters: Filters
    noise: NoiseLevels
    tilted: bool
    corrections: Layout
    couplings: Array
    period: float
    delay: float = 0.0
    corrected: Robot | None = None

    def delayed(self, segment: Segment) -> Segment | None:
        """Return the part of a segment whose torques are in the log; None if it is too short.

        With a delay of up to 20 ms it is the whole segment, because the margin is about as long.
        """
        if abs(self.delay) <= 0.02:
            return segment
        lag, whole = round(self.delay / self.period), segment.unbroken
        first, last = max(segment.first, whole.start - lag), min(segment.last, whole.stop - lag)
        return replace(segment, first=first, last=last) if last - first >= self.filters.shortest else None

    @property
    def floats(self) -> bool:
        """Whether the base moves by unknown accelerations in some contact mode, because no sole is at rest."""
        return any(mode.flies or mode.slides for mode in self.contact_modes.values())

    @property
    def bare(self) -> BoolArray:
        """Mask of joints whose friction is only that of couplings, among joints and couplings, shape (n + c,)."""
        own = [self.robot.joint_names[column] in self.robot.bare for column in self.joints]
        return np.append(own, np.zeros(self.couplings.shape[1], dtype=bool))

    @property
    def velocity_noise(self) -> Array:
        """Standard deviation of the velocities' noise [rad/s], of joints and couplings, shape (n + c,)."""
        noise = self.noise.position[self.joints] * np.linalg.norm(self.filters.smooth[1])
        return np.asarray(np.linalg.norm(noise[:, None] * acting(self.couplings), axis=0))

    def equations(self, segment: Segment, gait: int) -> WeakEquations:
        """Compute the weak form of one segment, which is part of a numbered gait phase."""
        log, joints, window = self.log, self.joints, self.filters.window
        mode, rows = self.contact_modes[segment.feet], slice(segment.first, segment.last)
        if self.corrected:
            mode = replace(mode, robot=self.corrected)
        state, torque = self._state(segment), self._torque(segment)
        foot = None if mode.sensor is None else log.foot_names.index(mode.surface)
        wrench = None if foot is None or log.foot_wrench is None else log.foot_wrench[rows, foot]
        external = 0.0 if log.external_torque is None else log.external_torque[rows]
        remainder = mode.left_side(state, torque + external, wrench)
        centers = self._at_windows(state, segment)
        up = None
        if centers.orientation is not None:
            up = gravity_in_root_link(centers.orientation.quaternion, self.robot.up)
        encoder, root, unknowns = mode.responses(centers.position, up)
        free, half, slip = None, len(window.taps) // 2, None
        if unknowns is not None:
            free = null_projection(unknowns)
            slip = unknown_acceleration(window.apply(remainder), unknowns) if mode.slides else None
            remainder = without_forces(remainder, unknowns, half, window.step)

        def summed(of_rows: Array) -> Array:
            """Return the sums P^T of rows, shape (K, rows, c) -> (K, m, c)."""
            return of_rows if free is None else free @ of_rows

        on_joints = acting(self.couplings)
        speeds = on_joints * ~self.bare  # the friction of a joint that never moves is its offset
        on_rows = mode.on_rows(on_joints)
        plain = free is None and on_rows.shape == (len(joints), len(joints))
        smooth_torque, regressors = window.apply(torque[:, joints]), None
        if self.corrections.size:
            signals = Signals(
                layout=self.corrections,
                mode=mode,
                state=centers,
                slip=slip,
                on_joints=on_joints,
                torque=smooth_torque,
                torque_rate=window.apply(np.gradient(self._late(segment, torque)[:, joints], self.period, axis=0)),
                wrench=None if wrench is None else window.apply(wrench),
                carried=self._carried(segment),
            )
            own = [each.columns(signals) for each in CORRECTIONS if each.columns and self.corrections.sizes[each.name]]
            regressors = summed(np.concatenate(own, axis=2))
        residual = summed(window.apply(remainder)[:, :, None])[:, :, 0]
        if self.corrected and regressors is not None:
            residual += regressors[:, :, self.corrections.part("bodies")] @ self._change
        time = log.time[segment.first + half :: window.step][: len(centers.position)]
        before, velocity, position = self._fine(segment)
        standing = self.robot.standing(segment.feet)[joints]
        overlaps = window.overlaps(self.filters.sharp[2], np.ones(1))
        return WeakEquations(
            time=time,
            since=time - (-np.inf if segment.begins is None else log.time[segment.begins]),
            until=(np.inf if segment.ends is None else log.time[segment.ends]) - time,
            gait=gait,
            residual=residual,
            velocity=velocity @ speeds,
            before=before @ speeds,
            blur=self.filters.smooth.shape[1] // 4 * window.fineness,
            taps=window.fine_taps,
            step=window.step * window.fineness,
            projection=None if plain else summed(np.broadcast_to(on_rows, (len(time), *on_rows.shape))),
            standing=(standing @ np.abs(on_joints)) > 0,
            encoder_response=summed(encoder),
            root_response=summed(root),
            encoder_noise=self.noise.position,
            torque_noise=self._padded(self.noise.torque[joints], 0.0),
            acceleration_overlap=overlaps[0],
            torque_overlap=overlaps[1],
            regressors=regressors,
            torque=self._padded(smooth_torque, 0.0),
            elapsed=time - log.time[0],
            position=self._padded(np.where(np.array(self.robot.prismatic)[joints], np.nan, position)),
            temperature=None if log.temperature is None else self._padded(window.apply(log.temperature[rows, joints])),
            position_noise=self._padded(self.noise.position[joints], 0.0),
            couplings=self.couplings if self.couplings.size else None,
            wrench_noise=np.zeros(0) if foot is None else self.noise.wrench[foot],
        )

    @cached_property
    def _change(self) -> Array:
        """Inertial parameters of the corrected robot minus the model's, shape (10 bodies,)."""
        assert self.corrected is not None
        return inertial_parameters_of(self.corrected).ravel() - self.corrections.inertial_parameters.ravel()

    def _carried(self, segment: Segment) -> list[bool]:
        """Find which payloads the robot carries in the middle of a segment."""
        middle = float(self.log.time[(segment.first + segment.last) // 2]) - self.log.start
        return [payload.present(middle, self.log.path) for payload in self.robot.payloads]

    def _padded(self, of_joints: Array, value: float = np.nan) -> Array:
        """Append a column per coupling."""
        columns = np.full((*of_joints.shape[:-1], self.couplings.shape[1]), value)
        return np.concatenate([of_joints, columns], axis=-1)

    def _state(self, segment: Segment) -> State:
        """Compute the motion at the rows of a segment."""
        log, rows, turn = self.log, (segment.first, segment.last), None
        position, velocity = derivatives(log.position, *rows, self.filters.smooth, (0, 1))
        if self.tilted:
            half = self.filters.smooth.shape[1] // 2
            quaternions = self._quaternions(slice(segment.first - half, segment.last + half))
            rates = derivatives(quaternions, half, len(quaternions) - half, self.filters.smooth, (0, 1, 2))
            turn = orientation_from_derivatives(*rates)
        return State(position, velocity, derivatives(log.position, *rows, self.filters.sharp, (2,))[0], turn)

    def _at_windows(self, state: State, segment: Segment) -> State:
        """Compute the motion at the windows' centers, from a segment's motion."""
        smooth, turn, filters = self.filters.window.apply, state.orientation, self.filters
        if turn is not None and filters.turn is not None:
            reach = filters.turn.margin
            quaternions = self._quaternions(slice(segment.first - reach, segment.last + reach))
            rows = slice(reach, len(quaternions) - reach)
            change = filters.turn.windows(quaternions, rows.start, rows.stop)
            of_windows = orientation_from_derivatives(smooth(quaternions[rows]), change, change)
            turn = replace(of_windows, angular_velocity=smooth(turn.angular_velocity))
        acceleration = filters.joints.windows(self.log.position, segment.first, segment.last)
        return State(smooth(state.position), smooth(state.velocity), acceleration, turn)

    def _quaternions(self, rows: slice) -> Array:
        """Compute the quaternions of the root link from those of the base, shape (T, 4)."""
        assert self.log.base_orientation is not None
        return root_quaternions(self.robot, self.log.position[rows], self.log.base_orientation[rows])

    def _fine(self, segment: Segment) -> tuple[Array, Array, Array]:
        """Compute fine velocities of up to 0.5 s before a segment, and velocities and positions in it, shape (any, n).

        Presliding builds up before the segment.
        """
        window, edge = self.filters.window, self.filters.window.edge
        first = max(segment.unbroken.start + self.filters.margin, segment.first - round(0.5 / self.period))
        rows = first - edge, segment.last + edge
        motion = derivatives(self.log.position, *rows, self.filters.smooth, (0, 1))
        position, velocity = (window.refine(signal[:, self.joints]) for signal in motion)
        count = (segment.first - first) * window.fineness
        return velocity[:count], velocity[count:], position[count:]

    def _late(self, segment: Segment, torque: Array) -> Array:
        """Select the delayed part of the torques: measured torques completely, commanded ones without the feedback."""
        return torque if self.log.command is None else self.log.command[segment.first : segment.last]

    def _torque(self, segment: Segment) -> Array:
        """Select the torques `delay` after the segment's rows, shape (T, all joints).

        Beyond the part without gaps, its last torques are repeated.
        """
        if self.delay == 0:
            return self.log.torque[segment.first : segment.last]
        lag = round(self.delay / self.period)
        rows = np.arange(segment.first + lag, segment.last + lag)
        torque = self.log.torque[rows.clip(segment.unbroken.start, segment.unbroken.stop - 1)]
        return np.asarray(torque + (self.delay - lag * self.period) * np.gradient(torque, self.period, axis=0))


def acting(couplings: Array) -> Array:
    """Return how friction acts on n joints, [I B] of shape (n, n + c), from the coefficients B, shape (n, c)."""
    return np.hstack([np.eye(len(couplings)), couplings])


def weak_form(
    robot: Robot,
    prepared: PreparedLog,
    joints: Sequence[int] | IntArray,
    settings: Settings,
    *,
    wrenches: bool = True,
    couplings: Sequence[str] = (),
) -> WeakForm:
    """Prepare the weak form of a log.

    Parameters
    ----------
    robot
        The robot.
    prepared
        Log that is evenly sampled within each unbroken part, with its support phases.
    joints
        Columns of the joints whose friction is identified; each must have a measured torque.
    settings
        `tilt`, `corrections`, `fit_armature` and `double_support` are used.
    wrenches
        Whether the wrenches on standing surfaces are used, where the log has them and inertias are corrected.
    couplings
        Names of the couplings whose friction is identified.
    """
    log, unbroken, period = prepared.log, prepared.sampling.segments, prepared.sampling.period
    columns = np.asarray(joints, dtype=np.int64)
    names = [robot.joint_names[column] for column in columns]
    noise = measure_noise(log.position, log.applied_torque(), unbroken, log.foot_wrench)
    surfaces = [foot for foot, contact in robot.contacts.items() if contact.kind == "surface"]
    cut = partial(cut_segments, prepared.support.phases, unbroken, period, surfaces=surfaces)
    inside = tuple(slice(part.first, part.last) for part in cut(margin=0, shortest=shortest(smooth_window(period))))
    filters = find_filters(log.position, noise.position, columns, unbroken, inside, period)
    if tilted := uses_orientation(robot, log, settings):
        filters = _with_turn(filters, robot, log, inside, unbroken, period)
    segments = cut(margin=filters.margin, shortest=filters.shortest)
    measured = log.foot_names if wrenches and log.foot_wrench is not None and settings.corrections != "none" else ()
    sensed = [foot for foot in surfaces if foot in measured]
    used = rows_of_modes(robot, log, segments, columns, settings, sensed)
    corrections = find_corrections(robot, [*names, *couplings], settings, len(sensed), log.command_delays)
    return WeakForm(
        robot=robot,
        log=log,
        joints=columns,
        names=(*names, *couplings),
        segments=tuple(segment for segment in segments if segment.feet in used),
        contact_modes=used,
        filters=filters,
        noise=noise,
        tilted=tilted,
        corrections=replace(corrections, floating=corrections.floating and (len(used) > 1 or not any(used))),
        couplings=robot.coefficients(names, couplings),
        period=period,
    )


def _with_turn(
    filters: Filters, robot: Robot, log: RobotLog, used: tuple[slice, ...], unbroken: tuple[slice, ...], period: float
) -> Filters:
    """Add the filter of the root link's orientation, by its noise and motion in the rows that are used."""
    assert log.base_orientation is not None
    rows = zip(leading_rows(log.position, used), leading_rows(log.base_orientation, used), strict=True)
    quaternions = [root_quaternions(robot, *pair) for pair in rows if len(pair[0])]
    rate = np.zeros(3) if log.angular_velocity is None else white_noise(log.angular_velocity, unbroken)
    noise = float(np.linalg.norm(rate)) / np.sqrt(3)
    return replace(filters, turn=turn_filter(quaternions, noise, period, filters.window, filters.smooth[2]))

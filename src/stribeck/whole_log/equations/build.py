"""The weak form of a log, segment by segment, computed when it is asked for (docs/estimator.md, equations 2 and 3).

Modulating functions: Shinbrot 1957; weak form: Messenger and Bortz 2021.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.contact import SupportPhase
from stribeck.dynamics.state import Orientation, State
from stribeck.log import RobotLog
from stribeck.robot import Robot
from stribeck.settings import Settings
from stribeck.whole_log.equations.constants import BEFORE, CLAMPED_DELAY, FEWEST_WINDOWS
from stribeck.whole_log.equations.contact_mode import (
    ContactMode,
    at_every_row,
    find_contact_mode,
    null_projection,
    sees_friction,
    without_contact_forces,
)
from stribeck.whole_log.equations.couplings import acting, with_couplings
from stribeck.whole_log.equations.joint_acceleration import JointAcceleration, joint_acceleration
from stribeck.whole_log.equations.motion import Differentiator, differentiator
from stribeck.whole_log.equations.noise import NoiseLevels, measure_noise
from stribeck.whole_log.equations.regressors import inertia_regressors, zero_regressors
from stribeck.whole_log.equations.segments import Segment, cut_segments
from stribeck.whole_log.equations.window import Window, smooth_window
from stribeck.whole_log.weak_equations import WRENCH_SIZE, CorrectionLayout, WeakEquations


@dataclass(frozen=True, eq=False, kw_only=True)
class WeakForm:
    """What the weak form of a log is made from; `equations` makes that of one segment.

    Attributes
    ----------
    joints
        Columns of the joints whose friction is asked for, shape (n,).
    contact_modes
        By the feet that stand.
    corrections
        What of the model and of the calibration is corrected beside the friction.
    couplings
        Coefficients of these joints in each coupling, shape (n, c).
    period
        [s].
    delay
        By which torques are taken to be late [s]; corrections start from there.
    """

    robot: Robot
    log: RobotLog
    joints: NDArray[np.int64]
    segments: tuple[Segment, ...]
    contact_modes: dict[tuple[str, ...], ContactMode]
    window: Window
    filter: Differentiator
    acceleration_kernels: JointAcceleration
    noise: NoiseLevels
    tilted: bool
    corrections: CorrectionLayout
    couplings: Array
    period: float
    delay: float = 0.0

    @property
    def margin(self) -> int:
        """Rows between a segment and the end of the unbroken part of the log, at least."""
        return max(self.filter.margin, self.acceleration_kernels.margin)

    def delayed(self, segment: Segment) -> Segment | None:
        """Return the part of a segment whose torques are in the log; None if it is too short.

        Up to `CLAMPED_DELAY` it is the whole segment: the margin is about as long.
        """
        if abs(self.delay) <= CLAMPED_DELAY:
            return segment
        late = round(self.delay / self.period)
        cut = segment.within(slice(segment.unbroken.start - late, segment.unbroken.stop - late))
        return cut if self.window.count(cut.last - cut.first) >= FEWEST_WINDOWS else None

    @property
    def velocity_noise(self) -> Array:
        """Standard deviation of the velocities' noise [rad/s], of joints and couplings, shape (n + c,)."""
        noise = self.noise.position[self.joints] * np.linalg.norm(self.filter.smooth[1])
        return np.asarray(np.linalg.norm(noise[:, None] * acting(self.couplings), axis=0))

    def equations(self, segment: Segment, gait: int) -> WeakEquations:
        """Return the weak form of one segment, which is part of a numbered gait phase."""
        state = self.filter.state(self.robot, self.log, segment.first, segment.last, self.tilted)
        mode, window = self.contact_modes[segment.feet], self.window
        torque = self._torque(segment)
        wrench = self._wrench(mode, segment)
        left = mode.left_side(state, torque + self._external(segment), wrench)
        columns = None
        if self.corrections.size:
            acceleration = self.acceleration_kernels.windows(self.log.position, segment.first, segment.last)
            columns = self._columns(mode, state, acceleration, torque[:, self.joints], wrench)
        centres = window.apply(state.position)
        jacobian = mode.jacobian(centres) if mode.feet else None
        encoder, root = mode.responses(centres, jacobian)
        projection, half = None, len(window.taps) // 2
        if wrench is not None:  # all rows are used, but friction acts on the joints' alone
            projection = np.broadcast_to(np.eye(len(mode.rows)), (len(centres), *2 * [len(mode.rows)]))
        unknowns = mode.unknowns(centres, jacobian)
        if unknowns is not None:
            projection = null_projection(unknowns)
            left = without_contact_forces(left, at_every_row(unknowns, half, window.step, len(left)))
        of_acceleration, of_torque = window.overlaps(self.filter.sharp[2], np.ones(1))
        time = self.log.time[segment.first + half :: window.step][: len(centres)]
        plain = WeakEquations(
            time=time,
            since=time - (-np.inf if segment.begins is None else self.log.time[segment.begins]),
            until=(np.inf if segment.ends is None else self.log.time[segment.ends]) - time,
            gait=gait,
            residual=_projected(projection, window.apply(left)[:, :, None])[:, :, 0],
            velocity=np.ascontiguousarray(state.velocity[:, self.joints]),
            before=self._before(segment),
            taps=window.taps,
            step=window.step,
            projection=None if projection is None else projection[:, :, -len(self.joints) :],
            standing=self._standing(segment.feet),
            encoder_response=_projected(projection, encoder),
            root_response=_projected(projection, root),
            encoder_noise=self.noise.position,
            torque_noise=self.noise.torque[self.joints],
            acceleration_overlap=of_acceleration,
            torque_overlap=of_torque,
            regressors=None if columns is None else _projected(projection, columns),
            torque=window.apply(torque[:, self.joints]),
            elapsed=time - self.log.time[0],
            position=np.where(np.array(self.robot.prismatic)[self.joints], np.nan, state.position[:, self.joints]),
            temperature=self._temperature(segment),
            position_noise=self.noise.position[self.joints],
            wrench_noise=np.zeros(0) if wrench is None else self.noise.wrench[self.log.foot_names.index(mode.foot)],
        )
        return with_couplings(plain, self.couplings)

    def _before(self, segment: Segment) -> Array:
        """Return velocities of the rows before the segment, shape (any, n)."""
        first = max(segment.unbroken.start + self.margin, segment.first - round(BEFORE / self.period))
        if first >= segment.first:
            return np.zeros((0, len(self.joints)))
        return self.filter.velocity(self.log, first, segment.first)[:, self.joints]

    def _torque(self, segment: Segment) -> Array:
        """Return the torques that come `delay` after the segment's rows, shape (T, all joints).

        Beyond the unbroken part they stay as they are at its end.
        """
        if self.delay == 0:
            return self.log.torque[segment.first : segment.last]
        late = round(self.delay / self.period)
        rows = np.arange(segment.first + late, segment.last + late)
        torque = self.log.torque[rows.clip(segment.unbroken.start, segment.unbroken.stop - 1)]
        return np.asarray(torque + (self.delay - late * self.period) * np.gradient(torque, self.period, axis=0))

    def _external(self, segment: Segment) -> Array | float:
        """Return the external torques at the segment's rows, shape (T, all joints), or zero."""
        external = self.log.external_torque
        return 0.0 if external is None else external[segment.first : segment.last]

    def _temperature(self, segment: Segment) -> Array | None:
        if self.log.temperature is None:
            return None
        return self.window.apply(self.log.temperature[segment.first : segment.last, self.joints])

    def _wrench(self, mode: ContactMode, segment: Segment) -> Array | None:
        """Return the measured wrench on the standing foot at the segment's rows, shape (T, 6), if it is used."""
        if not mode.sensed or self.log.foot_wrench is None:
            return None
        return self.log.foot_wrench[segment.first : segment.last, self.log.foot_names.index(mode.foot)]

    def _standing(self, feet: tuple[str, ...]) -> NDArray[np.bool_]:
        if self.robot.base == "fixed":
            return np.zeros(len(self.joints), dtype=bool)
        return np.asarray(self.robot.standing(feet)[self.joints])

    def _columns(
        self,
        mode: ContactMode,
        state: State,
        acceleration: Array,
        torque: Array,
        wrench: Array | None,
    ) -> Array:
        """Return the columns of all corrections, shape (K, rows, c).

        Accelerations are those at the windows, shape (K, all joints); torque, shape (T, n), and wrench are measured.
        """
        turn, smooth = state.orientation, self.window.apply
        if turn is not None:
            turn = Orientation(
                smooth(turn.quaternion), smooth(turn.angular_velocity), smooth(turn.angular_acceleration)
            )
        smoothed = State(smooth(state.position), smooth(state.velocity), acceleration, turn)
        rows = np.arange(mode.rooted.root_size + len(self.robot.joint_names)) if self.robot.loops else mode.rows
        own = np.eye(len(mode.rows))[:, len(mode.rows) - len(self.joints) :]
        found = []
        if self.corrections.bodies:
            root = mode.root(smoothed)
            found.append(inertia_regressors(self.robot, mode.rooted, rows, smoothed, root))
            if self.robot.loops:
                found[-1] = mode.used(smoothed.position, found[-1])
        if self.corrections.gains:
            found.append(smooth(torque)[:, None] * own)
            found.append(zero_regressors(mode.rooted, rows, smoothed, mode.root))
        if self.corrections.delays:
            found.append(-(own @ smooth(np.gradient(torque, self.period, axis=0))[:, :, None]))
        if self.corrections.delays > 1:
            turning = np.zeros((len(smoothed.position), 3)) if turn is None else turn.angular_velocity
            found.append(-(found[-2][:, :, -3:] @ turning[:, :, None]))
        if self.corrections.wrenches:
            sensors = np.zeros((len(smoothed.position), len(mode.rows), self.corrections.wrenches, WRENCH_SIZE))
            if wrench is not None:
                own_sensor = sensors[:, :6, _sensed_feet(self.robot, self.log).index(mode.foot)]
                own_sensor[:, :, :6], own_sensor[:, :, 6] = np.eye(6), smooth(wrench)
            found.append(sensors.reshape(*sensors.shape[:2], -1))
        if rotors := list(self.corrections.rotors):
            turned = acting(self.couplings)[:, rotors]
            found.append((smoothed.acceleration[:, self.joints] @ turned)[:, None] * (own @ turned))
        return np.concatenate(found, axis=2)


def _projected(projection: Array | None, rows: Array) -> Array:
    """Return the sums P^T of rows, shape (K, rows, c) -> (K, m, c)."""
    return rows if projection is None else projection @ rows


def _sensed_feet(robot: Robot, log: RobotLog) -> list[str]:
    """Return the standing surfaces whose wrench is measured."""
    sensed = log.foot_names if log.foot_wrench is not None else ()
    return [foot for foot, contact in robot.contacts.items() if contact.kind == "surface" and foot in sensed]


def find_corrections(robot: Robot, names: Sequence[str], settings: Settings) -> CorrectionLayout:
    """Return what is corrected: nothing, inertias and the torques' delay, all sensors' calibration, rotor inertias.

    `names` are those of joints, then of couplings.
    """
    asked = settings.fit_armature
    everywhere = asked is True or (asked == "auto" and robot.torque_source != "link_side_sensor")
    rotors = tuple(k for k, name in enumerate(names) if everywhere or (isinstance(asked, list) and name in asked))
    modelled = dict(zip(robot.joint_names, robot.armature.tolist(), strict=True))
    armature = np.array([modelled.get(names[k], 0.0) for k in rotors])
    if settings.corrections == "none":
        return CorrectionLayout(rotors=rotors, armature=armature)
    model = robot.tree.model
    bodies = range(1, model.njoints)
    calibration = settings.corrections == "calibration"
    return CorrectionLayout(
        bodies=tuple(str(model.names[body]) for body in bodies),
        inertial_parameters=np.stack([model.inertias[body].toDynamicParameters() for body in bodies]),
        gains=sum(name in robot.joint_names for name in names) if calibration else 0,
        zeros=len(robot.joint_names) if calibration else 0,
        tilts=3 if calibration else 0,
        delays=1 + (calibration and robot.base == "floating"),
        rotors=rotors,
        armature=armature,
    )


def weak_form(
    robot: Robot,
    log: RobotLog,
    joints: Sequence[int] | NDArray[np.int64],
    phases: tuple[SupportPhase, ...],
    unbroken: tuple[slice, ...],
    period: float,
    settings: Settings,
    *,
    wrenches: bool = True,
    couplings: Sequence[str] = (),
) -> WeakForm:
    """Return the weak form of a log.

    Parameters
    ----------
    robot
        The robot.
    log
        Evenly sampled within each segment.
    joints
        Columns of the joints whose friction is asked for; each must have a measured torque.
    phases, unbroken
        Support phases, and rows that no filter may cross the ends of.
    period
        [s].
    settings
        `tilt`, `corrections`, `fit_armature` and `double_support` are used.
    wrenches
        Whether the wrenches on standing surfaces are used, where the log has them and inertias are corrected.
    couplings
        Names of those whose friction is asked for too.
    """
    columns = np.asarray(joints, dtype=np.int64)
    names = [robot.joint_names[column] for column in columns]
    noise = measure_noise(log.position, log.applied_torque(), unbroken, log.foot_wrench)
    kernels = differentiator(float(np.median(noise.position[columns])), period)
    window, corrections = smooth_window(period), find_corrections(robot, [*names, *couplings], settings)
    surfaces = [foot for foot, contact in robot.contacts.items() if contact.kind == "surface"]
    acceleration_kernels = joint_acceleration(log.position, noise.position, unbroken, period, window, kernels.smooth[2])
    margin = max(kernels.margin, acceleration_kernels.margin)
    segments = cut_segments(phases, unbroken, period, margin, window.rows(FEWEST_WINDOWS), surfaces)
    sensed = _sensed_feet(robot, log) if wrenches and corrections.bodies else []
    corrections = replace(corrections, wrenches=len(sensed))
    contact_modes = {
        feet: find_contact_mode(robot, feet, columns, sensed) for feet in dict.fromkeys(s.feet for s in segments)
    }
    tilted = robot.base == "floating" and settings.tilt != "flat" and log.base_orientation is not None
    used = [
        feet
        for feet, mode in contact_modes.items()
        if (tilted or not mode.flies) and _used(mode, corrections, settings)
    ]
    return WeakForm(
        robot=robot,
        log=log,
        joints=columns,
        segments=tuple(segment for segment in segments if segment.feet in used),
        contact_modes=contact_modes,
        window=window,
        filter=kernels,
        acceleration_kernels=acceleration_kernels,
        noise=noise,
        tilted=tilted,
        corrections=corrections,
        couplings=robot.coefficients(names, couplings),
        period=period,
    )


def _used(mode: ContactMode, corrections: CorrectionLayout, settings: Settings) -> bool:
    """Return whether a contact mode is used.

    Several surfaces are only with `double_support = "fit"`, as they add little; no loop of feet is where encoder zeros
    are corrected, as these turn the contact forces too.
    """
    if not mode.feet:
        return True
    loops = mode.foot != "" and settings.double_support != "fit"
    return sees_friction(mode) and not loops and not corrections.zeros

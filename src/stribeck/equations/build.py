"""The weak form of a log, stretch by stretch, worked out only when it is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stribeck.contact import SupportPhase
from stribeck.dynamics.state import Orientation, State
from stribeck.equations.calm import CalmAcceleration, calm_acceleration
from stribeck.equations.corrections import inertia_columns, zero_columns
from stribeck.equations.motion import Differentiator, differentiator
from stribeck.equations.noise import NoiseLevels, measure_noise
from stribeck.equations.stretches import Stretch, cut_stretches
from stribeck.equations.support import (
    Support,
    at_every_row,
    find_support,
    null_projection,
    sees_friction,
    without_contact_forces,
)
from stribeck.equations.window import Window, smooth_window
from stribeck.log import RobotLog
from stribeck.robot import Robot
from stribeck.settings import Settings
from stribeck.typing import Array
from stribeck.weak_equations import WRENCH_SIZE, Corrections, WeakEquations

FEWEST_WINDOWS = 4
"""In a stretch [1]; less is not worth the trouble."""


@dataclass(frozen=True, eq=False, kw_only=True)
class WeakForm:
    """What the weak form of a log is made from; `equations` makes that of one stretch.

    Attributes
    ----------
    joints
        Columns of the joints whose friction is asked for, shape (n,).
    supports
        By the feet that stand.
    corrections
        What of the model and of the calibration is corrected beside the friction.
    """

    robot: Robot
    log: RobotLog
    joints: NDArray[np.int64]
    stretches: tuple[Stretch, ...]
    supports: dict[tuple[str, ...], Support]
    window: Window
    filter: Differentiator
    calm: CalmAcceleration
    noise: NoiseLevels
    tilted: bool
    corrections: Corrections

    @property
    def velocity_noise(self) -> Array:
        """Standard deviation of the velocities' noise [rad/s], shape (n,)."""
        return np.asarray(self.noise.position[self.joints] * np.linalg.norm(self.filter.smooth[1]))

    def equations(self, stretch: Stretch, gait: int) -> WeakEquations:
        """Return the weak form of one stretch, which is part of a numbered gait phase."""
        state = self.filter.state(self.robot, self.log, stretch.first, stretch.last, self.tilted)
        support, window = self.supports[stretch.feet], self.window
        torque = self.log.torque[stretch.first : stretch.last]
        wrench = self._wrench(support, stretch)
        left = support.left_side(state, torque, wrench)
        columns = None
        if self.corrections.size:
            calm = self.calm.windows(self.log.position, stretch.first, stretch.last)
            columns = self._columns(stretch.feet, support, state, calm, torque[:, self.joints], wrench)
        centres = window.apply(state.position)
        jacobian = support.jacobian(centres) if support.feet else None
        encoder, root = support.responses(centres, jacobian)
        projection, half = None, len(window.taps) // 2
        if wrench is not None:  # all rows are seen, but friction acts on the joints' alone
            projection = np.broadcast_to(np.eye(len(support.rows)), (len(centres), *2 * [len(support.rows)]))
        if jacobian is not None:
            forces = jacobian[:, :, support.rows]
            projection = null_projection(forces)
            left = without_contact_forces(left, at_every_row(forces, half, window.step, len(left)))
        of_acceleration, of_torque = window.overlaps(self.filter.sharp[2], np.ones(1))
        time = self.log.time[stretch.first + half :: window.step][: len(centres)]
        return WeakEquations(
            time=time,
            since=time - (-np.inf if stretch.begins is None else self.log.time[stretch.begins]),
            until=(np.inf if stretch.ends is None else self.log.time[stretch.ends]) - time,
            gait=gait,
            residual=_seen(projection, window.apply(left)[:, :, None])[:, :, 0],
            velocity=np.ascontiguousarray(state.velocity[:, self.joints]),
            taps=window.taps,
            step=window.step,
            projection=None if projection is None else projection[:, :, -len(self.joints) :],
            standing=self._standing(stretch.feet),
            encoder_response=_seen(projection, encoder),
            root_response=_seen(projection, root),
            encoder_noise=self.noise.position,
            torque_noise=self.noise.torque[self.joints],
            acceleration_overlap=of_acceleration,
            torque_overlap=of_torque,
            columns=None if columns is None else _seen(projection, columns),
            torque=window.apply(torque[:, self.joints]),
            elapsed=time - self.log.time[0],
            temperature=self._temperature(stretch),
            wrench_noise=np.zeros(0) if wrench is None else self.noise.wrench[self.log.foot_names.index(support.foot)],
        )

    def _temperature(self, stretch: Stretch) -> Array | None:
        if self.log.temperature is None:
            return None
        return self.window.apply(self.log.temperature[stretch.first : stretch.last, self.joints])

    def _wrench(self, support: Support, stretch: Stretch) -> Array | None:
        """Return the measured wrench on the standing foot at the stretch's rows, shape (T, 6), if it is looked at."""
        if not support.sensed or self.log.foot_wrench is None:
            return None
        return self.log.foot_wrench[stretch.first : stretch.last, self.log.foot_names.index(support.foot)]

    def _standing(self, feet: tuple[str, ...]) -> NDArray[np.bool_]:
        if self.robot.base == "fixed":
            return np.zeros(len(self.joints), dtype=bool)
        return np.asarray(self.robot.standing(feet)[self.joints])

    def _columns(
        self,
        feet: tuple[str, ...],
        support: Support,
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
        own = np.eye(len(support.rows))[:, len(support.rows) - len(self.joints) :]
        found = []
        if self.corrections.bodies:
            root = support.root(smoothed)
            found.append(inertia_columns(self.robot, support.rooted, support.rows, smoothed, root))
        if self.corrections.gains:
            found.append(smooth(torque)[:, None] * own)
            found.append(zero_columns(self.robot, support.rooted, support.rows, feet, smoothed))
        if self.corrections.wrenches:
            sensors = np.zeros((len(smoothed.position), len(support.rows), self.corrections.wrenches, WRENCH_SIZE))
            if wrench is not None:
                own_sensor = sensors[:, :6, _sensed_feet(self.robot, self.log).index(support.foot)]
                own_sensor[:, :, :6], own_sensor[:, :, 6] = np.eye(6), smooth(wrench)
            found.append(sensors.reshape(*sensors.shape[:2], -1))
        if rotors := list(self.corrections.rotors):
            found.append(smoothed.acceleration[:, None, self.joints[rotors]] * own[:, rotors])
        return np.concatenate(found, axis=2)


def _seen(projection: Array | None, rows: Array) -> Array:
    """Return what the contacts let one see of rows, shape (K, rows, c) -> (K, m, c)."""
    return rows if projection is None else projection @ rows


def _sensed_feet(robot: Robot, log: RobotLog) -> list[str]:
    """Return the standing surfaces whose wrench is measured."""
    there = log.foot_names if log.foot_wrench is not None else ()
    return [foot for foot, contact in robot.contacts.items() if contact.kind == "surface" and foot in there]


def find_corrections(robot: Robot, joints: NDArray[np.int64], settings: Settings) -> Corrections:
    """Return what is corrected: nothing, the bodies' inertias, the calibration of the sensors, rotor inertias."""
    asked = settings.fit_armature
    rotors = tuple(k for k, c in enumerate(joints) if asked is True or (asked and robot.joint_names[c] in asked))
    if settings.corrections == "none":
        return Corrections(rotors=rotors)
    model = robot.tree.model
    bodies = range(1, model.njoints)
    calibration = settings.corrections == "calibration"
    return Corrections(
        bodies=tuple(str(model.names[body]) for body in bodies),
        inertial_parameters=np.stack([model.inertias[body].toDynamicParameters() for body in bodies]),
        gains=len(joints) if calibration else 0,
        zeros=len(robot.joint_names) if calibration else 0,
        tilts=3 if calibration else 0,
        rotors=rotors,
    )


def weak_form(
    robot: Robot,
    log: RobotLog,
    joints: Sequence[int] | NDArray[np.int64],
    phases: tuple[SupportPhase, ...],
    segments: tuple[slice, ...],
    period: float,
    settings: Settings,
    *,
    wrenches: bool = True,
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
    phases, segments
        Support phases, and rows that no filter may cross the ends of.
    period
        [s].
    settings
        `tilt`, `corrections`, `fit_armature` and `double_support` are used.
    wrenches
        Whether the wrenches on standing surfaces are looked at, where the log has them and inertias are corrected.
    """
    columns = np.asarray(joints, dtype=np.int64)
    noise = measure_noise(log.position, log.torque, segments, log.foot_wrench)
    kernels = differentiator(float(np.median(noise.position[columns])), period)
    window, corrections = smooth_window(period), find_corrections(robot, columns, settings)
    surfaces = [foot for foot, contact in robot.contacts.items() if contact.kind == "surface"]
    calm = calm_acceleration(log.position, noise.position, segments, period, window, kernels.smooth[2])
    margin = max(kernels.margin, calm.margin)
    stretches = cut_stretches(phases, segments, period, margin, window.rows(FEWEST_WINDOWS), surfaces)
    sensed = _sensed_feet(robot, log) if wrenches and corrections.bodies else []
    corrections = replace(corrections, wrenches=len(sensed))
    supports = {feet: find_support(robot, feet, columns, sensed) for feet in dict.fromkeys(s.feet for s in stretches)}
    seen = [feet for feet, support in supports.items() if _wanted(support, corrections, settings)]
    return WeakForm(
        robot=robot,
        log=log,
        joints=columns,
        stretches=tuple(stretch for stretch in stretches if stretch.feet in seen),
        supports=supports,
        window=window,
        filter=kernels,
        calm=calm,
        noise=noise,
        tilted=robot.base == "floating" and settings.tilt != "flat" and log.base_orientation is not None,
        corrections=corrections,
    )


def _wanted(support: Support, corrections: Corrections, settings: Settings) -> bool:
    """Return whether a support is used.

    Several surfaces are only if asked for, as they add little; no loop of feet is where encoder zeros are set free, as
    they turn the contact forces too.
    """
    if not support.feet:
        return True
    loops = support.foot != "" and settings.double_support != "fit"
    return sees_friction(support) and not loops and not corrections.zeros

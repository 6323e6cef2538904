"""The weak form of a log, stretch by stretch, worked out only when it is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stribeck.base_motion import standing_root
from stribeck.contact import SupportPhase
from stribeck.dynamics import RootMotion, inertia_matrix, rooted_inverse_dynamics
from stribeck.equations import Corrections, WeakEquations
from stribeck.log import Array, RobotLog
from stribeck.robot import Robot
from stribeck.rooting import RootedModel
from stribeck.settings import Settings
from stribeck.state import Orientation, State
from stribeck.weak_form.corrections import inertia_columns, zero_columns
from stribeck.weak_form.motion import Differentiator, differentiator
from stribeck.weak_form.noise import NoiseLevels, measure_noise
from stribeck.weak_form.stretches import Stretch, cut_stretches
from stribeck.weak_form.window import Window, smooth_window


@dataclass(frozen=True, eq=False, kw_only=True)
class WeakForm:
    """What the weak form of a log is made from; `equations` makes that of one stretch.

    Attributes
    ----------
    joints
        Columns of the joints whose friction is asked for, shape (n,).
    corrections
        What of the model and of the calibration is corrected beside the friction.
    """

    robot: Robot
    log: RobotLog
    joints: NDArray[np.int64]
    stretches: tuple[Stretch, ...]
    window: Window
    filter: Differentiator
    noise: NoiseLevels
    tilted: bool
    corrections: Corrections

    def equations(self, stretch: Stretch, gait: int) -> WeakEquations:
        """Return the weak form of one stretch, which is part of a numbered gait phase."""
        state = self.filter.state(self.robot, self.log, stretch.first, stretch.last, self.tilted)
        rooted, root = _root(self.robot, stretch.feet, state)
        _, needed = rooted_inverse_dynamics(rooted, state.position, state.velocity, state.acceleration, root)
        residual = (self.log.torque[stretch.first : stretch.last] - needed)[:, self.joints]
        centres = self.window.apply(state.position)
        inertia = inertia_matrix(rooted, centres)[:, rooted.root_size + self.joints]
        lags = self.window.lags(self.filter.sharp.shape[1])
        middle = stretch.first + len(self.window.taps) // 2
        time = self.log.time[middle :: self.window.step][: len(centres)]
        return WeakEquations(
            time=time,
            since=time - (-np.inf if stretch.begins is None else self.log.time[stretch.begins]),
            until=(np.inf if stretch.ends is None else self.log.time[stretch.ends]) - time,
            gait=gait,
            residual=self.window.apply(residual),
            velocity=np.ascontiguousarray(state.velocity[:, self.joints]),
            taps=self.window.taps,
            step=self.window.step,
            projection=None,
            encoder_response=inertia[:, :, rooted.root_size :],
            root_response=inertia[:, :, : rooted.root_size],
            encoder_noise=self.noise.position,
            torque_noise=self.noise.torque[self.joints],
            acceleration_overlap=self.window.overlap(self.filter.sharp[2], lags),
            torque_overlap=self.window.overlap(np.ones(1), lags),
            columns=self._columns(stretch, rooted, state) if self.corrections.size else None,
        )

    def _columns(self, stretch: Stretch, rooted: RootedModel, state: State) -> Array:
        """Return the columns of all corrections, shape (K, n, c)."""
        turn, smooth = state.orientation, self.window.apply
        if turn is not None:
            turn = Orientation(
                smooth(turn.quaternion), smooth(turn.angular_velocity), smooth(turn.angular_acceleration)
            )
        smoothed = State(smooth(state.position), smooth(state.velocity), smooth(state.acceleration), turn)
        _, root = _root(self.robot, stretch.feet, smoothed)
        found = [inertia_columns(self.robot, rooted, self.joints, smoothed, root)]
        if self.corrections.gains:
            torque = smooth(self.log.torque[stretch.first : stretch.last, self.joints])
            found.append(torque[:, :, None] * np.eye(len(self.joints)))
            found.append(zero_columns(self.robot, rooted, self.joints, stretch.feet, smoothed))
        return np.concatenate(found, axis=2)


def find_corrections(robot: Robot, joints: int, settings: Settings) -> Corrections:
    """Return what is corrected: nothing, the bodies' inertias, or the calibration of the sensors as well."""
    if settings.corrections == "none":
        return Corrections()
    model = robot.tree.model
    bodies = range(1, model.njoints)
    calibration = settings.corrections == "calibration"
    return Corrections(
        bodies=tuple(str(model.names[body]) for body in bodies),
        inertial_parameters=np.stack([model.inertias[body].toDynamicParameters() for body in bodies]),
        gains=joints if calibration else 0,
        zeros=len(robot.joint_names) if calibration else 0,
        tilts=3 if calibration else 0,
    )


def weak_form(
    robot: Robot,
    log: RobotLog,
    joints: Sequence[int] | NDArray[np.int64],
    phases: tuple[SupportPhase, ...],
    segments: tuple[slice, ...],
    period: float,
    settings: Settings,
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
        `tilt` and `corrections` are used.
    """
    columns = np.asarray(joints, dtype=np.int64)
    noise = measure_noise(log.position, log.torque, segments)
    kernels = differentiator(float(np.median(noise.position[columns])), period)
    return WeakForm(
        robot=robot,
        log=log,
        joints=columns,
        stretches=cut_stretches(robot, phases, segments, period, kernels.margin),
        window=smooth_window(period),
        filter=kernels,
        noise=noise,
        tilted=robot.base == "floating" and settings.tilt != "flat" and log.base_orientation is not None,
        corrections=find_corrections(robot, len(columns), settings),
    )


def _root(robot: Robot, feet: tuple[str, ...], state: State) -> tuple[RootedModel, RootMotion | None]:
    if robot.base == "fixed":
        return robot.tree, None
    return robot.rooted_at(feet[0]), standing_root(robot, feet[0], state)


@dataclass(frozen=True, eq=False)
class Lazily(Sequence[WeakEquations]):
    """The equations of several logs' stretches with their gait phases, worked out when they are asked for."""

    parts: tuple[tuple[WeakForm, Stretch, int], ...]

    def __len__(self) -> int:
        return len(self.parts)

    def __getitem__(self, k: int) -> WeakEquations:  # type: ignore[override]
        form, stretch, gait = self.parts[k]
        return form.equations(stretch, gait)

    @property
    def gaits(self) -> int:
        """How many gait phases there are."""
        return 1 + max((gait for _, _, gait in self.parts), default=-1)


def all_equations(forms: Sequence[WeakForm]) -> Lazily:
    """Return the equations of all stretches of some logs; every log's supports are gait phases of their own."""
    gaits: dict[tuple[int, tuple[str, ...]], int] = {}
    parts = []
    for number, form in enumerate(forms):
        for stretch in form.stretches:
            steps = stretch.begins is not None or stretch.ends is not None
            gait = gaits.setdefault((number, stretch.feet), len(gaits)) if steps else -1
            parts.append((form, stretch, gait))
    return Lazily(tuple(parts))

"""Friction of all joints of a robot in service, sample by sample.

Over a window with weights w that vanish at its ends, the momentum balance p' = tau - R + b needs no accelerations:

    sum w R = sum w (tau + b) + sum w' p

The mean friction of a window is compared with the mean of the identified law, and Kalman filters track the difference.
All work on windows starts and ends with samples of the stream, so the result does not depend on how it is cut.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.dynamics.contact.mode import ContactMode
from stribeck.core.errors import SettingsError
from stribeck.core.log.clock import STEP
from stribeck.core.result import Corrections, Result
from stribeck.core.robot import Robot
from stribeck.service.online.alarms import Alarm, Watchdog
from stribeck.service.online.arguments import base_motion, joined, rows_of, standing_contacts
from stribeck.service.online.baseline import Baseline, with_estimates
from stribeck.service.online.friction_state import FrictionState
from stribeck.service.online.kalman import JointFilters
from stribeck.service.online.motion import Base, Tree
from stribeck.service.online.state import load_state, save_state

WINDOW = 0.05
"""Duration of a window [s]: short compared with a step, long compared with the noise of velocities."""
FEWEST, IMPOSSIBLE, FASTER = 8, 30.0, 10.0
"""Smallest number of samples in a window; and its change of friction, relative to the friction, and its speed, relative
to the top speed of the identified log, from which it is damaged [1]."""
WALK, CHANGE = 300.0, 0.13
"""Motion in which friction may change as much as from log to log [s], and smallest change that the filters expect [1]:
the spread of a robot with one log. A smaller one would hide wear where logs are alike."""
RETURN = 3600.0
"""Time constant with which the estimate returns to the identified friction without motion, and longest pause [s]."""
OFFSET, PAYLOAD = 1.0, 0.05
"""Standard deviations of offset relative to friction and offset, and of payload relative to the robot's mass [1]."""


class OnlineFriction:
    """Tracks the friction of a robot in service and raises alarms.

    Parameters
    ----------
    result
        Identified friction, and corrections of the model and the sensors.
    robot
        Robot of the result, without closed loops.
    rate
        Rate of the samples [Hz].
    hours_per_false_alarm
        Mean time between false alarms [h].

    Attributes
    ----------
    alarms
        Alarms that are raised, by name.
    counts
        Numbers of samples: `used`, `repeated` stamps, samples with `missing` values, and `breaks` of the stream.

    Raises
    ------
    SettingsError
        If result and robot do not match, or a setting is not valid.

    Examples
    --------
    >>> online = OnlineFriction(result, robot, rate=1000.0)
    >>> online.update(log.time, log.position, log.velocity, log.torque)  # a log, a batch or a sample
    []
    >>> online.state()["elbow"].alarm
    False
    """

    def __init__(self, result: Result, robot: Robot, rate: float, *, hours_per_false_alarm: float = 100.0) -> None:
        if not 1.0 <= rate <= 1e5:
            raise SettingsError(f"rate is {rate!r}; expected 1 to 100,000 Hz")
        if not 1.0 <= hours_per_false_alarm <= 1e6:
            raise SettingsError(f"hours_per_false_alarm is {hours_per_false_alarm!r}; expected 1 to 1,000,000 h")
        if robot.loops:
            raise SettingsError(f"{robot.path or robot.name}: online estimation does not support closed loops")
        self.robot, self.baseline = with_estimates(robot, result), Baseline(result, robot)
        self.result, self._period, self._joints = result, 1 / rate, len(robot.joint_names)
        known, names = result.corrections or Corrections(chi_square=1.0), robot.joint_names
        self._gain = np.array([1 - known.torque_gain.get(name, (0.0,))[0] for name in names])
        self._zero = np.array([known.encoder_zero.get(name, (0.0,))[0] for name in names])
        self._delay = known.torque_delay[0] if known.torque_delay else 0.0
        self._untracked = np.setdiff1d(np.arange(len(names)), self.baseline.columns)
        spread, columns = np.maximum(self.baseline.spread, CHANGE), self.baseline.columns
        zero = OFFSET * np.hypot(1.0, self.baseline.offset / self.baseline.level)
        scales = np.stack([spread, zero, spread, np.full(len(columns), PAYLOAD)], axis=1)
        self.filters = JointFilters(scales, scales / np.sqrt(WALK), RETURN, self.baseline.residual**2)
        self.watchdog = Watchdog(self.baseline, self.robot.mass, hours_per_false_alarm)
        self.alarms: dict[str, Alarm] = {}
        self.counts = dict.fromkeys(("used", "repeated", "missing", "breaks"), 0)
        self.time, self.checked = -np.inf, -np.inf
        self._samples, self._second, self._unseen = 0, round(rate), np.zeros(len(columns))
        self.motion, self._moved = np.zeros(len(columns)), np.zeros(len(columns), dtype=bool)
        self._trees: dict[ContactMode, Tree] = {}
        self._make_window()

    def _make_window(self) -> None:
        """Allocate the signals of a window and compute its weights."""
        rows = max(FEWEST, round(WINDOW / self._period))
        phase = np.pi * (np.arange(rows) + 0.5) / rows
        self._weight = np.sin(phase) ** 2 * 2 / rows
        self._slope = np.sin(2 * phase) * 2 * np.pi / (rows**2 * self._period)
        delayed_phase = np.clip(phase - np.pi * self._delay / (rows * self._period), 0.0, np.pi)
        self._late = np.sin(delayed_phase) ** 2 / np.sum(np.sin(delayed_phase) ** 2)
        self._signals = np.empty((6, rows, self._joints))  # position, velocity, torque, p, b, temperature
        self._filled, self._span = 0, rows * self._period
        self._pending: tuple[float, Array, Array, BoolArray, BoolArray] | None = None
        self._mode: ContactMode | None = None
        self._last = self._settled = -np.inf

    def update(
        self,
        time: ArrayLike,
        position: ArrayLike,
        velocity: ArrayLike,
        torque: ArrayLike,
        base: tuple[ArrayLike, ArrayLike | None] | None = None,
        contact: ArrayLike | Literal["hung"] | None = None,
        temperature: ArrayLike | None = None,
    ) -> list[Alarm]:
        """Add a sample, or T consecutive samples, and return the alarms that are raised or cleared.

        A joint with a missing or absurd torque is skipped; without a position or velocity, all joints are. After a gap
        or a jump of the stamps, a new window starts.

        Parameters
        ----------
        time
            Time [s], one number or shape (T,).
        position, velocity, torque
            Joint signals in robot order [rad], [rad/s], [N m], shape (n,) or (T, n).
        base
            Quaternion xyzw of a floating base, as in a log, shape (4,) or (T, 4), and angular velocity of the root link
            in its coordinates [rad/s], (3,) or (T, 3), which point feet require. Without it, a standing sole is level.
        contact
            Standing contacts in the robot's order, shape (feet,) or (T, feet), or "hung" while something else holds the
            base; required for a floating base.
        temperature
            Temperatures of the joints [°C], shape (n,) or (T, n), if the identified friction depends on them.

        Raises
        ------
        LogError
            If an array has a wrong shape, or a floating base has no contacts.
        """
        stamps = rows_of("time", time)
        samples = len(stamps)
        signals = joined((samples, self._joints), position=position, velocity=velocity, torque=torque)
        signals[0] -= self._zero
        signals[2] *= self._gain
        signals[2, :, self._untracked] = 0.0
        warm = None if temperature is None else joined((samples, self._joints), temperature=temperature)[0]
        turn, spin = base_motion(base, samples)
        sums = signals[:2].sum(axis=(0, 2)) + (0.0 if turn is None else turn.sum(axis=1))
        known = np.isfinite(sums).tolist()
        self.counts["missing"] += int(np.sum(~np.isfinite(sums + signals[2].sum(axis=1) + stamps)))
        alarms: list[Alarm] = []
        for k, (stamp, feet) in enumerate(
            zip(stamps.tolist(), standing_contacts(self.robot, contact, samples), strict=True)
        ):
            if self._follow(stamp, feet, known[k]):
                base_now = None if turn is None else turn[k], None if spin is None else spin[k]
                self._add(base_now, signals[:, k], None if warm is None else warm[k])
            self._samples += 1
            if self._samples % self._second == 0:
                alarms += self._check()
        return alarms

    def _follow(self, stamp: float, feet: tuple[str, ...], known: bool) -> bool:
        """Follow the clock and the contacts; return whether the sample can be used."""
        step = stamp - self._last
        if not known or not np.isfinite(stamp):
            return False
        if -1.0 < step < 0.25 * self._period:
            self.counts["repeated"] += 1
            return False
        self._last = stamp
        if not 0 < step <= STEP * self._period:
            self.counts["breaks"] += 1
            self._filled, self._pending, self._mode = 0, None, None
        if self._mode is None or feet != self._mode.feet:
            support = self.robot.settings.support
            landed = self._mode is not None
            self._mode = (self._mode or ContactMode(self.robot, ())).followed_by(feet)
            self._filled, self._pending = 0, None
            self._settled = stamp + (support.trim_start + support.trim_end) * landed
        return stamp >= self._settled and (bool(feet) or self.robot.base == "fixed")

    def _add(self, base: Base, signals: Array, warm: Array | None) -> None:
        """Add position, velocity and torque, shape (3, n), to the window, and evaluate the window if it is full."""
        assert self._mode is not None
        if self._mode not in self._trees:
            self._trees[self._mode] = Tree(self._mode)
        tree = self._trees[self._mode]
        row, position = self._filled, signals[0]
        turned = row % 5 == 0  # five samples share the tilt of a standing sole, which is at rest
        motion = tree.momentum(position, signals[1], base, turned=turned)
        self._signals[:3, row], self._signals[3:5, row] = signals, motion
        self._signals[5, row] = np.nan if warm is None else warm
        self._filled += 1
        self.counts["used"] += 1
        rows = len(self._weight)
        if self._filled == rows:
            self._filled = 0
            self._pending = (self._last, *self._measure(tree, position, base))
        elif self._filled == rows - 2 and self._pending is not None:
            self._commit(*self._pending)

    @np.errstate(over="ignore", invalid="ignore")
    def _measure(self, tree: Tree, position: Array, base: Base) -> tuple[Array, Array, BoolArray, BoolArray]:
        """Compute regressors (n, 4), values, joints that can be used, and standing joints of a window, (n,) each."""
        of, columns = self.baseline, self.baseline.columns
        q, v, tau, p, b, warm = self._signals[:, :, columns]
        warmer = np.nan_to_num(warm - of.mean_temperature)
        every = slice(None, None, max(1, len(q) // 20))  # friction is smooth, and costs most of the time
        w = self._weight
        friction = self._late @ tau + w @ b + self._slope @ p
        law = w[every] @ of.friction(v[every], q[every], tau[every], warmer[every]) / w[every].sum()
        payload = tree.payload(position, base)[columns] * self.robot.mass
        regressor = np.stack([law, of.level, (w @ v) / of.speed * of.level, payload], axis=1) / of.level[:, None]
        slow = 0.25 * of.speeds[0]  # near standstill: far below the slow point of the friction curve
        moving = (v > slow).all(axis=0) | (v < -slow).all(axis=0)
        value = (friction - of.offset - law) / of.level
        known = (np.abs(v) < FASTER * of.speeds[2]).all(axis=0) & np.isfinite(regressor).all(axis=1)
        usable = (np.abs(value) < IMPOSSIBLE) & known & moving & tree.seen[columns]
        regressor[~usable], value[~usable] = 0.0, 0.0  # a dead channel blinds its own joint only
        resting = known & (np.abs(v).max(axis=0) < of.speeds[0]) & (np.abs(q[-1] - q[0]) < of.speeds[0] * self._span)
        enough = np.where(usable, 20.0, resting)  # one window in twenty is enough; a joint at rest has nothing to see
        self._unseen = np.maximum(self._unseen - self._span * enough, 0.0)
        return regressor, value, usable, tree.stands[columns]

    def _commit(self, stamp: float, regressor: Array, value: Array, used: BoolArray, stands: BoolArray) -> None:
        """Let the filters use a window that no contact change has followed."""
        self.watchdog.normal_until += min(stamp - self.time, 0.0)  # the clock may be set back
        self.filters.predict(min(max(stamp - self.time, 0.0), RETURN))
        self.filters.update(regressor, value, used, stands)
        self.time = stamp
        self.motion += used * self._span
        self._moved |= used

    def _check(self) -> list[Alarm]:
        """Check for alarms, once in the number of samples of a second, whatever their stamps are."""
        self.checked = self._last if np.isfinite(self._last) else 0.0
        state, covariance, payload = self.filters.with_shared_payload()
        sure, moved, self._moved = self.baseline.sure, self._moved & self.baseline.sure, np.zeros_like(self._moved)
        self._unseen += sure
        strange = np.sqrt(self.filters.noise[0]) / self.baseline.residual * (self.filters.count[0] > 300)  # settled
        stream = np.stack([self._unseen, strange])
        alarms = self.watchdog.check(self.checked, state[:, ::2], covariance[:, ::2, ::2], moved, payload, stream)
        latest = self.alarms | {alarm.key: alarm for alarm in alarms}
        self.alarms = {key: alarm for key, alarm in latest.items() if alarm.raised}
        return alarms

    def state(self) -> dict[str, FrictionState]:
        """Return the current friction by joint."""
        state, covariance, _ = self.filters.with_shared_payload()
        of, level = self.baseline, self.baseline.level
        now = 1 + state[:, 0] + state[:, 2]
        half = 1.96 * np.sqrt(covariance[:, 0, 0] + 2 * covariance[:, 0, 2] + covariance[:, 2, 2])
        normal = 1.96 * of.spread
        limits = [level * np.maximum(bound, 0.0) for bound in (now - half, now + half, 1 - normal, 1 + normal)]
        corrections = 1 + state[:, 0], level * state[:, 1], level / of.speed * state[:, 2]
        rows = np.stack([*corrections, level * now, level, self.motion, *limits], axis=1).tolist()
        alarms = {alarm.name for alarm in self.alarms.values()}
        return {
            name: FrictionState(s, o, v, now, was, moved, (ends[0], ends[1]), (ends[2], ends[3]), name in alarms)
            for name, (s, o, v, now, was, moved, *ends) in zip(of.names, rows, strict=True)
        }

    def compensation_gains(self, most: float = 1.5) -> dict[str, float]:
        """Compute the gain of each joint for `friction_settings.gain` of the exported C header.

        The gain is the lower end of the 95 % interval of friction now, divided by the identified friction and limited
        to 0 to `most`. It is the smallest over slow, middle and top speed, so that the compensation exceeds the
        friction at none of them, with 97.5 % confidence each. Multiply it by your own gain.
        """
        state, covariance, _ = self.filters.with_shared_payload()
        of = self.baseline
        law = np.abs(of.friction(of.speeds, np.zeros_like(of.speeds), np.zeros_like(of.speeds)))
        ratio = of.speeds / of.speed * of.level / np.maximum(law, 1e-9)
        now = 1 + state[:, 0] + state[:, 2] * ratio
        variance = covariance[:, 0, 0] + 2 * ratio * covariance[:, 0, 2] + ratio**2 * covariance[:, 2, 2]
        lowest = (now - 1.96 * np.sqrt(variance + of.own_error**2)).min(axis=0)
        return dict(zip(of.names, np.clip(lowest, 0.0, most).tolist(), strict=True))

    def save(self, path: str | Path) -> None:
        """Write the estimates, noise, references and alarms, completely or not at all."""
        save_state(self, Path(path))

    def load(self, path: str | Path) -> None:
        """Continue from a file that `save` wrote.

        Raises
        ------
        SettingsError
            If the file is damaged or belongs to another result.
        """
        load_state(self, Path(path))

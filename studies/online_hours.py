"""Simulate hours of many robots in service by the measurements of the online filters, a joint and a window each.

The windows of a real stream are recorded: regressors, which joints move, their mean errors, and the noise that the
filters found. Simulated measurements have these regressors and mean errors, new Gaussian noise of the same variance
and correlation in time, and friction that differs from log to log and drifts as the alarms assume. Real friction may
drift otherwise, and real noise may have longer tails.
"""

from collections.abc import Callable, Iterable
from copy import copy
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from stribeck.core.base.typing import Array, BoolArray
from stribeck.service.online import Alarm, OnlineFriction
from stribeck.service.online.alarms import NORMAL, SESSION, Watchdog
from stribeck.service.online.estimator import RETURN
from stribeck.service.online.kalman import JointFilters


@dataclass(frozen=True, eq=False)
class Windows:
    """W windows of the n identified joints: stamps, regressors, use, standing, and mean errors.

    `fresh` is an estimator before, and `noise` and `correlation`, shape (2, n), are those of one after the stream.
    """

    fresh: OnlineFriction
    time: Array
    regressor: Array
    used: BoolArray
    stands: BoolArray
    mean: Array
    noise: Array
    correlation: Array

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the identified joints."""
        of = self.fresh.baseline
        return tuple(name for name, sure in zip(of.names, of.sure, strict=True) if sure)


def record(fresh: OnlineFriction, online: OnlineFriction, repetitions: Iterable[Callable[[], object]]) -> Windows:
    """Record the windows of repetitions of the same motion; the first only settles the filters."""
    rows, update = list[list[Any]](), online.filters.update

    def spy(*window: Any) -> None:
        rows[-1].append((online.time, *window))
        update(*window)

    online.filters.update = spy  # type: ignore[assignment, method-assign]
    for repetition in repetitions:
        rows.append([])
        repetition()
    sure, length = online.baseline.sure, min(map(len, rows[1:]))
    time, regressor, value, used, stands = (
        np.array([[window[k] for window in own[:length]] for own in rows[1:]]) for k in range(5)
    )
    errors = value - (regressor * online.filters.state).sum(axis=-1)
    every = np.asarray(used.all(axis=0))
    mean = np.where(every, errors.mean(axis=0), 0.0)[:, sure]
    correlation = np.clip(online.filters.lagged / online.filters.noise, 0.0, 0.95)
    own = regressor[0][:, sure], every[:, sure], stands[0][:, sure], mean
    return Windows(fresh, time[0] - time[0, 0], *own, online.filters.noise[:, sure], correlation[:, sure])


def simulate(windows: Windows, robots: int, seconds: float, change: Array, seed: int) -> list[list[Alarm]]:
    """Simulate robots whose friction changes by `change`, shape (robots, n), after two minutes; list their alarms."""
    of, filters, random = windows.fresh.baseline, windows.fresh.filters, np.random.default_rng(seed)
    joints, sure = int(of.sure.sum()), of.sure
    start, walk = np.sqrt(np.diagonal(filters.covariance, axis1=1, axis2=2))[sure], np.sqrt(filters._walk)[sure]
    residual = np.tile(of.residual[sure] ** 2, robots)
    every = JointFilters(np.tile(start, (robots, 1)), np.tile(walk, (robots, 1)), RETURN, residual)
    own: Any = SimpleNamespace(names=windows.names, spread=of.spread[sure], viscous_share=of.viscous_share[sure])
    dogs = [Watchdog(own, windows.fresh.robot.mass, 100.0) for _ in range(robots)]
    alarms = [list[Alarm]() for _ in range(robots)]
    shape = robots, joints
    offset, drift, noise = of.spread[sure] * random.standard_normal(shape), NORMAL * random.standard_normal(shape), 0.0
    last, checked, moved = -1.0, 0.0, np.zeros(joints, dtype=bool)
    length = windows.time[-1] + 1.0
    for k in range(int(seconds / length * len(windows.time))):
        turn, row = divmod(k, len(windows.time))
        time, x = turn * length + windows.time[row], windows.regressor[row]
        step = time - last
        kind = windows.stands[row].astype(int), np.arange(joints)
        r = windows.correlation[kind]
        noise = r * noise + np.sqrt(1 - r**2) * random.standard_normal(shape)
        kept = np.exp(-step / SESSION)
        drift = kept * drift + NORMAL * np.sqrt(1 - kept**2) * random.standard_normal(shape)
        true = offset + drift + (time >= 120.0) * change
        value = x[:, 0] * true + windows.mean[row] + np.sign(x[:, 0]) * np.sqrt(windows.noise[kind]) * noise
        used, stands = (np.tile(part[row], robots) for part in (windows.used, windows.stands))
        every.predict(step)
        every.update(np.tile(x, (robots, 1)), value.ravel(), used, stands)
        last, moved = time, moved | windows.used[row]
        if time >= checked + 1.0:
            for robot, dog in enumerate(dogs):
                rows, part = slice(robot * joints, (robot + 1) * joints), copy(every)
                part.state, part.covariance, part._walk = every.state[rows], every.covariance[rows], every._walk[rows]
                state, covariance, payload = part.with_shared_payload()
                changes = state[:, ::2], covariance[:, ::2, ::2]
                alarms[robot] += dog.check(time, *changes, moved, payload, np.zeros((2, joints)))
            checked, moved = time, np.zeros(joints, dtype=bool)
    return alarms

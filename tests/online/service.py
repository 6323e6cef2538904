"""Streams of an arm in service, whose friction changes."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from tests.arm import TRUTH, arm_log, stribeck_torque

from stribeck import Robot, RobotLog
from stribeck.core.base.typing import Array
from stribeck.service.online import Alarm, OnlineFriction

RATE = 100.0
"""Rate of the arm's logs [Hz]."""


def noisy(log: RobotLog, seed: int) -> RobotLog:
    generator = np.random.default_rng(seed)
    return replace(log, torque=log.torque + 0.1 * generator.normal(size=log.torque.shape))


def friction(log: RobotLog) -> Array:
    return stribeck_torque(log.velocity, TRUTH | {"offset": 0.0})


def stream(robot: Robot, duration: float, factor: Callable[[Array], Array], seed: int = 1) -> RobotLog:
    """Make a log whose friction is multiplied by a factor that depends on time and joint, shape (T, n)."""
    log = noisy(arm_log(robot, duration=duration, rate=RATE, seed=seed), seed)
    return replace(log, torque=log.torque + friction(log) * (factor(log.time) - 1))


def feed(online: OnlineFriction, log: RobotLog, length: int = 10, rows: slice = slice(None)) -> list[Alarm]:
    alarms: list[Alarm] = []
    part = log.take(rows)
    for start in range(0, len(part.time), length):
        own = slice(start, start + length)
        alarms += online.update(part.time[own], part.position[own], part.velocity[own], part.torque[own])
    return alarms


def elbow(share: Callable[[Array], Any]) -> Callable[[Array], Array]:
    return lambda time: 1 + share(time)[:, None] * np.array([0.0, 1.0, 0.0])


def same(_: Array) -> Array:
    return np.ones((1, 1))

"""Radius of ball feet, which roll while they stand, from the motion of standing feet relative to each other."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.dynamics.contact.phases import SupportPhase
from stribeck.core.dynamics.root_motion import gravity_in_root_link
from stribeck.core.dynamics.state import orientation_from_derivatives, root_quaternions
from stribeck.core.filters.savitzky_golay import correlate_valid, savgol_kernels
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.core.robot.kinematics import point_motion
from stribeck.core.robot.rolling_radius import rolling_radius


def with_rolling_feet(
    robot: Robot, logs: Sequence[tuple[RobotLog, tuple[SupportPhase, ...], float]]
) -> tuple[Robot, list[str]]:
    """Find the radius of point feet without a given one, and write a note on it, or on slip.

    The feet are balls of the model's collision geometry, unless the log shows that they do not roll. Without these, the
    log gives the radius.

    With v the velocities of the centers of two standing feet, W their angular velocities, and u up,

        v_1 - v_2 = r (W_1 - W_2) x u

    The radius is a robust least-squares estimate (Geman and McClure 1985) from its weighted median.

    Parameters
    ----------
    logs
        Logs, their support phases, and their sampling periods [s].
    """
    # Smallest and largest plausible radius [m]; smaller feet count as points.
    radii = (0.008, 0.06)
    points = {name: foot for name, foot in robot.contacts.items() if foot.kind == "point" and not foot.given}
    usable = [log for log in logs if log[0].base_orientation is not None]
    parts = [part for log in usable for part in _pairs(robot, *log)] if points and robot.base == "floating" else []
    if not parts:
        return robot, []
    turn, speed = np.concatenate([turn for turn, _ in parts]), np.concatenate([speed for _, speed in parts])
    weight, product = np.sum(turn**2, axis=1), np.sum(turn * speed, axis=1)
    ratio = product / np.maximum(weight, 1e-12)
    order = np.argsort(ratio)
    total = np.cumsum(np.sqrt(weight[order]))
    radius = float(ratio[order][np.searchsorted(total, total[-1] / 2)])
    model = Path(robot.model_path)
    ball = max(point.ball or rolling_radius(model, point.frame, meshes=True) for point in points.values())
    rolled, slid = (float(np.median(np.linalg.norm(speed - guess * turn, axis=1))) for guess in (ball, 0.0))
    if ball and rolled < 2 * slid:
        balls = {name: replace(contact, radius=ball, given=True) for name, contact in points.items()}
        note = f"The feet are balls of {1e3 * ball:.0f} mm, from the collision geometry of the model."
        return replace(robot, contacts={**robot.contacts, **balls}), [note]
    for _ in range(30):
        error = np.linalg.norm(speed - radius * turn, axis=1)
        trust = (1 + (error / max(float(np.median(error)), 1e-6)) ** 2) ** -2.0
        radius = float(trust @ product / max(trust @ weight, 1e-12))
    if (slip := float(np.median(error))) > 0.02:  # [m/s], faster feet slip
        note = (
            f"Standing feet move relative to each other at a median of {1e3 * slip:.0f} mm/s: they slip, roll on an "
            "unknown radius, or contacts are wrong. The error of the legs' friction can exceed its intervals. For ball "
            "feet, set radius in [contacts]; otherwise log a walk on firmer ground"
        )
        return robot, [note]
    if not radii[0] <= radius <= radii[1]:
        return robot, []
    rolling = {name: replace(contact, radius=radius, given=False) for name, contact in points.items()}
    note = f"Standing feet roll like balls with a radius of {1e3 * radius:.0f} mm."
    return replace(robot, contacts={**robot.contacts, **rolling}), [note]


def _pairs(
    robot: Robot, log: RobotLog, phases: tuple[SupportPhase, ...], period: float
) -> Iterator[tuple[Array, Array]]:
    """Yield (W_1 - W_2) x u and the horizontal part of v_1 - v_2 for pairs of standing points, shape (t, 3) each."""
    half = max(3, round(0.015 / period))
    kernels, step = savgol_kernels(2 * half + 1, 4, period), max(1, round(0.01 / period))
    long = [phase for phase in phases if len(phase.feet) > 1 and (phase.stop - phase.start) * period > 0.06]  # [s]
    for phase in long[:: max(1, len(long) // 400)]:
        rows = phase.stop - phase.start
        first = max(phase.start + round(0.3 * rows), half)
        last = min(phase.stop - round(0.15 * rows), len(log.time) - half)
        if last - first < 3:
            continue
        wide = slice(first - half, last + half)
        position, velocity = (signal[::step] for signal in correlate_valid(log.position[wide], kernels[:2], (0, 1)))
        assert log.base_orientation is not None
        quaternions = root_quaternions(robot, log.position[wide], log.base_orientation[wide])
        derivatives = correlate_valid(quaternions, kernels, (0, 1, 2))
        turn = orientation_from_derivatives(*(derivative[::step] for derivative in derivatives))
        up = gravity_in_root_link(turn.quaternion, robot.up)
        moves = {}
        for foot in phase.feet:
            if robot.contacts[foot].kind == "point":
                frame = robot.tree.model.getFrameId(robot.contacts[foot].frame)
                point = point_motion(robot.tree, frame, position, velocity, np.zeros_like(position))
                moves[foot] = point.velocity + np.cross(turn.angular_velocity, point.position), point.turning
        for (move, its_turn), (other, other_turn) in combinations(moves.values(), 2):
            apart = move - other
            yield np.cross(its_turn - other_turn, up), apart - np.sum(apart * up, axis=1, keepdims=True) * up

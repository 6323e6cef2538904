"""Friction in double support, where contacts leave it undetermined, by its weights (6.1) (Fig. 6.1).

All frictions `R_0 + J^T f` explain the measured accelerations, with any contact forces f that the base does not feel.
Therefore M_mod^-1 of (5.12) is singular, and `a_est - a_msr = M_mod^-1 R_0` for each of them. The part of a measured
acceleration that the contacts do not permit, as of a foot that slips, drops out.
"""

from collections.abc import Iterator

import numpy as np

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.dynamics.contact.mode import ContactMode, contact_modes
from stribeck.core.dynamics.rooted import inertia_matrix, rooted_inverse_dynamics
from stribeck.core.dynamics.state import State
from stribeck.core.equations.friction_torque.inverse_dynamics import differentiate, orientation_filter
from stribeck.core.equations.friction_torque.preparation import PreparedLog
from stribeck.core.filters import make_filter
from stribeck.core.result.samples import FrictionSamples
from stribeck.core.robot import Robot
from stribeck.core.robot.kinematics import frame_pose, joint_torque_of_wrench
from stribeck.core.settings import Settings
from stribeck.paper.figures.figure import PaperChart, PaperSection, busiest, rms


def ambiguous_friction(mode: ContactMode, state: State, torque: Array) -> tuple[Array, Array]:
    """Compute M_mod^-1 (5.12), shape (T, k, k), and one friction torque that explains the motion [N m], shape (T, k).

    Parameters
    ----------
    mode
        Contact mode of a floating robot with k torque-controlled joints.
    state, torque
        Motion and joint torque, shape (T, n).
    """
    robot, motion = mode.robot, (state.position, state.velocity, state.acceleration)
    wrench, needed = rooted_inverse_dynamics(mode.rooted, *motion, mode.root(state))
    root = 0 if mode.surface else 6  # a standing surface holds the root
    free = np.concatenate([np.arange(root), 6 + robot.torque_controlled])  # other joints move as measured
    feet = [_contact_columns(mode, foot, state.position)[:, free] for foot in mode.feet if foot != mode.surface]
    contacts = np.concatenate(feet, axis=2)
    forces = np.linalg.pinv(contacts[:, :root]) @ wrench[:, :root, None]
    friction = (torque - needed)[:, robot.torque_controlled] + (contacts[:, root:] @ forces)[:, :, 0]
    inverse = np.linalg.inv(inertia_matrix(mode.rooted, state.position)[:, free[:, None], free])
    bound = inverse @ contacts
    inverse -= bound @ np.linalg.pinv(contacts.transpose(0, 2, 1) @ bound) @ bound.transpose(0, 2, 1)
    return np.asarray(inverse[:, root:, root:], dtype=np.float64), friction


def _contact_columns(mode: ContactMode, foot: str, position: Array) -> Array:
    """Compute J^T of a foot in the coordinates of the tree, root first, shape (T, 6 + n, m)."""
    rooted, contact = mode.rooted, mode.robot.contacts[foot]
    frame = rooted.model.getFrameId(contact.frame)
    rotation, place = frame_pose(rooted, frame, position)
    columns = []
    for axis in np.eye(6)[: contact.size]:
        force, moment = rotation @ axis[:3], rotation @ axis[3:]
        on_joints = joint_torque_of_wrench(rooted, frame, position, np.tile(axis, (len(position), 1)))
        columns.append(np.hstack([force, moment + np.cross(place, force), on_joints]))
    return np.stack(columns, axis=2)


def weighted_friction(
    mobility: Array, friction: Array, weight: float | Array = 1.0, penalty: float | Array = 1e-8
) -> Array:
    """Compute the friction torque that (6.1) picks, shape (T, k).

        min over R of  1/2 (Da - M_mod^-1 R)^T W (Da - M_mod^-1 R) + 1/2 R^T lambda R

    It is the smallest friction that explains the accelerations, which is a guess, not an estimate (5.3).

    Parameters
    ----------
    mobility, friction
        See `ambiguous_friction`.
    weight
        Diagonal of W [(rad/s^2)^-2], one number or one per torque-controlled joint.
    penalty
        Diagonal of lambda [(N m)^-2], one number or one per torque-controlled joint.
    """
    normal = (mobility.transpose(0, 2, 1) * weight) @ mobility
    damped = normal + np.eye(friction.shape[1]) * penalty
    return np.asarray(np.linalg.solve(damped, normal @ friction[:, :, None])[:, :, 0])


def double_support_section(
    prepared: PreparedLog, robot: Robot, settings: Settings, samples: FrictionSamples, order: IntArray
) -> PaperSection:
    """Draw the friction of each joint by (6.1), with equal weights and as if it were in this joint, and by (5.13)."""
    shown = busiest(samples)
    shown = shown[:: -(-len(shown) // 2000)]  # more are not visible
    time = samples.time[shown]
    values, charts = np.full((3, len(time), samples.usable.shape[1]), np.nan), []
    values[2] = np.where(samples.usable, samples.friction_torque, np.nan)[shown]
    if robot.base == "floating" and not robot.loops:
        for rows, mode, state, torque in _shared_loads(prepared, robot, settings, time):
            values[:2, rows] = _both_guesses(mode, state, torque)
    for column in order[np.isfinite(values[0, :, order]).any(axis=1)]:
        lines = values[:, :, column]
        charts.append(PaperChart(samples, column, time, lines, [rms(lines[1]), rms(lines[0])]))
    why = "fixed" if robot.base == "fixed" else "closed" if robot.loops else "stepping"
    return PaperSection("double-support", charts, about="about" if charts else why)


def _shared_loads(
    prepared: PreparedLog, robot: Robot, settings: Settings, time: Array
) -> Iterator[tuple[IntArray, ContactMode, State, Array]]:
    """Yield places in `time`, contact mode, motion and torque of the samples in which feet share the load."""
    log, period, phases = prepared.log, prepared.sampling.period, prepared.support.phases
    motion_filter = make_filter(settings.filter, period)
    turn_filter = orientation_filter(robot, log, motion_filter, period, settings)
    every = np.searchsorted(log.time, time - period / 2)
    for phase, mode in zip(phases, contact_modes(robot, phases), strict=True):
        quarter = (phase.last - phase.first) // 4  # feet land and lift at both ends
        places = np.flatnonzero((every >= phase.first + quarter) & (every < phase.last - quarter))
        if mode.leaves_open and not mode.hung and len(places):
            span, rows = slice(every[places[0]], every[places[-1]] + 1), every[places] - every[places[0]]
            state, torque = differentiate(robot, log, span, motion_filter, turn_filter, settings)
            yield places, mode, state.take(rows), torque[rows]


def _both_guesses(mode: ContactMode, state: State, torque: Array) -> Array:
    """Solve (6.1) with a small penalty on the joint itself, and with equal penalties, shape (2, T, k)."""
    mobility, friction = ambiguous_friction(mode, state, torque)
    stands = mode.standing[mode.robot.torque_controlled]
    guesses = np.full((2, *friction.shape), np.nan)
    guesses[1, :, stands] = weighted_friction(mobility, friction)[:, stands].T
    for column in np.flatnonzero(stands):
        own = np.where(np.arange(len(stands)) == column, 1e-12, 1e-8)
        guesses[0, :, column] = weighted_friction(mobility, friction, penalty=own)[:, column]
    return guesses

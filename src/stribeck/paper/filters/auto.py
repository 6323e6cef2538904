"""Choice of the filter from the spectrum of the model's acceleration (7.1.2, Fig. 7.1)."""

from dataclasses import replace

import numpy as np

from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.dynamics.rooted import MASSLESS
from stribeck.core.equations.friction_torque.inverse_dynamics import Chunk, torque_chunks
from stribeck.core.equations.friction_torque.preparation import PreparedLog
from stribeck.core.errors import LogError
from stribeck.core.filters import CutoffChoice
from stribeck.core.filters.savitzky_golay import savgol_cutoff
from stribeck.core.robot import Robot
from stribeck.core.settings import FilterSettings, Settings
from stribeck.paper.filters.cutoff import MIN_SAMPLES, ORDER, choose_cutoff
from stribeck.paper.observer import loop_inertia

MOST_SAMPLES = 30_000
"""Largest number of usable samples for the choice of the cutoff."""


def cutoff_from_log(prepared: PreparedLog, robot: Robot, settings: Settings) -> CutoffChoice:
    """Choose the cutoff for a log, see `choose_cutoff`.

    Raises
    ------
    LogError
        If no support phase can be used.
    """
    rate = 1 / prepared.sampling.period
    accelerations, positions = raw_accelerations(prepared, robot, settings)
    longest = max(int(np.isfinite(segment).sum(axis=0).max()) for segment in accelerations)
    if longest < MIN_SAMPLES + 2:  # as in a trot; differences lose two
        short = 0.03  # window where all segments are too short for a spectrum [s]
        window = 2 * max(3, round(short / 2 * rate)) + 1
        reason = f"no segment has the {MIN_SAMPLES} samples of a spectrum, so a window of {1e3 * short:.0f} ms is taken"
        return CutoffChoice(cutoff=savgol_cutoff(window, ORDER, rate), window=window, reason=reason)
    return choose_cutoff(accelerations, rate, positions)


def raw_accelerations(prepared: PreparedLog, robot: Robot, settings: Settings) -> tuple[list[Array], list[Array]]:
    """Compute the model's acceleration in all segments of a log, and the positions of the torque-controlled joints.

    The model's acceleration is the acceleration by the measured torque without friction (5.12), for the joints that a
    fit uses: `a_est = a_msr + M^-1 R`. The noise of the measured acceleration cancels in it.

    Raises
    ------
    LogError
        If no support phase can be used.
    """
    # Positions are differentiated over a short window even if the log has velocities; the torque is not filtered.
    shortest = FilterSettings(kind="savitzky-golay", window=7)
    raw = {"filter": shortest, "filter_torque": False, "averaged_law": False, "observer_bandwidth": None}
    settings = settings.model_copy(update=raw | {"standing_legs": settings.standing_legs is True})
    rate = 1 / prepared.sampling.period
    phases = [phase for phase in prepared.support.phases if phase.plausible(prepared.sampling.period)]
    rows = np.concatenate([np.empty(0, dtype=np.int64), *(np.arange(phase.first, phase.last) for phase in phases)])
    end = int(rows[:MOST_SAMPLES].max(initial=-1)) + 1
    examined = tuple(replace(phase, last=min(phase.last, end)) for phase in phases)
    accelerations, positions = [], []
    for chunk in torque_chunks(prepared, robot, settings, examined):
        for run in chunk.runs():
            position = prepared.log.position[chunk.rows[run]]
            accelerations.append(model_acceleration(robot, chunk, run, position, max(1, round(0.004 * rate))))
            positions.append(position[:, robot.torque_controlled])
    if not accelerations:
        raise LogError(
            "log: no support phase is suitable to choose a filter: feet always stand together or contacts change "
            "too often; expected phases on one foot, or [identify.filter] kind = 'savitzky-golay' and a window"
        )
    return accelerations, positions


def model_acceleration(robot: Robot, chunk: Chunk, run: slice, position: Array, held: int) -> Array:
    """Compute the model's acceleration over a run in one contact mode, NaN where a fit may not use it, (t, n).

    It is `a_msr + M_mod^-1 R` by (5.13), over the joints whose friction torque a fit may use.

    The inertia is recomputed every `held` samples, in which no limb turns far.
    """
    samples = chunk.samples
    feet = samples.support_names[samples.support[run.start]].split("+")
    surface = next((foot for foot in feet if foot in robot.contacts and robot.contacts[foot].kind == "surface"), None)
    rooted = robot.rooted_at(surface) if surface else robot.tree
    columns = np.flatnonzero(samples.usable[run].any(axis=0))
    middles = np.arange(0, len(position), held) + held // 2
    inertia = loop_inertia(robot, rooted, position[np.minimum(middles, len(position) - 1)])
    diagonal = np.einsum("tii->ti", inertia)
    columns = columns[diagonal[0, robot.torque_controlled[columns]] > MASSLESS * diagonal[0].max()]
    columns = columns[_find_independent(inertia[0][np.ix_(*[robot.torque_controlled[columns]] * 2)])]
    joints = robot.torque_controlled[columns]
    friction = np.zeros((held * len(middles), len(columns)))
    friction[: len(position)] = samples.friction_torque[run][:, columns]
    of_postures = friction.reshape(len(middles), held, -1).transpose(0, 2, 1)
    change = np.linalg.solve(inertia[:, joints[:, None], joints], of_postures).transpose(0, 2, 1)
    acceleration = np.full((len(position), len(samples.joint_names)), np.nan)
    acceleration[:, columns] = samples.acceleration[run][:, columns] + change.reshape(friction.shape)[: len(position)]
    return acceleration


def _find_independent(inertia: Array) -> BoolArray:
    """Find the joints whose inertia cannot be canceled by other joints, as between coaxial ones, shape (k,)."""
    scale = 1 / np.sqrt(np.diag(inertia))
    values, vectors = np.linalg.eigh(inertia * np.outer(scale, scale))
    return np.asarray(np.all(np.abs(vectors[:, values < MASSLESS]) < MASSLESS, axis=1))

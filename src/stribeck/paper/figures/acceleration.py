"""Acceleration that the measured torque causes without friction (5.10), and the measured one (Fig. 7.3)."""

import numpy as np

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.equations.friction_torque.inverse_dynamics import torque_chunks
from stribeck.core.equations.friction_torque.preparation import PreparedLog
from stribeck.core.equations.friction_torque.thinning import join
from stribeck.core.result.samples import FrictionSamples
from stribeck.core.robot import Robot
from stribeck.core.settings import Settings
from stribeck.paper.figures.figure import PaperChart, PaperSection, busiest, rms
from stribeck.paper.filters.auto import MOST_SAMPLES, model_acceleration


def estimated_acceleration(prepared: PreparedLog, robot: Robot, settings: Settings) -> tuple[FrictionSamples, Array]:
    """Compute friction torque and estimated acceleration of the torque-controlled joints.

    (5.13) gives `a_est = a_msr + M_mod^-1 R` over all joints whose friction torque is known: on one foot, this is
    (5.10). Where the ground reaction is unknown, the base moves as measured.

    Returns
    -------
    samples
        N samples of n joints, also of legs that stand on one foot.
    acceleration
        Estimated acceleration [rad/s^2], shape (N, n), NaN where the friction torque is unknown.

    Raises
    ------
    LogError
        If no sample is usable.
    """
    settings = settings.model_copy(update={"standing_legs": True})
    stride = max(1, -(-sum(phase.last - phase.first for phase in prepared.support.phases) // MOST_SAMPLES))
    held = max(1, round(0.004 / prepared.sampling.period / stride))
    samples, accelerations = [], []
    for chunk in torque_chunks(prepared, robot, settings, stride=stride):
        positions = ((run, prepared.log.position[chunk.rows[run]]) for run in chunk.runs())
        accelerations += [model_acceleration(robot, chunk, *each, held) for each in positions]
        samples.append(chunk.samples)
    return join(samples), np.concatenate(accelerations)


def acceleration_section(samples: FrictionSamples, estimated: Array, order: IntArray) -> PaperSection:
    """Draw both accelerations of each joint."""
    shown, charts = busiest(samples), []
    for column in order:
        both = np.stack([estimated[:, column], samples.acceleration[:, column]])
        both[:, np.isnan(both[0])] = np.nan
        sizes = [rms(both[0] - both[1]), rms(both[1])]
        charts.append(PaperChart(samples, column, samples.time[shown], both[:, shown], sizes))
    return PaperSection("acceleration", charts)

"""Spectra of the estimated acceleration, and the cutoff that separates motion from noise (Fig. 7.1)."""

from contextlib import suppress

import numpy as np

from stribeck.core.base.typing import IntArray
from stribeck.core.equations.friction_torque.preparation import PreparedLog
from stribeck.core.errors import LogError
from stribeck.core.result.samples import FrictionSamples
from stribeck.core.robot import Robot
from stribeck.core.settings import Settings
from stribeck.paper.figures.figure import PaperChart, PaperSection
from stribeck.paper.filters.auto import cutoff_from_log, raw_accelerations
from stribeck.paper.filters.cutoff import acceleration_spectra


def spectrum_section(
    prepared: PreparedLog, robot: Robot, settings: Settings, samples: FrictionSamples, order: IntArray
) -> PaperSection:
    """Draw the spectra of each joint's estimated acceleration and of the second difference of its position."""
    choice, charts = cutoff_from_log(prepared, robot, settings), []
    segments = raw_accelerations(prepared, robot, settings.model_copy(update={"standing_legs": True}))
    with suppress(LogError):  # all segments are too short, as in a trot
        spectra = acceleration_spectra(*segments, 1 / prepared.sampling.period)
        densities, seen = np.stack([spectra.first, spectra.second]), spectra.frequency <= 1.5 * choice.cutoff
        noise = np.sqrt(densities[:, spectra.frequency > choice.cutoff].sum(axis=1))
        for column in order[spectra.parts[order] > 0]:
            numbers = [noise[1, column] / max(noise[0, column], 1e-9)]
            lines = np.sqrt(densities[:, seen, column])
            charts.append(PaperChart(samples, column, spectra.frequency[seen], lines, numbers))
    return PaperSection("spectrum", charts, "about" if charts else "short", choice.reason, [choice.cutoff])

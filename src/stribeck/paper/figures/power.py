"""Power that friction takes from each joint over time (Fig. 7.4, Equation 7.9)."""

import numpy as np

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.judgement.passivity import positive_power_fraction
from stribeck.core.result.samples import FrictionSamples
from stribeck.paper.figures.figure import PaperChart, PaperSection, busiest


def friction_power(samples: FrictionSamples) -> Array:
    """Compute the power R v that friction takes [W], shape (N, n); NaN where a fit may not use the friction torque."""
    return np.where(samples.usable, samples.friction_torque * samples.velocity, np.nan)


def power_section(samples: FrictionSamples, order: IntArray) -> PaperSection:
    """Draw the power of friction of each joint, and count the samples in which friction seems to add power."""
    power, shown, charts = friction_power(samples), busiest(samples), []
    for column in order:
        known = samples.usable[:, column]
        adding = positive_power_fraction(samples.velocity[known, column], samples.friction_torque[known, column])
        numbers = power[known, column].mean(), 100 * adding
        charts.append(PaperChart(samples, column, samples.time[shown], power[shown, column][None], numbers))
    return PaperSection("power", charts)

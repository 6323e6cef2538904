"""Fig. 7.1: spectra of the model's acceleration of the swinging leg.

For comparison, the measured acceleration is the second difference of the unfiltered position.
"""

from typing import NamedTuple

import numpy as np
from scipy.signal import periodogram

from stribeck import Settings
from stribeck.core.base.typing import Array
from stribeck.core.settings import FilterSettings
from stribeck.simulation.run import Simulated
from studies.markdown import percent
from studies.paper.estimate import estimate
from studies.paper.study import Numbers
from studies.paper.swing import JOINTS, model_acceleration, swinging
from studies.paper.walks import legs_by_sensors

WALKS = ("legs-contact", "harsh")
PAPER = 10.0
"""Cutoff of the paper [Hz]."""
NOISE = (200.0, 450.0)
"""Band in which a spectrum contains only noise [Hz]."""
UNFILTERED = Settings(filter=FilterSettings(kind="savitzky-golay", window=7))
"""Settings with a short filter: the model's acceleration depends on velocity, but not on measured acceleration."""


class Spectra(NamedTuple):
    """Spectral densities of the acceleration of the swinging leg's joints [(rad/s^2)^2/Hz], shape (F, 6)."""

    frequency: Array  # [Hz], shape (F,)
    model: Array
    measured: Array


def run(quick: bool) -> Numbers:
    found = {name: _spectra(walk) for name, walk in legs_by_sensors(quick).items()}
    return {
        "logs": {name: {"noisier": _noisier(each)} for name, each in found.items()},
        "beyond": _beyond(found["exact"]),
    }


def _spectra(walk: Simulated) -> Spectra:
    """Average the spectra of the right leg's swings, with one Hann window per swing."""
    found = estimate(walk, UNFILTERED)
    model = model_acceleration(walk, found)
    time, rate = swinging(found, "knee").time, 1 / found.samples.period
    ends = np.concatenate([[0], np.flatnonzero(np.diff(time) > 1.5 / rate) + 1, [len(time)]])
    length = round(0.95 * float(np.median(np.diff(ends))))
    firsts = ends[:-1][np.diff(ends) >= length]
    here = np.searchsorted(walk.log.time, time - 0.5 / rate)
    columns = [walk.log.joint_names.index(f"right_{joint}") for joint in JOINTS]
    models: list[Array] = []
    measured: list[Array] = []
    for first in firsts:
        rows = slice(here[first] - 1, here[first] + length + 1)
        second = np.diff(walk.log.position[rows, columns], 2, axis=0) * rate**2
        for kept, signal in ((models, model[first : first + length]), (measured, second)):
            frequency, density = periodogram(signal, rate, window="hann", axis=0)
            kept.append(density[1:])
    return Spectra(frequency[1:], np.mean(models, axis=0), np.mean(measured, axis=0))


def _noisier(spectra: Spectra) -> dict[str, float]:
    """Compute the noise amplitude of the measured acceleration divided by the model's, per joint."""
    band = (spectra.frequency > NOISE[0]) & (spectra.frequency < NOISE[1])
    ratios = np.sqrt(spectra.measured[band].mean(axis=0) / spectra.model[band].mean(axis=0))
    return dict(zip(JOINTS, ratios.tolist(), strict=True))


def _beyond(spectra: Spectra) -> dict[str, float]:
    """Compute the share of power above the paper's 10 Hz in each joint's acceleration."""
    shares = spectra.model[spectra.frequency > PAPER].sum(axis=0) / spectra.model.sum(axis=0)
    return dict(zip(JOINTS, shares.tolist(), strict=True))


def texts(numbers: Numbers) -> dict[str, str]:
    """Format power above 10 Hz, and noise of measured accelerations."""
    beyond, noisier = numbers["beyond"], {name: row["noisier"] for name, row in numbers["logs"].items()}
    return {
        "beyond-most": f"{percent(max(beyond.values()))} ({max(beyond, key=beyond.__getitem__).replace('_', ' ')})",
        "noisier-knee": f"{noisier['realistic']['knee']:.0f}",
        "noisier-least": f"{min(noisier['realistic'].values()):.1f}",
    }
